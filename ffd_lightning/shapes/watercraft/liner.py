"""Cruise ships, liners and ferries."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.kit.vectors import vec
from ffd_lightning.shapes.watercraft.hull import Hull, bulwark, solid_hull, tint
from ffd_lightning.shapes.watercraft.superstructure import House, add_house, funnel, mast


def liner(rng: Rng) -> Builder:
    """Build a cruise ship, an ocean liner or a ferry: many decks of cabins and funnels."""
    b = Builder()
    length = rng.uniform(1.4, 2.2)
    beam, depth = rng.uniform(0.24, 0.32), rng.uniform(0.14, 0.2)
    hull = Hull(
        length=length,
        beam=beam,
        depth=depth,
        widest=rng.uniform(0.35, 0.5),
        transom=rng.uniform(0.6, 0.85),
        fineness=rng.uniform(0.6, 0.85),
        fullness=rng.uniform(3, 5),
        sheer=(rng.uniform(0.02, 0.06), 0.01),
        rake=(rng.uniform(0.05, 0.15), 0.02),
        lift=(0, 0.3 * depth),
    )
    white, glass = tint(rng, "white", "white", "cream"), tint(rng, "window")
    paint = tint(rng, "white", "navy", "black", "red", "blue")
    solid_hull(b, hull, paint, tint(rng, "red", "blue", "black"), 0.35 * depth, tint(rng, "teak"))
    bulwark(b, hull, paint, height=0.02, span=(0.0, 0.2))
    floors, storey = int(rng.integers(2, 6)), rng.uniform(0.04, 0.055)
    front, back = rng.uniform(-0.32, -0.24) * length, rng.uniform(0.36, 0.44) * length
    steps, y = rng.uniform(0.2, 0.9, 2) * 0.05 * length, hull.top(0.5)
    wide = 1.96 * hull.half(front / length + 0.5)
    for i in range(floors):
        tier = House(
            width=wide * (1 - 0.03 * i),
            z=(front + steps[0] * i, back - steps[1] * i),
            y=(y, y + storey),
            slope=(0.2, 0.0),
            taper=0.0,
        )
        add_house(b, tier, white, glass, windows="panes", roof=0.006, band=(0.3, 0.75))
        y += storey
    z = (front + steps[0] * floors, front + steps[0] * floors + 0.16 * length)
    top = House(width=0.8 * wide, z=z, y=(y, y + storey), slope=(0.25, 0))
    add_house(b, top, white, glass, windows="band")
    mast(b, white, vec(0, y + storey, z[1] - 0.08), height=rng.uniform(0.1, 0.2), arms=2)
    size = vec(rng.uniform(0.07, 0.1), rng.uniform(0.12, 0.22), rng.uniform(0.11, 0.16))
    stack = tint(rng, "red", "orange", "white", "blue", "black")
    count = int(rng.integers(1, 5)) if floors < 5 else 1
    rear = back - steps[1] * floors - 0.1
    for at in np.linspace(z[1] + 0.1, rear, count) if count > 1 else [0.6 * rear]:
        funnel(b, stack, tint(rng, "black", "white"), (0, y, at), size)
    for at in np.linspace(front + 0.15, back - 0.2, int(rng.integers(3, 7))):
        for side in (-1, 1):
            boat = (side * (wide / 2 + 0.012), hull.top(0.5) + 0.3 * storey, at)
            b.ellipsoid("cargo", tint(rng, "orange"), boat, (0.018, 0.018, 0.05), segments=8)
    return b
