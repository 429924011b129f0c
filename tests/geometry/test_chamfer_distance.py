import numpy as np
import pytest
import torch
from scipy.spatial.distance import cdist

from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.metrics.chamfer import chamfer


@pytest.mark.parametrize(("reduction", "reduce"), [("sum", np.sum), ("mean", np.mean)])
def test_equals_all_distances(reduction, reduce):
    rng = np.random.default_rng(0)
    pred, target = rng.normal(size=(3, 7, 3)), rng.normal(size=(3, 5, 3))
    squared = [cdist(*pair) ** 2 for pair in zip(pred, target, strict=True)]
    expected = [reduce(table.min(axis=1)) + reduce(table.min(axis=0)) for table in squared]
    found = chamfer_distance(torch.from_numpy(pred), torch.from_numpy(target), reduction)
    np.testing.assert_allclose(found, expected, rtol=1e-13)
    if reduction == "mean":
        metric = [chamfer(*pair) for pair in zip(pred, target, strict=True)]
        np.testing.assert_allclose(metric, expected, rtol=1e-13)
