"""Chests of drawers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ffd_lightning.shapes.cabinet.casework import STANDS, add_top, stand
from ffd_lightning.shapes.cabinet.fronts import fronts
from ffd_lightning.shapes.cabinet.joinery import Joinery, carcass, dividers, draw_joinery
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.vectors import Pair, Triple, vec


class _Limits(NamedTuple):
    """From what to what the sizes (metres) and the numbers of drawers of a kind go."""

    width: Pair
    height: Pair
    depth: Pair
    rows: tuple[int, int]
    columns: tuple[int, int]


_LIMITS = {
    "night": _Limits((0.38, 0.6), (0.3, 0.6), (0.3, 0.45), rows=(1, 3), columns=(1, 1)),
    "tall": _Limits((0.4, 0.7), (1.0, 1.5), (0.38, 0.5), rows=(5, 7), columns=(1, 1)),
    "chest": _Limits((0.75, 1.1), (0.65, 1.1), (0.4, 0.55), rows=(3, 5), columns=(1, 2)),
    "wide": _Limits((1.2, 1.8), (0.55, 0.9), (0.4, 0.55), rows=(2, 4), columns=(2, 3)),
}


def dresser(rng: Rng) -> Builder:
    """Build a chest of drawers: nightstand, tallboy, wide dresser."""
    b = Builder()
    style = draw_joinery(rng)
    kind = draw(rng, ["night", "tall", "chest", "wide"], [0.25, 0.2, 0.25, 0.3])
    limits = _LIMITS[kind]
    width, height, depth = (rng.uniform(*limit) for limit in limits[:3])
    fewest, most = limits.rows
    rows = int(rng.integers(fewest, most + 1))
    columns = int(rng.integers(limits.columns[0], most)) % 4
    columns = int(np.clip(columns, *limits.columns))
    base = stand(b, rng, style.body, (width, depth), STANDS, 0.22)
    bay = carcass(b, style, (width, height, depth), bottom=base)
    size = (width, base + height, depth)
    add_top(b, rng, style.body if rng.random() < 0.6 else style.front, size)
    graded = np.linspace(rng.uniform(1.0, 1.7), 1.0, rows)
    levels = bay.split(graded, across=False)
    dividers(b, style, levels, across=False)
    split_top = rng.random() < 0.4 and kind in ("chest", "wide")
    open_level = 0 if kind == "night" and rows > 1 and rng.random() < 0.5 else -1
    for i, level in enumerate(levels):
        if i == open_level:
            continue
        count = columns + 1 if split_top and i == rows - 1 else columns
        cells = level.split(np.ones(count), across=True)
        dividers(b, style, cells, across=True)
        for cell in cells:
            fronts(b, style, cell, 1)
    if kind == "wide" and rng.random() < 0.3:
        _mirror(b, rng, style, (width, base + height, depth))
    return b


def _mirror(b: Builder, rng: Rng, style: Joinery, size: Triple) -> None:
    """Stand a framed mirror on the back of a dresser of `size`."""
    width, height, depth = size
    wide, tall = rng.uniform(0.5, 0.85) * width, rng.uniform(0.45, 0.8)
    center = vec(0, height + 0.08 + tall / 2, depth / 2 - 0.03)
    glass = Material((0.75, 0.83, 0.88))
    b.rounded_box("top", style.body, center, (wide, tall, 0.03), 0.01)
    b.box("top", glass, center - vec(0, 0, 0.01), (wide - 0.1, tall - 0.1, 0.018))
    for x in (-0.3, 0.3):
        post = (0.04, 0.5 * tall + 0.16, 0.02)
        b.box("top", style.body, center + vec(x * wide, -0.25 * tall, 0.01), post)
