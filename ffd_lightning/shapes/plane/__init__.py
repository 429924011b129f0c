"""Aeroplanes: what they are for, a fuselage, a wing, engines, a tail, and what they carry."""

from dataclasses import replace

from ffd_lightning.shapes.kit import Builder, Chosen, Product, Rng
from ffd_lightning.shapes.plane.engines import ENGINES
from ffd_lightning.shapes.plane.fuselages import COCKPITS, FUSELAGES
from ffd_lightning.shapes.plane.gear import GEARS, STORES
from ffd_lightning.shapes.plane.plan import ROLES
from ffd_lightning.shapes.plane.tails import TAILS
from ffd_lightning.shapes.plane.wings import FORES, MOUNTS, WINGS


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build an aeroplane of its components."""
    b, plan = Builder(), chosen["role"].build(rng)
    if chosen["engines"].name in ("rear2", "rear3"):  # their weight needs a wing further back
        plan = replace(plan, lead=plan.lead + 0.08)
    plan = replace(plan, rows=chosen["fuselage"].build(b, rng, plan))
    plan = replace(plan, level=chosen["mount"].build(rng, plan))
    plan = chosen["wing"].build(b, rng, plan)
    for slot in ("fore", "cockpit", "engines", "tail", "gear", "stores"):
        chosen[slot].build(b, rng, plan)
    return b


CATEGORY = Product(
    parts=("body", "wing", "tail", "engine", "window", "gear"),
    slots={
        "role": ROLES, "fuselage": FUSELAGES, "mount": MOUNTS, "wing": WINGS, "fore": FORES,
        "cockpit": COCKPITS, "engines": ENGINES, "tail": TAILS, "gear": GEARS, "stores": STORES,
    },
    family=("role", "wing"),
    assemble=assemble,
)  # fmt: skip
