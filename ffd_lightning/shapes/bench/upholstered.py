"""Padded benches."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.bench.boards import draw_bench_size
from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import pad
from ffd_lightning.shapes.kit.legs import add_legs, draw_leg_style
from ffd_lightning.shapes.kit.upholstery import draw_cover
from ffd_lightning.shapes.kit.vectors import vec


def upholstered(rng: Rng) -> Builder:
    """Build a padded seat on legs, perhaps buttoned, with scrolled ends or a low back."""
    b = Builder()
    length, depth, height = draw_bench_size(rng)
    cover, soft = draw_cover(rng), rng.uniform(0.07, 0.16)
    frame = pick_material(rng, draw(rng, ["wood", "metal"], [0.7, 0.3]))
    cushion = (length, soft, depth)
    b.rounded_box("seat", cover, (0, height - soft / 2, 0), cushion, radius=0.05, edge=0.4 * soft)
    under = height - soft
    if rng.random() < 0.6:
        size = (0.98 * length, 0.05, 0.96 * depth)
        b.rounded_box("seat", frame, (0, under - 0.015, 0), size, 0.01)
    style = draw_leg_style(rng, (0.035, 0.07), hairpin=0.12)
    xs = np.linspace(-1, 1, 2 if length < 1.5 else 3) * (length / 2 - 0.09)
    z = depth / 2 - 0.08
    tops = np.array([(x, under - 0.01, side) for side in (-z, z) for x in xs])
    add_legs(b, "leg", frame, style, tops, tops * vec(1, 0, 1))
    if rng.random() < 0.5:
        rows, columns = int(rng.integers(2, 4)), round(length / 0.17)
        for x in np.linspace(-0.42, 0.42, columns) * length:
            for at in np.linspace(-0.3, 0.3, rows) * depth:
                button = [(0.016, -0.004), (0.018, 0.002), (0.009, 0.009)]
                b.lathe("seat", frame, button, (x, height, at), segments=8)
    kind = draw(rng, ["none", "ends", "back"], [0.35, 0.35, 0.3])
    rise, thick = rng.uniform(0.15, 0.4), rng.uniform(0.06, 0.1)
    middle = height + (rise - soft) / 2
    for side in (-1, 1) if kind == "ends" else ():
        x = side * (length / 2 + 0.02)
        b.rounded_box("arm", cover, (x, middle, 0), (thick, rise + soft, depth), 0.02)
        roll = vec(x + side * 0.3 * thick, height + rise, 0)
        half = vec(0, 0, depth / 2)
        b.cylinder("arm", cover, roll - half, roll + half, 0.75 * thick)
    if kind == "back":
        size = (length, rise + soft, thick)
        pad(b, "back", cover, (0, middle, depth / 2), size, 0.05, rng.uniform(2, 10))
    return b
