"""Cabinets: what they are for, their front, what they stand on, their top, their plan."""

from ffd_lightning.shapes.cabinet.ends import STANDS, TOPS
from ffd_lightning.shapes.cabinet.layouts import LAYOUTS
from ffd_lightning.shapes.cabinet.plan import OUTLINES, USES, draw_plan
from ffd_lightning.shapes.kit import Builder, Chosen, Product, Rng


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a cabinet of its components."""
    b, plan = Builder(), draw_plan(rng, chosen)
    warped = chosen["outline"].build(b, rng, plan)
    for slot in ("layout", "stand", "top"):
        chosen[slot].build(warped, rng, plan)
    return b


CATEGORY = Product(
    parts=("body", "top", "door", "drawer", "shelf", "handle", "leg"),
    slots={"use": USES, "layout": LAYOUTS, "stand": STANDS, "top": TOPS, "outline": OUTLINES},
    family=("layout", "top"),
    assemble=assemble,
)
