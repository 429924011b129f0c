"""Display cabinets: a case on a deeper one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.cabinet.casework import add_cornice, add_top, fill, stand
from ffd_lightning.shapes.cabinet.fronts import doors, fronts, shelves
from ffd_lightning.shapes.cabinet.joinery import carcass, dividers, draw_joinery, plank
from ffd_lightning.shapes.kit import Builder, Rng


def hutch(rng: Rng) -> Builder:
    """Build a display cabinet: a glazed or open case on a deeper closed one."""
    b = Builder()
    style = replace(draw_joinery(rng), board=rng.uniform(0.02, 0.03))
    width, depth = rng.uniform(0.7, 1.7), rng.uniform(0.38, 0.55)
    low_height, high_height = rng.uniform(0.55, 0.9), rng.uniform(0.6, 1.2)
    base = stand(b, rng, style.body, (width, depth), ("plinth", "bracket", "legs"), 0.14)
    low = carcass(b, style, (width, low_height, depth), bottom=base)
    add_top(b, rng, style.body, (width, base + low_height, depth))
    count = max(1, round(width / rng.uniform(0.4, 0.6)))
    if rng.random() < 0.6:
        low, row = low.split((1, rng.uniform(0.25, 0.4)), across=False)
        dividers(b, style, [low, row], across=False)
        fronts(b, style, row, 1, count)
    doors(b, style, low, count, handle=0.85)
    deep = rng.uniform(0.6, 0.85) * depth
    z, bottom = (depth - deep) / 2, base + low_height + 0.018
    wide = width - rng.uniform(0, 0.08)
    gap = rng.uniform(0.15, 0.35) if rng.random() < 0.4 else 0.0
    if gap:
        end = (bottom + gap + 0.01, z + deep / 2)
        for x in (-wide / 2, wide / 2 - style.board):
            plank(b, "body", style.body, (x, bottom, z), (x + style.board, *end))
        plank(b, "body", style.body, (-wide / 2, bottom, end[1] - 0.015), (wide / 2, *end))
    bottom += gap
    bay = carcass(b, style, (wide, high_height, deep), (0.0, z), bottom)
    if rng.random() < 0.3:
        columns = bay.split(np.ones(max(1, count - 1)), across=True)
        dividers(b, style, columns, across=True)
        for column in columns:
            fill(b, rng, style, column, "open")
    else:
        shelves(b, style, bay, int(rng.integers(1, 4)))
        doors(b, style, bay, count, glazed=True, handle=0.3)
    size = (wide, bottom + high_height, deep)
    add_cornice(b, style.body, size, rng.uniform(0.03, 0.08), z)
    return b
