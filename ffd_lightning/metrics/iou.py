"""Intersection over union of occupancy grids."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from ffd_lightning.geometry.voxels import PAPER_HALF_SIZE, voxelize
from ffd_lightning.metrics.clouds import as_given

Voxels: TypeAlias = Tensor | NDArray[np.bool_]
"""Occupancy in numpy or torch, on any device."""


def voxel_iou(pred: Voxels, target: Voxels) -> Any:
    r"""Return the intersection over union of each pair of grids.

    .. math:: \mathrm{IoU}(A, B) = |A \cap B| / |A \cup B|

    Args:
        pred: (*batch, X, Y, Z) bool.
        target: the same shape. Both grids must divide the same box of space.

    Returns:
        A share from 0 to 1, (*batch,) float64: a tensor if either input is one, else numpy, or a
        float for one pair. One empty grid against one that is not gives 0.

    Raises:
        ValueError: different or too few dimensions, values that are not bool, or both grids of a
            pair empty, which have no such share.

    Source: the paper's equation 3.

    >>> cube = np.zeros((4, 4, 4), bool)
    >>> cube[:2, :2, :2] = True
    >>> voxel_iou(cube, np.roll(cube, 1, axis=0))
    0.3333333333333333
    """
    a, b = (x if isinstance(x, Tensor) else torch.from_numpy(np.asarray(x)) for x in (pred, target))
    if a.shape != b.shape or a.ndim < 3:
        raise ValueError(
            f"grids must be (*batch, X, Y, Z) of one shape, got {tuple(a.shape)}, {tuple(b.shape)}"
        )
    if a.dtype != torch.bool or b.dtype != torch.bool:
        raise ValueError(f"grids must be bool (apply a threshold), got {a.dtype}, {b.dtype}")
    grids = (-3, -2, -1)
    both, either = torch.count_nonzero(a & b, grids), torch.count_nonzero(a | b, grids)
    if not either.all():
        raise ValueError(f"both grids are empty in {int((either == 0).sum())} of the pairs")
    return as_given(both.double() / either, pred, target)


def mesh_iou(
    pred_mesh: tuple[ArrayLike, ArrayLike],
    target_mesh: tuple[ArrayLike, ArrayLike],
    resolution: int = 32,
    half_size: float = PAPER_HALF_SIZE,
) -> float:
    """Return the intersection over union of two meshes, filled, over the grid of [-0.5, 0.5]^3.

    The paper's numbers are with the defaults, and with prediction and target in the frame of
    `geometry.normalization`, neither moved nor scaled. What sticks out of the box is cut off; a
    prediction wholly outside has 0.

    Args:
        pred_mesh: vertices (V, 3) and faces (F, 3), numpy or torch.
        target_mesh: likewise.
        resolution: voxels along each axis.
        half_size: of the boxes that make the surface, in voxels; see `surface_voxels`.

    Raises:
        ValueError: both meshes empty or outside of the box, or what `surface_voxels` refuses.

    Source: the paper's equation 3.

    >>> tetrahedron = ([[0, 0, 0], [0.4, 0, 0], [0, 0.4, 0], [0, 0, 0.4]], [[0, 1, 2], [1, 2, 3]])
    >>> mesh_iou(tetrahedron, tetrahedron)
    1.0
    """
    grids = [
        voxelize(_as_array(vertices), _as_array(faces), resolution, half_size=half_size)
        for vertices, faces in (pred_mesh, target_mesh)
    ]
    return voxel_iou(*grids)


def _as_array(values: Any) -> Any:
    return values.detach().cpu().numpy() if isinstance(values, Tensor) else values
