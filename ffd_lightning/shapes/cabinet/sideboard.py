"""Low, wide cabinets."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.cabinet.casework import STANDS, add_top, fill, stand
from ffd_lightning.shapes.cabinet.fronts import sliding_doors
from ffd_lightning.shapes.cabinet.joinery import carcass, dividers, draw_joinery
from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material


def sideboard(rng: Rng) -> Builder:
    """Build a low, wide cabinet of two to five bays: sideboard, television bench, credenza."""
    b = Builder()
    style = draw_joinery(rng, ("wood", "wood", "paint", "plastic"))
    width, depth = rng.uniform(0.9, 2.2), rng.uniform(0.3, 0.52)
    height = rng.uniform(0.28, 0.45) if rng.random() < 0.4 else rng.uniform(0.5, 0.85)
    material = style.body if rng.random() < 0.6 else pick_material(rng, "metal")
    base = stand(b, rng, material, (width, depth), STANDS, 0.28)
    bay = carcass(b, style, (width, height, depth), bottom=base)
    count = int(rng.integers(2, 6)) if width > 1.4 else int(rng.integers(2, 4))
    half = rng.uniform(0.6, 1.6, (count + 1) // 2)
    shares = np.concatenate([half, half[: count // 2][::-1]])  # symmetric, as most are
    if rng.random() < 0.2:
        sliding_doors(b, style, bay, count)
    else:
        columns = bay.split(shares, across=True)
        dividers(b, style, columns, across=True)
        kinds = ["door", "drawers", "open", "glass", "mixed"]
        fillings = [draw(rng, kinds, [0.35, 0.25, 0.2, 0.08, 0.12]) for _ in half]
        fillings += fillings[: count // 2][::-1]
        for column, filling in zip(columns, fillings, strict=True):
            fill(b, rng, style, column, filling)
    if rng.random() < 0.7:
        top = style.front if rng.random() < 0.4 else style.body
        add_top(b, rng, top, (width, base + height, depth))
    return b
