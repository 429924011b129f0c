"""Intervals hold the truth as often as they say, over other trainings and other shapes."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from ffd_lightning.analysis.uncertainty import LEVEL, Estimate, difference, holm


def group(rng, shapes, runs, *, seeds=0.0, rest=0.0, name=""):
    """Scores of runs, (len(shapes), runs)."""
    noise = rng.normal(0, rest, (len(shapes), runs)) if rest else 0.0
    scores = shapes[:, None] + rng.normal(0, seeds, runs) + noise
    return pd.DataFrame(np.broadcast_to(scores, (len(shapes), runs))).add_prefix(name)


def pair(rng, n=80, runs=3, *, own=1.0, **spread):
    """Two groups without a difference; shapes have an effect, `own` one with each group."""
    common = rng.normal(0, 5, n)
    shapes = [common + rng.normal(0, own, n) for _ in range(2)]
    return tuple(group(rng, x, runs, **spread) for x in shapes)


@pytest.mark.parametrize(
    ("runs", "spread"),
    [
        (2, {"seeds": 0.3, "rest": 1.0}),
        (3, {"seeds": 0.0, "rest": 1.0}),
        (3, {"seeds": 0.3, "rest": 1.0}),
        (5, {"seeds": 1.0, "rest": 0.0}),
    ],
)
def test_intervals_hold_the_truth(runs, spread):
    rng = np.random.default_rng(0)
    found = [difference([pair(rng, runs=runs, **spread)])[0] for _ in range(300)]
    intervals = np.array([estimate.interval for estimate in found])
    held = ((intervals[:, 0] <= 0) & (intervals[:, 1] >= 0)).mean()
    assert 0.9 < held < 0.98
    told_apart = np.mean([estimate.p_differs() < LEVEL for estimate in found])
    assert told_apart == pytest.approx(1 - held)


def test_what_varies_beside_runs_and_shapes_counts_once():
    rng = np.random.default_rng(0)

    def squared_error():
        a, b = (group(rng, np.zeros(20), 8, seeds=0.3, rest=1.0) for _ in range(2))
        return difference([(a, b)])[0].error ** 2

    expected = 2 * (0.3**2 / 8 + 1 / (8 * 20))
    assert np.mean([squared_error() for _ in range(300)]) == pytest.approx(expected, rel=0.08)


def test_seeds_alone_are_a_t_test_of_runs():
    rng = np.random.default_rng(0)
    x = rng.normal(size=40)
    a, b = (group(rng, x, 4, seeds=1.0) for _ in range(2))
    found, trainings = difference([(a, b)])
    welch = stats.ttest_ind(a.mean(), b.mean(), equal_var=False)
    assert trainings
    assert found.p_differs() == pytest.approx(welch.pvalue)
    assert found.interval == pytest.approx(tuple(welch.confidence_interval()))


def test_shapes_alone_are_a_t_test_of_pairs():
    rng = np.random.default_rng(0)
    a, b = (group(rng, rng.normal(size=40), 3) for _ in range(2))
    found, trainings = difference([(a, b)])
    assert trainings
    assert found.p_differs() == pytest.approx(stats.ttest_rel(a["0"], b["0"]).pvalue)
    one, trainings = difference([(a[["0"]], b)])
    assert not trainings
    assert one.interval == pytest.approx(found.interval)


def test_a_run_on_several_categories_counts_once():
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=(2, 40))
    runs = rng.normal(size=(2, 3))
    joint = [
        (pd.DataFrame(z[:, None] + runs[0]), pd.DataFrame(z[:, None] + runs[1])) for z in (x, y)
    ]
    apart = [(a.add_prefix(f"{k}-"), b.add_prefix(f"{k}-")) for k, (a, b) in enumerate(joint)]
    (once, known), (twice, _) = difference(joint), difference(apart)
    welch = stats.ttest_ind(*runs, equal_var=False)
    assert known
    assert once.p_differs() == pytest.approx(welch.pvalue)
    assert twice.error == pytest.approx(once.error / 2**0.5)
    alone = [(a[[0]], b[[0]]) for a, b in joint]
    assert not difference(alone)[1], "one training in all"


def test_of_one_run_each_the_categories_are_the_sample():
    rng = np.random.default_rng(0)
    true, pairs = rng.normal(size=7), []
    for k, shift in enumerate(true):
        x = rng.normal(size=30)
        a, b = (group(rng, z, 1, name=f"{k}-") for z in (x + shift, x))
        pairs.append((a, b))
    found, trainings = difference(pairs)
    assert trainings
    assert found.p_differs() == pytest.approx(stats.ttest_1samp(true, 0).pvalue)


def test_equal_is_shown_by_two_one_sided_tests():
    x = np.random.default_rng(0).normal(0.1, 1, 50)
    found, margin = Estimate.over_strata([x]), 0.6
    one_sided = [
        stats.ttest_1samp(x, -margin, alternative="greater").pvalue,
        stats.ttest_1samp(x, margin, alternative="less").pvalue,
    ]
    assert found.p_equal(margin) == pytest.approx(max(one_sided))
    same = Estimate.over_strata([np.zeros(5)])
    assert (same.p_differs(), same.p_equal(0.1), same.interval) == (1, 0, (0, 0))


def test_holm():
    """As he states it: the smallest level at which each is rejected."""
    p = np.random.default_rng(0).random(12) ** 3
    levels, worst = {}, 0.0
    for rank, k in enumerate(np.argsort(p)):
        worst = levels[int(k)] = max(worst, min(1.0, p[k] * (len(p) - rank)))
    assert holm(p) == pytest.approx([levels[k] for k in range(len(p))])
    assert holm([0.01, 0.01, 0.9]) == pytest.approx([0.03, 0.03, 0.9])
    assert holm([np.nan, 0.01, 0.9]) == pytest.approx([np.nan, 0.02, 0.9], nan_ok=True)
    assert holm([]) == []
