"""Sofas: rows of seats, what they stand on, seat, back, arms."""

import numpy as np

from ffd_lightning.shapes.kit import Builder, Chosen, Product, Rng
from ffd_lightning.shapes.kit.sheets import Bent
from ffd_lightning.shapes.sofa.parts import ARM_KINDS, BACKS, BASES, SEATS
from ffd_lightning.shapes.sofa.plan import LAYOUTS, draw_plan


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a sofa of its components, row by row."""
    b, plan = Builder(), draw_plan(rng, chosen)
    rows = chosen["layout"].build(rng, plan)
    for slot in ("base", "seat", "back", "arms"):
        seed = int(rng.integers(1 << 32))  # so that the rows look alike
        for row in rows:
            if slot in row.slots:
                bent, same = Bent(b, row.place, 0.44 * row.radius), np.random.default_rng(seed)
                chosen[slot].build(bent, same, row.plan)
    return b


CATEGORY = Product(
    parts=("seat", "back", "arm", "leg"),
    slots={"layout": LAYOUTS, "base": BASES, "seat": SEATS, "back": BACKS, "arms": ARM_KINDS},
    family=("layout", "back"),
    assemble=assemble,
)
