"""Fuselages of aeroplanes, and their cockpits and cabins."""

import itertools

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import Pair, vec
from ffd_lightning.shapes.plane.plan import BLACK, GLASS, Plan, skin

Rows = tuple[tuple[float, float, float, float], ...]
"""Sections: (z, lift as a share of `tall`, width of `wide`, height of `tall`)."""
_SLIM: Rows = (
    (-0.5, -0.1, 0.04, 0.04), (-0.42, -0.07, 0.4, 0.45), (-0.34, -0.02, 0.74, 0.8),
    (-0.2, 0, 0.92, 1), (-0.04, 0, 1, 0.9), (0.24, 0, 1, 0.82), (0.42, 0, 0.85, 0.65),
)  # fmt: skip
_BROAD = tuple((z, y, (1 if z < -0.1 else 1.6) * wide, tall) for z, y, wide, tall in _SLIM)
_BARREL: Rows = (
    (-0.5, 0, 0.62, 0.62), (-0.47, 0, 0.7, 0.7), (-0.25, 0, 0.95, 0.95), (0, 0, 1, 1),
    (0.2, 0, 0.9, 0.92), (0.43, 0.02, 0.6, 0.65),
)  # fmt: skip
_COWLED: Rows = (
    (-0.5, 0, 0.6, 0.52), (-0.487, 0, 0.75, 0.68), (-0.36, 0, 0.82, 0.76), (-0.2, 0, 1, 0.92),
    (0.04, 0.02, 1, 0.95), (0.22, 0.08, 0.72, 0.66), (0.46, 0.2, 0.26, 0.32), (0.5, 0.2, 0.1, 0.16),
)  # fmt: skip
_INLINE = ((-0.5, 0, 0.42, 0.4), (-0.487, 0, 0.5, 0.5), (-0.36, 0, 0.76, 0.76), *_COWLED[3:])
_RADIAL = ((-0.5, 0, 0.9, 0.85), (-0.487, 0, 0.98, 0.92), (-0.36, 0, 1, 0.95), *_COWLED[3:])
_SAILPLANE: Rows = (
    (-0.5, -0.2, 0.06, 0.06), (-0.47, -0.18, 0.45, 0.42), (-0.38, -0.1, 0.85, 0.8),
    (-0.25, 0, 1, 1), (-0.1, 0.06, 0.85, 0.85), (0.05, 0.18, 0.36, 0.34), (0.5, 0.2, 0.2, 0.2),
)  # fmt: skip
_POD: Rows = (
    (-0.5, -0.12, 0.05, 0.05), (-0.48, -0.1, 0.35, 0.32), (-0.4, -0.05, 0.72, 0.66),
    (-0.26, 0, 1, 0.95), (-0.05, 0, 1, 1), (0.07, 0.05, 0.7, 0.7), (0.14, 0.06, 0.42, 0.42),
)  # fmt: skip
_CENTRE: Rows = (
    (-0.43, 0, 0.1, 0.1), (-0.35, 0.1, 0.4, 0.5), (-0.22, 0.15, 0.85, 1), (-0.1, 0.1, 1, 0.95),
    (0.05, 0, 0.5, 0.3), (0.12, 0, 0.3, 0.06),
)  # fmt: skip


def formed(b: Builder, rng: Rng, p: Plan, rows: Rows, box: float = 0.2) -> list[Section]:
    """Add a fuselage through given sections, each a little larger or smaller, sooner or later."""
    sections = []
    for z, lift, wide, tall in rows:
        early = rng.uniform(-0.03, 0.03) * (-0.47 < z < 0.44)
        grow = rng.uniform(0.9, 1.1, 2) * (p.wide, p.tall)
        sections.append(Section(z + early, lift * p.tall, wide * grow[0], tall * grow[1]))
    skin(b, "body", p.paint, sections, rng.uniform(0, box))
    return sections


