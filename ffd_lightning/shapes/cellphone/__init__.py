"""Telephones: a form, a housing, a front, an aerial, a back, what holds it."""

from ffd_lightning.shapes.cellphone.bodies import FORMS, HOUSINGS
from ffd_lightning.shapes.cellphone.extras import AERIALS, BACKS, HOLDS, side_buttons
from ffd_lightning.shapes.cellphone.fronts import FRONTS
from ffd_lightning.shapes.cellphone.plan import draw_finish
from ffd_lightning.shapes.kit import Builder, Chosen, Product, Rng

_TIPS = {"cradle": (5, 25), "prop": (12, 32)}  # degrees by which what holds it tips it back


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a telephone of its components."""
    b, hold = Builder(), chosen["hold"].name
    tipped = {"tip": _TIPS[hold]} if hold in _TIPS else {}
    plan = chosen["form"].build(b, rng, draw_finish(rng), **tipped)
    for slot in ("housing", "front", "aerial", "back", "hold"):
        chosen[slot].build(b, rng, plan)
    side_buttons(b, rng, plan)
    return b


CATEGORY = Product(
    parts=("body", "screen", "key", "button", "camera", "speaker", "antenna", "stand"),
    slots={
        "form": FORMS, "housing": HOUSINGS, "front": FRONTS, "aerial": AERIALS, "back": BACKS,
        "hold": HOLDS,
    },
    family=("form", "front"),
    assemble=assemble,
)  # fmt: skip
