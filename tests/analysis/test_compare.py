import numpy as np
import pandas as pd
import pytest
from analysis.made import results
from analysis.made import run_samples as made_samples

from ffd_lightning.analysis.compare import compare, compare_with, decide, leads
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import Metric


def run_samples(chamfer, regime="b", **columns):
    return made_samples(len(chamfer), regime, chamfer=chamfer, **columns)


def pair(b, w, category="table", seed=0):
    return [run_samples(x, r, category=category, seed=seed) for x, r in ((b, "b"), (w, "w"))]


def compared(*samples, **options):
    return compare(results(*samples), "chamfer", **options)


def skewed(seed, n=60, shift=0.3):
    """Scores of two runs whose differences have a long tail."""
    rng = np.random.default_rng(seed)
    b = rng.gamma(2.0, size=n)
    return b, b + shift - rng.exponential(size=n) ** 2 / 2


def test_shapes_that_all_runs_have_are_paired_by_id_and_views_averaged():
    b, w = skewed(0)
    of_b, of_w = pair(b, w)
    in_order = compared(of_b, of_w)
    shuffled = of_w.sample(frac=1, random_state=0)
    pd.testing.assert_frame_equal(compared(of_b, shuffled), in_order)
    row = compared(of_b, of_w.iloc[10:]).iloc[0]
    assert row["num_samples"] == 50
    assert row["difference"] == pytest.approx(np.mean((w - b)[10:]))
    views = [part.assign(view=k) for k in range(3) for part in pair(b + k, w + k)]
    names = ["num_samples", "difference", "low", "high"]
    assert compared(*views)[names].iloc[0].tolist() == pytest.approx(in_order[names].iloc[0])


def of_seeds(values, regime, spread=0.001):
    """Three runs that differ a little."""
    return [run_samples(values + spread * k, regime, seed=k) for k in range(3)]


def test_one_training_each_decides_nothing():
    x = np.sin(np.arange(30.0)) + 2
    assert not compared(*pair(x, x + 0.5))[["differs", "equal", "trainings"]].any(axis=None)
    assert not compared(*of_seeds(x, "b"), run_samples(x + 0.5, "w"))["differs"].any()
    assert compared(*of_seeds(x, "b"), *of_seeds(x + 0.5, "w"))["differs"].all()


def test_equal_is_measured_above_the_floor():
    x = np.sin(np.arange(30.0)) + 2
    runs = [*of_seeds(x, "b"), *of_seeds(x + 0.1, "w")]
    (row,) = compared(*runs).to_dict("records")
    assert np.isnan(row["above"])
    assert not row["equal"], "nobody knows"
    (row,) = compared(*(run.assign(floor_chamfer=0.0) for run in runs)).to_dict("records")
    assert row["above"] == pytest.approx(row["mean_b"])
    assert row["equal"]
    runs = [run.assign(floor_chamfer=1.5, undeformed_chamfer=run["chamfer"]) for run in runs]
    (row,) = compared(*runs).to_dict("records")
    assert row["above"] == pytest.approx(row["mean_b"] - 1.5)
    assert not row["equal"], "0.1 of 0.5"
    assert row["differs"]
    (undeformed,) = compare(results(*runs), "undeformed_chamfer").to_dict("records")
    assert undeformed["above"] == row["above"]


def test_a_table_is_corrected_for_its_rows():
    x = np.random.default_rng(1).normal(size=30)
    rows = compared(*of_seeds(x, "b", 0.05), *of_seeds(x + 0.2, "w", 0.05))
    assert rows["differs"].all()
    many = decide(pd.concat([rows.assign(p=p) for p in (*rows["p"], *np.full(20, 0.9))]))
    assert many["p_corrected"].iloc[0] == pytest.approx(21 * rows["p"].iloc[0])
    assert not many["differs"].any()


def test_each_category_counts_the_same_in_the_mean():
    (b1, w1), (b2, w2) = skewed(0, n=25), skewed(1, n=80, shift=1.0)
    table = compared(*pair(b1, w1), *pair(b2, w2, "chair")).set_index("category")
    row = table.loc["mean of 2"]
    assert row["difference"] == pytest.approx((np.mean(w1 - b1) + np.mean(w2 - b2)) / 2)
    assert row["low"] < row["difference"] < row["high"]
    assert row["num_samples"] == 105
    assert len(table) == 3


def test_a_category_in_which_a_group_is_missing_is_left_out_of_the_mean():
    b, w = skewed(0)
    three = (*pair(b, w), run_samples(b + w, "e"))
    table = compared(*three, *pair(w, b, "chair"), run_samples(b, category="lamp"))
    assert table["category"].tolist() == ["table"] * 3 + ["chair", "mean of 2"]
    assert tuple(table.iloc[-1][["a", "b"]]) == ("w", "b")
    assert table.iloc[-1]["difference"] == pytest.approx(0, abs=1e-12)
    found = [row["category"] for row in leads(table, Metric("chamfer", ""))]
    assert found == ["table", "chair"], "e is not in both"


