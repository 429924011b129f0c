"""Watercraft: a hull, houses on it and what stands on them, a load, oars, motors or sails."""

from ffd_lightning.shapes.kit import Builder, Chosen, Product, Rng
from ffd_lightning.shapes.watercraft.houses import HOUSES, TOPS
from ffd_lightning.shapes.watercraft.hulls import HULLS
from ffd_lightning.shapes.watercraft.loads import LOADS
from ffd_lightning.shapes.watercraft.rigs import RIGS


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a watercraft of its components."""
    b = Builder()
    plan = chosen["hull"].build(b, rng)
    plan = chosen["house"].build(b, rng, plan) or plan  # there may be no house
    for slot in ("top", "load", "rig"):
        chosen[slot].build(b, rng, plan)
    return b


CATEGORY = Product(
    parts=(
        "hull", "deck", "cabin", "mast", "sail", "keel", "funnel", "engine", "cargo", "gun",
        "seat", "oar", "rail",
    ),
    slots={"hull": HULLS, "house": HOUSES, "top": TOPS, "load": LOADS, "rig": RIGS},
    family=("hull", "rig"),
    assemble=assemble,
)  # fmt: skip
