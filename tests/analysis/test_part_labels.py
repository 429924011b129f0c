import shutil

import numpy as np
import pandas as pd
import pytest
from analysis.made import run_samples as made_samples

from ffd_lightning.analysis.parts import family_table, part_columns, transfer_table
from ffd_lightning.analysis.results import Results
from ffd_lightning.app.commands.evaluate import evaluate_run
from ffd_lightning.app.commands.report import print_labels
from ffd_lightning.app.config import EvaluateConfig
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.candidates import CANDIDATES


def run_samples(n=40, run="a", **columns):
    """Samples of one run under protocol parts."""
    rng = np.random.default_rng(len(run) + n)
    scores = {
        "part_iou": rng.uniform(0.3, 0.9, n) ** 2,
        "undeformed_part_iou": rng.uniform(0.2, 0.9, n) ** 2,
        "floor_part_iou": 0.9,
    }
    return made_samples(n, run=run, **({"family": "desk"} | scores | columns))


def test_each_shape_beside_the_model():
    samples = run_samples()
    table = transfer_table(samples).set_index("shape")
    assert list(table.index) == ["", "undeformed", "floor"], "those that were scored"
    model, as_is = samples["part_iou"], samples["undeformed_part_iou"]
    assert table.loc["undeformed", "mean"] == pytest.approx(as_is.mean())
    assert table.loc["undeformed", "gain"] == pytest.approx((model - as_is).mean())
    assert np.isnan(table.loc["", "gain"])
    assert table.loc["floor", ["low", "high"]].tolist() == pytest.approx([0.9, 0.9])


def test_runs_and_categories_are_apart_and_images_of_a_model_together():
    one = run_samples(20)
    views = pd.concat([one, one.assign(view=1, part_iou=one["part_iou"] + 0.1)])
    other = run_samples(20, "bb").assign(category=["table"] * 8 + ["chair"] * 12)
    table = transfer_table(pd.concat([views, other]))
    table = table[table["shape"] == ""].set_index(["run", "category"])
    assert table["num_samples"].tolist() == [20, 8, 12]
    assert table.loc[("a", "table"), "mean"] == pytest.approx(one["part_iou"].mean() + 0.05)
    assert table.loc[("bb", "chair"), "mean"] == pytest.approx(other["part_iou"][8:].mean())


def test_parts_count_where_they_are():
    nan = np.nan
    shelf = {"part_iou_shelf": [0.5, 0.7, 0.9], "undeformed_part_iou_shelf": [0.4, 0.4, 0.4]}
    columns = {name: [*values, *[nan] * 5] for name, values in shelf.items()}
    columns |= {"part_iou_top": 0.8, "undeformed_part_iou_top": 0.5}
    samples = run_samples(8, **columns, part_iou_drawer=nan, undeformed_part_iou_drawer=nan)
    names = ["part_iou_top", "part_iou_shelf", "part_iou_drawer"]
    assert part_columns(samples) == names
    table = transfer_table(samples, names).set_index(["measure", "shape"])
    assert "part_iou_drawer" not in table.index.get_level_values(0)
    shelf = table.loc[("part_iou_shelf", "undeformed")]
    assert (shelf["num_samples"], shelf["gain"]) == (3, pytest.approx(0.3))
    assert np.isnan(shelf["low"]), "3 shapes say nothing of others"
    assert np.isnan(shelf["gain_high"])
    assert table.loc[("part_iou_top", "undeformed"), "gain_low"] == pytest.approx(0.3)


def test_families():
    samples = run_samples(60, template=["x", "y", "y"] * 20)
    samples.loc[0, "family"] = None
    families = {"a": {"x": "table/desk", "y": "table/round"}}
    table = family_table(samples, families).set_index("family")
    x, y = (samples[1:].query(f"template == '{name}'") for name in "xy")
    assert table["num_samples"].to_dict() == {"same": 19, "other": 40, "same - other": 59}
    means = [part["part_iou"].mean() for part in (x, y)]
    gains = [(part["part_iou"] - part["undeformed_part_iou"]).mean() for part in (x, y)]
    assert table["mean"].tolist() == pytest.approx([*means, means[0] - means[1]])
    assert table["gain"].tolist() == pytest.approx([*gains, gains[0] - gains[1]])
    low, high = table.loc["same - other", ["low", "high"]]
    assert low < table.loc["same - other", "mean"] < high


def test_families_that_are_not_known_or_never_met():
    samples = run_samples(12)
    assert family_table(samples, {}).empty
    assert family_table(samples.assign(family=None), {"a": {"x": "table/desk"}}).empty
    table = family_table(samples, {"a": {"x": "chair/desk"}}).set_index("family")
    assert table["num_samples"].tolist() == [0, 12, 12], "of another category"
    assert table.loc[["same", "same - other"], ["mean", "low", "gain"]].isna().all(axis=None)
    assert table.loc["other", ["mean", "low", "gain"]].notna().all()


# --- runs ----------------------------------------------------------------------------------------


def test_what_is_printed(tiny_run, tmp_path, capsys):
    run = shutil.copytree(tiny_run.path, tmp_path / "b")
    with pytest.raises(DataError, match="holds no run"):
        print_labels(run / "no")
    given = [f"run={run}", "protocol=parts", "progress_bar=false", "evaluation.references=true"]
    evaluate_run(typed_config(compose_config("evaluate", EvaluateConfig, given), EvaluateConfig))
    samples = Results.read(run, "parts").samples
    print_labels(run)
    out = capsys.readouterr().out
    shapes = [s for s in CANDIDATES if s != "resampled"]  # of protocols that carry points
    for column in [f"{shape}_part_iou".removeprefix("_") for shape in shapes]:
        assert f"{100 * samples[column].mean():.1f}" in out, column
    part = part_columns(samples)[0].removeprefix("part_iou_")
    for word in (part, "same - other", "floor", "95% interval"):
        assert word in out
    (run / "template_ranking.csv").unlink()
    print_labels(run)
    assert "families: none are known" in capsys.readouterr().out