def test_numbers_of_templates_are_held_apart_or_compared():
    x = np.arange(12.0)
    samples = [run_samples(x * t + k, r, templates=t) for t in (2, 16) for k, r in enumerate("bw")]
    table = compared(*samples)
    assert table["templates"].tolist() == [2, 16]
    assert table["difference"].tolist() == [1.0, 1.0]
    table = compared(*samples, by="templates")
    assert table["regime"].tolist() == ["b", "w"]
    assert set(zip(table["a"], table["b"], strict=True)) == {("T = 16", "T = 2")}
    table = compared(*samples, by=["regime", "templates"])
    assert len(table) == 6
    assert tuple(table.iloc[0][["a", "b"]]) == ("b, T = 16", "b, T = 2")


def test_other_settings_must_be_equal():
    x = np.arange(9.0)
    samples = pair(x, x + 1)
    same = results(*samples, trainer__devices=[1, 2], regime__name=["b", "w"])
    assert len(compare(same, "chamfer")) == 1
    other = results(*samples, schedule__steps=[1000, 300])
    with pytest.raises(DataError, match=r"schedule\.steps \(1000, 300\).* regime"):
        compare(other, "chamfer")
    assert len(compare(other, "chamfer", ["regime", "templates", "variant"])) == 1, "as a whole"


@pytest.mark.parametrize("data", ["", " (data.seed=1)"])
def test_shapes_of_joint_runs_are_the_same_shapes(data):
    x = np.linspace(1, 2, 20)
    together = [
        run_samples(x, category=c + data).assign(run="joint", variant="category=joint")
        for c in ("table", "sofa")
    ]
    for part, category in zip(together, ("table/", "sofa/"), strict=True):
        part["id"] = category + part["id"]
    alone = run_samples(x + 0.5, category="table" + data)
    (row,) = compared(alone, *together, by="variant").to_dict("records")
    assert (row["category"], row["num_samples"]) == ("table" + data, 20)
    assert row["difference"] == pytest.approx(-0.5)


@pytest.mark.parametrize(
    ("samples", "measure", "message"),
    [
        (pair([1.0, 2], [1.0, 2]), "emd", "no column emd"),
        (pair([1.0, 2], [1.0, np.nan]), "chamfer", "w/t16/seed0 "),
        (pair([1.0], [1.0]), "chamfer", "share 1 test shapes"),
        ([run_samples([1.0, 2])], "chamfer", "same regime"),
    ],
)
def test_what_cannot_be_compared_is_said(samples, measure, message):
    with pytest.raises(DataError, match=message):
        compare(results(*samples), measure)


def test_the_best_is_compared_with_the_second():
    x = np.linspace(1, 2, 30) ** 2
    table = compared(*pair(x, x - 0.5), run_samples(x - 0.4, "e"))
    (lower,) = leads(table, Metric("chamfer", ""))
    (higher,) = leads(table, Metric("chamfer", "", higher_is_better=True))
    assert (lower["a"], lower["b"], lower["difference"]) == ("w", "e", pytest.approx(-0.1))
    assert (higher["a"], higher["b"], higher["difference"]) == ("b", "e", pytest.approx(0.4))
    assert lower["mean_a"] - lower["mean_b"] == pytest.approx(lower["difference"])
    for row in (lower, higher):
        assert [row["low"], row["high"]] == pytest.approx([row["difference"]] * 2, abs=0.05)


def test_a_network_is_held_against_what_it_retrieves():
    rng, own = np.random.default_rng(0), "feature_retrieval_chamfer"
    network, retrieved = rng.random((2, 2, 30))
    runs = [
        run_samples(network[k], "e", seed=k, feature_retrieval_chamfer=retrieved[k] + 0.5)
        for k in range(2)
    ]
    other = run_samples(network[0], "r", feature_retrieval_chamfer=network[0])
    table = compare_with(results(*runs, other), "chamfer", "feature_retrieval")
    assert set(zip(table["a"], table["b"], strict=True)) == {("network", "feature_retrieval")}
    row, same = (table[table["regime"] == name].iloc[0] for name in "er")
    differences = network.mean(0) - retrieved.mean(0) - 0.5
    assert row["difference"] == pytest.approx(differences.mean())
    assert row["low"] < differences.mean() < row["high"] < 0
    assert (row["num_samples"], row["seeds_a"], row["seeds_b"]) == (30, 2, 2)
    assert not same["differs"]
    assert row["trainings"]
    # Trainings are paired: what makes one good or bad does not blur its gain.
    runs = [run.assign(chamfer=run["chamfer"] + run["seed"]) for run in runs]
    runs = [run.assign(**{own: run[own] + run["seed"]}) for run in runs]
    again = compare_with(results(*runs), "chamfer", "feature_retrieval").iloc[0]
    assert again[["low", "high"]].tolist() == pytest.approx(row[["low", "high"]].tolist())
    with pytest.raises(DataError, match="no column feature_retrieval_emd"):
        compare_with(results(*runs), "emd", "feature_retrieval")
    half = results(runs[0], run_samples(network[1], "e", seed=1))
    with pytest.raises(DataError, match="samples without chamfer: ffd evaluate"):
        compare_with(half, "chamfer", "feature_retrieval")
