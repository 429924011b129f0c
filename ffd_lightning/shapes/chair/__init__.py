"""Chairs: what they are for, what they stand on, a seat, a back, arms."""

from dataclasses import replace

from ffd_lightning.shapes.chair.backs import ARM_KINDS, BACKS
from ffd_lightning.shapes.chair.plan import USES, Plan
from ffd_lightning.shapes.chair.seats import BASES, SEATS
from ffd_lightning.shapes.kit import Builder, Chosen, Product, Rng
from ffd_lightning.shapes.kit.upholstery import Seating


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a chair of its components."""
    b, plan = Builder(), chosen["use"].build(rng)
    padded = chosen["base"].name == "plinth"
    if chosen["seat"].name == "disc":
        plan = replace(plan, depth=plan.width)
    shared: Plan | Seating = plan.seating(rng, chosen["arms"].name) if padded else plan
    # The corners of a shell curl up, so that what carries it must reach in further.
    narrow = replace(plan, width=0.72 * plan.width, depth=0.75 * plan.depth)
    chosen["base"].build(b, rng, narrow if chosen["seat"].name == "shell" else shared)
    for slot in ("seat", "back", "arms"):
        chosen[slot].build(b, rng, shared)
    return b


CATEGORY = Product(
    parts=("seat", "back", "arm", "leg"),
    slots={"use": USES, "base": BASES, "seat": SEATS, "back": BACKS, "arms": ARM_KINDS},
    family=("base", "back"),
    assemble=assemble,
)
