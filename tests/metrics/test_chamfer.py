import numpy as np
import pytest
from scipy.spatial.distance import cdist

from ffd_lightning.metrics.chamfer import chamfer


@pytest.mark.parametrize("sizes", [(1, 50), (90, 140)])
def test_equals_all_distances(sizes):
    rng = np.random.default_rng(0)
    pred, target = (rng.normal(size=(size, 3)) for size in sizes)
    distances = cdist(pred, target) ** 2
    expected = distances.min(axis=1).mean() + distances.min(axis=0).mean()
    found = chamfer(pred, target)
    assert found == pytest.approx(expected, rel=1e-13)
    assert found == chamfer(target, pred)
