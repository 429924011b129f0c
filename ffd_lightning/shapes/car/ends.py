"""The ends of cars: how bonnet and tail run, lights, grilles and bumpers."""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.car.cabins import Cabin, cockpit_floor
from ffd_lightning.shapes.car.plan import BLACK, CHROME, LAMP, RED, Plan
from ffd_lightning.shapes.kit import Builder, Component, Rng
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import Pair, lean, vec


def nose(rng: Rng, p: Plan, c: Cabin, spans: Sequence[Pair], hump: float) -> Plan:
    """Set the line of the bonnet; `hump` arches it. Heights are shares of the belt's."""
    low, wide, rounding = (rng.uniform(*span) for span in spans)
    half, cowl = p.length / 2, c.feet[0]
    room = cowl + half
    front, step = p.belt * low, min(rounding, 0.5 * room)
    rows = [(-half, front - min(0.8 * step, 0.35 * (front - p.clearance))), (step - half, front)]
    at, floor = max(p.axles[0] - 0.8 * p.arch, step + 0.02 - half), p.least - 0.02
    if at < cowl - 0.1:
        straight = front + (p.belt - front) * (at + half - step) / (room - step)
        rows += [(at, min(p.belt, max(floor, straight + hump * (p.belt - straight))))]
    ends = (p.ends[0] if p.taper < 0.3 else wide, p.ends[1])
    return replace(p, ends=ends, line=(*rows, (cowl, p.belt)))


def tail(rng: Rng, p: Plan, c: Cabin, spans: Sequence[Pair], flat: bool) -> Plan:
    """Set the line behind the cabin; `flat` is for beds. Heights are shares of the belt's."""
    rise, wide, rounding = (rng.uniform(*span) for span in spans)
    half, foot, high = p.length / 2, c.feet[1], max(p.belt * rise, p.least - 0.1)
    ends, line = (p.ends[0], p.ends[1] if p.taper < 0.3 else wide), list(p.line)
    if not c.glass:  # an open car
        line += [(z, cockpit_floor(p)) for z in (c.feet[0] + 0.01, foot - 0.01)]
    if flat:
        line += [(foot + 0.02, p.belt), (foot + 0.03, p.least), (half, p.least)]
        return replace(p, ends=ends, line=tuple(line))
    line += [(foot, p.belt)]
    step = min(rounding, 0.6 * (half - foot))
    at = min(p.axles[-1] + 0.8 * p.arch, half - step - 0.02)
    if at > foot + 0.1:
        straight = p.belt + (high - p.belt) * (at - foot) / (half - step - foot)
        line += [(at, max(straight, p.least - 0.02))]
    line += [(half - step, high), (half, high - min(0.8 * step, 0.35 * (high - p.clearance)))]
    path = bend([(0, y, z) for z, y in line], 0.1, 3)
    return replace(p, ends=ends, line=tuple((z, y) for _, y, z in path))


_MODERN = ("city", "compact", "family", "large", "sports", "suv", "van", "pickup")
_TALL = ("compact", "family", "large", "suv", "pickup", "vintage", "lorry")
_NOSES = (  # name, weight, uses; ranges of the front's height and width and of its rounding; hump
    ("wedge", 2, (*_MODERN[:5], "van"), (0.55, 0.78), (0.72, 0.92), (0.06, 0.2), 0.0),
    ("level", 2, _TALL, (0.84, 0.99), (0.88, 0.98), (0.02, 0.08), 0.0),
    ("domed", 2, _MODERN, (0.68, 0.86), (0.62, 0.84), (0.12, 0.4), 0.6),
    ("blunt", 1, ("city", "compact", "suv", "van", "pickup"), (0.86, 0.97), (0.8, 0.92),
     (0.08, 0.2), 0.0),
    ("bluff", 1, ("lorry", "bus"), (0.96, 0.99), (0.92, 0.98), (0.01, 0.03), 0.0),
)  # fmt: skip
_DECKED = ("notchback", "coupe", "open", "fastback")
_FULL = ("hatch", "estate", "box", "minivan", "windows", "panel", "coach", "double")
_TAILS = (  # name, weight, cabins; ranges of the end's height and width and of its rounding
    ("boot", 2, _DECKED, (0.92, 1.03), (0.84, 0.96), (0.03, 0.1)),
    ("drop", 1, (*_DECKED, "arch"), (0.7, 0.9), (0.62, 0.86), (0.1, 0.35)),
    ("duck", 0.7, ("notchback", "coupe", "fastback"), (1.03, 1.12), (0.82, 0.94), (0.02, 0.06)),
    ("hatch", 1, _FULL, (0.96, 1.0), (0.84, 0.98), (0.01, 0.06)),
    ("flat", 1, ("cab", "crew", "cabover"), (1, 1), (0.94, 1), (0.01, 0.02)),
)
NOSES = tuple(
    Component.of(name, weight, nose, {"use": uses}, spans=spans, hump=hump)
    for name, weight, uses, *spans, hump in _NOSES
)
TAILS = tuple(
    Component.of(name, weight, tail, {"cabin": cabins}, spans=spans, flat=name == "flat")
    for name, weight, cabins, *spans in _TAILS
)


