import numpy as np
import pytest
from analysis.made import run_samples as made_samples

from ffd_lightning.analysis.parts import family_table


def run_samples(n=40, run="a", **columns):
    """Samples of one run under protocol parts."""
    rng = np.random.default_rng(len(run) + n)
    columns = {"family": "desk", "part_iou": rng.uniform(0.3, 0.9, n) ** 2} | columns
    return made_samples(n, run=run, **columns)


def test_families():
    samples = run_samples(60, template=["x", "y", "y"] * 20)
    samples.loc[0, "family"] = None
    families = {"a": {"x": "table/desk", "y": "table/round"}}
    table = family_table(samples, families).set_index("family")
    x, y = (samples[1:].query(f"template == '{name}'") for name in "xy")
    assert table["num_samples"].to_dict() == {"same": 19, "other": 40, "same - other": 59}
    means = [part["part_iou"].mean() for part in (x, y)]
    assert table["mean"].tolist() == pytest.approx([*means, means[0] - means[1]])
    low, high = table.loc["same - other", ["low", "high"]]
    assert low < table.loc["same - other", "mean"] < high


def test_families_that_are_not_known_or_never_met():
    samples = run_samples(12)
    assert family_table(samples, {}).empty
    assert family_table(samples.assign(family=None), {"a": {"x": "table/desk"}}).empty
    table = family_table(samples, {"a": {"x": "chair/desk"}}).set_index("family")
    assert table["num_samples"].tolist() == [0, 12, 12], "of another category"
    assert table.loc[["same", "same - other"], ["mean", "low"]].isna().all(axis=None)
    assert table.loc["other", ["mean", "low"]].notna().all()
