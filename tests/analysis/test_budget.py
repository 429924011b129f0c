from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from ffd_lightning.analysis.budget import error_budget
from ffd_lightning.analysis.plots import budget_bars
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import PaperProtocol, ProtocolDescription

PROTOCOL = ProtocolDescription.of(PaperProtocol())


def samples_of(run, *rows):
    names = ("floor_chamfer", "fitted_chamfer", "best_deformed_chamfer", "chamfer", "folded")
    table = pd.DataFrame(rows, columns=names)
    settings = {"run": run, "category": "table", "regime": run, "templates": 4, "seed": 0}
    return table.assign(**settings)


def test_the_parts_add_up_to_the_total():
    table = pd.concat(
        [
            samples_of("b", (0.02, 0.03, 0.05, 0.09, 0.5), (0.04, 0.05, 0.07, 0.07, 0.1)),
            samples_of("r", (0.02, 0.03, 0.06, 0.06, 0.0), (None, None, None, 0.9, 0.0)),
        ]
    )
    budget = error_budget(table, PROTOCOL)
    assert budget.loc["b"].round(6).to_dict() == {
        "floor": 30,
        "capacity": 10,
        "deformation": 20,
        "selection": 20,
        "total": 80,
        "regret": 0.25,
        "folded": 0.3,
    }
    assert budget.loc["r", "total"] == pytest.approx(60), "of samples that have their references"
    assert budget.loc["r", "regret"] == 0
    (panel,) = budget_bars(table, PROTOCOL).axes
    ends = [bar.get_x() + bar.get_width() for bar in panel.containers[-1]]
    assert ends == pytest.approx([80, 60])
    assert [label.get_text() for label in panel.get_yticklabels()] == ["b, base", "r, regularized"]


def test_density_is_what_points_drawn_anew_take_off_the_emd():
    table = samples_of("b", (1, 2, 3, 4, 0), (1, 2, 3, 4, 0)).assign(
        emd=[0.6, 0.2], resampled_emd=[0.4, 0.2]
    )
    assert error_budget(table, PROTOCOL).loc["b", "density"] == pytest.approx(0.25)
    earlier = samples_of("r", (1, 2, 3, 4, 0)).assign(emd=0.6)
    both = error_budget(pd.concat([table, earlier]), PROTOCOL)["density"]
    assert both.isna().tolist() == [False, True], "not known of an earlier version's run"


def test_parts_below_zero_are_drawn_below_zero():
    """A choice by Chamfer distance may be better than the best one by another measure."""
    (panel,) = budget_bars(samples_of("b", (0.02, 0.03, 0.055, 0.05, 0)), PROTOCOL).axes
    spans = [(bar.get_x(), bar.get_x() + bar.get_width()) for (bar,) in panel.containers]
    np.testing.assert_allclose(spans, [(0, 20), (20, 30), (30, 55), (0, -5)])
    (line,) = panel.collections
    np.testing.assert_allclose(line.get_segments()[0][:, 0], 50, err_msg="the total")
    assert panel.get_xlim()[0] < -5


def test_where_more_is_better_there_is_no_error_to_split():
    measures = tuple(replace(m, higher_is_better=True) for m in PROTOCOL.metrics)
    better = replace(PROTOCOL, metrics=measures)
    with pytest.raises(DataError, match="more is better"):
        error_budget(samples_of("b", (1, 2, 3, 4, 5)), better)


def test_without_references_there_is_no_budget():
    with pytest.raises(DataError, match=r"evaluation\.references=true"):
        error_budget(samples_of("b", (1, 2, 3, 4, 5)).drop(columns="fitted_chamfer"), PROTOCOL)
