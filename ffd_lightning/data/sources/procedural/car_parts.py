"""What cars have in common: the shell, wheels, greenhouse, lights and open tubs. Metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ffd_lightning.data.sources.procedural.furniture import beam, draw
from ffd_lightning.data.sources.procedural.shapes import (
    Array,
    Builder,
    Material,
    pick_material,
    rotation,
)

BLACK = Material((0.06, 0.06, 0.065))
CHROME = Material((0.75, 0.76, 0.78))
LAMP = Material((0.95, 0.93, 0.82))
RED = Material((0.75, 0.06, 0.05))

Profile = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Stance:
    """How a car stands: its size, its axles and the outline of its top.

    Attributes:
        length: along z; the nose is at -length / 2.
        width: across the flanks.
        axles: z of each axle, front first.
        radius: of the tyres.
        clearance: height of the sills.
        profile: (z, height) rows from nose to tail: the top of the body without its cabin.
        nose: width at the ends as a fraction of `width`.
    """

    length: float
    width: float
    axles: tuple[float, ...]
    radius: float
    clearance: float
    profile: Profile
    nose: float = 0.85

    def top(self, z: float) -> float:
        """Return the height of the body at z."""
        rows = np.asarray(self.profile)
        return float(np.interp(z, rows[:, 0], rows[:, 1]))

    def half_width(self, z: float) -> float:
        """Return half the width of the body at z; it narrows towards both ends."""
        t = np.clip((abs(2 * z / self.length) - 0.55) / 0.45, 0, 1)
        return 0.5 * self.width * (1 - (1 - self.nose) * t**2.5)

    def lower(self, z: float) -> float:
        """Return the height of the body's lower edge at z: the sill or a wheel arch."""
        arch = 1.13 * self.radius
        reach = min(abs(z - axle) for axle in self.axles)
        if reach < arch:
            return self.radius + float(np.sqrt(arch**2 - reach**2))
        return self.clearance


def draw_paint(rng: np.random.Generator) -> Material:
    """Draw a car's colour: lively, or white, silver, grey or black."""
    if rng.random() < 0.6:
        return pick_material(rng, "paint")
    return Material((float(rng.choice([0.08, 0.25, 0.5, 0.7, 0.92])),) * 3)


def draw_glass(rng: np.random.Generator) -> Material:
    """Draw the tint of windows, dark and opaque."""
    value = rng.uniform(0.08, 0.3)
    return Material((0.8 * value, 0.95 * value, 1.1 * value))


def shell(b: Builder, paint: Material, stance: Stance) -> None:
    """Add the body with open wheel arches, and the dark underbody that shows through them."""
    arch, half = 1.13 * stance.radius, stance.length / 2
    stations = [*np.linspace(-half, half, 22), *(z for z, _ in stance.profile)]
    for axle in stance.axles:
        inner = [axle - arch * np.cos(a) for a in np.linspace(0.02, np.pi - 0.02, 11)]
        stations += [axle - 1.002 * arch, *inner, axle + 1.002 * arch]
    inside = [z for z in sorted(stations) if -half <= z <= half]
    kept = [inside[0]]
    kept += [z for z in inside[1:] if z - kept[-1] > 1e-4]
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


def wheel(
    b: Builder,
    rng: np.random.Generator,
    radius: float,
    thickness: float,
    hub: tuple[float, float, float],
    style: tuple[str, int, Material],
) -> None:
    """Add a wheel at `hub`, turned outwards; `style` is (kind of rim, spokes, rim material)."""
    kind, count, metal = style
    out = 1.0 if hub[0] > 0 else -1.0
    turn, center = rotation((0, 0, 1), -90 * out), np.array(hub)
    rim, w = 0.66 * radius, thickness / 2
    profile = [(rim, -w), (0.93 * radius, -w), (radius, -0.6 * w), (radius, 0.6 * w)]
    profile += [(0.93 * radius, w), (rim, 0.9 * w), (0.97 * rim, 0.4 * w)]
    b.lathe("wheel", pick_rubber(), profile, center, 24, turn)
    face = center + np.array([0.45 * w * out, 0, 0])
    plate = BLACK if kind == "spokes" else metal
    bulge = [
        (0.97 * rim, -0.05 * w),
        (0.97 * rim, 0.06 * w),
        (0.45 * rim, 0.25 * w),
        (0.1 * rim, 0.3 * w),
    ]
    b.lathe("wheel", plate, bulge, face, 20, turn)
    if kind == "spokes":
        for i in range(count):
            spin = rotation((1, 0, 0), 360 * i / count)
            arm = spin @ np.array([0.3 * w * out, 0.5 * rim, 0])
            b.box("wheel", metal, face + arm, (0.2 * w, 1.0 * rim, 1.1 * rim / count), spin)
    cap = [(0.22 * rim, 0), (0.2 * rim, 0.5 * w), (0.05 * rim, 0.6 * w)]
    b.lathe("wheel", metal, cap, face, 12, turn)


