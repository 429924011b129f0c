"""Tables of slabs."""

from __future__ import annotations

from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import UP
from ffd_lightning.shapes.table.tops import draw_materials, draw_size


def slab(rng: Rng) -> Builder:
    """Build a parsons table, a waterfall of three slabs, a cube, or a C-shaped side table."""
    b = Builder()
    kind = draw(rng, ["parsons", "waterfall", "cube", "c"], [0.35, 0.35, 0.15, 0.15])
    uses = ("side",) if kind in ("cube", "c") else ("dining", "coffee", "console", "side", "square")
    width, depth, height = draw_size(rng, *uses)
    top, base = draw_materials(rng)
    base = top if rng.random() < 0.6 and top.alpha == 1 else base
    side = rng.uniform(0.035, 0.09) * (0.7 if kind == "c" else 1.0)
    slab = (width, side, depth)
    b.rounded_box("top", top, (0, height - side / 2, 0), slab, 0.2 * side, segments=4)
    under = height - side + 0.002
    if kind == "parsons":
        style = LegStyle("square", side, ((0, 1), (0.25, 1), (0.5, 1), (0.75, 1), (1, 1)))
        feet = corners(width - side, depth - side, 0.0)
        add_legs(b, "leg", base, style, feet + under * UP, feet)
    else:
        ends = {"waterfall": (-1, 1), "cube": (-1, 1), "c": (-1,)}[kind]
        for x in ends:
            center = (x * (width - side) / 2, under / 2, 0)
            b.rounded_box("leg", base, center, (side, under, depth), 0.2 * side, segments=4)
    if kind == "cube" or (kind == "waterfall" and rng.random() < 0.4):
        level = rng.uniform(0.15, 0.5) * under if kind == "waterfall" else side / 2
        inner = (width - 1.9 * side, 0.6 * side, 0.97 * depth)
        b.rounded_box("shelf", base, (0, level, 0), inner, 0.1 * side, segments=4)
    if kind == "cube" and rng.random() < 0.6:
        back = (width - 1.9 * side, under - 0.01, 0.02)
        b.rounded_box("support", base, (0, under / 2, depth / 2 - 0.02), back, 0.008)
    if kind == "c":
        b.rounded_box("leg", base, (0, side / 2, 0), slab, 0.2 * side, segments=4)
    return b
