"""Tables of the living room: nests, and tables with shelves below."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, rails
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs, draw_leg_style
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import UP, vec
from ffd_lightning.shapes.table.tops import (
    draw_materials,
    draw_size,
    drawer_fronts,
    rectangular_top,
)


def nested(rng: Rng) -> Builder:
    """Build two or three tables of one design, each smaller one pulled out from the last."""
    b = Builder()
    width, depth, height = draw_size(rng, "side", "coffee")
    top, base = draw_materials(rng)
    panel, side = rng.random() < 0.35, rng.uniform(0.025, 0.045)
    pull = vec(0, 0, -rng.uniform(0.12, 0.35))
    style = LegStyle(draw(rng, ["square", "round"]), side, ((0, 0.8), (0.5, 0.9), (1, 1)))
    rail = draw(rng, ["sides", "box", "none"])
    for i in range(int(rng.integers(2, 4))):
        w = width - i * max(0.17 * width, 3.2 * side)
        d, h = (1 - 0.1 * i) * depth, (1 - 0.16 * i) * height
        at = pull * i * vec(width, 0, depth)
        slab = (w, side * 0.8, d)
        b.rounded_box("top", top, at + (h - 0.4 * side) * UP, slab, radius=0.02, edge=0.01)
        under = h - 0.8 * side + 0.002
        feet = corners(w - 1.2 * side, d - 1.6 * side, 0.0) + at
        if panel:
            for x in (-0.5, 0.5):
                board = (0.7 * side, under, d - 0.5 * side)
                offset = vec(x * (w - 1.4 * side), under / 2, 0)
                b.rounded_box("leg", base, at + offset, board, 0.01)
            continue
        add_legs(b, "leg", base, style, feet + under * UP, feet)
        low = feet + side / 2 * UP
        if rail == "sides":
            beam(b, "support", base, low[0], low[3], width=0.7 * side, height=0.7 * side)
            beam(b, "support", base, low[1], low[2], width=0.7 * side, height=0.7 * side)
        elif rail == "box":
            rails(b, "support", base, feet + (under - 0.03) * UP, width=0.015, height=0.06)
    return b


def two_tier(rng: Rng) -> Builder:
    """Build a low table with one to three lower shelves between legs, panels or a cross."""
    b = Builder()
    width, depth, height = draw_size(rng, "coffee", "coffee", "side", "console")
    top, base = draw_materials(rng)
    thickness, kind = rng.uniform(0.015, 0.045), draw(rng, ["posts", "panels", "drawers"])
    rectangular_top(b, rng, top, (width, depth, height), thickness)
    under = height - thickness + 0.002
    shelves = int(rng.integers(1, 4)) if height > 0.42 else 1
    levels = np.linspace(rng.uniform(0.12, 0.35), 0.95, shelves + 1)[:-1] * under
    board = vec(0.94 * width, rng.uniform(0.012, 0.03), 0.9 * depth)
    lower = base if rng.random() < 0.5 else top
    for y in levels:
        b.rounded_box("shelf", lower, (0, y, 0), board, 0.02)
    if kind == "posts":
        style = draw_leg_style(rng, (0.03, 0.07), hairpin=0.0)
        feet = corners(board[0] - 0.9 * style.thickness, board[2] - 0.9 * style.thickness, 0.0)
        add_legs(b, "leg", base, style, feet + under * UP, feet)
        return b
    for x in (-0.5, 0.5):
        panel = (0.025, under, 0.88 * depth)
        b.rounded_box("leg", base, (x * 0.94 * width, under / 2, 0), panel, 0.01)
    if kind == "drawers":
        box = min(0.15, under - levels[-1] - 0.02)
        center = (0, under - box / 2 - 0.004, 0)
        b.box("support", base, center, (0.93 * width, box, 0.82 * depth))
        face = (0, under - box / 2, -0.41 * depth)
        columns = int(rng.integers(1, 4))
        metal = pick_material(rng, "metal")
        drawer_fronts(b, base, metal, face, (0.9 * width, 0.92 * box), rows=1, columns=columns)
    return b