def pick_rubber() -> Material:
    """Return the colour of tyres."""
    return Material((0.09, 0.09, 0.09))


def wheels(b: Builder, rng: np.random.Generator, stance: Stance, inset: float = 0.02) -> None:
    """Add two wheels to every axle, all alike, their outer faces `inset` inside the flanks."""
    thickness = stance.radius * rng.uniform(0.5, 0.75)
    kind = draw(rng, ["spokes", "disc"], [0.7, 0.3])
    metal = CHROME if rng.random() < 0.6 else pick_material(rng, "metal")
    style = (kind, int(rng.integers(5, 9)), metal)
    for axle in stance.axles:
        x = stance.half_width(axle) - thickness / 2 - inset
        for side in (-x, x):
            wheel(b, rng, stance.radius, thickness, (side, stance.radius, axle), style)


@dataclass(frozen=True)
class Cabin:
    """A closed cabin: where its glass starts at the belt and ends at the roof.

    Attributes:
        belt: z of the windscreen's and the rear window's feet.
        roof: z of the roof's front and rear edge.
        heights: of the belt and of the roof.
        widths: across at the belt and at the roof.
        pillars: fractions along the sides where pillars stand, besides the four corners.
        pillar: how wide they are.
    """

    belt: tuple[float, float]
    roof: tuple[float, float]
    heights: tuple[float, float]
    widths: tuple[float, float]
    pillars: tuple[float, ...] = (0.48,)
    pillar: float = 0.06

    def point(self, along: float, up: float, side: float) -> Array:
        """Return a point of the flank: fractions along it and up it, and `side` -1 or 1."""
        t = max(0.0, min(1.0, up))
        front, rear = ((1 - t) * self.belt[i] + t * self.roof[i] for i in (0, 1))
        half = 0.5 * ((1 - up) * self.widths[0] + up * self.widths[1])
        y = (1 - up) * self.heights[0] + up * self.heights[1]
        return np.array([side * half, y, front + along * (rear - front)])

    def ring(self, up: float, grow: float = 0.0, corner: float = 0.08) -> Array:
        """Return the horizontal outline (16, 3) at a fraction of the height."""
        low, high = self.point(0, up, 1), self.point(1, up, 1)
        x, z = np.array([high[0], (high[2] - low[2]) / 2]) + grow
        signs = np.repeat([(1, 1), (-1, 1), (-1, -1), (1, -1)], 4, axis=0)
        angles = np.concatenate([np.linspace(0, np.pi / 2, 4) + i * np.pi / 2 for i in range(4)])
        flat = signs * np.array([x - corner, z - corner])
        flat = flat + corner * np.column_stack([np.cos(angles), np.sin(angles)])
        middle = (low[2] + high[2]) / 2
        return np.column_stack([flat[:, 0], np.full(16, low[1]), flat[:, 1] + middle])


def cabin(b: Builder, paint: Material, glass: Material, shape: Cabin, roof: Material) -> None:
    """Add windows, pillars and a roof."""
    b.loft("window", glass, [shape.ring(up) for up in (-0.15, 0.0, 0.5, 1.0)])
    for side in (-1, 1):
        for along in (0.0, *shape.pillars, 1.0):
            inset = {0.0: 0.012, 1.0: -0.012}.get(along, 0.0)
            foot, head = (shape.point(along, up, 0.985 * side) for up in (-0.1, 1.0))
            shift = np.array([-0.012 * side if inset else 0, 0, inset])
            beam(b, "roof", paint, foot + shift, head + shift, shape.pillar, shape.pillar)
    thick = 0.05 * (shape.heights[1] - shape.heights[0]) + 0.02
    rise = np.array([0, thick, 0])
    rings = [shape.ring(0.97, 0.02), shape.ring(1.0, 0.012) + 0.3 * rise]
    rings += [shape.ring(1.0, -0.06) + 0.8 * rise, shape.ring(1.0, -0.25) + rise]
    b.loft("roof", roof, rings)


