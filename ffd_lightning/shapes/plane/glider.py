"""Sailplanes."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import vec
from ffd_lightning.shapes.plane.engines import undercarriage
from ffd_lightning.shapes.plane.fuselage import canopy, fuselage, height_at
from ffd_lightning.shapes.plane.livery import STEEL, draw_livery
from ffd_lightning.shapes.plane.wings import pair, tail


def glider(rng: Rng) -> Builder:
    """Draw a sailplane: very long slender wings, a pod with a long canopy, a thin boom."""
    b, (paint, accent) = Builder(), draw_livery(rng)
    wide, tall = rng.uniform(0.08, 0.11), rng.uniform(0.1, 0.14)
    boom = rng.uniform(0.26, 0.4)
    rows = [
        Section(z=-0.5, lift=-0.2 * tall, width=0.06 * wide, height=0.06 * tall),
        Section(z=-0.47, lift=-0.18 * tall, width=0.45 * wide, height=0.42 * tall),
        Section(z=-0.38, lift=-0.1 * tall, width=0.85 * wide, height=0.8 * tall),
        Section(z=-0.25, lift=0, width=wide, height=tall),
        Section(z=-0.1, lift=0.06 * tall, width=0.85 * wide, height=0.85 * tall),
        Section(z=0.08, lift=0.18 * tall, width=boom * wide, height=boom * tall),
        Section(z=0.5, lift=0.2 * tall, width=0.6 * boom * wide, height=0.6 * boom * tall),
    ]
    fuselage(b, "body", paint, rows)
    span, root = rng.uniform(0.85, 1.35), rng.uniform(0.1, 0.14)
    lead, rise = rng.uniform(-0.2, -0.12), rng.uniform(0.03, 0.09) * span
    y = height_at(rows, lead + 0.05, rng.choice([0.35, 0.75]))
    t = np.array([0, 0.5, 0.85, 1.0])
    edge = vec(0, y, lead) + np.column_stack([span * t, rise * t**2, 0.035 * t**2])
    chords = root * np.array([1.0, 0.85, 0.55, 0.25])
    pair(b, "wing", paint, edge, chords, 0.13)
    if rng.random() < 0.4:
        end = edge[-1] + vec(0.01, 0.045, 0.02)
        pair(b, "wing", accent, [edge[-1], end], (0.25 * root, 0.12 * root), 0.1)
    ends = (-0.44, rng.uniform(-0.22, -0.12))
    canopy(b, rows, ends=ends, width=0.78 * wide, rise=0.022, frames=paint)
    color, size = accent if rng.random() < 0.5 else paint, rng.uniform(0.12, 0.16)
    tail(b, rng, color, rows, size, draw(rng, ["tee", "low", "cross"], [0.6, 0.25, 0.15]))
    top = (0, height_at(rows, -0.2, -0.6), -0.2)
    undercarriage(b, STEEL, top, drop=0.035 + 0.2 * tall, radius=0.024)
    return b
