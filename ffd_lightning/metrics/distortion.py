"""How a deformation folds and stretches a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def distortion(
    vertices: NDArray[np.float64],
    deformed: NDArray[np.float64],
    faces: NDArray[np.int64],
    jacobians: NDArray[np.float64],
) -> dict[str, float]:
    """Measure how a deformation folds and stretches a mesh.

    Independent of the unit. The deformation is looked at where the mesh has vertices, so measure
    the finely subdivided mesh that is deformed, not the coarse one.

    Args:
        vertices: (V, 3) original positions.
        deformed: (V, 3) positions after the deformation.
        faces: (F, 3) vertex indices.
        jacobians: (V, 3, 3), see `geometry.jacobian.deformation_jacobian`.

    Returns:
        `folded`, the share of the original surface where the deformation turns space inside out
        (each corner stands for a third of its face); `stretch_median` and `stretch_95`, the median
        and the 95th percentile over edges of max(r, 1 / r), r the ratio of lengths: 1 for none.

    Raises:
        ValueError: the original mesh has no area.

    >>> corner, wide = np.eye(4, 3), np.diag([2.0, 1, 1])
    >>> distortion(corner, corner @ wide, np.array([[3, 0, 1]]), np.tile(wide, (4, 1, 1)))
    {'folded': 0.0, 'stretch_median': 1.5811388300841895, 'stretch_95': 2.0}
    """
    edges = vertices[faces[:, 1:]] - vertices[faces[:, :1]]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    if not area.sum() > 0:
        raise ValueError("the original mesh has no area")
    # A share of vertices would count mostly the finely modelled parts.
    folded = (np.linalg.det(jacobians) < 0)[faces].mean(axis=1)
    stretch = edge_stretch(vertices, deformed, faces)
    # Values that occur, not ones between two: there may be infinite ones.
    median, most = np.percentile(stretch, (50, 95), method="inverted_cdf")
    return {
        "folded": float((area * folded).sum() / area.sum()),
        "stretch_median": float(median),
        "stretch_95": float(most),
    }


def edge_stretch(
    vertices: NDArray[np.float64], deformed: NDArray[np.float64], faces: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return max(r, 1 / r) of every edge, r the deformed length over the original one.

    Edges between the same two original positions are one edge. Edges of original length 0 are left
    out; one that the deformation takes to length 0 gives inf.

    Positions before and after are (V, 3), faces (F, 3); returns (E,).

    >>> line = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> edge_stretch(line, line * [4, 0.5, 1], np.array([[0, 1, 1]]))
    array([4.])
    """
    _, first, same = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    corners = first[same.ravel()][faces]
    ends = corners, np.roll(corners, -1, axis=1)
    numbers = np.unique(np.minimum(*ends) * len(vertices) + np.maximum(*ends))
    start, end = np.divmod(numbers, len(vertices))
    before, after = (np.linalg.norm(x[start] - x[end], axis=1) for x in (vertices, deformed))
    before, after = before[before > 0], after[before > 0]
    with np.errstate(divide="ignore"):
        return np.maximum(after / before, before / after)
