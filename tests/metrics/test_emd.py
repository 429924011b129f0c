import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from ffd_lightning.metrics.emd import earth_movers_distance


def by_assignment(pred, target):
    """Oracle: scipy's Jonker-Volgenant."""
    cost = cdist(pred, target)
    return cost[linear_sum_assignment(cost)].mean()


def clouds(name, num=150):
    rng = np.random.default_rng(sum(map(ord, name)))
    a, b = rng.random((num, 3)), rng.random((num, 3))
    grid = np.stack(np.meshgrid(*[np.arange(5.0)] * 3), axis=-1).reshape(-1, 3)
    return {
        "random": (a, b),
        "duplicates": (a[rng.integers(0, 9, num)], b[rng.integers(0, 30, num)]),
        "one point against many": (np.zeros((num, 3)), b),
        "flat": (a * [1, 1, 0], b * [1, 1, 0]),
        "lines": (a * [1, 0, 0], b * [1, 0, 0]),
        "ties": (grid, grid + [1, 0, 0]),
        "two clumps": (a * 1e-3 + (a[:, :1] < 0.5), b * 1e-3 + (b[:, :1] < 0.4)),
        "outlier": (np.vstack([a[1:], [[1e4, 0, 0]]]), b),
        "far away": (a + 1e6, b + 1e6),
        "tiny": (a * 1e-12, b * 1e-12),
        "huge": (a * 1e12, b * 1e12),
        "two points": (a[:2], b[:2]),
        "one point": (a[:1], b[:1]),
    }[name]


KINDS = [
    *("random", "duplicates", "one point against many", "flat", "lines", "ties", "two clumps"),
    *("outlier", "far away", "tiny", "huge", "two points", "one point"),
]


@pytest.mark.parametrize("kind", KINDS)
def test_equals_scipy(kind):
    pred, target = clouds(kind)
    assert earth_movers_distance(pred, target) == pytest.approx(
        by_assignment(pred, target), rel=1e-13, abs=0
    )


@pytest.mark.parametrize("kind", ["random", "ties", "duplicates"])
def test_same_cloud_is_at_zero(kind):
    pred, _ = clouds(kind)
    shuffled = np.random.default_rng(0).permutation(pred)
    assert earth_movers_distance(pred, shuffled) == 0


def test_translation_costs_its_length():
    pred, _ = clouds("random")
    move = np.array([0.3, -0.5, 2.0])
    assert earth_movers_distance(pred, pred + move) == pytest.approx(
        np.linalg.norm(move), rel=1e-14
    )


def test_is_a_distance_of_sets():
    (a, b), (_, c) = clouds("random"), clouds("flat")
    distance = earth_movers_distance(a, b)
    for seed in range(10):
        shuffled = np.random.default_rng(seed).permutation(a)
        assert earth_movers_distance(shuffled, b) == distance
    assert earth_movers_distance(b, a) == distance
    assert earth_movers_distance(a, c) <= distance + earth_movers_distance(b, c)


@pytest.mark.parametrize(
    ("pred", "target"),
    [
        (np.zeros((4, 3)), np.zeros((5, 3))),
        (np.zeros((0, 3)), np.zeros((0, 3))),
        (np.zeros((4, 3)), np.full((4, 3), np.nan)),
    ],
)
def test_refuses(pred, target):
    with pytest.raises(ValueError, match="finite clouds of equal size"):
        earth_movers_distance(pred, target)


@pytest.mark.filterwarnings("ignore:numItermax")
def test_a_solver_that_stops_early_gives_no_result(monkeypatch):
    import ot

    solve = ot.emd
    monkeypatch.setattr(ot, "emd", lambda *a, **options: solve(*a, **options | {"numItermax": 20}))
    with pytest.raises(RuntimeError, match="no optimal assignment"):
        earth_movers_distance(*clouds("random"))
