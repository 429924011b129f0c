"""Transports: jet airliners and turboprops."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import Array, vec
from ffd_lightning.shapes.plane.engines import nacelle, propeller, undercarriage
from ffd_lightning.shapes.plane.fuselage import (
    fuselage,
    height_at,
    tapered,
    width_at,
    windows,
    windscreen,
)
from ffd_lightning.shapes.plane.livery import STEEL, draw_livery
from ffd_lightning.shapes.plane.wings import on_wing, pair, surface, tail


def airliner(rng: Rng) -> Builder:
    """Draw a jet airliner or business jet, its engines under the wings or at the tail."""
    b, (paint, accent) = Builder(), draw_livery(rng)
    wide = rng.uniform(0.085, 0.15)
    rows = tapered(
        length=1.0,
        width=wide,
        height=wide * rng.uniform(1.0, 1.12),
        nose=1.3 * wide,
        tail=rng.uniform(0.26, 0.36),
        upsweep=0.32 * wide,
    )
    fuselage(b, "body", paint, rows)
    span, root, tip = rng.uniform(0.4, 0.56), rng.uniform(0.17, 0.26), rng.uniform(0.04, 0.07)
    lead, sweep = rng.uniform(-0.16, -0.05), rng.uniform(0.35, 0.7)
    y = height_at(rows, 0, -0.55)
    kink = rng.uniform(0.25, 0.4)
    tip_at = [span, rng.uniform(0.03, 0.1), sweep * span]
    edge = vec(0, y, lead) + np.outer([0.0, kink, 1.0], tip_at)
    pair(b, "wing", STEEL if rng.random() < 0.3 else paint, edge, (root, 0.6 * root, tip), 0.11)
    if rng.random() < 0.5:
        end = edge[-1] + vec(0.02, 0.06, 0.05)
        pair(b, "wing", accent, [edge[-1], end], (tip, 0.5 * tip), 0.1)
    belly = [
        Section(z=lead - 0.04, lift=y, width=0.3 * wide, height=0.2 * wide),
        Section(z=lead + 0.06, lift=y, width=0.9 * wide, height=0.5 * wide),
        Section(z=lead + 0.9 * root, lift=y, width=0.9 * wide, height=0.5 * wide),
        Section(z=lead + 1.25 * root, lift=y, width=0.3 * wide, height=0.2 * wide),
    ]
    fuselage(b, "body", paint, belly)
    rear_engines = rng.random() < 0.35
    tail(b, rng, accent, rows, rng.uniform(0.14, 0.19), "tee" if rear_engines else "low")
    _jets(b, rng, paint if rng.random() < 0.6 else accent, rows, edge, rear_engines)
    _cabin(b, rng, (paint, accent), rows, wide)
    if rng.random() < 0.6:
        drop, r = rng.uniform(0.07, 0.1), rng.uniform(0.013, 0.019)
        for x in (-0.07, 0.07):
            undercarriage(b, STEEL, (x, y + 0.01, lead + 0.7 * root), drop=drop, radius=r, wheels=2)
        front = -0.38
        top = (0, height_at(rows, front, -0.9), front)
        drop = drop + height_at(rows, front, -0.9) - y - 0.01
        undercarriage(b, STEEL, top, drop=drop, radius=r, wheels=2)
    return b


def _cabin(
    b: Builder, rng: Rng, colors: tuple[Material, Material], rows: Sequence[Section], wide: float
) -> None:
    """Add the cockpit's and the cabin's windows, perhaps a stripe, perhaps an upper deck."""
    windscreen(b, rows, z=-0.5 + 0.38 * wide, depth=0.32 * wide)
    count, size = int(rng.integers(14, 30)), (0.009, 0.016)
    windows(b, rows, ends=(-0.5 + 1.4 * wide, 0.24), count=count, up=0.2, size=size)
    if rng.random() < 0.5:
        for side in (-1, 1):
            x = side * 0.5 * wide * 0.99
            b.box("body", colors[1], (x, height_at(rows, 0, -0.12), -0.08), (0.01, 0.014, 0.62))
    if rng.random() < 0.2:
        hump = [
            Section(z=-0.42, lift=0.2 * wide, width=0.4 * wide, height=0.3 * wide),
            Section(z=-0.34, lift=0.38 * wide, width=0.72 * wide, height=0.6 * wide),
            Section(z=-0.12, lift=0.38 * wide, width=0.72 * wide, height=0.6 * wide),
            Section(z=0.0, lift=0.2 * wide, width=0.4 * wide, height=0.3 * wide),
        ]
        fuselage(b, "body", colors[0], hump)


def _jets(
    b: Builder, rng: Rng, paint: Material, rows: Sequence[Section], edge: Array, rear: bool
) -> None:
    """Hang two or four turbofans below the wing, or mount two or three at the tail."""
    radius = rng.uniform(0.024, 0.042)
    length = radius * rng.uniform(3.0, 4.2)
    if rear:
        z = rng.uniform(0.17, 0.25)
        x, y = 0.5 * width_at(rows, z) + 1.25 * radius, height_at(rows, z, 0.35)
        for side in (-x, x):
            nacelle(b, paint, (side, y, z), radius, length)
        chords = (0.6 * length,) * 2
        pylon = [(0, y, z - 0.25 * length), (x, y, z - 0.25 * length)]
        pair(b, "engine", paint, pylon, chords, 0.12)
        return
    for t in (0.36,) if rng.random() < 0.7 else (0.3, 0.62):
        hold = on_wing(edge, t)
        center = hold + vec(0, -1.5 * radius, -0.28 * length)
        for side in (-1, 1):
            nacelle(b, paint, center * vec(side, 1, 1), radius, length)
            foot, head = center + vec(0, 0.7 * radius, -0.2 * length), hold + vec(0, 0.002, 0.02)
            chords = (0.9 * length, 0.08)
            surface(b, "engine", paint, np.array([foot, head]) * vec(side, 1, 1), chords, 0.08)


def turboprop(rng: Rng) -> Builder:
    """Draw a propeller transport with two or four engines, its wing high or low."""
    b, (paint, accent) = Builder(), draw_livery(rng, 0.4)
    wide, high = rng.uniform(0.09, 0.16), rng.random() < 0.55
    rows = tapered(
        length=1.0,
        width=wide,
        height=wide * rng.uniform(1.0, 1.15),
        nose=1.1 * wide,
        tail=rng.uniform(0.3, 0.42),
        upsweep=0.4 * wide,
    )
    fuselage(b, "body", paint, rows, rng.uniform(0, 0.35))
    span, root = rng.uniform(0.45, 0.62), rng.uniform(0.13, 0.19)
    tip, lead = root * rng.uniform(0.4, 0.8), rng.uniform(-0.14, -0.05)
    y = height_at(rows, 0, 0.85 if high else -0.6)
    tip_at = [span, rng.uniform(0, 0.07), rng.uniform(0.0, 0.07)]
    edge = vec(0, y, lead) + np.outer([0.0, 1.0], tip_at)
    pair(b, "wing", paint, edge, (root, tip), 0.13)
    tail(b, rng, accent, rows, rng.uniform(0.15, 0.2), draw(rng, ["low", "cross", "tee"]))
    cowl = accent if rng.random() < 0.5 else paint
    radius, blades = rng.uniform(0.07, 0.1), int(rng.integers(3, 7))
    for t in (0.33,) if rng.random() < 0.6 else (0.28, 0.58):
        for side in (-1, 1):
            hub = (on_wing(edge, t) + vec(0, 0.0, -0.08)) * vec(side, 1, 1)
            pod = [
                Section(z=hub[2] + 0.005, lift=hub[1], width=0.03, height=0.035),
                Section(z=hub[2] + 0.04, lift=hub[1], width=0.044, height=0.052),
                Section(z=lead + 0.5 * root, lift=hub[1], width=0.044, height=0.052),
                Section(z=lead + 1.15 * root, lift=hub[1], width=0.015, height=0.02),
            ]
            fuselage(b, "engine", cowl, pod, 0.2, hub[0])
            propeller(b, rng, hub, radius=radius, blades=blades, spinner=STEEL)
    windscreen(b, rows, z=-0.5 + 0.36 * wide, depth=0.3 * wide)
    ends = (-0.5 + 1.4 * wide, 0.18)
    windows(b, rows, ends=ends, count=int(rng.integers(6, 16)), up=0.2, size=(0.014, 0.018))
    drop = rng.uniform(0.07, 0.1)
    ground = height_at(rows, 0, -1) - drop
    for x in (-0.3 * wide, 0.3 * wide) if high else (-0.33 * span, 0.33 * span):
        top = height_at(rows, 0, -0.6) if high else y
        undercarriage(b, STEEL, (x, top, lead + 0.7 * root), drop=top - ground, radius=0.02)
    top = height_at(rows, -0.38, -0.8)
    undercarriage(b, STEEL, (0, top, -0.38), drop=top - ground, radius=0.016)
    return b
