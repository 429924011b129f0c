"""Open-wheeled racing cars, whose components go together alone."""

import numpy as np

from ffd_lightning.shapes.car.plan import BLACK, CHROME, Plan
from ffd_lightning.shapes.kit import Builder, Component, Rng
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import Pair, vec


def monocoque(b: Builder, rng: Rng, p: Plan) -> None:
    """Add the slender body, mostly with side pods, and the wishbones."""
    (front, rear), seat, y = p.axles, sum(p.axles) / 2, p.belt
    bulk, out, tall = rng.uniform(0.55, 0.8), rng.uniform(0.28, 0.4) * p.width, 0.37
    stations = [(-p.length / 2, y - 0.1, 0.16, 0.1), (0.35 - p.length / 2, y - 0.06, 0.24, 0.17)]
    stations += [(front, y, 0.36, 0.3), (seat - 0.4, y + 0.04, bulk, 0.46)]
    stations += [(seat + 0.45, y + 0.06, bulk, 0.54), (rear, y, 0.42, 0.36)]
    stations += [(rear + 0.4, y, 0.2, 0.2)]
    b.loft("body", p.paint, [Section(*row).ring(0.5, 16) for row in stations])
    start = seat - rng.uniform(0.1, 0.4)
    pods = [(start, 1.0, 1.0), (start + 0.5, 1.0, 1.0), (rear - 0.25, 0.45, 0.55)]
    for side in (-1, 1) if rng.random() < 0.7 else ():
        rings = []
        for z, w, h in pods:
            cut = Section(z, y - 0.5 * tall * (1 - h), width=out * w, height=tall * h)
            rings.append(cut.ring(0.5, 16, side=side * (0.2 * bulk + 0.5 * out * w)))
        b.loft("body", p.second, rings)
        center = (side * (0.2 * bulk + 0.5 * out + 0.08), y, start - 0.004)
        b.box("body", BLACK, center, (0.55 * out, 0.6 * tall, 0.02))
    for z in (front, rear):
        for side in (-1, 1):
            for up, along in ((0.06, -0.22), (0.06, 0.22), (-0.08, -0.2), (-0.08, 0.2)):
                hub = vec(side * (p.track / 2 - 0.12), p.radius + up, z)
                root = vec(0.1 * side, y + up, z + along)
                b.cylinder("trim", BLACK, root, hub, 0.018, segments=6)


def driver(b: Builder, rng: Rng, p: Plan) -> None:
    """Add the cockpit's rim, a helmet, mirrors, and sometimes a hoop that protects the head."""
    seat, y = sum(p.axles) / 2, p.belt + 0.28
    b.ellipsoid("seat", BLACK, (0, y, seat), (0.24, 0.06, 0.4), segments=18)
    b.ellipsoid("seat", p.second, (0, y + 0.1, seat + 0.08), (0.13, 0.15, 0.15), segments=16)
    b.ellipsoid("window", BLACK, (0, y + 0.12, seat - 0.02), (0.11, 0.05, 0.08), segments=12)
    halo = rng.random() < 0.5
    for side in (-1, 1):
        head = vec(0.42 * side, y + 0.06, seat - 0.4)
        b.cylinder("trim", BLACK, (0.2 * side, y - 0.06, seat - 0.38), head, 0.014, segments=8)
        b.box("trim", p.second, head, (0.16, 0.08, 0.05))
        if halo:
            hoop = [(0.2, -0.1, 0.3), (0.28, 0.2, 0.15), (0.27, 0.2, -0.1), (0, 0.2, -0.36)]
            path = vec(0, y, seat) + np.array([*hoop, (0, -0.06, -0.5)]) * vec(side, 1, 1)
            b.tube("trim", BLACK, path, 0.03, segments=8)


def front(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a wing below the nose, or the ring around its opening."""
    z, y = -p.length / 2, p.belt - 0.1
    if rng.random() < 0.3:
        b.cylinder("trim", CHROME, (0, y, z - 0.03), (0, y, z + 0.08), 0.11)
        return
    size = (rng.uniform(0.7, 0.98) * p.width, rng.uniform(0.26, 0.4))
    _wing(b, p, z + 0.12, y - 0.05, size, int(rng.integers(1, 3)))


def rear(b: Builder, rng: Rng, p: Plan) -> None:
    """Add exhaust pipes, or the engine's air intake and a wing over the tail."""
    seat, y, axle = sum(p.axles) / 2, p.belt, p.axles[1]
    if rng.random() < 0.25:
        for side in (-0.3, 0.3):
            b.cylinder("trim", CHROME, (side, y, seat), (side, y - 0.05, p.length / 2), 0.05)
        return
    tall = rng.uniform(0.3, 0.5)
    airbox = [Section(seat + 0.3, y + 0.4, 0.26, tall), Section(seat + 0.6, y + 0.38, 0.22, tall)]
    airbox += [Section(z=axle, lift=y + 0.2, width=0.12, height=0.16)]
    b.loft("hood", p.paint, [row.ring(0.5, 16) for row in airbox])
    high, size = y + rng.uniform(0.3, 0.6), (rng.uniform(0.5, 0.72) * p.width, 0.3)
    _wing(b, p, axle + 0.45, high, size, int(rng.integers(1, 4)))
    for x in (-0.08, 0.08):
        foot = (x, y - 0.05, axle + 0.3)
        beam(b, "trim", BLACK, foot, (x, high, axle + 0.48), width=0.03, height=0.14)


def _wing(b: Builder, p: Plan, z: float, y: float, size: Pair, count: int) -> None:
    """Add `count` stacked aerofoils of (span, chord) between two end plates."""
    span, chord = size
    for i in range(count):
        a = np.array([(-0.5, 0), (-0.3, 0.05), (0.5, 0.16), (0.5, 0.13), (-0.3, -0.02)])
        foil = a * chord + [0.05 * i, 0.11 * i]
        rings = [[(x, y + up, z + along) for along, up in foil] for x in (-span / 2, span / 2)]
        b.loft("trim", p.second, rings)
    tall = 0.16 + 0.11 * (count - 1)
    for x in (-span / 2, span / 2):
        b.box("trim", p.paint, (x, y + tall / 2 - 0.06, z + 0.02), (0.025, tall, 1.15 * chord))


_RACER = {"use": ("racer",)}
BODY = Component("monocoque", 1, monocoque, _RACER)
CABIN = Component("cockpit", 1, driver, _RACER)
NOSE = Component("cone", 1, front, _RACER)
TAIL = Component("wing", 1, rear, {"cabin": ("cockpit",)})
