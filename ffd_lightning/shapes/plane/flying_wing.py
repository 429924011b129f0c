"""Tailless aeroplanes."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import Pair, vec
from ffd_lightning.shapes.plane.engines import undercarriage
from ffd_lightning.shapes.plane.fuselage import canopy, fuselage
from ffd_lightning.shapes.plane.livery import BLACK, STEEL, draw_livery
from ffd_lightning.shapes.plane.wings import pair


def flying_wing(rng: Rng) -> Builder:
    """Draw a tailless aeroplane: a broad swept wing that swells into a body."""
    b, (paint, accent) = Builder(), draw_livery(rng, 0.7)
    span, slope = rng.uniform(0.7, 1.1), rng.uniform(0.5, 0.8)
    chord, tip = rng.uniform(0.5, 0.65), rng.uniform(0.06, 0.12)
    lead, knee = -0.4, rng.uniform(0.25, 0.42)
    bend = (knee * span, 0, lead + slope * knee * span)
    edge = np.array([(0, 0, lead), bend, (span, 0.02, lead + slope * span)])
    pair(b, "wing", paint, edge, (chord, rng.uniform(0.24, 0.34) * 0.9, tip), 0.1)
    wide, tall = rng.uniform(0.16, 0.26), rng.uniform(0.09, 0.13)
    rows = [
        Section(z=lead - 0.03, lift=0, width=0.02, height=0.01),
        Section(z=lead + 0.05, lift=0.01, width=0.4 * wide, height=0.5 * tall),
        Section(z=lead + 0.18, lift=0.015, width=0.85 * wide, height=tall),
        Section(z=lead + 0.3, lift=0.01, width=wide, height=0.95 * tall),
        Section(z=lead + 0.9 * chord, lift=0, width=0.5 * wide, height=0.3 * tall),
        Section(z=lead + chord, lift=0, width=0.3 * wide, height=0.06 * tall),
    ]
    fuselage(b, "body", paint, rows)
    canopy(b, rows, ends=(lead + 0.06, lead + 0.22), width=0.5 * wide, rise=0.015, frames=paint)
    _buried_engines(b, rng, (paint, accent), wide, (lead, slope))
    if rng.random() < 0.45:
        hold = edge[-1] - vec(0.04, 0, 0)
        fin = [hold, hold + vec(0.02, rng.uniform(0.08, 0.16), 0.08)]
        pair(b, "tail", accent, fin, (1.3 * tip, 0.6 * tip), 0.08)
    for x, z in ((0.0, lead + 0.12), (-0.5 * wide, lead + 0.34), (0.5 * wide, lead + 0.34)):
        undercarriage(b, STEEL, (x, 0.0, z), drop=rng.uniform(0.1, 0.11), radius=0.022)
    return b


def _buried_engines(
    b: Builder, rng: Rng, colors: tuple[Material, Material], wide: float, edge: Pair
) -> None:
    """Add two or four humps on a wing whose leading edge is (z at the middle, slope)."""
    lead, slope = edge
    apart = rng.uniform(1.3, 1.7) * wide
    reach, count = (0.5, 2) if rng.random() < 0.67 else (0.7, 4)
    xs = np.linspace(-reach, reach, count) * apart
    for x in xs:
        z = lead + slope * abs(x) + 0.1
        pod = [
            Section(z=z, lift=0.035, width=0.075, height=0.05),
            Section(z=z + 0.12, lift=0.035, width=0.08, height=0.055),
            Section(z=z + 0.26, lift=0.02, width=0.05, height=0.025),
        ]
        fuselage(b, "engine", colors[len(xs) // 4], pod, 0.5, x)
        mouth = [Section(z=z + d, lift=0.035, width=0.06, height=0.035) for d in (-0.003, 0.01)]
        fuselage(b, "engine", BLACK, mouth, 0.5, x)
