"""How a deformation folds and stretches a mesh."""

import numpy as np
from numpy.typing import NDArray


def distortion(
    vertices: NDArray[np.float64],
    deformed: NDArray[np.float64],
    faces: NDArray[np.int64],
    edges: NDArray[np.int64],
    jacobians: NDArray[np.float64],
) -> dict[str, float]:
    """Measure how a deformation folds and stretches a mesh.

    Independent of the unit. The deformation is looked at where the mesh has vertices, so measure
    the finely subdivided mesh that is deformed, not the coarse one.

    Args:
        vertices: (V, 3) original positions.
        deformed: (V, 3) positions after the deformation.
        faces: (F, 3) vertex indices.
        edges: (E, 2) vertex indices, see `unique_edges`.
        jacobians: (V, 3, 3), see `geometry.jacobian.deformation_jacobian`.

    Returns:
        `folded`, the share of the original surface where the deformation turns space inside out
        (each corner stands for a third of its face); `stretch_median` and `stretch_95`, the median
        and the 95th percentile over edges of max(r, 1 / r), r the ratio of lengths: 1 for none,
        inf where an edge becomes a point. Edges that were points are left out.

    Raises:
        ValueError: the original mesh has no area.

    >>> corner, wide = np.eye(4, 3), np.diag([2.0, 1, 1])
    >>> faces, jacobians = np.array([[3, 0, 1]]), np.tile(wide, (4, 1, 1))
    >>> distortion(corner, corner @ wide, faces, unique_edges(corner, faces), jacobians)
    {'folded': 0.0, 'stretch_median': 1.5811388300841895, 'stretch_95': 2.0}
    """
    sides = vertices[faces[:, 1:]] - vertices[faces[:, :1]]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    if not area.sum() > 0:
        raise ValueError("the original mesh has no area")
    # A share of vertices would count mostly the finely modelled parts.
    folded = (np.linalg.det(jacobians) < 0)[faces].mean(axis=1)
    start, end = edges.T
    before, after = (np.linalg.norm(x[start] - x[end], axis=1) for x in (vertices, deformed))
    before, after = before[before > 0], after[before > 0]
    with np.errstate(divide="ignore"):
        stretch = np.maximum(after / before, before / after)
    # Values that occur, not ones between two: there may be infinite ones.
    median, most = np.percentile(stretch, (50, 95), method="inverted_cdf")
    return {
        "folded": float((area * folded).sum() / area.sum()),
        "stretch_median": float(median),
        "stretch_95": float(most),
    }


def unique_edges(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the edges of a mesh as vertex indices, (E, 2); those of equal positions once.

    Positions are (V, 3), faces (F, 3).

    >>> unique_edges(np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0]]), np.array([[0, 1, 2]])).tolist()
    [[0, 0], [0, 1]]
    """
    _, first, same = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    corners = first[same.ravel()][faces]
    ends = corners, np.roll(corners, -1, axis=1)
    numbers = np.unique(np.minimum(*ends) * len(vertices) + np.maximum(*ends))
    return np.stack(np.divmod(numbers, len(vertices)), axis=1)
