"""Piston-engined fighters."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import vec
from ffd_lightning.shapes.plane.engines import propeller, undercarriage
from ffd_lightning.shapes.plane.fuselage import canopy, fuselage, height_at
from ffd_lightning.shapes.plane.livery import BLACK, STEEL, draw_livery
from ffd_lightning.shapes.plane.wings import pair, tail


def warbird(rng: Rng) -> Builder:
    """Draw a piston-engined fighter: in-line or radial engine, low wing, tail wheel."""
    b, (paint, accent) = Builder(), draw_livery(rng, 0.8)
    wide, tall = rng.uniform(0.09, 0.12), rng.uniform(0.13, 0.16)
    radial = rng.random() < 0.45
    front = 0.95 if radial else 0.5
    rows = [
        Section(z=-0.5, lift=0, width=0.9 * front * wide, height=0.8 * front * tall),
        Section(z=-0.48, lift=0, width=front * wide, height=front * tall),
        Section(z=-0.36, lift=0, width=max(front, 0.8) * wide, height=max(front, 0.85) * tall),
        Section(z=-0.1, lift=0.0, width=wide, height=tall),
        Section(z=0.1, lift=0.03 * tall, width=0.85 * wide, height=0.85 * tall),
        Section(z=0.46, lift=0.15 * tall, width=0.2 * wide, height=0.3 * tall),
        Section(z=0.5, lift=0.16 * tall, width=0.06 * wide, height=0.12 * tall),
    ]
    fuselage(b, "body", paint, rows)
    if radial:
        cowl = [
            Section(z=-0.5, lift=0, width=0.98 * wide, height=0.98 * tall),
            Section(z=-0.4, lift=0, width=1.06 * wide, height=1.06 * tall),
        ]
        fuselage(b, "engine", accent, cowl)
        mouth = [Section(z, 0, width=0.85 * wide, height=0.85 * tall) for z in (-0.503, -0.49)]
        fuselage(b, "engine", BLACK, mouth)
    span, root, lead = rng.uniform(0.48, 0.62), rng.uniform(0.22, 0.28), rng.uniform(-0.24, -0.18)
    y, rise = -0.36 * tall, rng.uniform(0.03, 0.08)
    t = np.linspace(0, 1, 7)
    elliptic = rng.random() < 0.4
    plan = np.sqrt(1 - 0.97 * t**2.2) if elliptic else 1 - rng.uniform(0.35, 0.6) * t
    chords = root * plan
    edge = np.column_stack([span * t, y + rise * t, lead + 0.3 * (root - chords)])
    pair(b, "wing", paint, edge, chords, 0.12)
    ends = (rng.uniform(-0.1, -0.05), rng.uniform(0.1, 0.18))
    canopy(b, rows, ends=ends, width=0.62 * wide, rise=rng.uniform(0.025, 0.04), frames=paint)
    tail(b, rng, accent if rng.random() < 0.3 else paint, rows, rng.uniform(0.14, 0.18), "low")
    hub = (0, 0, -0.51)
    radius, blades = rng.uniform(0.15, 0.19), int(rng.integers(2, 6))
    propeller(b, rng, hub, radius=radius, blades=blades, spinner=accent)
    if rng.random() < 0.6:
        for side in (-1, 1):
            top = (side * 0.3 * span, y + 0.3 * rise, lead + 0.06)
            undercarriage(b, STEEL, top, drop=0.14, radius=0.035)
        undercarriage(b, STEEL, (0, height_at(rows, 0.42, -0.7), 0.42), drop=0.045, radius=0.013)
    for side in (-1, 1):
        for x in np.linspace(0.4, 0.55, int(rng.integers(0, 4))) * span * side:
            start = (x, y + rise * abs(x) / span, lead + 0.1)
            b.cylinder("wing", BLACK, start, np.array(start) - vec(0, 0, 0.16), 0.005, segments=8)
    return b
