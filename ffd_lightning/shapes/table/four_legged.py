"""Rectangular tables on four legs."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import rails
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs, draw_leg_style, stretchers
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import Triple
from ffd_lightning.shapes.table.tops import (
    SIZES,
    draw_materials,
    draw_size,
    drawer_fronts,
    rectangular_top,
)


def _frame(
    b: Builder, rng: Rng, material: Material, style: LegStyle, size: Triple, under: float
) -> None:
    """Add four legs, an apron, and perhaps stretchers or a shelf, below a top's underside."""
    width, depth, _ = size
    inset = style.thickness * rng.uniform(1.1, 1.6) + rng.uniform(0, 0.08) * depth
    splay = rng.uniform(0.02, 0.12) * under if rng.random() < 0.35 else 0.0
    splay = min(splay, 0.8 * inset)
    tops = corners(width - 2 * inset, depth - 2 * inset, under + 0.002)
    feet = corners(width - 2 * (inset - splay), depth - 2 * (inset - splay), 0.0)
    add_legs(b, "leg", material, style, tops, feet)
    if not style.plain:
        return
    apron = rng.uniform(0.06, 0.13) * min(1.0, under / 0.6)
    if rng.random() < 0.75:
        level = 1 - (apron / 2 + 0.004) / under
        rails(b, "support", material, feet + level * (tops - feet), width=0.022, height=apron)
    kind = draw(rng, ["none", "box", "h", "x", "shelf"], [0.42, 0.13, 0.15, 0.08, 0.22])
    level = rng.uniform(0.15, 0.4) if kind != "box" else rng.uniform(0.08, 0.25)
    points = feet + level * (tops - feet)
    if kind == "shelf":
        spread = np.ptp(points, axis=0) + style.thickness
        shelf = (spread[0], 0.02, spread[2])
        b.rounded_box("shelf", material, (0, points[0, 1], 0), shelf, 0.02)
    elif kind != "none":
        stretchers(b, "support", material, points, 0.5 * style.thickness, kind)


def four_legged(rng: Rng) -> Builder:
    """Build a rectangular table on four legs, sometimes with drawers in its apron."""
    b = Builder()
    size = draw_size(rng, *SIZES)
    top, base = draw_materials(rng)
    thickness = rng.uniform(0.02, 0.05)
    rectangular_top(b, rng, top, size, thickness)
    style = draw_leg_style(rng, (0.035, 0.085))
    under = size[2] - thickness
    _frame(b, rng, base, style, size, under)
    if style.plain and rng.random() < 0.25:
        height = rng.uniform(0.08, 0.14)
        inset = 2.3 * style.thickness + 0.09 * size[1]
        width, depth = size[0] - 2 * inset, size[1] - 2 * inset
        if width > 0.15 and depth > 0.05:
            center = (0, under - height / 2 - 0.004, 0)
            b.box("support", base, center, (width, height, depth))
            columns = max(1, round(width / rng.uniform(0.4, 0.7)))
            metal = pick_material(rng, "metal")
            front = (0.0, under - height / 2, -depth / 2)
            knobs = rng.random() < 0.5
            face = (width, height)
            drawer_fronts(b, base, metal, front, face, rows=1, columns=columns, knobs=knobs)
    return b
