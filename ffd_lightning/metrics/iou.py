"""Intersection over union of occupancy grids."""

import numpy as np
from numpy.typing import NDArray


def voxel_iou(pred: NDArray[np.bool_], target: NDArray[np.bool_]) -> float:
    r"""Return the intersection over union of two grids.

    $$ \mathrm{IoU}(A, B) = |A \cap B| / |A \cup B| $$

    Grids are (X, Y, Z) and must divide the same box of space. One empty grid against one that is
    not gives 0.

    Raises:
        ValueError: both grids are empty, which have no such share, or not of the same shape.

    Source: the paper's equation 3.

    >>> cube = np.zeros((4, 4, 4), bool)
    >>> cube[:2, :2, :2] = True
    >>> voxel_iou(cube, np.roll(cube, 1, axis=0))
    0.3333333333333333
    """
    if np.shape(pred) != np.shape(target):
        raise ValueError(f"grids of {np.shape(pred)} and {np.shape(target)} voxels")
    pred, target = np.asarray(pred, bool), np.asarray(target, bool)
    both, either = np.count_nonzero(pred & target), np.count_nonzero(pred | target)
    if either == 0:
        raise ValueError("both grids are empty")
    return float(both / either)
