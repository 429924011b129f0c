"""Benches bent around their front."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ffd_lightning.shapes.bench.boards import draw_bench_size
from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.legs import STRAIGHT, LegStyle, add_leg
from ffd_lightning.shapes.kit.sheets import arc
from ffd_lightning.shapes.kit.vectors import UP, vec


def curved(rng: Rng) -> Builder:
    """Build a bench bent around its front: bows of boards on posts, with or without a back."""
    b = Builder()
    _, depth, height = draw_bench_size(rng)
    wood = pick_material(rng, draw(rng, ["wood", "paint"], [0.75, 0.25]))
    base = pick_material(rng, draw(rng, ["metal", "wood"]))
    half, inner = np.radians(rng.uniform(25, 120)), rng.uniform(0.55, 1.3)
    angles = np.linspace(-half, half, 29)
    count, thick = int(rng.integers(1, 6)), rng.uniform(0.03, 0.06)
    edges = np.linspace(inner, inner + depth, count + 1)
    gap = 0.15 * depth / count if count > 1 else 0.0
    for start, end in pairwise(edges):
        arc(b, "seat", wood, (start, end - gap), (height - thick, height), angles)
    back, rows = rng.uniform(0.25, 0.45), int(rng.integers(1, 4))
    backed = rng.random() < 0.55
    if backed:
        levels = np.linspace(0.4, 1.0, rows + 1) * back + height
        outer = inner + depth
        for low, high in pairwise(levels):
            arc(b, "back", wood, (outer, outer + 0.03), (low, high - 0.15 * (high - low)), angles)
    style = LegStyle(draw(rng, ["square", "round"]), rng.uniform(0.045, 0.08), STRAIGHT)
    for angle in np.linspace(-0.92, 0.92, max(3, round(2 * half * inner / 0.7))) * half:
        out = vec(np.sin(angle), 0, np.cos(angle))
        for r in (inner + 0.12 * depth, inner + 0.85 * depth):
            foot = r * out
            add_leg(b, "leg", base, style, foot + (height - thick + 0.003) * UP, foot)
        level = (height - thick - 0.02) * UP
        outer_end = (inner + depth) * out + level
        beam(b, "leg", base, (inner + 0.03) * out + level, outer_end, width=0.04, height=0.04)
        if backed:
            foot = (inner + depth - 0.012) * out
            target = foot + (height + 0.97 * back) * UP
            beam(b, "back", base, foot + level, target, width=0.03, height=0.025)
    return b
