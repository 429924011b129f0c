"""Office steel: filing cabinets and lockers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.cabinet.casework import stand
from ffd_lightning.shapes.cabinet.fronts import doors, fronts
from ffd_lightning.shapes.cabinet.joinery import BOARD, Joinery, carcass, draw_joinery
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.vectors import vec


def filing(rng: Rng) -> Builder:
    """Build office steel: a filing cabinet with label holders, or a bank of lockers."""
    b = Builder()
    style = replace(draw_joinery(rng, ("metal", "paint", "plastic")), panel="flat", board=0.022)
    style = replace(style, grip=draw(rng, ["bar", "bow", "slot"]))
    if rng.random() < 0.45:
        _lockers(b, rng, style)
        return b
    rows = int(rng.integers(2, 6))
    width = rng.uniform(0.36, 0.5) if rng.random() < 0.6 else rng.uniform(0.7, 1.1)
    height, depth = rows * rng.uniform(0.2, 0.34), rng.uniform(0.4, 0.7)
    kinds = ("casters", "none") if rows < 4 else ("plinth", "none")
    base = stand(b, rng, style.body, (width, depth), kinds)
    bay = carcass(b, style, (width, height, depth), bottom=base)
    fronts(b, style, bay, rows)
    paper, z = Material((0.92, 0.92, 0.86)), bay.front - BOARD - 0.002
    for cell in bay.split(np.ones(rows), across=False, gap=0.0):
        place = (cell.x, cell.y + 0.2 * cell.height, z)
        b.rounded_box("drawer", style.handle, place, (0.1, 0.05, 0.006), 0.002, segments=1)
        b.box("drawer", paper, (*place[:2], z - 0.003), (0.085, 0.035, 0.004))
    lock = vec(0.4 * width, base + height - 0.035, z + 0.004)
    b.cylinder("handle", style.handle, lock, lock - vec(0, 0, 0.012), 0.012)
    return b


def _lockers(b: Builder, rng: Rng, style: Joinery) -> None:
    """Add a bank of lockers with air slits."""
    columns, rows = int(rng.integers(1, 6)), int(rng.integers(1, 4))
    width, height = columns * rng.uniform(0.28, 0.4), rng.uniform(1.4, 1.95)
    depth = rng.uniform(0.38, 0.55)
    base = stand(b, rng, style.body, (width, depth), ("plinth", "legs", "none"), 0.14)
    bay = carcass(b, style, (width, height, depth), bottom=base)
    dark, z = Material((0.12, 0.12, 0.13)), bay.front - (0 if style.inset else BOARD)
    slits = int(rng.integers(2, 6))
    for column in bay.split(np.ones(columns), across=True):
        for cell in column.split(np.ones(rows), across=False):
            doors(b, style, cell, 1)
            for end in (1, -1) if cell.height > 0.8 else (1,):
                for i in range(slits):
                    y = cell.y + end * (0.44 * cell.height - 0.025 * i)
                    b.box("door", dark, (cell.x, y, z), (0.5 * cell.width, 0.008, 0.004))
