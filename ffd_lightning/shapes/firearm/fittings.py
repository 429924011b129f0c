"""Triggers, sights, and what else is mounted."""

import numpy as np

from ffd_lightning.shapes.firearm.plan import BLACK, IRON, Plan, at, bar, block, sweep
from ffd_lightning.shapes.kit import Builder, Component, Rng, nothing
from ffd_lightning.shapes.kit.paths import bend


def add_trigger(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a trigger and its guard, a strap below the body."""
    back, drop, top = p.hold + 0.42 * p.palm, rng.uniform(0.032, 0.042), p.low + 0.004
    front = min(back + rng.uniform(0.05, 0.075), p.length - 0.006)
    loop = [(back, top), (back, top - drop), (front - 0.2 * drop, top - drop), (front, top)]
    sweep(b, "trigger", p.steel, bend(loop, 0.5 * drop, 4), 0.09 * drop, 0.013)
    blade = np.array([(0, -0.2), (-0.02, 0.3), (0.12, 0.7)]) * (drop, -drop)
    path = bend(blade + (back + 0.42 * (front - back), top), 0.3 * drop, 3)
    sweep(b, "trigger", p.steel, path, 0.09 * drop, 0.008)


def iron(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a notch at the rear and a blade or post at the front."""
    small, wide = p.kind in ("pistol", "revolver"), 0.003
    tall = rng.uniform(0.005, 0.011) if small else rng.uniform(0.012, 0.024)
    rear = 0.012 + 0.06 * p.length
    for side in (-0.6, 0.6):
        center = at(rear + 0.5 * tall, p.high + 0.3 * tall, side * tall)
        b.box("sight", BLACK, center, (0.6 * tall, 1.2 * tall, 0.9 * tall))
    front, top = p.end - 0.008, max(p.high, p.bore) + 0.8 * tall
    rows = [(front - 2.2 * tall, 0, 0.6 * top, wide), (front - 0.6 * tall, 0, top, wide)]
    bar(b, "sight", IRON, [*rows, (front, 0, top, wide)], boxiness=0.95)


def bead(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a bead near the muzzle."""
    b.ellipsoid("sight", BLACK, at(p.end - 0.015, p.bore), (0.004, 0.006, 0.004), segments=8)


def scope(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a telescopic sight on two rings."""
    length, radius, middle = rng.uniform(0.18, 0.4), rng.uniform(0.013, 0.022), 0.5 * p.length
    if p.kind == "revolver":
        length, radius, middle = 0.15, 0.011, 0.6 * p.length
    bell, eye, up = *rng.uniform(1.15, 1.9, 2), p.high + radius * rng.uniform(1.5, 2.6)
    stations = np.array([-0.5, -0.28, -0.2, 0.2, 0.3, 0.5]) * length + middle
    radii = radius * np.array([eye, eye, 1, 1, bell, bell])
    b.tube("sight", IRON, [at(f, up) for f in stations], list(radii), segments=14)
    for f, r in ((stations[0], eye), (stations[-1], bell)):
        b.cylinder("sight", BLACK, at(f - 0.003, up), at(f + 0.003, up), 0.85 * r * radius)
    for f in (middle - 0.14 * length, middle + 0.14 * length):
        block(b, "sight", IRON, (f - 0.011, f + 0.011), (0, up), 0.02)
        b.cylinder("sight", IRON, at(f - 0.012, up), at(f + 0.012, up), 1.2 * radius)
    for knob in (at(middle, up + 1.9 * radius), at(middle, up, 1.9 * radius)):
        b.cylinder("sight", IRON, at(middle, up), knob, 0.7 * radius)


def dot(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a short tube on a toothed rail along the body, or on a pistol's rear."""
    middle, radius = 0.5 * p.length, rng.uniform(0.016, 0.026)
    if p.kind == "pistol":
        middle, radius = 0.2 * p.length, 0.011
    else:
        block(b, "sight", IRON, (0.04, p.length), (p.high - 0.004, p.high + 0.008), 0.018)
        for f in np.arange(0.05, p.length - 0.005, 0.03):
            b.box("sight", IRON, at(f, p.high + 0.009), (0.022, 0.01, 0.014))
    ends, up = (middle - 1.8 * radius, middle + 1.8 * radius), p.high + 1.6 * radius
    block(b, "sight", IRON, ends, (p.high - 0.004, up), 1.4 * radius)
    b.cylinder("sight", BLACK, at(ends[0], up), at(ends[1], up), radius)


def carrier(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a carrying handle with the sight in it, and a post at the front."""
    rise, front, f = rng.uniform(0.035, 0.075), rng.uniform(0.55, 0.95) * p.length, p.end - 0.04
    loop = [(0.02, p.high - 0.01), (0.025, p.high + rise)]
    loop += [(front - 0.03, p.high + rise), (front, p.high - 0.01)]
    sweep(b, "sight", p.steel, bend(loop, 0.02, 3), depth=0.016, width=0.02)
    post = [(f, -0.018, p.high + 0.4 * rise, 0.012), (f + 0.02, -0.018, p.high, 0.012)]
    bar(b, "sight", p.steel, post)


def bipod(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two splayed legs with feet and their collar on the barrel."""
    drop, splay, rake = rng.uniform((0.15, 0.06, -0.06), (0.3, 0.15, 0.08))
    f = max(p.guard + 0.01, p.end - rng.uniform(0.06, 0.2))
    b.cylinder("stock", p.steel, at(f - 0.02, 0), at(f + 0.02, 0), 1.5 * p.bore)
    for side in (-1, 1):
        hip, foot = at(f, -0.01, 0.012 * side), at(f + rake, -drop, splay * side)
        b.cylinder("stock", p.steel, hip, foot, radius=0.009, radius_end=0.007, segments=10)
        b.ellipsoid("stock", p.steel, foot, (0.018, 0.009, 0.02), segments=10)


def foregrip(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a second grip below the front."""
    f, long, slant = rng.uniform((0.02, -0.13, -0.02), (0.05, -0.1, 0.03))
    path = np.outer([0.0, 0.2, 0.7, 1.0], [slant, long]) + (p.length + f, -0.008)
    sweep(b, "grip", p.hand, path, [0.034, 0.03, 0.036, 0.034], 0.03)


def light(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a lamp below a pistol's front."""
    front = max(p.length, p.hold + 0.42 * p.palm + 0.12) - rng.uniform(0.0, 0.01)
    block(b, "sight", BLACK, (front - 0.045, front), (p.low - 0.02, -0.5 * p.high), 0.024, 0.7)


def loop(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a handle to carry it by, over the front of the body."""
    hold, rise = p.length - 0.02, p.high + rng.uniform(0.03, 0.06)
    path = [at(hold, 0), at(hold, rise), at(hold - 0.11, rise + 0.01)]
    b.tube("body", p.hand, bend(path, 0.02, 3), 0.01, segments=10)


_BELOW = {"feed": ("straight", "curved", "short", "drum", "box", "grip", "none")}
_LIGHT = ("service", "compact", "machine_pistol", "bullpup", "support")
SIGHTS = (
    Component("iron", 1.6, iron, {"barrel": ("bare", "lug", "guard", "jacket", "lever")}),
    Component("bead", 1.4, bead, {"barrel": ("pump", "side", "over")}),
    Component("scope", 1.2, scope, {"kind": ("service", "bullpup", "bolt")}),
    Component("scope", 0.2, scope, {"kind": ("revolver", "hunting")}),
    Component("dot", 0.8, dot, {"kind": _LIGHT, **_BELOW}),
    Component("dot", 0.3, dot, {"body": ("slide",)}),
    Component("carrier", 0.9, carrier, {"kind": ("service", "bullpup")}),
)
EXTRAS = (
    Component("none", 2, nothing),
    Component("bipod", 5, bipod, {"kind": ("support",)}),
    Component("bipod", 0.3, bipod, {"kind": ("service", "bolt")}),
    Component("foregrip", 0.7, foregrip, {"barrel": ("guard",), "kind": ("service", "compact")}),
    Component("light", 0.4, light, {"body": ("slide",)}),
    Component("loop", 1.5, loop, {"kind": ("support",), "sight": ("iron",), **_BELOW}),
)
