"""Jet fighters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import UP, Array, Triple, vec
from ffd_lightning.shapes.plane.engines import undercarriage
from ffd_lightning.shapes.plane.fuselage import canopy, fuselage, width_at
from ffd_lightning.shapes.plane.livery import BLACK, STEEL, draw_livery
from ffd_lightning.shapes.plane.wings import pair, surface


def fighter(rng: Rng) -> Builder:
    """Draw a jet fighter: swept, delta or trapezoid wing, one or two engines and fins."""
    b, (paint, accent) = Builder(), draw_livery(rng, 0.85)
    twin = rng.random() < 0.5
    wide, tall = rng.uniform(0.08, 0.11) * (1.5 if twin else 1), rng.uniform(0.085, 0.115)
    rows = [
        Section(z=-0.5, lift=-0.1 * tall, width=0.004, height=0.004),
        Section(z=-0.38, lift=-0.05 * tall, width=0.4 * min(wide, 0.12), height=0.5 * tall),
        Section(z=-0.24, lift=0.0, width=0.7 * min(wide, 0.12), height=0.9 * tall),
        Section(z=-0.08, lift=0.0, width=wide, height=tall),
        Section(z=0.25, lift=0, width=wide, height=0.9 * tall),
        Section(z=0.4, lift=0, width=0.85 * wide, height=0.75 * tall),
    ]
    fuselage(b, "body", paint, rows, rng.uniform(0.2, 0.5))
    b.cylinder("body", STEEL, (0, -0.1 * tall, -0.56), (0, -0.1 * tall, -0.49), 0.003, segments=6)
    ends = (-0.36, rng.uniform(-0.14, -0.06))
    canopy(b, rows, ends=ends, width=0.055, rise=rng.uniform(0.02, 0.032), frames=paint)
    _intakes(b, rng, paint, rows, wide, tall)
    _nozzles(b, rng, wide, tall, twin)
    kind = draw(rng, ["delta", "swept", "trapezoid"])
    edge, chord, tip = _fighter_wing(b, rng, paint, wide, kind)
    _fighter_tail(b, rng, (paint, accent), wide, tall, twin or rng.random() < 0.2, kind == "delta")
    if rng.random() < 0.6:
        for side in (-1, 1):
            for t in (1.0, 0.6, 0.4)[: int(rng.integers(1, 4))]:
                hold = edge[0] + t * (edge[-1] - edge[0]) - 0.018 * (t < 1) * UP
                hold *= vec(side, 1, 1)
                z = hold[2] + 0.25 * (chord + t * (tip - chord))
                _missile(b, (hold[0], hold[1], z), rng.uniform(0.13, 0.17))
    if rng.random() < 0.4:
        for x, z in ((0.0, -0.22), (-0.5 * wide, 0.12), (0.5 * wide, 0.12)):
            undercarriage(b, STEEL, (x, -0.25 * tall, z), drop=0.06 + 0.25 * tall, radius=0.018)
    return b


def _fighter_wing(
    b: Builder, rng: Rng, paint: Material, wide: float, kind: str
) -> tuple[Array, float, float]:
    """Add the wing; return its leading edge (2, 3), root chord and tip chord."""
    span = rng.uniform(0.26, 0.4) + 0.2 * wide
    slope = {"delta": (1.2, 1.7), "swept": (0.7, 1.0), "trapezoid": (0.45, 0.9)}[kind]
    back = rng.uniform(*slope) * span
    chord = back + rng.uniform(0.02, 0.06) if kind == "delta" else rng.uniform(0.24, 0.34)
    tip = rng.uniform(0.02, 0.06) if kind == "delta" else chord * rng.uniform(0.25, 0.5)
    lead = min(rng.uniform(-0.1, 0.0), 0.36 - chord)
    y = rng.uniform(-0.012, 0.02)
    edge = np.array([[0, y, lead], [span, y + rng.uniform(-0.03, 0.02), lead + back]])
    pair(b, "wing", paint, edge, (chord, tip), 0.05)
    if kind != "swept" and rng.random() < 0.5:
        strake = [(0.3 * wide, y, lead - 0.2), (0.75 * wide, y, lead + 0.02)]
        pair(b, "wing", paint, strake, (0.36, 0.14), 0.03)
    if kind == "delta" and rng.random() < 0.5:
        fore = [(0.25 * wide, y + 0.015, lead - 0.16), (0.12 + 0.3 * wide, y + 0.02, lead - 0.06)]
        pair(b, "wing", paint, fore, (0.12, 0.04), 0.06)
    return edge, chord, tip


def _fighter_tail(
    b: Builder,
    rng: Rng,
    colors: tuple[Material, Material],
    wide: float,
    tall: float,
    twin: bool,
    bare: bool,
) -> None:
    """Add one fin or two canted ones and, unless `bare`, tailplanes."""
    paint, accent = colors
    chord, rise, cant = rng.uniform(0.17, 0.24), rng.uniform(0.12, 0.19), rng.uniform(0, 0.5)
    lead, top = rng.uniform(0.14, 0.2), 0.32 * tall
    color = accent if rng.random() < 0.25 else paint
    if twin:
        fin = [(0.38 * wide, top, lead), (0.38 * wide + cant * rise, top + rise, lead + 0.7 * rise)]
        pair(b, "tail", color, fin, (chord, 0.45 * chord), 0.06)
    else:
        fin = [(0, top, lead - 0.03), (0, top + 1.2 * rise, lead + 0.9 * rise)]
        surface(b, "tail", color, fin, (1.2 * chord, 0.4 * chord), 0.06)
    if not bare:
        out = rng.uniform(0.13, 0.2)
        plane = [(0.35 * wide, -0.01, 0.27), (0.35 * wide + out, -0.02, 0.27 + 0.7 * out)]
        pair(b, "tail", paint, plane, (0.17, 0.07), 0.05)


def _intakes(
    b: Builder, rng: Rng, paint: Material, rows: Sequence[Section], wide: float, tall: float
) -> None:
    """Add air intakes at both flanks, or one under the chin."""
    start, chin = rng.uniform(-0.2, -0.12), rng.random() < 0.3
    size = (0.55 * wide, 0.5 * tall) if chin else (0.42 * wide, 0.72 * tall)
    for side in (0.0,) if chin else (-1.0, 1.0):
        x = side * 0.5 * max(width_at(rows, start), 0.6 * wide)
        y = -0.45 * tall if chin else -0.05 * tall
        body = [
            Section(start, y, *size),
            Section(start + 0.15, y, *size),
            Section(z=0.28, lift=0.5 * y, width=0.5 * size[0], height=0.7 * size[1]),
        ]
        fuselage(b, "engine", paint, body, 0.7, x)
        mouth = [
            Section(z=start - 0.002, lift=y, width=0.82 * size[0], height=0.82 * size[1]),
            Section(z=start + 0.01, lift=y, width=0.82 * size[0], height=0.82 * size[1]),
        ]
        fuselage(b, "engine", BLACK, mouth, 0.7, x)


def _nozzles(b: Builder, rng: Rng, wide: float, tall: float, twin: bool) -> None:
    """Add the exhausts: flared steel rings, dark inside."""
    r, end = min(0.42 * tall, 0.24 * wide if twin else 1.0), 0.4 + rng.uniform(0.03, 0.08)
    for x in (-0.23 * wide, 0.23 * wide) if twin else (0.0,):
        start = (x, 0, 0.33)
        tip, radius = (x, 0, end), 1.08 * r
        b.cylinder("engine", STEEL, start, tip, radius=radius, radius_end=0.82 * r, segments=16)
        b.cylinder("engine", BLACK, (x, 0, end - 0.01), (x, 0, end + 0.002), 0.7 * r, segments=16)


def _missile(b: Builder, center: Triple, length: float) -> None:
    """Add a missile with cruciform fins."""
    x, y, z = center
    path = [(x, y, z + t * length) for t in (-0.5, -0.42, 0.5)]
    b.tube("wing", STEEL, path, [0.002, 0.0075, 0.0075], segments=8)
    for size in ((0.036, 0.003, 0.022), (0.003, 0.036, 0.022)):
        b.box("wing", STEEL, (x, y, z + 0.44 * length), size)
