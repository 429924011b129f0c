import numpy as np
import pytest

from ffd_lightning.metrics.iou import voxel_iou


def test_matches_a_naive_count():
    rng = np.random.default_rng(0)
    a, b = rng.random((4, 5, 6)) < 0.4, rng.random((4, 5, 6)) < 0.6
    first, second = (set(map(tuple, np.argwhere(grid))) for grid in (a, b))
    assert voxel_iou(a, b) == len(first & second) / len(first | second)
    assert voxel_iou(a, np.zeros_like(a)) == 0
    with pytest.raises(ValueError, match="both grids are empty"):
        voxel_iou(np.zeros_like(a), np.zeros_like(a))
