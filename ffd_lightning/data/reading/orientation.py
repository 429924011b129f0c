"""Turning meshes into the project's frame: y up, facing -z."""

import csv
import math
from collections.abc import Collection
from pathlib import Path
from typing import Literal, NamedTuple, cast, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ffd_lightning.errors import DataError, did_you_mean
from ffd_lightning.geometry.mesh import Mesh

Up = Literal["y", "z", "x", "-y", "-z", "-x"]
"""The axis of meshes that points up."""


class Orientation(NamedTuple):
    """How a mesh stands before it is turned: see `turn`."""

    up: Up = "y"
    yaw: float = 0.0


ORIENTATIONS = "orientations.csv"
"""Beside the meshes of a category: how single ones stand, see `read_orientations`."""


# Cosine and sine of quarter turns: numpy's leave 6e-17 where 0 is meant.
_QUARTERS = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}


def turn(points: ArrayLike, up: Up, yaw: float) -> NDArray[np.float64]:
    """Turn points (..., 3), or directions, until they are y up and face -z.

    Convention:
        With z up, (x, y, z) becomes (x, z, -y): what faces +y then faces -z. With -z up it becomes
        (x, -z, y); with the others, what faces -z still does. After that all is rotated by `yaw`
        degrees about +y, anticlockwise seen from above: 90 turns what faces -z to -x. Quarter turns
        are exact.

    >>> turn([0, 0, -1], "y", 90).tolist()
    [-1.0, 0.0, 0.0]
    """
    x, y, z = np.moveaxis(np.asarray(points, np.float64), -1, 0)
    x, y, z = {
        "y": (x, y, z),
        "z": (x, z, -y),
        "x": (-y, x, z),
        "-y": (-x, -y, z),
        "-z": (x, -z, y),
        "-x": (y, -x, z),
    }[up]
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


def read_orientations(
    file: Path, ids: Collection[str], usual: Orientation
) -> dict[str, Orientation]:
    """Read how single shapes stand: a CSV with a column `id`, and `yaw` or `up` or both.

    An empty field, or a column that is not there, means what is `usual`. Where there is no file, no
    shape stands otherwise.

    Raises:
        DataError: a column, an id or a value that cannot be; it names the line.
    """
    if not file.is_file():
        return {}
    found: dict[str, Orientation] = {}
    with file.open(encoding="utf-8-sig", errors="replace", newline="") as lines:
        rows: csv.DictReader[str] = csv.DictReader(lines, skipinitialspace=True)
        names = set(rows.fieldnames or ())
        if not {"id"} < names <= {"id", "yaw", "up"}:
            raise DataError(
                f"{file}, line 1: columns must be id, yaw and up, or id and one of both"
            )
        for row in rows:
            shape_id, up, yaw = ((row.get(name) or "").strip() for name in ("id", "up", "yaw"))
            try:
                if shape_id not in ids:
                    raise ValueError(
                        f"there is no shape {shape_id!r}.{did_you_mean(shape_id, ids)}"
                    )
                if shape_id in found:
                    raise ValueError(f"{shape_id} is there twice")
                pose = Orientation(cast(Up, up or usual.up), float(yaw or usual.yaw))
                check_orientation(*pose)
            except ValueError as error:
                raise DataError(f"{file}, line {rows.line_num}: {error}") from None
            found[shape_id] = pose
    return found
