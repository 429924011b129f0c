"""Bodies swept along a firearm, which points to -z."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material
from ffd_lightning.shapes.kit.sections import superellipse
from ffd_lightning.shapes.kit.vectors import Array, Pair, vec


class Cut(NamedTuple):
    """Where a body that runs along the barrel is cut across.

    Attributes:
        forward: the cut's place, towards the muzzle.
        low: height of the section's lower end.
        high: height of its upper end.
        width: across.
    """

    forward: float
    low: float
    high: float
    width: float


def at(forward: float, up: float, side: float = 0.0) -> Array:
    """Return the (3,) point that lies `forward` of the origin, towards -z."""
    return vec(side, up, -forward)


def bar(
    b: Builder, part: str, material: Material, rows: Sequence[Cut], boxiness: float = 0.7
) -> None:
    """Add a body along the barrel through the sections `rows`; `boxiness` is from 0 to 1."""
    ring = superellipse(boxiness)
    sections = []
    for forward, low, high, width in np.asarray(rows, float):
        y = (low + high) / 2 + ring[:, 1] * (high - low) / 2
        sections.append(np.column_stack([ring[:, 0] * width / 2, y, np.full(len(y), -forward)]))
    b.loft(part, material, sections)


def even_bar(
    b: Builder,
    part: str,
    material: Material,
    ends: Pair,
    low: float,
    high: float,
    width: float,
    boxiness: float = 0.7,
) -> None:
    """Add a body of one section, between the two places along the barrel in `ends`."""
    bar(b, part, material, [Cut(f, low, high, width) for f in ends], boxiness=boxiness)


def sweep(
    b: Builder,
    part: str,
    material: Material,
    path: ArrayLike,
    depth: ArrayLike,
    width: ArrayLike,
    boxiness: float = 0.6,
) -> None:
    """Sweep a section along a path (p, 2) of (forward, up) in the plane of symmetry.

    `depth` is measured in that plane, `width` across it; both may vary along the path.
    """
    points = np.asarray(path, float)
    tangents = np.gradient(points, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    depths = np.broadcast_to(np.asarray(depth, float), len(points))
    widths = np.broadcast_to(np.asarray(width, float), len(points))
    ring, sections = superellipse(boxiness), []
    for point, (df, du), d, w in zip(points, tangents, depths, widths, strict=True):
        flat = point + ring[:, 1:] * d / 2 * np.array([-du, df])
        sections.append(np.column_stack([ring[:, 0] * w / 2, flat[:, 1], -flat[:, 0]]))
    b.loft(part, material, sections)
