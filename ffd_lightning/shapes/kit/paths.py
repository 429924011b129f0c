"""Rows of points: corners, circles, bent polylines."""

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit.vectors import Array


def corners(width: float, depth: float, height: float, z: float = 0.0) -> Array:
    """Return the (4, 3) corners of a level rectangle about (0, height, z), in order around it.

    The first two are the front ones (-z).
    """
    signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    flat = signs * np.array([width, depth]) / 2 + np.array([0, z])
    return np.insert(flat, 1, height, axis=1)


def circle(count: int, radius: float, height: float, degrees: float = 0.0) -> Array:
    """Return `count` points (count, 3) evenly around the y axis, the first turned by `degrees`."""
    a = np.radians(degrees) + 2 * np.pi * np.arange(count) / count
    return np.stack([radius * np.cos(a), np.full(count, height), radius * np.sin(a)], 1)


def bend(points: ArrayLike, radius: float, steps: int = 5) -> Array:
    """Return the polyline (p, 3) with its inner corners rounded by about `radius`."""
    corners_ = np.asarray(points, float)
    path = [corners_[0]]
    for before, corner, after in zip(corners_, corners_[1:], corners_[2:], strict=False):
        to, away = before - corner, after - corner
        lengths = np.linalg.norm(to), np.linalg.norm(away)
        reach = min(radius, 0.45 * lengths[0], 0.45 * lengths[1])
        a, b = corner + to * reach / lengths[0], corner + away * reach / lengths[1]
        for t in np.linspace(0, 1, steps + 1):
            path.append((1 - t) ** 2 * a + 2 * t * (1 - t) * corner + t**2 * b)
    return np.array([*path, corners_[-1]])
