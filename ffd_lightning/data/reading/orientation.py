"""Turning meshes into the project's frame: y up, facing -z."""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ffd_lightning.geometry.mesh import Mesh

Up = Literal["y", "z"]
"""The axis of a data set's meshes that points up."""

# Cosine and sine of quarter turns: numpy's leave 6e-17 where 0 is meant.
_QUARTERS = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}


def turn(points: ArrayLike, up: Up, yaw: float) -> NDArray[np.float64]:
    """Turn points (..., 3), or directions, until they are y up and face -z.

    Convention:
        With z up, (x, y, z) becomes (x, z, -y): what faces +y then faces -z. After that all is
        rotated by `yaw` degrees about +y, anticlockwise seen from above: 90 turns what faces -z to
        -x. Quarter turns are exact.

    >>> turn([0, 0, -1], "y", 90).tolist()
    [-1.0, 0.0, 0.0]
    """
    x, y, z = np.moveaxis(np.asarray(points, np.float64), -1, 0)
    if up == "z":
        y, z = z, -y
    angle = np.radians(yaw)
    cosine, sine = _QUARTERS.get(yaw % 360, (np.cos(angle), np.sin(angle)))
    return np.stack([cosine * x + sine * z, y, cosine * z - sine * x], axis=-1) + 0.0  # no -0.0


def check_orientation(up: str, yaw: float) -> None:
    """Check the settings of a source that turns its meshes; a ValueError names the wrong one."""
    if up not in get_args(Up):
        raise ValueError(f"up={up} must be one of {', '.join(get_args(Up))}")
    if not math.isfinite(yaw):
        raise ValueError(f"yaw={yaw} must be a number of degrees")


def orient(mesh: Mesh, up: Up, yaw: float) -> Mesh:
    """Turn a mesh as `turn` does its points; the very same mesh where nothing is to be turned."""
    unturned = up == "y" and yaw % 360 == 0
    return mesh if unturned else mesh.with_vertices(turn(mesh.vertices, up, yaw))