def tube(
    b: Builder,
    rng: Rng,
    p: Plan,
    nose: Pair = (0.9, 1.8),
    up: Pair = (0, 0.4),
    box: Pair = (0, 0.1),
) -> list[Section]:
    """Add a transport's fuselage: `nose` is its length per width, `up` the rise of its tail."""
    long, tail, droop = p.wide * rng.uniform(*nose), rng.uniform(0.22, 0.42), rng.uniform(0.05, 0.2)
    rows, rise = [], p.wide * rng.uniform(*up)
    for angle in (0.01, 0.1, 0.3, 0.6, 1.0, np.pi / 2):
        s = np.sin(angle) ** 0.7
        z, lift = long * (1 - np.cos(angle)) - 0.5, droop * p.tall * (s - 1)
        rows.append(Section(z, lift, s * p.wide, s * p.tall))
    for t in np.array([0.0, 0.35, 0.7, 0.92, 1.0]):
        s = 1 - 0.86 * t**1.5
        rows.append(Section(0.5 - tail * (1 - t), rise * t**1.5, s * p.wide, s * p.tall))
    skin(b, "body", p.paint, rows, rng.uniform(*box))
    return rows


def hump(b: Builder, rng: Rng, p: Plan) -> list[Section]:
    """Add a transport's fuselage with an upper deck behind the nose."""
    rows, end = tube(b, rng, p), rng.uniform(-0.2, 0.05)
    start, w, h = -0.5 + 0.75 * p.wide, 0.74 * p.wide, 0.62 * p.tall
    deck = [(start, 0.5), (start + 0.05, 0.9), (start + 0.1, 1), (end - 0.08, 1), (end, 0.55)]
    skin(b, "body", p.paint, [Section(z, (0.1 + 0.22 * s) * p.tall, s * w, s * h) for z, s in deck])
    return rows


FUSELAGES = (
    Component("tube", 8, tube, {"role": ("airliner",)}),
    Component("decks", 0.6, tube, {"role": ("airliner",)}),
    Component("hump", 0.8, hump, {"role": ("airliner",)}),
    Component.of("cargo", 0.7, tube, {"role": ("airliner", "propliner")},
                 up=(0.4, 0.75), box=(0.2, 0.5)),
    Component.of("short", 1.4, tube, {"role": ("propliner",)}, box=(0, 0.35)),
    Component.of("sleek", 1, tube, {"role": ("business",)}, nose=(1.4, 2.4)),
    Component.of("needle", 1, tube, {"role": ("supersonic",)}, nose=(3.5, 5)),
    Component.of("slim", 1, formed, {"role": ("fighter",)}, rows=_SLIM, box=0.4),
    Component.of("broad", 1, formed, {"role": ("fighter",)}, rows=_BROAD, box=0.5),
    Component.of("barrel", 0.5, formed, {"role": ("fighter",)}, rows=_BARREL),
    Component.of("cowled", 1, formed, {"role": ("light",)}, rows=_COWLED, box=0.5),
    Component.of("inline", 1, formed, {"role": ("warbird",)}, rows=_INLINE),
    Component.of("radial", 0.8, formed, {"role": ("warbird", "light")}, rows=_RADIAL),
    Component.of("pod", 0.2, formed, {"role": ("light", "fighter", "warbird")}, rows=_POD),
    Component.of("sailplane", 1, formed, {"role": ("glider",)}, rows=_SAILPLANE),
    Component.of("centre", 1, formed, {"role": ("flying",)}, rows=_CENTRE),
)  # fmt: skip


def cabin(
    b: Builder, rng: Rng, p: Plan, count: tuple[int, int], ups: tuple[float, ...] = (0.2,)
) -> None:
    """Add a transport's windscreen and rows of windows at the shares `ups` of its half-height."""
    start, angles = -0.5 + 0.38 * p.wide, np.radians(np.linspace(16, 84, 6))
    for side in (-1, 1):
        rings = []
        for z in np.linspace(start, start + 0.32 * p.wide, 4):
            cut, arc = p.at(z), np.stack([np.cos(angles), np.sin(angles)], 1)
            arc = np.concatenate([1.03 * arc, 0.9 * arc[::-1]]) * [side * cut.width, cut.height] / 2
            rings.append(np.column_stack([arc[:, 0], cut.lift + arc[:, 1], np.full(12, z)]))
        b.loft("window", GLASS, rings)
    ends = (-0.5 + 2 * p.wide, rng.uniform(0.15, 0.26))
    tall = 0.16 * p.wide if count[1] < 15 else 0.016
    places = np.linspace(*ends, int(rng.integers(*count)))
    for z, up, side in itertools.product(places, ups, (-1, 1)):
        x = side * (p.half(z) * np.sqrt(1 - up**2) - 0.001)
        b.box("window", GLASS, (x, p.height(z, up), z), (0.006, tall, 0.6 * tall))
    for side in (-1, 1) if rng.random() < 0.5 else ():
        middle = (side * 0.495 * p.wide, -0.12 * p.tall, sum(ends) / 2)
        b.box("body", p.accent, middle, (0.01, 0.12 * p.tall, ends[1] - ends[0]))


