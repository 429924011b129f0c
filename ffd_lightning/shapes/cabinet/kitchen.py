"""Kitchen units: a worktop with a sink and a hob, and units on the wall."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.cabinet.casework import add_top, fill, stand
from ffd_lightning.shapes.cabinet.joinery import Joinery, carcass, dividers, draw_joinery, plank
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import Triple, vec


def kitchen(rng: Rng) -> Builder:
    """Build a kitchen unit: closed bays under a worktop with a sink or hob, often wall units."""
    b = Builder()
    style = draw_joinery(rng, ("wood", "paint", "paint", "plastic"))
    count = int(rng.choice([1, 2, 3], p=[0.2, 0.4, 0.4]))
    width, height, depth = count * rng.uniform(0.42, 0.75), rng.uniform(0.65, 0.8), 0.58
    base = stand(b, rng, pick_material(rng, "rubber"), (width, depth), ("plinth", "bracket"), 0.14)
    columns = carcass(b, style, (width, height, depth), bottom=base).split(np.ones(count), True)
    dividers(b, style, columns, across=True)
    for column in columns:
        fill(b, rng, style, column, draw(rng, ["door", "drawers", "mixed"], [0.5, 0.25, 0.25]))
    worktop = pick_material(rng, draw(rng, ["wood", "metal", "plastic"]))
    add_top(b, rng, worktop, (width, base + height, depth))
    level = base + height + 0.035
    steel = pick_material(rng, "metal")
    spots = [column.x for column in columns]
    _sink(b, rng, steel, spots.pop(int(rng.integers(len(spots)))), level)
    if spots and rng.random() < 0.6:
        x = spots[int(rng.integers(len(spots)))]
        material = Material((0.08, 0.08, 0.09))
        b.rounded_box("top", material, (x, level, 0), (0.44, 0.03, 0.42), 0.02, segments=2)
        for i, j in ((-1, -1), (1, -1), (-1, 1), (1, 1)):
            ring = [(0.05, 0.015), (0.075, 0.022), (0.05, 0.024), (0.03, 0.018)]
            b.lathe("top", steel, ring, (x + 0.11 * i, level, 0.1 * j), segments=12)
    if rng.random() < 0.6:
        _wall_units(b, rng, style, (width, level, depth), count)
    return b


def _sink(b: Builder, rng: Rng, steel: Material, x: float, level: float) -> None:
    """Add a sink's rim, its dark bowl and a tap at `x` on a worktop at `level`."""
    size = vec(rng.uniform(0.34, 0.42), 0.024, rng.uniform(0.3, 0.38))
    b.rounded_box("top", steel, (x, level, -0.04), size, 0.04, segments=2)
    bowl = Material((0.35, 0.36, 0.38))
    center = (x, level + 0.004, -0.04)
    b.rounded_box("top", bowl, center, size * vec(0.85, 1, 0.8), 0.06, segments=2)
    rise, reach = rng.uniform(0.14, 0.3), rng.uniform(0.12, 0.18)
    path = [(x, level, 0.2), (x, level + rise, 0.2)]
    path += [(x, level + y, 0.2 - reach) for y in (rise, 0.7 * rise)]
    b.tube("top", steel, bend(path, 0.06, 3), 0.013, segments=8)


def _wall_units(b: Builder, rng: Rng, style: Joinery, size: Triple, count: int) -> None:
    """Add a splashback behind a worktop of `size` (width, height, depth) and cases at its top."""
    width, level, depth = size
    gap, rise, deep = rng.uniform(0.4, 0.6), rng.uniform(0.45, 0.8), rng.uniform(0.28, 0.36)
    tiles = Material(pick_material(rng, "plastic").color, "checker", 5.0)
    low, high = (-width / 2, level - 0.02, depth / 2 - 0.02), (width / 2, level + gap + 0.02)
    plank(b, "body", tiles, low, (*high, depth / 2))
    bay = carcass(b, style, (width, rise, deep), (0.0, (depth - deep) / 2), level + gap)
    columns = bay.split(np.ones(count), across=True)
    dividers(b, style, columns, across=True)
    for column in columns:
        fill(b, rng, style, column, draw(rng, ["door", "glass", "open"], [0.6, 0.2, 0.2]))
