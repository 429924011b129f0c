"""Desks."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.legs import LegStyle, add_leg, add_legs, draw_leg_style
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import Triple, vec
from ffd_lightning.shapes.table.tops import draw_materials, drawer_fronts, rectangular_top


def desk(rng: Rng) -> Builder:
    """Build a desk with drawers on one or both sides, and sometimes a shelf on top."""
    b = Builder()
    width, depth, height = rng.uniform(1.0, 1.8), rng.uniform(0.5, 0.85), rng.uniform(0.68, 0.78)
    top, body = draw_materials(rng)
    top = body if top.alpha < 1 else top
    front = body if rng.random() < 0.6 else pick_material(rng, draw(rng, ["wood", "paint"]))
    handle = pick_material(rng, "metal")
    thickness, knobs = rng.uniform(0.02, 0.045), rng.random() < 0.4
    rectangular_top(b, rng, top, (width, depth, height), thickness)
    under, legs = height - thickness, rng.uniform(0, 0.2) if rng.random() < 0.5 else 0.0
    chest, inner = width * rng.uniform(0.22, 0.34), depth * 0.94
    rows, both = int(rng.integers(2, 5)), rng.random() < 0.5
    style = LegStyle("square", 0.04, ((0.0, 0.7), (0.5, 0.85), (1.0, 1.0)))
    edge = 0.98 * width / 2
    for side in (-1, 1) if both else (int(rng.choice([-1, 1])),):
        x, y = side * (edge - chest / 2), (under + legs) / 2
        b.rounded_box("support", body, (x, y, 0), (chest, under - legs, inner), 0.01)
        face = (x, y, -inner / 2)
        size = (0.94 * chest, 0.95 * (under - legs))
        drawer_fronts(b, front, handle, face, size, rows=rows, knobs=knobs)
        if legs > 0.02:
            tops = corners(chest - 0.05, inner - 0.05, legs + 0.01) + vec(x, 0, 0)
            add_legs(b, "leg", body, style, tops, tops * vec(1, 0, 1))
    if not both:
        _free_side(b, rng, body, -side * edge, inner, under)
    gap = 0.6 * (width - chest)
    if rng.random() < 0.6:
        z, drop = inner * rng.uniform(0.1, 0.45), under * rng.uniform(0.3, 0.75)
        b.box("support", body, (0, under - drop / 2, z), (1.9 * edge, drop, 0.018))
    elif both:
        b.box("support", body, (0, under - 0.05, 0), (width - 1.9 * chest, 0.1, inner))
        face = (0, under - 0.05, -inner / 2)
        drawer_fronts(b, front, handle, face, (gap, 0.09), rows=1, knobs=knobs)
    if rng.random() < 0.3:
        _hutch(b, rng, body, (width, depth, height))
    return b


def _free_side(
    b: Builder, rng: Rng, material: Material, x: float, depth: float, under: float
) -> None:
    """Carry the side of a desk at `x` that has no drawers: by a panel or by two legs."""
    if rng.random() < 0.5:
        panel = (0.025, under, depth)
        b.rounded_box("leg", material, (x * 0.97, under / 2, 0), panel, 0.005)
        return
    style = draw_leg_style(rng, (0.04, 0.07), hairpin=0.0)
    for z in (-0.45 * depth, 0.45 * depth):
        add_leg(b, "leg", material, style, (0.94 * x, under, z), (0.94 * x, 0, z))


def _hutch(b: Builder, rng: Rng, material: Material, size: Triple) -> None:
    """Add a shelf with compartments along the back of a desk's top."""
    width, depth, height = size
    rise, deep = rng.uniform(0.15, 0.45), rng.uniform(0.2, 0.32) * depth
    z = depth / 2 - deep / 2
    levels = 1 if rise < 0.28 else 2
    for level in range(1, levels + 1):
        center = (0, height + rise * level / levels - 0.01, z)
        b.rounded_box("shelf", material, center, (0.98 * width, 0.02, deep), 0.005)
    for x in np.linspace(-0.48, 0.48, int(rng.integers(3, 6))) * width:
        b.box("shelf", material, (x, height + rise / 2 - 0.01, z), (0.018, rise, deep))