def bubble(b: Builder, rng: Rng, p: Plan, long: Pair = (0.17, 0.3)) -> None:
    """Add a canopy with a few frames."""
    t, z = np.linspace(0, 1, 9), np.linspace(p.seat, p.seat + rng.uniform(*long), 9)
    wide, rise = 1.3 * p.half(float(z[3])), rng.uniform(0.15, 0.4) * p.wide
    swell = np.sqrt(np.clip(1 - (2 * t ** rng.uniform(0.65, 0.9) - 1) ** 2, 0.02, 1))
    sizes = zip(z, (0.25 + 0.75 * swell) * wide, 0.6 * wide + 2 * rise * swell, strict=True)
    sections = [Section(at, p.height(at, 1) - 0.3 * wide, w, tall) for at, w, tall in sizes]
    skin(b, "window", GLASS, sections, 0.1)
    for i in (2, 4):
        rings = [sections[i]._replace(z=z[i] + d).ring(0.1, grow=1.02) for d in (-0.004, 0.004)]
        b.loft("body", p.paint, rings)


def cab(b: Builder, rng: Rng, p: Plan) -> None:
    """Add an upright cabin with glass all around: up to a high wing, or with a roof of its own."""
    high = p.level > 0
    front, half, low = p.lead if high else p.seat, 0.46 * p.wide, p.height(p.seat, 0.4)
    long = rng.uniform(0.6, 0.9) * p.root if high else rng.uniform(0.15, 0.26)
    top = p.level if high else p.height(front, 1) + rng.uniform(0.2, 0.4) * p.tall
    places = [(front - 0.09, low, half), (front, top, half), (front + long, top, half)]
    places.append((front + long + 0.14, low, 0.55 * half))
    y = low - 0.03
    rings = [[(-w, y, z), (-0.9 * w, h, z), (0.9 * w, h, z), (w, y, z)] for z, h, w in places]
    b.loft("window", GLASS, rings)
    for z in (front, front + long / 2, front + long):
        for side in (-1, 1):
            foot, head = (side * 1.02 * half, low - 0.02, z), (side * 0.92 * half, top, z)
            b.cylinder("body", p.paint, foot, head, 0.008, segments=6)
    roof = (0, top, front + long / 2), (1.88 * half, 0.02, long + 0.03)
    b.rounded_box("body", p.paint, *roof, 0.02, segments=2)


def seats(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one or two open seats with small windscreens."""
    for z in np.linspace(p.seat + 0.06, p.seat + 0.22, int(rng.integers(1, 3))):
        top, radii = vec(0, p.height(z, 1), z), (0.33 * p.wide, 0.015, 0.05)
        b.ellipsoid("window", BLACK, top - vec(0, 0.004, 0), radii, segments=14)
        b.box("window", GLASS, top + vec(0, 0.015, -0.045), (0.3 * p.wide, 0.04, 0.006))


_LIGHT = {"role": ("light",), "mount": ("low", "high")}
COCKPITS = (
    Component.of("rows", 1, cabin, {"fuselage": ("tube", "hump", "needle")}, count=(14, 32)),
    Component.of("decks", 1, cabin, {"fuselage": ("decks",)}, count=(20, 34), ups=(-0.15, 0.42)),
    Component.of("few", 1, cabin, {"fuselage": ("cargo", "short", "sleek")}, count=(3, 13)),
    Component("bubble", 1, bubble, {"role": ("fighter", "warbird", "glider", "flying")}),
    Component.of("long", 1, bubble, _LIGHT, long=(0.28, 0.42)),
    Component("cab", 1.5, cab, {"mount": ("raised", "low"), "fuselage": ("cowled",)}),
    Component("seats", 1, seats, {"mount": ("parasol", "stack")}),
)
