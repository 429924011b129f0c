import csv

import numpy as np
import pandas as pd
import pytest
import yaml
from analysis.folders import write_run
from commands import train_config

from ffd_lightning.analysis.paper import (
    MEASURES,
    beside_paper,
    differences,
    paper_settings,
    paper_table,
)
from ffd_lightning.analysis.results import Results
from ffd_lightning.app.identity import to_yaml

# Where our preset for the paper is not as the paper.
OURS = {
    *("data.images", "data.render.camera", "data.render.samples"),
    *("split.name", "split.val_fraction"),
}


@pytest.fixture
def make(tmp_path):
    """Return a function that writes a finished run."""

    def run(values, category="table", regime="b", *, seed=0, templates=30):
        folder = tmp_path / category / regime / f"t{templates}/seed{seed}"
        scores = dict(zip(("chamfer", "emd", "iou"), values, strict=True))
        return write_run(folder, regime, templates, seed, category, **scores)

    return run


def cells(*runs):
    """The rows of the table, by category and source: cells by method."""
    head, *rows = csv.reader(beside_paper(Results.of(runs, "paper")).csv().splitlines())
    found, category = {}, ""
    for row in rows:
        category = row[0] or category
        found[category, row[1]] = dict(zip(head[2:], row[2:], strict=True))
    return found


def test_the_papers_table():
    table = paper_table().set_index(["category", "method"])
    assert table.loc[("watercraft", "e")].tolist() == [49, 304, 361]
    assert table.loc[("car", "PSGN")].tolist() == [110, 380, 169]
    assert table.loc["table"].loc["PSGN"].isna().tolist() == [True, True, False]
    assert len(table) == 15 * 6
    rows = paper_table()
    rows = rows[~rows["category"].str.startswith("mean") & rows["method"].isin(list("bwer"))]
    means = rows.groupby("method")[list(MEASURES)].mean()
    np.testing.assert_allclose(means, table.loc["mean13"].loc[means.index], atol=0.5)


def test_seeds_are_averaged_and_set_beside_the_paper(make):
    runs = [make((c, 0.4, 0.7), seed=k) for k, c in enumerate((0.05, 0.06, 0.1))]
    found = cells(*runs, make((0.02, 0.2, 0.9), regime="w"))
    assert found["table", "ours"]["b"] == "70/400/300"
    assert [found["table", "paper"][name] for name in ("b", "PSGN")] == ["47/352/447", "-/-/394"]
    assert list(found["table", "paper"]) == ["b", "w", "e", "r", "PSGN"]
    assert len(found) == 2, "of one category there is no mean"


def test_the_mean_is_over_the_same_categories_on_both_sides(make):
    found = cells(
        *(make((0.01 * k, 0.1, 0.5), c) for k, c in enumerate(("table", "chair", "plane"), 1)),
        *(make((0.02 * k, 0.1, 0.5), c, "w") for k, c in enumerate(("table", "chair"), 1)),
        *(make((9.0, 9.0, 0.0), "stool", regime) for regime in "bw"),
    )
    assert found["mean of 2", "ours"]["b"] == "15/100/500"
    assert found["mean of 2", "ours"]["w"] == "30/100/500"
    assert found["mean of 2", "paper"]["w"] == f"{(35 + 46) / 2:.0f}/303/412"
    assert found["mean of 2", "paper"]["PSGN"] == "-/-/425"
    assert ("stool", "paper") not in found
    assert list(dict.fromkeys(c for c, _ in found)) == [
        *("plane", "chair", "table", "stool", "mean of 2")
    ], "the paper's order"


def settings(regime="b", **changed):
    """The paper's settings, changed, as a row of those of results."""
    own = paper_settings(regime) | {"regime.name": regime, "seed": 3, "category.name": "table"}
    return {**own, **changed}


def test_each_setting_that_is_not_the_papers_is_listed_and_no_other():
    assert differences(pd.DataFrame([settings(), settings("e", **{"seed": 1})])) == []
    changed = {
        key: not value if isinstance(value, bool) else f"another-{value}"
        for key, value in paper_settings("e").items()
    }
    changed |= {"regime.terms.mine.weight": 2.0, "regime.terms.watched.weight": 0}
    listed = differences(pd.DataFrame([settings("e", **changed)]))
    assert {line.partition(": ")[0] for line in listed} == {*changed} - {
        "regime.terms.watched.weight"
    }
    several = differences(pd.DataFrame([settings(), settings(**{"schedule.steps": 900.0})]))
    assert several == ["schedule.steps: 900 (paper: 100000)"]


def test_our_preset_is_the_papers_but_for_what_is_named_here():
    for regime in "bwer":
        weights = paper_settings(regime)["encoder.weights"]
        chosen = [
            *("category=table", f"regime={regime}", "schedule=paper", "templates=t30"),
            *("data=shapenet", "data.root=.", f"encoder.weights=/somewhere/{weights}"),
        ]
        run = pd.json_normalize(yaml.safe_load(to_yaml(train_config(*chosen))))
        assert {line.partition(": ")[0] for line in differences(run)} == OURS
