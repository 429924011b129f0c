"""Sofas bent around their front."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.kit.legs import LegStyle, add_leg
from ffd_lightning.shapes.kit.sheets import arc
from ffd_lightning.shapes.kit.upholstery import draw_seating
from ffd_lightning.shapes.kit.vectors import UP, vec


def curved(rng: Rng) -> Builder:
    """Build a sofa bent around its front: part of a ring, its back along the outside."""
    b = Builder()
    s = draw_seating(rng, int(rng.integers(2, 6)))
    half = np.radians(rng.uniform(35, 95))
    outer = max(s.seats * 0.36 / half + 0.3, 1.0)
    inner = outer - s.depth
    angles = np.linspace(-half, half, 33)
    arc(b, "seat", s.cover, (inner + 0.02, outer), (s.foot, s.seat - 0.8 * s.cushion), angles)
    cuts = np.linspace(-half, half, s.seats + 1)
    for start, end in pairwise(cuts):
        gap = 0.004 / outer
        part = np.linspace(start + gap, end - gap, 9)
        radii = (inner, outer - 0.7 * s.thick)
        arc(b, "seat", s.pillows, radii, (s.seat - s.cushion, s.seat), part)
    fall = rng.uniform(0.0, 0.75) * s.back
    tops = s.seat + s.back - fall * np.abs(angles / half) ** rng.uniform(2, 5)
    arc(b, "back", s.cover, (outer - s.thick, outer + 0.02), (s.foot + 0.02, tops), angles)
    if rng.random() < 0.45:
        wide = s.arm / outer
        for side in (-1, 1):
            ends = side * (half + np.linspace(0, wide, 3))
            top = s.seat + min(s.arm_rise, s.back - fall)
            arc(b, "arm", s.cover, (inner, outer + 0.01), (s.foot, top), ends)
    style = LegStyle("round", 0.055, ((0.0, 0.7), (0.5, 0.85), (1.0, 1.0)))
    for r in (inner + 0.09, outer - 0.09):
        for angle in np.linspace(-0.93, 0.93, 3 if half < 1 else 5) * half:
            foot = vec(r * np.sin(angle), 0, r * np.cos(angle))
            add_leg(b, "leg", s.frame, style, foot + (s.foot + 0.02) * UP, foot)
    return b
