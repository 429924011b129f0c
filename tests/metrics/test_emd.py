import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from ffd_lightning.metrics.emd import earth_movers_distance

RNG = np.random.default_rng(0)
A, B = RNG.random((150, 3)), RNG.random((150, 3))
GRID = np.stack(np.meshgrid(*[np.arange(5.0)] * 3), axis=-1).reshape(-1, 3)
CLOUDS = {
    "random": (A, B),
    "duplicates": (A[RNG.integers(0, 9, 150)], B[RNG.integers(0, 30, 150)]),
    "ties": (GRID, GRID + [1, 0, 0]),
    "tiny": (A * 1e-12, B * 1e-12),  # POT's constants suppose costs around 1
}


@pytest.mark.parametrize("kind", CLOUDS)
def test_equals_scipys_assignment(kind):
    pred, target = CLOUDS[kind]
    cost = cdist(pred, target)
    expected = cost[linear_sum_assignment(cost)].mean()
    found = earth_movers_distance(pred, target)
    assert found == pytest.approx(expected, rel=1e-13, abs=0)
    assert earth_movers_distance(RNG.permutation(pred), target) == found, "of sets"


@pytest.mark.filterwarnings("ignore:numItermax")
def test_a_solver_that_stops_early_gives_no_result(monkeypatch):
    import ot

    solve = ot.emd
    monkeypatch.setattr(ot, "emd", lambda *a, **options: solve(*a, **options | {"numItermax": 20}))
    with pytest.raises(RuntimeError, match="no optimal assignment"):
        earth_movers_distance(A, B)
