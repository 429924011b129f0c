"""Fuselages and the glass in them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import Pair
from ffd_lightning.shapes.plane.livery import GLASS


def fuselage(
    b: Builder,
    part: str,
    material: Material,
    rows: Sequence[Section],
    boxiness: float = 0.0,
    side: float = 0.0,
) -> None:
    """Add a body along z through the sections `rows`, at x = `side`; `boxiness` is from 0 to 1."""
    b.loft(part, material, [row.ring(boxiness, side=side) for row in rows])


def tapered(
    length: float, width: float, height: float, nose: float, tail: float, upsweep: float
) -> list[Section]:
    """Return the sections of a transport's fuselage, nose at z = -length / 2.

    `nose` and `tail` are the lengths of the two cones; the tail's underside rises by `upsweep`.
    """
    rows = []
    for angle in (0.01, 0.1, 0.3, 0.6, 1.0, np.pi / 2):
        s = np.sin(angle) ** 0.7
        y = -0.14 * height * (1 - s)
        rows.append(Section(-length / 2 + nose * (1 - np.cos(angle)), y, width * s, height * s))
    for t in (0.0, 0.35, 0.7, 0.92, 1.0):
        s = 1 - 0.86 * t**1.5
        rows.append(Section(length / 2 - tail * (1 - t), upsweep * t**1.5, width * s, height * s))
    return rows


def width_at(rows: Sequence[Section], z: float) -> float:
    """Return the width of a fuselage at z."""
    return float(np.interp(z, [row.z for row in rows], [row.width for row in rows]))


def height_at(rows: Sequence[Section], z: float, up: float) -> float:
    """Return the height of the middle (`up` 0), top (1) or belly (-1) of a fuselage at z."""
    places = [row.z for row in rows]
    middle = np.interp(z, places, [row.lift for row in rows])
    tall = np.interp(z, places, [row.height for row in rows])
    return float(middle + up * tall / 2)


def canopy(
    b: Builder, rows: Sequence[Section], ends: Pair, width: float, rise: float, frames: Material
) -> None:
    """Add a bubble of glass on top of a fuselage between two z, with a few frames."""
    z = np.linspace(*ends, 9)
    t = (z - ends[0]) / (ends[1] - ends[0])
    swell = np.sqrt(np.clip(1 - (2 * t**0.8 - 1) ** 2, 0.02, 1))
    base = [height_at(rows, at, 1) for at in z]
    sections = [
        Section(at, low - 0.3 * width, (0.25 + 0.75 * s) * width, 0.6 * width + 2 * rise * s)
        for at, low, s in zip(z, base, swell, strict=True)
    ]
    fuselage(b, "window", GLASS, sections, 0.1)
    for i in (2, 4):
        rings = [sections[i]._replace(z=z[i] + d).ring(0.1, grow=1.02) for d in (-0.004, 0.004)]
        b.loft("body", frames, rings)


def windows(
    b: Builder, rows: Sequence[Section], ends: Pair, count: int, up: float, size: Pair
) -> None:
    """Add `count` cabin windows to both flanks, `up` of the half-height above the middle."""
    for z in np.linspace(*ends, count):
        x = 0.5 * width_at(rows, z) * np.sqrt(1 - up**2)
        y = height_at(rows, z, up)
        for side in (-1, 1):
            b.box("window", GLASS, (side * (x - 0.001), y, z), (0.006, size[1], size[0]))


def windscreen(b: Builder, rows: Sequence[Section], z: float, depth: float) -> None:
    """Add the cockpit's glass: a band around the upper front of a fuselage."""
    angles = np.radians(np.linspace(16, 84, 6))
    for side in (-1, 1):
        rings = []
        for at in np.linspace(z, z + depth, 4):
            middle, half = height_at(rows, at, 0), 0.5 * width_at(rows, at)
            tall = height_at(rows, at, 1) - middle
            cos, sin = np.cos(angles), np.sin(angles)
            flat = [(s * half * cos, middle + s * tall * sin) for s in (1.03, 0.9)]
            outer, inner = (np.stack(xy, 1) for xy in flat)
            ring = np.concatenate([outer, inner[::-1]]) * [side, 1]
            rings.append(np.column_stack([ring, np.full(12, at)]))
        b.loft("window", GLASS, rings)
