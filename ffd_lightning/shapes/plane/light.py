"""Single-engined aeroplanes: light ones and biplanes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import Pair, vec
from ffd_lightning.shapes.plane.engines import propeller, undercarriage
from ffd_lightning.shapes.plane.fuselage import canopy, fuselage, height_at
from ffd_lightning.shapes.plane.livery import BLACK, GLASS, STEEL, draw_livery
from ffd_lightning.shapes.plane.wings import pair, tail


def _slim(rng: Rng, wide: float, tall: float) -> list[Section]:
    """Draw the fuselage's sections of a single-engined aeroplane, its cowling at the front."""
    cowl, cabin = rng.uniform(0.65, 0.9), rng.uniform(-0.22, -0.1)
    rows = [
        Section(z=-0.5, lift=0.0, width=0.55 * wide, height=0.5 * tall),
        Section(z=-0.49, lift=0.0, width=cowl * wide, height=0.68 * tall),
        Section(z=-0.36, lift=0.0, width=cowl * wide, height=0.76 * tall),
        Section(z=cabin - 0.06, lift=0.0, width=wide, height=0.85 * tall),
        Section(z=cabin + 0.2, lift=0.02 * tall, width=wide, height=0.9 * tall),
        Section(z=cabin + 0.36, lift=0.1 * tall, width=0.7 * wide, height=0.62 * tall),
        Section(z=0.47, lift=0.22 * tall, width=0.18 * wide, height=0.3 * tall),
        Section(z=0.5, lift=0.24 * tall, width=0.08 * wide, height=0.16 * tall),
    ]
    return rows


def _ground(
    b: Builder,
    rng: Rng,
    paint: Material,
    rows: Sequence[Section],
    reach: float,
    z: float,
    nose: bool,
) -> None:
    """Add sprung main legs with spats or bare wheels, and a nose or tail wheel."""
    r, drop = rng.uniform(0.03, 0.042), rng.uniform(0.07, 0.11)
    floor = height_at(rows, z, -1) - drop
    spats = rng.random() < 0.4
    for side in (-1, 1):
        hip, axle = (0.02 * side, height_at(rows, z, -0.8), z), (side * reach, floor + r, z)
        b.cylinder("gear", paint, hip, axle, 0.011, segments=8)
        half = vec(0.3 * r, 0, 0)
        b.cylinder("gear", BLACK, axle - half, axle + half, r, segments=16)
        if spats:
            center = (side * reach, floor + 1.15 * r, z + 0.3 * r)
            b.ellipsoid("gear", paint, center, (0.45 * r, 0.75 * r, 1.7 * r), segments=12)
    if nose:
        top = (0, height_at(rows, -0.42, -0.8), -0.42)
        undercarriage(b, STEEL, top, drop=top[1] - floor, radius=0.8 * r)
    else:
        top = (0, height_at(rows, 0.45, -0.8), 0.45)
        undercarriage(b, STEEL, top, drop=0.05, radius=0.013)


def _cab(
    b: Builder, rows: Sequence[Section], paint: Material, front: float, top: float, wide: float
) -> None:
    """Add an upright cabin with glass all around below a high wing at height `top`."""
    low = height_at(rows, front, 0.4)
    sections = []
    for z, y, w in (
        (front - 0.09, low, 0.46 * wide),
        (front, top, 0.46 * wide),
        (front + 0.16, top, 0.46 * wide),
        (front + 0.3, low, 0.25 * wide),
    ):
        base = low - 0.03
        sections.append([(-w, base, z), (-0.9 * w, y, z), (0.9 * w, y, z), (w, base, z)])
    b.loft("window", GLASS, sections)
    for z in (front, front + 0.16):
        for side in (-1, 1):
            foot, head = (side * 0.47 * wide, low - 0.02, z), (side * 0.425 * wide, top, z)
            b.cylinder("body", paint, foot, head, 0.008, segments=6)
    roof = (0, top, front + 0.08)
    b.rounded_box("body", paint, roof, (0.86 * wide, 0.018, 0.18), 0.02, segments=2)


