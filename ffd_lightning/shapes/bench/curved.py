"""Benches bent around their front."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ffd_lightning.shapes.bench.plan import Plan
from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.legs import STRAIGHT, LegStyle, add_leg
from ffd_lightning.shapes.kit.sheets import arc
from ffd_lightning.shapes.kit.vectors import UP, vec


def bows(b: Builder, rng: Rng, p: Plan, backed: bool = False) -> None:
    """Add bows of boards on pairs of posts, `backed` with some behind them."""
    half, inner = np.radians(rng.uniform(25, 125)), rng.uniform(0.3, 1.0)
    inner += 0.25 / half
    angles, outer, low = np.linspace(-half, half, 29), inner + p.depth, p.under
    edges = np.linspace(inner, outer, int(rng.integers(2, 7)))
    for start, end in pairwise(edges):
        arc(b, "seat", p.wood, (start, end - 0.01), (low, p.seat), angles)
    levels = p.seat + np.linspace(0.35, 1.0, int(rng.integers(2, 5))) * p.rise
    for bottom, top in pairwise(levels) if backed else ():
        heights = bottom, top - 0.15 * (top - bottom)
        arc(b, "back", p.wood, (outer, outer + 0.03), heights, angles)
    style = LegStyle(draw(rng, ["square", "round"]), p.side, STRAIGHT)
    for angle in np.linspace(-0.92, 0.92, max(3, round(2 * half * inner / 0.7))) * half:
        out = vec(np.sin(angle), 0, np.cos(angle))
        for r in (inner + 0.12 * p.depth, inner + 0.85 * p.depth):
            add_leg(b, "leg", p.frame, style, r * out + low * UP, r * out)
        level = (low - 0.02) * UP
        ends = (inner + 0.03) * out + level, outer * out + level
        beam(b, "leg", p.frame, *ends, width=0.04, height=0.04)
        if backed:
            top = (outer - 0.012) * out + (p.seat + 0.97 * p.rise) * UP
            beam(b, "back", p.frame, (outer - 0.012) * out + level, top, width=0.03, height=0.025)
