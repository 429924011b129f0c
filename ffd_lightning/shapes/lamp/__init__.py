"""Lamps: where they stand or hang, a stem, what carries it, heads."""

from dataclasses import replace

from ffd_lightning.shapes.kit import Builder, Chosen, Product, Rng
from ffd_lightning.shapes.lamp.bases import BASES
from ffd_lightning.shapes.lamp.heads import HEADS
from ffd_lightning.shapes.lamp.plan import PLACES
from ffd_lightning.shapes.lamp.stems import STEMS


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a lamp of its components."""
    b, plan = Builder(), chosen["place"].build(rng)
    plan = replace(plan, foot=chosen["base"].build(b, rng, plan) or 0.0)
    sockets = chosen["stem"].build(b, rng, plan)
    chosen["head"].build(b, rng, plan, sockets)
    return b


CATEGORY = Product(
    parts=("base", "pole", "arm", "shade", "bulb"),
    slots={"place": PLACES, "stem": STEMS, "base": BASES, "head": HEADS},
    family=("stem",),
    assemble=assemble,
)