def light_plane(rng: Rng) -> Builder:
    """Draw a single-engined aeroplane with a strutted high wing or a low wing and a bubble."""
    b, (paint, accent) = Builder(), draw_livery(rng)
    wide, tall = rng.uniform(0.12, 0.16), rng.uniform(0.14, 0.19)
    rows = _slim(rng, wide, tall)
    fuselage(b, "body", paint, rows, rng.uniform(0.15, 0.5))
    high = rng.random() < 0.55
    span, root = rng.uniform(0.55, 0.75), rng.uniform(0.17, 0.23)
    tip, lead = root * rng.uniform(0.55, 1.0), rng.uniform(-0.24, -0.18)
    y = 0.45 * tall + rng.uniform(0.03, 0.06) if high else -0.36 * tall
    rise = rng.uniform(0.01, 0.04) if high else rng.uniform(0.04, 0.1)
    knee = rng.uniform(0.3, 0.6)
    chords = (root, root, tip)
    edge = vec(0, y, lead) + np.outer([0, knee, 1], [span, rise, 0.0])
    edge[2, 2] += rng.uniform(0, 0.06)
    pair(b, "wing", accent if rng.random() < 0.4 else paint, edge, chords, 0.13)
    if high:
        _cab(b, rows, paint, lead, y, wide)
        for side in (-1, 1):
            foot = (side * 0.4 * wide, -0.3 * tall, lead + 0.07)
            head = (side * knee * span, y + knee * rise, lead + 0.07)
            b.cylinder("wing", paint, foot, head, 0.007, segments=6)
    else:
        ends = (lead - 0.04, lead + 0.34)
        canopy(b, rows, ends=ends, width=0.72 * wide, rise=rng.uniform(0.05, 0.075), frames=paint)
    tail(b, rng, accent, rows, rng.uniform(0.15, 0.2), draw(rng, ["low", "tee"], [0.8, 0.2]))
    reach, z = (0.09, 0.13) if high else (0.16, 0.17)
    nose = rng.random() < 0.6
    place = lead + (0.13 if nose else 0.02)
    _ground(b, rng, paint, rows, rng.uniform(reach, z), place, nose)
    hub = (0, 0, -0.505)
    radius, blades = rng.uniform(0.11, 0.15), int(rng.integers(2, 4))
    propeller(b, rng, hub, radius=radius, blades=blades, spinner=accent)
    return b


def biplane(rng: Rng) -> Builder:
    """Draw a biplane (or triplane): open cockpits, wings stacked on struts."""
    b, (paint, accent) = Builder(), draw_livery(rng, 0.4)
    wide, tall = rng.uniform(0.11, 0.14), rng.uniform(0.13, 0.17)
    rows = _slim(rng, wide, tall)
    fuselage(b, "body", paint, rows, rng.uniform(0.1, 0.6))
    if rng.random() < 0.5:
        cowl = [
            Section(z=-0.5, lift=0, width=1.02 * wide, height=0.86 * tall),
            Section(z=-0.41, lift=0, width=1.05 * wide, height=0.9 * tall),
        ]
        fuselage(b, "engine", STEEL, cowl)
    count = 3 if rng.random() < 0.2 else 2
    span, chord = rng.uniform(0.5, 0.72), rng.uniform(0.13, 0.19)
    gap, stagger = rng.uniform(0.19, 0.27) * (0.75 if count == 3 else 1), rng.uniform(0, 0.07)
    lead, low = rng.uniform(-0.27, -0.22), -0.38 * tall
    color = accent if rng.random() < 0.6 else paint
    for i in range(count):
        reach = span * (rng.uniform(0.8, 1.0) if i == 0 else 1.0)
        edge = vec(0, low + i * gap, lead - i * stagger + 0.06)
        points = edge + np.outer([0, 0.9, 1], [reach, 0.02, 0.0])
        points[2, 2] += 0.02
        pair(b, "wing", color, points, (chord, chord, 0.7 * chord), 0.09)
    heights = (low, low + (count - 1) * gap)
    _struts(b, rng, heights, (lead + 0.06, (count - 1) * stagger), span, chord)
    tail(b, rng, color, rows, rng.uniform(0.15, 0.18), "low")
    _ground(b, rng, paint, rows, rng.uniform(0.1, 0.14), lead + 0.05, False)
    propeller(b, rng, (0, 0, -0.515), radius=rng.uniform(0.13, 0.17), blades=2, spinner=accent)
    for z in np.linspace(lead + 0.2, lead + 0.36, int(rng.integers(1, 3))):
        top = height_at(rows, z, 1)
        b.ellipsoid("window", BLACK, (0, top - 0.004, z), (0.33 * wide, 0.015, 0.05), segments=14)
        b.box("window", GLASS, (0, top + 0.015, z - 0.045), (0.3 * wide, 0.04, 0.006))
    return b


def _struts(b: Builder, rng: Rng, heights: Pair, lead: Pair, span: float, chord: float) -> None:
    """Join the lowest and the highest wing by struts and wires; `lead` is (z, stagger)."""
    bottom, top = heights
    z, stagger = lead
    bays = [0.62] if rng.random() < 0.6 else [0.4, 0.72]
    for side in (-1, 1):
        for t in (0.08, *bays):
            x = side * t * span
            for along in (0.15, 0.7):
                foot = (x, bottom + 0.02 * t, z + along * chord)
                head = (x * (1.3 if t < 0.1 else 1), top + 0.02 * t, z - stagger + along * chord)
                b.cylinder("wing", STEEL, foot, head, 0.007, segments=6)
        inner, outer = 0.1 * span * side, bays[-1] * span * side
        for a, c in (((inner, bottom), (outer, top)), ((inner, top), (outer, bottom))):
            start, end = (*a, z + 0.4 * chord), (*c, z + 0.4 * chord)
            b.cylinder("wing", STEEL, start, end, 0.0025, segments=4)
