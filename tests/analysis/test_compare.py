import tracemalloc

import numpy as np
import pandas as pd
import pytest
from analysis.made import results
from analysis.made import run_samples as made_samples
from scipy import stats

from ffd_lightning.analysis import compare as compare_module
from ffd_lightning.analysis.compare import compare, compare_with, holm, leads
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


# --- one category ---------------------------------------------------------------------------------


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
    names = ["num_samples", "difference", "low", "high", "p"]
    assert compared(*views)[names].iloc[0].tolist() == pytest.approx(in_order[names].iloc[0])


def test_seeds_of_a_group_are_averaged_first():
    rng = np.random.default_rng(0)
    b, w = rng.random((3, 30)), rng.random((2, 30)) + 0.2
    parts = [run_samples(x, "b", seed=k) for k, x in enumerate(b)]
    parts += [run_samples(x, "w", seed=k) for k, x in enumerate(w)]
    row = compared(*parts).iloc[0]
    differences = w.mean(0) - b.mean(0)
    assert row["difference"] == pytest.approx(differences.mean())
    assert row["p"] == pytest.approx(stats.wilcoxon(differences).pvalue)
    assert (row["seeds_a"], row["seeds_b"]) == (2, 3)
    signs = [x.mean() > y.mean() for x in w for y in b]
    assert row["agreement"] == pytest.approx(np.mean(signs))


def test_holm():
    """As he states it: the smallest level at which each is rejected."""
    p = np.random.default_rng(0).random(12) ** 3
    levels, worst = {}, 0.0
    for rank, k in enumerate(np.argsort(p)):
        worst = levels[int(k)] = max(worst, min(1.0, p[k] * (len(p) - rank)))
    assert holm(p) == pytest.approx([levels[k] for k in range(len(p))])
    assert holm([0.01, 0.01, 0.9]) == pytest.approx([0.03, 0.03, 0.9])


def test_mean_and_ranks_must_agree():
    x = np.full(40, 0.1) + 1e-3 * np.arange(40)
    outliers = np.where(np.arange(40) < 6, 2.0 + np.arange(40), 0)
    assert not compared(*pair(0 * x, x - outliers))["shown"].any()


def test_equal_differences_have_no_interval():
    x = np.sin(np.arange(30.0))
    row = compared(*pair(x, x)).iloc[0]
    assert (row["difference"], row["low"], row["high"], row["p"]) == (0, 0, 0, 1)
    row = compared(*pair(x, x + 0.5)).iloc[0]
    assert (row["low"], row["high"]) == pytest.approx((0.5, 0.5))
    assert row["shown"]


def test_many_shapes_need_little_memory(monkeypatch):
    monkeypatch.setattr(compare_module, "RESAMPLES", 500)
    samples = pair(*np.random.default_rng(0).random((2, 10_000)))
    tracemalloc.start()
    compared(*samples)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 40e6


# --- several categories ---------------------------------------------------------------------------


def test_each_category_counts_the_same_in_the_mean():
    (b1, w1), (b2, w2) = skewed(0, n=25), skewed(1, n=80, shift=1.0)
    table = compared(*pair(b1, w1), *pair(b2, w2, "chair")).set_index("category")
    row = table.loc["mean of 2"]
    assert row["difference"] == pytest.approx((np.mean(w1 - b1) + np.mean(w2 - b2)) / 2)
    assert row["low"] < row["difference"] < row["high"]
    assert row["num_samples"] == 105
    one_sided = [
        stats.wilcoxon(d, alternative="greater", method="approx").pvalue for d in (w1 - b1, w2 - b2)
    ]
    combined = stats.combine_pvalues(one_sided, method="stouffer").pvalue
    assert row["p"] == pytest.approx(2 * min(combined, 1 - combined), rel=0.05)
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


# --- what is compared -----------------------------------------------------------------------------


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


def test_shapes_of_joint_runs_are_the_same_shapes():
    x = np.linspace(1, 2, 20)
    together = [
        run_samples(x, category=c).assign(run="joint", variant="category=joint")
        for c in ("table", "sofa")
    ]
    for part in together:
        part["id"] = part["category"] + "/" + part["id"]
    (row,) = compared(run_samples(x + 0.5), *together, by="variant").to_dict("records")
    assert (row["category"], row["num_samples"]) == ("table", 20)
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
    assert lower["shown"]


def test_a_network_is_held_against_what_it_retrieves():
    rng = np.random.default_rng(0)
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
    assert not same["shown"]
    with pytest.raises(DataError, match="no column feature_retrieval_emd"):
        compare_with(results(*runs), "emd", "feature_retrieval")
    half = results(runs[0], run_samples(network[1], "e", seed=1))
    with pytest.raises(DataError, match="samples without chamfer: ffd evaluate"):
        compare_with(half, "chamfer", "feature_retrieval")
