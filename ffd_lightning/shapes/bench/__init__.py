"""Benches: what they are for, a seat, what carries it, a back, arms, what is below."""

from dataclasses import replace

from ffd_lightning.shapes.bench.parts import ARMS, BACKS, BASES, BELOW, SEATS
from ffd_lightning.shapes.bench.plan import USES
from ffd_lightning.shapes.kit import Builder, Chosen, Material, Product, Rng


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a bench of its components."""
    b, plan = Builder(), chosen["use"].build(rng, chosen["seat"].name)
    if chosen["seat"].name == "slab":
        grey = rng.uniform(0.45, 0.85)
        color = (grey, grey * rng.uniform(0.93, 1.0), grey * rng.uniform(0.82, 0.98))
        stone = Material(color, "speckle", 3.0, seed=int(rng.integers(1 << 30)))
        plan = replace(plan, wood=stone, frame=stone, cover=stone)
    for slot in _SLOTS:
        chosen[slot].build(b, rng, plan)
    return b


_SLOTS = {"seat": SEATS, "base": BASES, "back": BACKS, "arms": ARMS, "below": BELOW}
CATEGORY = Product(
    parts=("seat", "back", "arm", "leg", "table"),
    slots={"use": USES, **_SLOTS},
    family=("base", "back"),
    assemble=assemble,
)
