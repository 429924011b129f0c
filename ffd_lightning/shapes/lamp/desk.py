"""Desk lamps."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import UP, Array, lean, vec
from ffd_lightning.shapes.lamp.bodies import add_foot
from ffd_lightning.shapes.lamp.materials import draw_body_material, draw_metal
from ffd_lightning.shapes.lamp.shades import HEADS, add_head, draw_shade


def desk(rng: Rng) -> Builder:
    """Build a lamp with a jointed arm or a gooseneck, whose head looks down and forward."""
    b = Builder()
    metal, material = draw_metal(rng), draw_body_material(rng)
    foot, back = rng.uniform(0.015, 0.04), rng.uniform(0.0, 0.06)
    add_foot(b, rng, material, rng.uniform(0.07, 0.12), foot)
    lower, upper = rng.uniform(0.27, 0.42), rng.uniform(0.2, 0.38)
    start = vec(0, foot + 0.01, back)
    if rng.random() < 0.35:
        rise = lower + upper * rng.uniform(0.3, 0.6)
        corner = start + rise * UP
        points = [start - 0.02 * UP, corner, corner + vec(0, 0.03, -upper)]
        points += [corner + vec(0, -0.1, -1.1 * upper)]
        path = bend(points, 0.3, 8)
        b.tube("arm", metal, path, 0.012, segments=10)
        end, tilt = path[-1], rng.uniform(0, 25)
    else:
        tip, fall = np.radians(rng.uniform(5, 32)), np.radians(rng.uniform(-10, 60))
        elbow = start + lower * vec(0, np.cos(tip), np.sin(tip))
        end = elbow + upper * vec(0, np.sin(fall), -np.cos(fall))
        gap = 0.014 if rng.random() < 0.5 else 0.0
        for first, second in ((start, elbow), (elbow, end)):
            _rods(b, metal, first, second, gap)
        for joint in (start, elbow, end):
            axle = vec(0.012 + gap, 0, 0)
            b.cylinder("arm", material, joint - axle, joint + axle, 0.022, segments=16)
        tilt = rng.uniform(0, 50)
    if rng.random() < 0.25:
        _bar_head(b, rng, material, end)
        return b
    shade = draw_shade(rng, rng.uniform(0.07, 0.12), rng.uniform(0.09, 0.17), HEADS)
    add_head(b, shade, metal, end, lean(tilt), 0.08)
    return b


def _rods(b: Builder, metal: Material, start: Array, end: Array, gap: float) -> None:
    """Join two points by one rod, or by two that are `gap` to each side."""
    for side in (-1, 1) if gap else (0,):
        shift = vec(side * gap, 0, 0)
        b.cylinder("arm", metal, start + shift, end + shift, 0.008 if gap else 0.012, segments=10)


def _bar_head(b: Builder, rng: Rng, material: Material, end: Array) -> None:
    """Add a long flat head with a glowing underside, across the front or along the arm."""
    long, wide = rng.uniform(0.25, 0.45), rng.uniform(0.05, 0.1)
    across = rng.random() < 0.5
    size = np.array([long, 0.025, wide] if across else [wide, 0.025, long])
    center = end + vec(0, 0, 0.0 if across else -0.4 * long)
    b.rounded_box("shade", material, center, size, radius=0.02, edge=0.008)
    glow = Material((1.0, 0.96, 0.82))
    b.box("bulb", glow, center - 0.013 * UP, size * vec(0.9, 0.3, 0.8))
