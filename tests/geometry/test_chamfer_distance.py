import numpy as np
import pytest
import torch
from scipy.spatial.distance import cdist

from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.metrics.chamfer import chamfer


def naive(pred, target, reduce):
    """Oracle: all distances."""
    squared = cdist(pred, target) ** 2
    return reduce(squared.min(axis=1)) + reduce(squared.min(axis=0))


def clouds(seed=0, num_pred=7, num_target=5):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(3, num_pred, 3)), rng.normal(size=(3, num_target, 3))


@pytest.mark.parametrize(("reduction", "reduce"), [("sum", np.sum), ("mean", np.mean)])
def test_equals_all_distances(reduction, reduce):
    pred, target = clouds()
    found = chamfer_distance(torch.from_numpy(pred), torch.from_numpy(target), reduction)
    expected = [naive(*pair, reduce) for pair in zip(pred, target, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-13)
    if reduction == "mean":
        metric = [chamfer(*pair) for pair in zip(pred, target, strict=True)]
        np.testing.assert_allclose(metric, expected, rtol=1e-13)
