"""The frame all shapes share: ShapeNet's, centred and scaled by the bounding box."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def normalize(vertices: ArrayLike, faces: ArrayLike | None = None) -> NDArray[np.float64]:
    """Move the bounding box's centre to the origin and scale its diagonal to 1.

    Convention:
        The scale is the same along every axis and nothing is turned. The result lies within
        0.5 of the origin.

    Args:
        vertices: (V, 3) positions in any unit.
        faces: (F, 3) vertex indices; where given, only vertices that a face uses count for the
            box (the others are moved along).

    Returns:
        (V, 3) float64 positions.

    Raises:
        ValueError: no vertices, not finite, or the box has no extent.

    >>> normalize([[0, 0, 0], [2, 0, 0], [2, 0, 0]])
    array([[-0.5,  0. ,  0. ],
           [ 0.5,  0. ,  0. ],
           [ 0.5,  0. ,  0. ]])
    """
    center, diagonal = bounding_box(vertices, faces)
    return (np.asarray(vertices, np.float64) - center) / diagonal


def bounding_box(
    vertices: ArrayLike, faces: ArrayLike | None = None
) -> tuple[NDArray[np.float64], float]:
    """Return the centre, (3,), and the diagonal of the bounding box.

    Args:
        vertices: (V, 3) positions.
        faces: (F, 3) vertex indices; where given, only vertices that a face uses count.

    Raises:
        ValueError: as `normalize`.
    """
    points = np.asarray(vertices, np.float64)
    used = points if faces is None else points[np.unique(np.asarray(faces, np.int64))]
    if len(used) == 0:
        raise ValueError("there are no vertices to normalise")
    low, high = used.min(axis=0), used.max(axis=0)
    diagonal = float(np.linalg.norm(high - low))
    if not np.isfinite(diagonal):
        raise ValueError("the vertices are not all finite")
    if diagonal == 0:
        raise ValueError("the bounding box has no extent: all vertices are the same point")
    return low / 2 + high / 2, diagonal
