"""The bodies of cars: paint, shell, hood, lights and open tubs. Metres."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.car.stance import Stance
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import Array, Pair, vec

BLACK = Material((0.06, 0.06, 0.065))
CHROME = Material((0.75, 0.76, 0.78))
LAMP = Material((0.95, 0.93, 0.82))
RED = Material((0.75, 0.06, 0.05))


def draw_paint(rng: Rng) -> Material:
    """Draw a car's colour: lively, or white, silver, grey or black."""
    if rng.random() < 0.6:
        return pick_material(rng, "paint")
    return Material((float(rng.choice([0.08, 0.25, 0.5, 0.7, 0.92])),) * 3)


def shell(b: Builder, paint: Material, stance: Stance) -> None:
    """Add the body with open wheel arches, and the dark underbody that shows through them."""
    arch, half = 1.13 * stance.radius, stance.length / 2
    stations = [*np.linspace(-half, half, 13), *(z for z, _ in stance.profile)]
    for axle in stance.axles:
        inner = [axle - arch * np.cos(a) for a in np.linspace(0.02, np.pi - 0.02, 8)]
        stations += [axle - 1.002 * arch, *inner, axle + 1.002 * arch]
    inside = [z for z in sorted(stations) if -half <= z <= half]
    kept = np.array(inside)[np.diff(inside, prepend=-np.inf) > 1e-4]
    b.loft("body", paint, [_section(stance, z) for z in kept])
    inner_width = 0.62 * stance.width
    floor = min(stance.clearance + 0.04, stance.radius)
    tall = min(1.9 * stance.radius, min(h for _, h in stance.profile) - 0.05) - floor
    center = (0, floor + tall / 2, 0)
    b.box("body", BLACK, center, (inner_width, tall, 0.96 * stance.length))


def _section(stance: Stance, z: float) -> Array:
    """Return the cross-section of the body at z, (14, 3)."""
    w, top, low = stance.half_width(z), stance.top(z), stance.lower(z)
    shoulder = max(stance.clearance + 0.72 * (top - stance.clearance), low + 0.02)
    edge = 0.5 * (shoulder + top)
    side = [(0.95 * w, low), (0.99 * w, low + 0.2 * (shoulder - low)), (w, 0.5 * (low + shoulder))]
    side += [(0.99 * w, shoulder), (0.955 * w, edge), (0.9 * w, top - 0.1 * (top - shoulder))]
    side += [(0.8 * w, top)]
    ring = side + [(-x, y) for x, y in reversed(side)]
    return np.array([(x, y, z) for x, y in ring])


def hood(b: Builder, paint: Material, stance: Stance, ends: Pair) -> None:
    """Add the hood's panel on the body between two z, following its profile."""
    rows = [z for z, _ in stance.profile if ends[0] < z < ends[1]]
    rings = []
    for z in [ends[0], *rows, ends[1]]:
        w, y = 0.76 * stance.half_width(z), stance.top(z)
        rings.append([(-w, y - 0.02, z), (-w, y + 0.012, z), (w, y + 0.012, z), (w, y - 0.02, z)])
    b.loft("hood", paint, rings)


def face(b: Builder, rng: Rng, stance: Stance, paint: Material) -> None:
    """Add lights, grille, number plates and bumpers to both ends."""
    shape = draw(rng, ["round", "wide", "tall"])
    bumper = CHROME if rng.random() < 0.25 else (BLACK if rng.random() < 0.4 else paint)
    for end in (-1, 1):
        z = end * stance.length / 2
        half, top = stance.half_width(z), stance.top(z)
        tall = top - stance.clearance
        size = {"round": (0.16, 0.16), "wide": (0.34, 0.11), "tall": (0.14, 0.22)}[shape]
        size = (min(size[0], 0.5 * half), min(size[1], 0.4 * tall))
        y = stance.clearance + (0.72 if end < 0 else 0.75) * tall - 0.1 * size[1]
        for side in (-1, 1):
            center = vec(side * (0.93 * half - size[0] / 2 - 0.02), y, z)
            material = LAMP if end < 0 else RED
            if shape == "round":
                b.ellipsoid("light", material, center, (size[0] / 2, size[1] / 2, 0.04), segments=8)
            else:
                b.rounded_box("light", material, center, (*size, 0.06), 0.025, segments=1)
        low = stance.clearance + 0.2 * tall
        box = (1.98 * half, 0.22 * tall, 0.16)
        b.rounded_box("trim", bumper, (0, low, z - end * 0.03), box, 0.07, segments=2)
        b.box("trim", LAMP, (0, low + 0.02, z + end * 0.052), (0.42, 0.09, 0.012))
    _grille(b, rng, stance)


def _grille(b: Builder, rng: Rng, stance: Stance) -> None:
    """Add a grille of a few bars between the headlights."""
    z = -stance.length / 2
    half, tall = stance.half_width(z), stance.top(z) - stance.clearance
    y, high, wide = stance.clearance + 0.62 * tall, 0.3 * tall, half * rng.uniform(0.5, 1.0)
    b.box("trim", BLACK, (0, y, z), (wide, high, 0.03))
    bars = int(rng.integers(1, 5))
    for t in (np.arange(bars) + 0.5) / bars - 0.5:
        b.box("trim", CHROME, (0, y + t * high, z - 0.015), (wide, 0.12 * high, 0.015))


def walls(
    b: Builder,
    paint: Material,
    stance: Stance,
    ends: Pair,
    span: Pair,
    thickness: float,
    closed: tuple[bool, bool] = (True, True),
) -> None:
    """Wall in an open bed or cockpit between two z and two heights; `closed` ends get a wall."""
    low, high = span
    stations = np.linspace(*ends, 6)
    for side in (-1, 1):
        rings = []
        for z in stations:
            outer = side * 0.985 * stance.half_width(z)
            inner = outer - side * thickness
            flat = [(inner, low), (outer, low), (outer, high - 0.03)]
            flat += [(outer - 0.2 * side * thickness, high), (inner, high)]
            rings.append([(x, y, z) for x, y in flat])
        b.loft("body", paint, rings)
    for z, wall, shift in zip(ends, closed, (0.5, -0.5), strict=True):
        if wall:
            size = (1.9 * stance.half_width(z), high - low, thickness)
            b.box("body", paint, (0, (low + high) / 2, z + shift * thickness), size)
