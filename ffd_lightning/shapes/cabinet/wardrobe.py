"""Wardrobes and tall cupboards."""

from __future__ import annotations

from ffd_lightning.shapes.cabinet.casework import add_cornice, add_top, fill, stand
from ffd_lightning.shapes.cabinet.fronts import doors, fronts, shelves, sliding_doors
from ffd_lightning.shapes.cabinet.joinery import carcass, dividers, draw_joinery
from ffd_lightning.shapes.kit import Builder, Rng, draw


def wardrobe(rng: Rng) -> Builder:
    """Build a wardrobe or tall cupboard: two to five doors, drawers or a shelf below."""
    b = Builder()
    style = draw_joinery(rng)
    count = int(rng.integers(1, 6))
    width = count * rng.uniform(0.36, 0.56)
    height, depth = rng.uniform(1.6, 2.3), rng.uniform(0.35, 0.65)
    base = stand(b, rng, style.body, (width, depth), ("plinth", "bracket", "legs", "none"), 0.18)
    bay = carcass(b, style, (width, height, depth), bottom=base)
    kinds = ["plain", "drawers", "attic", "sliding", "middle"]
    kind = draw(rng, kinds, [0.3, 0.25, 0.15, 0.2, 0.1])
    if kind == "drawers":
        low, bay = bay.split((rng.uniform(0.15, 0.35), 1), across=False)
        dividers(b, style, [low, bay], across=False)
        fronts(b, style, low, int(rng.integers(1, 3)), 2 if width > 0.8 else 1)
    elif kind == "attic":
        bay, high = bay.split((1, rng.uniform(0.2, 0.35)), across=False)
        dividers(b, style, [bay, high], across=False)
        doors(b, style, high, count, handle=0.1)
    if kind == "sliding" and count > 1:
        sliding_doors(b, style, bay, 2 if width < 1.5 else 3)
    elif kind == "middle" and count > 2:
        columns = bay.split((1, rng.uniform(0.8, 1.4), 1), across=True)
        dividers(b, style, columns, across=True)
        for column, filling in zip(columns, ("door", "mixed", "door"), strict=True):
            fill(b, rng, style, column, filling)
    else:
        shelves(b, style, bay, int(rng.integers(1, 5)))
        doors(b, style, bay, count)
    if rng.random() < 0.6:
        add_cornice(b, style.body, (width, base + height, depth), rng.uniform(0.03, 0.08))
    else:
        add_top(b, rng, style.body, (width, base + height, depth))
    return b
