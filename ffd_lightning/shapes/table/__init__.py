"""Tables: what they are for, an outline, a top, what carries it, what is below it and on it."""

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Chosen, Product, Rng
from ffd_lightning.shapes.table.parts import BASES, BRACES, EXTRAS, TOPS
from ffd_lightning.shapes.table.plan import BOX, SHAPES, USES, draw_plan


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a table of its components, and smaller ones alike that are pulled out from it."""
    b, (width, depth, height) = Builder(), chosen["use"].build(rng)
    outline, corners = chosen["shape"].build(rng, width, depth)
    plan = draw_plan(rng, outline, corners, height, flush=chosen["shape"].name in BOX)
    nest = chosen["extra"].name == "nest"
    if nest:
        side = min(plan.side, 0.04)
        plan = replace(plan, side=side, inset=0.7 * side, thick=min(plan.thick, 0.03), splay=0.0)
    if chosen["base"].name not in ("legs", "sled"):
        plan = replace(plan, splay=0.0)
    state, pull = int(rng.integers(1 << 30)), rng.uniform(0.15, 0.45) * depth
    for _ in range(int(rng.integers(2, 4)) if nest else 1):
        same = np.random.default_rng(state)  # so that the smaller tables match
        for slot in ("base", "brace", "top", "extra"):
            chosen[slot].build(b, same, plan)
        shrink = np.array([1 - (2 * plan.side + 0.02) / plan.half[0], 0.92])
        smaller = {"outline": plan.outline * shrink, "corners": plan.corners * shrink}
        plan = replace(plan, **smaller, height=plan.under - 0.02, z=plan.z - pull)
    return b


_CARRIED = {"base": BASES, "brace": BRACES, "extra": EXTRAS}
CATEGORY = Product(
    parts=("top", "leg", "support", "shelf", "drawer"),
    slots={"use": USES, "shape": SHAPES, "top": TOPS, **_CARRIED},
    family=("base", "shape"),
    assemble=assemble,
)
