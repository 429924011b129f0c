"""Monitors and televisions: a body, what it stands on and by, loudspeakers, extras."""

from ffd_lightning.shapes.kit import Builder, Chosen, Product, Rng
from ffd_lightning.shapes.monitor.bodies import BODIES
from ffd_lightning.shapes.monitor.plan import draw_plan
from ffd_lightning.shapes.monitor.stands import EXTRAS, FEET, NECKS, SOUNDS


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a monitor of its components."""
    b, plan = Builder(), draw_plan(rng, chosen["body"].name, chosen["foot"].name)
    for component in chosen.values():
        component.build(b, rng, plan)
    return b


CATEGORY = Product(
    parts=("screen", "frame", "back", "stand", "base", "speaker", "button"),
    slots={"body": BODIES, "foot": FEET, "neck": NECKS, "sound": SOUNDS, "extra": EXTRAS},
    family=("body", "foot"),
    assemble=assemble,
)
