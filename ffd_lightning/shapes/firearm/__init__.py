"""Firearms: a kind, its body, what is held and shouldered, feed, barrel, muzzle, sight, extras."""

from ffd_lightning.shapes.firearm.bodies import BARRELS, BODIES, MUZZLES
from ffd_lightning.shapes.firearm.fittings import EXTRAS, SIGHTS, add_trigger
from ffd_lightning.shapes.firearm.plan import KINDS
from ffd_lightning.shapes.firearm.stocks import FEEDS, GRIPS, STOCKS
from ffd_lightning.shapes.kit import Builder, Chosen, Product, Rng


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a firearm of its components."""
    b, plan = Builder(), chosen["kind"].build(rng)
    for slot in ("body", "stock", "grip", "feed", "barrel", "muzzle", "sight", "extra"):
        chosen[slot].build(b, rng, plan)
    add_trigger(b, rng, plan)
    return b


CATEGORY = Product(
    parts=("barrel", "body", "grip", "trigger", "magazine", "stock", "sight"),
    slots={
        "kind": KINDS, "body": BODIES, "stock": STOCKS, "grip": GRIPS, "feed": FEEDS,
        "barrel": BARRELS, "muzzle": MUZZLES, "sight": SIGHTS, "extra": EXTRAS,
    },
    family=("kind", "stock"),
    assemble=assemble,
)  # fmt: skip
