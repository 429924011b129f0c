import numpy as np
import pytest
from scipy.spatial.distance import cdist

from ffd_lightning.metrics.chamfer import chamfer


def naive(pred, target, power):
    """Oracle: all distances."""
    distances = cdist(pred, target) ** power
    return distances.min(axis=1).mean() + distances.min(axis=0).mean()


@pytest.mark.parametrize("power", [1, 2])
@pytest.mark.parametrize("sizes", [(1, 1), (1, 50), (90, 140), (300, 20), (64, 64)])
def test_equals_all_distances(sizes, power):
    rng = np.random.default_rng(0)
    pred, target = (rng.normal(size=(size, 3)) for size in sizes)
    found = chamfer(pred, target, power)
    assert found == pytest.approx(naive(pred, target, power), rel=1e-13)
    assert found == chamfer(target, pred, power)
    assert chamfer(4 * pred, 4 * target, power) == 4**power * found


def test_known_shapes():
    line = np.arange(10.0)[:, None] * [1, 0, 0]
    assert chamfer(line, line + [0, 0.5, 0]) == pytest.approx(0.5)
    assert chamfer(line, line + [0, 0.5, 0], power=1) == pytest.approx(1)
    # 4 of the target lie within 0.25 of it, a fifth at 10.
    target = np.array([[0.25, 0, 0]] * 4 + [[10, 0, 0]])
    assert chamfer(np.zeros((1, 3)), target) == pytest.approx(0.25**2 + (4 * 0.25**2 + 100) / 5)
    assert chamfer(line, line[::-1]) == 0


@pytest.mark.parametrize("bad", [np.zeros((0, 3)), np.full((4, 3), np.inf)])
def test_refuses(bad):
    for pair in ((bad, np.zeros((4, 3))), (np.zeros((4, 3)), bad)):
        with pytest.raises(ValueError, match=r"no pair|finite"):
            chamfer(*pair)