def face(b: Builder, rng: Rng, p: Plan, lamps: Pair, pairs: int = 1) -> None:
    """Add lights (round ones if as wide as tall), grille, number plates, bumpers to both ends."""
    bumper = CHROME if rng.random() < 0.25 else (BLACK if rng.random() < 0.4 else p.paint)
    level, tall_bumper = rng.uniform(0.68, 0.76), rng.uniform(0.16, 0.3)
    for end in (-1, 1):
        z = end * p.length / 2
        half, low, material = p.half(z), p.lower(z), LAMP if end < 0 else RED
        tall = p.top(z) - low
        size = (min(lamps[0], 0.9 * half / pairs), min(lamps[1], 0.42 * tall))
        size = (min(size),) * 2 if lamps[0] == lamps[1] else size
        for side, i in itertools.product((-1, 1), range(pairs)):
            at = (side * (0.93 * half - (i + 0.5) * size[0] - 0.02), low + level * tall, z)
            if lamps[0] == lamps[1]:
                b.ellipsoid("light", material, at, (size[0] / 2, size[1] / 2, 0.045), segments=10)
            else:
                b.rounded_box("light", material, at, (*size, 0.06), 0.025, segments=1)
        height, box = low + 0.2 * tall, (1.98 * half, tall_bumper * tall, 0.16)
        b.rounded_box("trim", bumper, (0, height, z - end * 0.03), box, 0.07, segments=2)
        b.box("trim", LAMP, (0, height + 0.02, z + end * 0.052), (0.42, 0.09, 0.012))
    _grille(b, rng, p, 0.92 * p.half(z) - pairs * size[0])


def _grille(b: Builder, rng: Rng, p: Plan, half: float) -> None:
    """Add a grille of a few bars within `half` from the middle."""
    z = -p.length / 2
    tall = p.top(z) - p.lower(z)
    y, high = p.lower(z) + 0.62 * tall, rng.uniform(0.15, 0.36) * tall
    wide = 2 * half * rng.uniform(0.4, 0.95)
    if wide < 0.15:
        return
    b.box("trim", BLACK, (0, y, z), (wide, high, 0.03))
    bars = int(rng.integers(0, 5))
    for t in (np.arange(bars) + 0.5) / max(bars, 1) - 0.5:
        b.box("trim", CHROME, (0, y + t * high, z - 0.015), (wide, 0.1 * high, 0.015))


def radiator(b: Builder, rng: Rng, p: Plan) -> None:
    """Add an upright radiator, headlamps on a bar, rear lamps and a bumper."""
    z = -p.length / 2
    wide, high = 2 * p.half(z) * rng.uniform(1.0, 1.06), p.top(z + 0.1) - 0.36
    y = 0.36 + high / 2
    b.rounded_box("trim", CHROME, (0, y, z), (wide, high, 0.14), radius=0.05, edge=0.04)
    b.box("trim", BLACK, (0, y - 0.01, z - 0.07), (0.82 * wide, 0.84 * high, 0.02))
    for x in np.linspace(-0.4, 0.4, 7):
        b.box("trim", CHROME, (x * wide, y - 0.01, z - 0.082), (0.02, 0.82 * high, 0.012))
    size, lamp = rng.uniform(0.09, 0.14), p.belt - rng.uniform(0.2, 0.35)
    apart = 0.5 * wide + 1.2 * size
    b.cylinder("trim", CHROME, (-apart, lamp, z + 0.05), (apart, lamp, z + 0.05), 0.022)
    for side in (-apart, apart):
        bowl = [(0.02, 0.9), (0.7, 0.6), (1, -0.4), (1, -0.6)]
        hub = vec(side, lamp, z + 0.05)
        b.lathe("trim", CHROME, np.array(bowl) * size, hub, segments=16, turn=lean(90))
        glass = hub - vec(0, 0, 0.55 * size)
        b.ellipsoid("light", LAMP, glass, (0.94 * size, 0.94 * size, 0.05), segments=14)
        rear = vec(np.sign(side) * 0.8 * p.half(-z), 0.62 * p.belt, -z)
        b.ellipsoid("light", RED, rear, (0.05, 0.05, 0.05), segments=10)
    if rng.random() < 0.6:
        left, right = (vec(x * p.track, 0.42, z - 0.33) for x in (-0.46, 0.46))
        b.cylinder("trim", CHROME, left, right, 0.04, segments=8)
        for x in (-0.3 * wide, 0.3 * wide):
            b.cylinder("trim", CHROME, (x, 0.42, z - 0.33), (x, 0.42, z + 0.1), 0.025, segments=8)


_FACED = {"use": (*_MODERN, "lorry", "bus")}
FACES = (
    Component.of("round", 1, face, _FACED, lamps=(0.2, 0.2)),
    Component.of("twin", 0.5, face, _FACED, lamps=(0.15, 0.15), pairs=2),
    Component.of("wide", 1.5, face, _FACED, lamps=(0.36, 0.11)),
    Component.of("narrow", 1, face, _FACED, lamps=(0.42, 0.06)),
    Component.of("tall", 0.8, face, _FACED, lamps=(0.14, 0.24)),
    Component("radiator", 1, radiator, {"use": ("vintage",)}),
    Component("none", 1, radiator, {"use": ("racer",)}),
)
