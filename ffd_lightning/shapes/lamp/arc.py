"""Bows over a heavy base."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.kit.vectors import UP, about_y, vec
from ffd_lightning.shapes.lamp.materials import draw_body_material, draw_metal
from ffd_lightning.shapes.lamp.shades import add_head, draw_shade


def arc(rng: Rng) -> Builder:
    """Build one or several long bows over a heavy base, a shade at the end of each."""
    b = Builder()
    metal, material = draw_metal(rng), draw_body_material(rng)
    count = int(rng.choice([1, 3, 5], p=[0.7, 0.2, 0.1]))
    back, thick = rng.uniform(0.3, 0.6), rng.uniform(0.012, 0.02)
    low = rng.uniform(0.03, 0.16)
    if rng.random() < 0.5:
        center = (0, low / 2, back)
        b.rounded_box("base", material, center, (0.28, low, 0.24), radius=0.02, edge=0.01)
    else:
        wide = rng.uniform(0.13, 0.2)
        rows = [(wide, 0), (wide, 0.8 * low), (0.9 * wide, low), (0.02, low)]
        b.lathe("base", material, rows, (0, 0, back), segments=32)
    wide = rng.uniform(0.12, 0.25) if count == 1 else rng.uniform(0.09, 0.13)
    kinds = {"dome": 0.5, "drum": 0.15, "empire": 0.15, "bowl": 0.2}
    shade = draw_shade(rng, wide, wide * rng.uniform(0.7, 1.2), kinds, fine=count < 3)
    height, reach = rng.uniform(1.2, 1.7), back + rng.uniform(0.2, 0.6)
    last, lean = rng.uniform(1.9, 2.6), rng.uniform(0.4, 0.65)
    for i, side in enumerate(np.linspace(-50, 50, count) if count > 1 else [0.0]):
        tall = height * (1 - 0.12 * (i % 3))
        a = np.linspace(0, last, 24)
        along = reach * (1 - np.cos(a)) / (1 - np.cos(last))
        rise = (1 - lean) * tall * np.sin(a)
        points = np.stack([0 * a, lean * tall + rise, -along], 1)
        path = np.concatenate([[(0, low - 0.01, 0)], points]) @ about_y(side).T + vec(0, 0, back)
        b.tube("pole", metal, path, list(np.linspace(thick, 0.6 * thick, len(path))), segments=10)
        end = path[-1] - 0.03 * UP
        b.cylinder("arm", metal, path[-1] + 0.005 * UP, end - 0.01 * UP, 0.012, segments=10)
        add_head(b, shade, metal, end, np.eye(3), 0.1)
    return b
