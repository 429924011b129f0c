"""Floor lamps."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs
from ffd_lightning.shapes.kit.paths import bend, circle
from ffd_lightning.shapes.kit.vectors import about_y, about_z
from ffd_lightning.shapes.lamp.bodies import add_foot, ball
from ffd_lightning.shapes.lamp.materials import draw_body_material, draw_metal, draw_shade_material
from ffd_lightning.shapes.lamp.shades import (
    CLOTH,
    FLIP,
    HEADS,
    add_bulb,
    add_harp,
    add_head,
    add_shade,
    draw_shade,
)


def floor(rng: Rng) -> Builder:
    """Build a tall pole or tripod with a shade, a torchiere's bowl, a globe or several heads."""
    b = Builder()
    metal, material = draw_metal(rng), draw_body_material(rng)
    height, radius = rng.uniform(1.1, 1.55), rng.uniform(0.014, 0.026)
    head = draw(rng, ["shade", "bowl", "globe", "tree"], [0.5, 0.2, 0.12, 0.18])
    if rng.random() < 0.3 and head != "tree":
        _tripod(b, rng, material, metal, height)
    else:
        add_foot(b, rng, metal, rng.uniform(0.13, 0.2), rng.uniform(0.02, 0.06))
        b.cylinder("pole", metal, (0, 0.01, 0), (0, height, 0), radius, radius_end=0.8 * radius)
        for y in rng.uniform(0.1, 0.85, int(rng.integers(0, 4))) * height:
            rows = [(radius, -0.04), (2.2 * radius, -0.01), (2.2 * radius, 0.01), (radius, 0.04)]
            b.lathe("pole", material, rows, (0, y, 0), segments=16)
        if rng.random() < 0.15:
            y = rng.uniform(0.3, 0.45) * height
            tray = rng.uniform(0.17, 0.25)
            b.lathe("base", material, [(tray, 0), (tray, 0.02)], (0, y, 0), segments=32)
    if head == "shade":
        wide, tall = rng.uniform(0.16, 0.32), rng.uniform(0.2, 0.42)
        add_bulb(b, metal, (0, height - 0.02, 0), 0.12)
        add_harp(b, metal, low=height, high=height + 0.75 * tall, reach=0.06)
        shade = draw_shade(rng, wide, tall, CLOTH)
        add_shade(b, shade, metal, (0, height + 0.75 * tall, 0))
    elif head == "bowl":
        shade = draw_shade(rng, rng.uniform(0.13, 0.24), rng.uniform(0.08, 0.22), HEADS)
        add_shade(b, shade, metal, (0, height, 0), FLIP)
        add_bulb(b, metal, (0, height, 0), 0.09)
    elif head == "globe":
        size = rng.uniform(0.1, 0.2)
        radii = size * np.array([1, rng.uniform(0.8, 1.5)])
        center = (0, height + 0.9 * radii[1], 0)
        ball(b, "shade", draw_shade_material(rng), center, radii)
    else:
        _branches(b, rng, metal, height)
    return b


def _tripod(b: Builder, rng: Rng, material: Material, metal: Material, height: float) -> None:
    """Add three long legs that meet below the shade, and perhaps a ring or a tray between them."""
    joint = height * rng.uniform(0.55, 0.93)
    style = LegStyle(draw(rng, ["round", "square"]), 0.04, ((0, 0.6), (0.5, 0.9), (1, 1)))
    spread = rng.uniform(0.2, 0.36)
    tops = circle(count=3, radius=0.025, height=joint, degrees=90)
    feet = circle(count=3, radius=spread, height=0, degrees=90)
    add_legs(b, "base", material, style, tops, feet)
    b.cylinder("pole", metal, (0, joint - 0.06, 0), (0, joint + 0.02, 0), 0.045)
    b.cylinder("pole", metal, (0, joint, 0), (0, height, 0), 0.014)
    if rng.random() < 0.4:
        level = rng.uniform(0.25, 0.5)
        reach = float(np.linalg.norm((feet + level * (tops - feet))[0, [0, 2]]))
        b.lathe("base", material, [(reach, 0), (reach, 0.02)], (0, level * joint, 0), segments=28)


def _branches(b: Builder, rng: Rng, metal: Material, height: float) -> None:
    """Add two to five short arms with small shades, turned around the pole."""
    count = int(rng.integers(2, 6))
    shade = draw_shade(rng, rng.uniform(0.07, 0.11), rng.uniform(0.11, 0.17), HEADS, fine=False)
    tilt, reach = rng.uniform(20, 130), rng.uniform(0.12, 0.26)
    levels = height - np.linspace(0, rng.uniform(0.0, 0.5), count)
    start = rng.uniform(0, 360)
    for i, y in enumerate(levels):
        out = about_y(start + i * 360.0 / count)
        path = bend([(0, y - 0.05, 0), (0.6 * reach, y - 0.05, 0), (reach, y + 0.03, 0)], 0.05)
        b.tube("arm", metal, path @ out.T, 0.009, segments=8)
        turn = out @ about_z(tilt)
        add_head(b, shade, metal, out @ path[-1], turn, 0.07)
