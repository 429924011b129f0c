"""Vectors and rotations: y is up, the front is -z, matrices turn columns."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Pair = tuple[float, float]
"""Two ends of a range, or two sides."""
Point = ArrayLike
"""A point (3,), an array or a tuple."""
Triple = tuple[float, float, float]
"""A point as (x, y, z), or a size as (width, height, depth) where nothing else is said."""
UP = np.array([0.0, 1.0, 0.0])
UNTURNED = np.eye(3)
SIDES = np.array([-1, 1])
"""The sign of x at the left and at the right."""


def vec(x: float, y: float, z: float) -> Array:
    """Return a point, a shift or a scale as an array (3,)."""
    return np.array([x, y, z], float)


def rotation(axis: ArrayLike, degrees: float) -> Array:
    """Return the (3, 3) matrix that turns by `degrees` about `axis` (right-handed)."""
    direction = np.asarray(axis, float)
    x, y, z = direction / np.linalg.norm(direction)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    a = np.radians(degrees)
    return np.eye(3) + np.sin(a) * k + (1 - np.cos(a)) * k @ k


def lean(degrees: float) -> Array:
    """Return the (3, 3) rotation about x: it tips an upright's top backward (+z) by `degrees`."""
    return rotation((1, 0, 0), degrees)


def about_y(degrees: float) -> Array:
    """Return the (3, 3) rotation about y: it turns the front (-z) to the left (-x)."""
    return rotation(UP, degrees)


def about_z(degrees: float) -> Array:
    """Return the (3, 3) rotation about z: it tips an upright's top to the left (-x)."""
    return rotation((0, 0, 1), degrees)
