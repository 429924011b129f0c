"""Lamps on the wall."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import lean, vec
from ffd_lightning.shapes.lamp.materials import draw_metal
from ffd_lightning.shapes.lamp.shades import FLIP, add_bulb, add_shade, draw_shade


def sconce(rng: Rng) -> Builder:
    """Build a plate for the wall with one to three arms that hold shades in front of it."""
    b = Builder()
    metal = draw_metal(rng)
    wide, tall = rng.uniform(0.05, 0.12), rng.uniform(0.1, 0.32)
    upright = lean(-90)
    if rng.random() < 0.5:
        center, block = (0, 0, 0.012), (wide, 0.024, tall)
        b.rounded_box("base", metal, center, block, radius=0.4 * wide, edge=0.008, turn=upright)
    else:
        rows = [(0.5 * tall, -0.012), (0.5 * tall, 0.004), (0.4 * tall, 0.014), (0.02, 0.02)]
        center = (0, 0, 0.012)
        squash = rng.uniform(0.6, 1.5)
        b.lathe("base", metal, rows, center, segments=28, turn=upright, squash=squash)
    size = rng.uniform(0.06, 0.12)
    count = int(rng.choice([1, 2, 3], p=[0.55, 0.3, 0.15]))
    up = rng.random() < 0.6
    kinds = {"empire": 0.3, "bell": 0.25, "bowl": 0.15, "dome": 0.15, "drum": 0.15}
    shade = draw_shade(rng, size, size * rng.uniform(1, 2), kinds, fine=count == 1, glass=0.25)
    reach, sag = size + rng.uniform(0.03, 0.12), rng.uniform(-0.08, 0.08)
    spread = 1.25 * size * (count - 1)
    for x in np.linspace(-spread, spread, count) if count > 1 else [0.0]:
        middle = 0.04 if x == 0 else 0.0
        foot = vec(0.1 * x, 0, 0.01)
        end = vec(x, 0.06 if up else 0.02, -reach - middle)
        low = (x, -0.06 - abs(sag), end[2])
        points = np.array([foot, foot - vec(0, sag, 0.4 * reach), low, end])
        if not up:
            points[1:3] = (0.1 * x, 0.1, -0.3 * reach), (x, 0.12, end[2])
        b.tube("arm", metal, bend(points, 0.1, 6), 0.009, segments=8)
        add_shade(b, shade, metal, end, FLIP if up else None)
        add_bulb(b, metal, end, min(0.1, 0.8 * shade.height), None if up else FLIP)
    return b
