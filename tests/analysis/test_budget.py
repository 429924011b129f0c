from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from analysis.made import PAPER, run_samples

from ffd_lightning.analysis.budget import error_budget
from ffd_lightning.errors import DataError


def samples_of(regime, *rows):
    names = ("floor_chamfer", "fitted_chamfer", "best_deformed_chamfer", "chamfer")
    columns = dict(zip(names, np.array(rows, float).T, strict=True))
    return run_samples(len(rows), regime, run=regime, **columns)


def test_the_parts_add_up_to_the_total():
    b = samples_of("b", (0.02, 0.03, 0.05, 0.09), (0.04, 0.05, 0.07, 0.07))
    r = samples_of("r", (0.02, 0.03, 0.06, 0.06), (None, None, None, 0.9))
    budget = error_budget(pd.concat([b, r]), PAPER)
    parts = {"floor": 30, "capacity": 10, "deformation": 20, "selection": 20, "total": 80}
    assert budget.loc["b"].round(6).to_dict() == {**parts, "regret": 0.25}
    assert budget.loc["r", "total"] == pytest.approx(60), "of samples that have their references"
    assert budget.loc["r", "regret"] == 0


def test_without_distances_or_references_there_is_nothing_to_split():
    better = replace(PAPER, metrics=tuple(replace(m, higher_is_better=True) for m in PAPER.metrics))
    samples = samples_of("b", (1, 2, 3, 4))
    with pytest.raises(DataError, match="more is better"):
        error_budget(samples, better)
    with pytest.raises(DataError, match=r"evaluation\.references=true"):
        error_budget(samples.drop(columns="fitted_chamfer"), PAPER)
