"""Benches of stone."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.bench.boards import draw_bench_size
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.boards import pad
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import Pair, vec


def _pedestal(b: Builder, stone: Material, kind: str, x: float, plan: Pair, top: float) -> None:
    """Add a block, a flared block or a turned foot at `x`, `plan` (width, depth), up to `top`."""
    if kind == "turned":
        r = 0.48 * plan[1]
        radii = np.array([1, 1, 0.6, 0.8, 0.55, 1, 1]) * r
        heights = [0, 0.05, 0.09, 0.45 * top, 0.8 * top, top - 0.03, top]
        b.lathe("leg", stone, np.column_stack([radii, heights]), (x, 0, 0))
        return
    flare = 1.5 if kind == "flared" else 1.0
    rings = []
    for t, k in zip((0, 0.12, 0.3, 0.7, 0.88, 1), (flare, flare, 1, 1, flare, flare), strict=True):
        ring = corners(k * plan[0], (0.7 + 0.3 * k) * plan[1], t * top)
        rings.append(ring + vec(x, 0, 0))
    b.loft("leg", stone, rings)


def stone(rng: Rng) -> Builder:
    """Build a heavy slab on two blocks or turned pedestals, sometimes with a slab back."""
    b = Builder()
    length, depth, height = draw_bench_size(rng)
    grey = rng.uniform(0.45, 0.85)
    color = (grey, grey * rng.uniform(0.93, 1.0), grey * rng.uniform(0.82, 0.98))
    stone = Material(color, "speckle", 3.0, seed=int(rng.integers(1 << 30)))
    thick, edge = rng.uniform(0.06, 0.15), rng.uniform(0.008, 0.03)
    slab = (length, thick, depth)
    center = (0, height - thick / 2, 0)
    b.rounded_box("seat", stone, center, slab, radius=0.05, edge=edge, segments=6)
    under, reach = height - thick + 0.002, length / 2 * rng.uniform(0.6, 0.85)
    kind, wide = draw(rng, ["blocks", "turned", "flared"]), rng.uniform(0.08, 0.2)
    for x in (-reach, reach):
        _pedestal(b, stone, kind, x, (wide, 0.75 * depth), under)
    if rng.random() < 0.35:
        rise, t = rng.uniform(0.28, 0.5), rng.uniform(0.05, 0.1)
        at = (0, height + rise / 2 - 0.01, depth / 2 - 0.6 * t)
        pad(b, "back", stone, at, (length, rise, t), rng.uniform(0.02, 0.2), rng.uniform(0, 6))
    return b
