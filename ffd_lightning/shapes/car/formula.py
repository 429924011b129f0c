"""Open-wheeled racing cars."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.car.body import BLACK, draw_paint
from ffd_lightning.shapes.car.wheels import Rim, wheel
from ffd_lightning.shapes.kit import Builder, Material, Rng, pick_material
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import Pair, vec


def formula(rng: Rng) -> Builder:
    """Draw a formula car: nose, side pods, airbox, two wings (old ones have none)."""
    b, paint, second = Builder(), draw_paint(rng), draw_paint(rng)
    length, width = rng.uniform(3.8, 5.0), rng.uniform(1.6, 2.0)
    front, rear = -length * rng.uniform(0.26, 0.32), length * rng.uniform(0.3, 0.36)
    size = (rng.uniform(0.28, 0.33), rng.uniform(0.31, 0.38))
    modern = rng.random() < 0.7
    bulk, y = rng.uniform(0.55, 0.8), rng.uniform(0.36, 0.42)
    seat = front + rng.uniform(0.42, 0.55) * (rear - front)
    stations = [
        Section(z=-length / 2, lift=y - 0.12, width=0.16, height=0.1),
        Section(z=-length / 2 + 0.35, lift=y - 0.07, width=0.24, height=0.17),
        Section(z=front, lift=y, width=0.36, height=0.3),
        Section(z=seat - 0.4, lift=y + 0.04, width=bulk, height=0.46),
        Section(z=seat + 0.45, lift=y + 0.06, width=bulk, height=0.54),
        Section(z=rear, lift=y, width=0.42, height=0.36),
        Section(z=rear + 0.4, lift=y, width=0.2, height=0.2),
    ]
    b.loft("body", paint, [row.ring(0.5, 16) for row in stations])
    _driver(b, rng, second, seat, y + 0.28)
    if modern:
        _pods(b, rng, second, (seat - 0.25, rear - 0.25), y, bulk, width)
        airbox = [
            Section(z=seat + 0.3, lift=y + 0.42, width=0.26, height=0.42),
            Section(z=seat + 0.6, lift=y + 0.4, width=0.22, height=0.4),
            Section(z=rear, lift=y + 0.2, width=0.12, height=0.16),
        ]
        b.loft("hood", paint, [row.ring(0.5, 16) for row in airbox])
        plan = (0.94 * width, 0.32)
        _wing(b, second, paint, z=-length / 2 + 0.12, y=y - 0.18, size=plan, count=1)
        count = int(rng.integers(1, 4))
        high = y + rng.uniform(0.3, 0.55)
        _wing(b, second, paint, rear + 0.45, high, (rng.uniform(0.5, 0.62) * width, 0.3), count)
        for side in (-0.1, 0.1):
            start = (side, y - 0.05, rear + 0.3)
            beam(b, "trim", BLACK, start, (side, high, rear + 0.48), width=0.03, height=0.14)
    else:
        for side in (-0.5 * bulk, 0.5 * bulk):
            b.cylinder("trim", BLACK, (side, y, seat), (side, y - 0.05, length / 2), 0.05)
    _running_gear(b, rng, (front, rear), size, width, y)
    return b


def _driver(b: Builder, rng: Rng, paint: Material, seat: float, y: float) -> None:
    """Add the cockpit's rim, a helmet, a small windscreen or a halo, and mirrors."""
    b.ellipsoid("seat", BLACK, (0, y, seat), (0.24, 0.06, 0.4), segments=18)
    b.ellipsoid("seat", paint, (0, y + 0.1, seat + 0.08), (0.13, 0.15, 0.15), segments=16)
    b.ellipsoid("window", BLACK, (0, y + 0.12, seat - 0.02), (0.11, 0.05, 0.08), segments=12)
    if rng.random() < 0.5:
        a = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 9) * 1.1
        hoop = np.stack([0.3 * np.sin(a), np.full(9, y + 0.2), seat + 0.25 - 0.6 * np.cos(a)], 1)
        b.tube("trim", BLACK, hoop, 0.03, segments=8)
        b.cylinder("trim", BLACK, (0, y - 0.04, seat - 0.5), (0, y + 0.2, seat - 0.35), 0.025)
        for end in (hoop[0], hoop[-1]):
            b.cylinder("trim", BLACK, end, end - vec(0.1 * np.sign(end[0]), 0.25, -0.05), 0.03)
    for side in (-1, 1):
        head = vec(0.42 * side, y + 0.06, seat - 0.4)
        b.cylinder("trim", BLACK, (0.2 * side, y - 0.06, seat - 0.38), head, 0.014, segments=8)
        b.box("trim", paint, head, (0.16, 0.08, 0.05))


def _pods(
    b: Builder, rng: Rng, paint: Material, ends: Pair, y: float, bulk: float, width: float
) -> None:
    """Add the radiators' side pods and the floor."""
    front, rear = ends
    out, tall = rng.uniform(0.3, 0.42) * width, rng.uniform(0.34, 0.46)
    for side in (-1, 1):
        rings = []
        for z, w, h in ((front, 1.0, 1.0), (front + 0.5, 1.0, 1.0), (rear, 0.45, 0.55)):
            x = side * (0.2 * bulk + 0.5 * out * w)
            cut = Section(z, y - 0.02 - 0.5 * tall * (1 - h), width=out * w, height=tall * h)
            rings.append(cut.ring(0.5, 16, side=x))
        b.loft("body", paint, rings)
        x = side * (0.2 * bulk + 0.5 * out)
        center = (x + 0.08 * side, y - 0.02, front - 0.004)
        b.box("body", BLACK, center, (0.55 * out, 0.6 * tall, 0.02))
    floor = y - 0.02 - tall / 2
    size = (0.4 * bulk + 2.1 * out, 0.03, rear - front)
    b.box("body", BLACK, (0, floor, (front + rear) / 2), size)


def _wing(
    b: Builder, paint: Material, plate: Material, z: float, y: float, size: Pair, count: int
) -> None:
    """Add `count` stacked aerofoils of (span, chord) between two end plates."""
    span, chord = size
    for i in range(count):
        a = np.array([(-0.5, 0), (-0.3, 0.05), (0.5, 0.16), (0.5, 0.13), (-0.3, -0.02)])
        foil = a * chord + [0.05 * i, 0.11 * i]
        rings = [[(x, y + up, z + along) for along, up in foil] for x in (-span / 2, span / 2)]
        b.loft("trim", paint, rings)
    tall = 0.16 + 0.11 * (count - 1)
    for side in (-span / 2, span / 2):
        center = (side, y + tall / 2 - 0.06, z + 0.02)
        b.box("trim", plate, center, (0.025, tall, 1.15 * chord))


def _running_gear(b: Builder, rng: Rng, axles: Pair, sizes: Pair, width: float, y: float) -> None:
    """Add four wide wheels and their wishbones."""
    kind = "spokes" if rng.random() < 0.6 else "disc"
    style = Rim(kind, 6, pick_material(rng, "metal"))
    for z, radius, thick in zip(axles, sizes, (0.28, 0.36), strict=True):
        for side in (-1, 1):
            x = side * (width / 2 - thick / 2)
            wheel(b, radius, thick, (x, radius, z), style)
            for up, along in ((0.06, -0.22), (0.06, 0.22), (-0.08, -0.2), (-0.08, 0.2)):
                hub, root = vec(x, radius + up, z), vec(0.1 * side, y + up, z + along)
                b.cylinder("trim", BLACK, root, hub, 0.018, segments=6)
