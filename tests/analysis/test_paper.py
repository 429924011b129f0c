import csv
import json

import numpy as np
import pytest
from omegaconf import OmegaConf

from ffd_lightning.analysis.paper import (
    MEASURES,
    beside_paper,
    differences,
    paper_settings,
    paper_table,
)
from ffd_lightning.analysis.runs import load_runs
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.app.identity import to_yaml
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.protocols import PaperProtocol, ProtocolDescription
from ffd_lightning.run_folder import RunFolder

# Where our preset for the paper is not as the paper.
OURS = {
    "data.images",
    "data.render.camera",
    "data.render.samples",
    "split.name",
    "split.val_fraction",
}


@pytest.fixture
def make(tmp_path):
    """Return a function that writes a finished run's folder, as the paper's but for `settings`."""

    def run(values, category="table", regime="b", *, seed=0, templates=30, **settings):
        own = paper_settings(regime) | {"templates.count": templates} | settings
        own |= {"category.name": category, "regime.name": regime, "seed": seed}
        config = OmegaConf.create({})
        for key, value in own.items():
            OmegaConf.update(config, key, value, force_add=True)
        folder = RunFolder(tmp_path / category / regime / f"t{templates}/seed{seed}")
        folder.path.mkdir(parents=True)
        OmegaConf.save(config, folder.config)
        folder.set_status("finished")
        place = folder.evaluation("paper")
        place.mkdir(parents=True)
        summary = dict(zip(("chamfer", "emd", "iou"), values, strict=True))
        protocol = ProtocolDescription.of(PaperProtocol()).to_json()
        (place / "summary.json").write_text(json.dumps(summary | {"protocol": protocol}))
        return folder

    return run


def cells(*runs):
    """The rows of the table, by category and source: cells by method."""
    head, *rows = csv.reader(beside_paper(load_runs(runs)).csv().splitlines())
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
    assert found["table", "paper"] == {
        "b": "47/352/447",
        "w": "46/331/432",
        "e": found["table", "paper"]["e"],
        "r": found["table", "paper"]["r"],
        "PSGN": "-/-/394",
    }
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


def test_numbers_of_templates_are_told_apart(make):
    runs = [make((0.05, 0.4, 0.7), templates=t) for t in (16, 2)]
    found = cells(*runs)
    assert [m for m, cell in found["table", "ours"].items() if cell != "-"] == ["b T=2", "b T=16"]


def other(value):
    """Another value of the same kind."""
    match value:
        case None:
            return 7
        case bool():
            return not value
        case int() | float():
            return 2 * value + 1
        case list():
            return [2 * x for x in value]
    return f"another-{value}"


def test_each_setting_that_is_not_the_papers_is_listed_and_no_other(make):
    assert differences([make((0.05, 0.4, 0.7), seed=1, seconds=3)]) == []
    changed = {key: other(value) for key, value in paper_settings("e").items()}
    changed |= {"regime.terms.mine.weight": 2.0, "regime.terms.watched.weight": 0}
    told = differences([make((0.05, 0.4, 0.7), "chair", "e", **changed)])
    assert {line.partition(": ")[0] for line in told} == {*changed} - {
        "regime.terms.watched.weight"
    }
    several = differences(
        [make((0.05, 0.4, 0.7), "plane"), make((0.1, 0.4, 0.7), **{"schedule.steps": 900.0})]
    )
    assert several == ["schedule.steps: 900 (paper: 100000)"]
    (told,) = differences([make((0.05, 0.4, 0.7), regime="mine")])
    assert told == "regime.name: mine (paper: b, w, e or r)"


def test_our_preset_is_the_papers_but_for_what_is_named_here(make):
    for regime in "bwer":
        weights = paper_settings(regime)["encoder.weights"]
        chosen = [
            *("category=table", f"regime={regime}", "schedule=paper", "templates=t30"),
            *("data=shapenet", "data.root=.", f"encoder.weights=/somewhere/{weights}"),
        ]
        config = typed_config(compose_config("train", TrainConfig, chosen), TrainConfig)
        run = make((0.05, 0.4, 0.7), regime=regime)
        run.config.write_text(to_yaml(config))
        assert {line.partition(": ")[0] for line in differences([run])} == OURS


def test_what_cannot_be_set_beside_the_paper_is_said(make):
    run = make((0.05, 0.4, 0.7))
    searched = make((0.01, 0.1, 0.9), seed=1)
    searched.evaluation("paper").rename(searched.path / "val")  # results of no test shapes
    searched.set_status("finished", summary={"chamfer": 0.01, "emd": 0.1, "iou": 0.9})
    assert cells(run, searched)["table", "ours"]["b"] == "50/400/300"
    with pytest.raises(DataError, match="no finished run"):
        beside_paper(load_runs([searched]))
    runs = load_runs([run])
    with pytest.raises(DataError, match=r"again, with protocol=paper"):
        beside_paper(runs.assign(protocol="modern"))
    with pytest.raises(DataError, match="has no emd"):
        beside_paper(runs.drop(columns="emd"))
    run.config.unlink()
    with pytest.raises(ConfigError, match=r"it has no config\.yaml"):
        beside_paper(runs)