def hood(b: Builder, paint: Material, stance: Stance, ends: tuple[float, float]) -> None:
    """Add the hood's panel on the body between two z, following its profile."""
    rows = [z for z, _ in stance.profile if ends[0] < z < ends[1]]
    rings = []
    for z in [ends[0], *rows, ends[1]]:
        w, y = 0.76 * stance.half_width(z), stance.top(z)
        rings.append([(-w, y - 0.02, z), (-w, y + 0.012, z), (w, y + 0.012, z), (w, y - 0.02, z)])
    b.loft("hood", paint, rings)


def face(b: Builder, rng: np.random.Generator, stance: Stance, paint: Material) -> None:
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
            center = np.array([side * (0.93 * half - size[0] / 2 - 0.02), y, z])
            material = LAMP if end < 0 else RED
            if shape == "round":
                b.ellipsoid("light", material, center, (size[0] / 2, size[1] / 2, 0.04), 14)
            else:
                b.rounded_box("light", material, center, (*size, 0.06), 0.025)
        low = stance.clearance + 0.2 * tall
        box = (1.98 * half, 0.22 * tall, 0.16)
        b.rounded_box("trim", bumper, (0, low, z - end * 0.03), box, 0.07)
        b.box("trim", LAMP, (0, low + 0.02, z + end * 0.052), (0.42, 0.09, 0.012))
    _grille(b, rng, stance)


def _grille(b: Builder, rng: np.random.Generator, stance: Stance) -> None:
    """Add a grille of a few bars between the headlights."""
    z = -stance.length / 2
    half, tall = stance.half_width(z), stance.top(z) - stance.clearance
    y, high, wide = stance.clearance + 0.62 * tall, 0.3 * tall, half * rng.uniform(0.5, 1.0)
    b.box("trim", BLACK, (0, y, z), (wide, high, 0.03))
    bars = int(rng.integers(1, 5))
    for t in (np.arange(bars) + 0.5) / bars - 0.5:
        b.box("trim", CHROME, (0, y + t * high, z - 0.015), (wide, 0.12 * high, 0.015))


def doors(b: Builder, stance: Stance, seams: Sequence[float], belt: float) -> None:
    """Add the doors' vertical seams at each z of `seams`, a handle behind each but the last."""
    low, rows = stance.clearance + 0.1, sorted(seams)
    for side in (-1, 1):
        for i, z in enumerate(rows):
            bottom = max(low, stance.lower(z) + 0.02)
            top = stance.clearance + 0.72 * (belt - stance.clearance)
            if top - bottom < 0.1:
                continue
            x = side * (stance.half_width(z) - 0.012)
            b.box("body", BLACK, (x, (bottom + top) / 2, z), (0.026, top - bottom, 0.012))
            if i:
                handle = (side * (stance.half_width(z) + 0.002), top - 0.04, z - 0.14)
                b.box("trim", CHROME, handle, (0.03, 0.025, 0.14))


def mirrors(b: Builder, paint: Material, foot: Array) -> None:
    """Add two mirrors beside `foot`, the lower end of the right front pillar."""
    for side in (-1, 1):
        root = foot * np.array([side, 1, 1])
        head = root + np.array([0.12 * side, 0.08, -0.02])
        b.cylinder("trim", BLACK, root, head, 0.018, segments=8)
        b.rounded_box("trim", paint, head, (0.16, 0.11, 0.08), 0.035, segments=2)


def walls(
    b: Builder,
    paint: Material,
    stance: Stance,
    ends: tuple[float, float],
    span: tuple[float, float],
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
            rings.append(
                [
                    (inner, low, z),
                    (outer, low, z),
                    (outer, high - 0.03, z),
                    (outer - 0.2 * side * thickness, high, z),
                    (inner, high, z),
                ]
            )
        b.loft("body", paint, rings)
    for z, wall, shift in zip(ends, closed, (0.5, -0.5), strict=True):
        if wall:
            size = (1.9 * stance.half_width(z), high - low, thickness)
            b.box("body", paint, (0, (low + high) / 2, z + shift * thickness), size)
