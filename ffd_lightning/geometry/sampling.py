"""Points drawn from a surface: independently, or with a share for each face."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def sample_surface(
    vertices: ArrayLike, faces: ArrayLike, count: int, rng: np.random.Generator
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Draw points independently and uniformly by area; a face without area is never drawn.

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
    corners, cumulative = _surface(vertices, faces)
    # Draws stay below the sum, and side="right" passes over faces that add nothing to it.
    face_ids = np.searchsorted(cumulative, rng.random(count) * cumulative[-1], side="right")
    return _within(corners, face_ids, rng), face_ids.astype(np.int32)


def sample_stratified(
    vertices: ArrayLike, faces: ArrayLike, count: int, rng: np.random.Generator
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Draw points on a surface of which each face has its share.

    A face has as many points as the rounded, cumulated area says; only their places on it, and the
    order of all, are random. Arguments, returns and errors are those of `sample_surface`.

    Source: how the authors' code samples all its clouds.
    """
    corners, cumulative = _surface(vertices, faces)
    ends = np.round(cumulative * (count / cumulative[-1])).astype(np.int64)
    face_ids = rng.permutation(np.repeat(np.arange(len(ends)), np.diff(ends, prepend=0)))
    return _within(corners, face_ids, rng), face_ids.astype(np.int32)


def _surface(
    vertices: ArrayLike, faces: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the faces' corners, (F, 3, 3), and twice their areas, cumulated, (F,)."""
    corners = np.asarray(vertices, np.float64)[np.asarray(faces, np.int64).reshape(-1, 3)]
    sides = corners[:, 1:] - corners[:, :1]
    cumulative = np.cumsum(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1))
    if len(cumulative) == 0 or not 0 < cumulative[-1] < np.inf:
        raise ValueError("the surface has no area to draw points from")
    return corners, cumulative


def _within(
    corners: NDArray[np.float64], face_ids: NDArray[np.int64], rng: np.random.Generator
) -> NDArray[np.float32]:
    """Draw one point on each of the faces that are named, (n, 3)."""
    origin = corners[:, 0]
    edge_u, edge_v = corners[:, 1] - origin, corners[:, 2] - origin
    u, v = rng.random((2, len(face_ids), 1))
    outside = u + v > 1
    u, v = np.where(outside, 1 - u, u), np.where(outside, 1 - v, v)
    points = origin[face_ids] + u * edge_u[face_ids] + v * edge_v[face_ids]
    return points.astype(np.float32)
