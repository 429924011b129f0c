"""Points drawn uniformly from a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def sample_surface(
    vertices: ArrayLike, faces: ArrayLike, count: int, rng: np.random.Generator
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Draw points independently and uniformly by area.

    A face is drawn with probability proportional to its area, then barycentric coordinates by
    folding the unit square onto the triangle. A face without area is never drawn.

    Args:
        vertices: (V, 3) positions.
        faces: (F, 3) vertex indices.
        count: number of points.
        rng: the only source of randomness: the same state gives the same points.

    Returns:
        points, (count, 3) float32, and the face that each was drawn from, (count,) int32.

    Raises:
        ValueError: no face has a positive, finite area.
    """
    corners = np.asarray(vertices, np.float64)[np.asarray(faces, np.int64).reshape(-1, 3)]
    origin, edge_u = corners[:, 0], corners[:, 1] - corners[:, 0]
    edge_v = corners[:, 2] - corners[:, 0]
    cumulative = np.cumsum(np.linalg.norm(np.cross(edge_u, edge_v), axis=1))
    if len(cumulative) == 0 or not 0 < cumulative[-1] < np.inf:
        raise ValueError("the surface has no area to draw points from")
    # Draws stay below the sum, and side="right" passes over faces that add nothing to it.
    face_ids = np.searchsorted(cumulative, rng.random(count) * cumulative[-1], side="right")
    u, v = rng.random((2, count, 1))
    outside = u + v > 1
    u, v = np.where(outside, 1 - u, u), np.where(outside, 1 - v, v)
    points = origin[face_ids] + u * edge_u[face_ids] + v * edge_v[face_ids]
    return points.astype(np.float32), face_ids.astype(np.int32)
