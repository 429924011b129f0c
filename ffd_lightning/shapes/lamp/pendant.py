"""Pendant lamps."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.vectors import UP, vec
from ffd_lightning.shapes.lamp.bodies import outline, turned
from ffd_lightning.shapes.lamp.cords import HANGING, add_cord, add_rose, hang_shade
from ffd_lightning.shapes.lamp.materials import draw_metal, draw_shade_material
from ffd_lightning.shapes.lamp.shades import FLIP, Shade, add_bulb, add_shade, draw_shade


def pendant(rng: Rng) -> Builder:
    """Build one shade on a cord, several from a bar or a plate, a globe, or stacked rings."""
    b = Builder()
    metal = draw_metal(rng)
    kind = draw(rng, ["single", "row", "cluster", "globe", "rings"], [0.35, 0.2, 0.15, 0.15, 0.15])
    drop = rng.uniform(0.15, 0.8)
    if kind in ("row", "cluster"):
        _several(b, rng, metal, kind, drop)
        return b
    add_rose(b, metal, rng.uniform(0.05, 0.09), np.zeros(3))
    add_cord(b, metal, np.zeros(3), drop)
    if kind == "single":
        wide = rng.uniform(0.14, 0.34)
        shade = draw_shade(rng, wide, wide * rng.uniform(0.6, 1.7), HANGING, glass=0.1)
        hang_shade(b, shade, metal, vec(0, -drop, 0), 0.12)
    elif kind == "globe":
        wide = rng.uniform(0.14, 0.28)
        tall = wide * rng.uniform(0.7, 1.4)
        a = np.linspace(-1.5, 1.5, 21)
        ribs = 1 + 0.02 * np.cos(np.pi * np.arange(21)) * (rng.random() < 0.5)
        rows = np.stack([wide * ribs * np.cos(a), tall * np.sin(a)], 1)
        turned(b, "shade", draw_shade_material(rng), rows, outline("round"), (0, -drop - tall, 0))
        b.cylinder("shade", metal, (0, -drop - 0.03, 0), (0, 0.02 - drop, 0), 0.03)
    else:
        _tiers(b, rng, metal, drop)
    return b


def _several(b: Builder, rng: Rng, metal: Material, kind: str, drop: float) -> None:
    """Add two to six equal shades, in a row below a bar or around below a plate."""
    count = int(rng.integers(2, 6)) if kind == "row" else int(rng.integers(3, 7))
    wide = rng.uniform(0.07, 0.15)
    shade = draw_shade(rng, wide, wide * rng.uniform(0.8, 2.0), HANGING, fine=count < 4)
    uneven = rng.uniform(0.1, 0.5) if rng.random() < 0.5 else 0.0
    if kind == "row":
        gap = wide * rng.uniform(2.3, 3.2)
        bar = (gap * (count - 1) + 0.1, 0.03, 0.06)
        b.rounded_box("base", metal, (0, -0.015, 0), bar, radius=0.02, edge=0.005)
        places = np.array([(x, 0.0, 0.0) for x in gap * (np.arange(count) - (count - 1) / 2)])
    else:
        ring = 1.15 * wide / np.sin(np.pi / count)
        add_rose(b, metal, ring + 0.04, np.zeros(3))
        places = circle(count, ring, height=0.0)
    for place in places:
        length = max(0.08, drop + uneven * rng.uniform(-0.5, 0.5))
        add_cord(b, metal, place, length)
        hang_shade(b, shade, metal, place - length * UP, 0.1)


def _tiers(b: Builder, rng: Rng, metal: Material, drop: float) -> None:
    """Add two to six conical leaves, one above the other on a rod, as an artichoke of discs."""
    count, wide = int(rng.integers(2, 7)), rng.uniform(0.16, 0.34)
    gap = rng.uniform(0.05, 0.1)
    skin, bulge = draw_shade_material(rng, glass=0.0), rng.uniform(0.3, 0.9)
    b.cylinder("pole", metal, (0, -drop, 0), (0, -drop - gap * count, 0), 0.02)
    for i, t in enumerate(np.linspace(-1, 0.7, count)):
        r = wide * (1 - bulge * t * t)
        rows = np.array([(r, -1.1 * gap), (0.62 * r, -0.35 * gap), (0.03, 0.0)])
        add_shade(b, Shade(rows, outline("round"), skin), metal, (0, -drop - i * gap, 0))
    add_bulb(b, metal, (0, -drop - gap * (count - 1), 0), 0.1, FLIP)
