"""Bodies of firearms, barrels and what surrounds them, muzzles."""

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.firearm.plan import BLACK, Plan, at, bar, block, sweep
from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, draw, nothing
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import Pair


def _hammer(b: Builder, p: Plan, forward: float, up: float, size: float) -> None:
    """Add a spur hammer that leans back from (forward, up)."""
    path = np.array([(0.3, -0.5), (0, 0.4), (-0.25, 0.9), (-0.8, 1.0)]) * size + (forward, up)
    sweep(b, "trigger", p.steel, path, depth=0.35 * size, width=0.45 * size)


def slide(b: Builder, rng: Rng, p: Plan, opened: bool) -> None:
    """Add a frame with a slide, or with a short bolt behind a barrel that stands free."""
    high, wide, nose = p.high, p.wide, rng.uniform(0.0, 0.7) * p.high
    back = p.length * (rng.uniform(0.5, 0.65) if opened else 1)
    rows = [(0, -high, high, wide), (0.8 * back, -high, high, wide)]
    bar(b, "body", p.steel, [*rows, (back, nose - high, high - 0.3 * nose, 0.9 * wide)], 0.8)
    if opened:
        for side in (-0.64, 0.64):
            knob = at(0.3 * back, 0.5 * high), at(0.3 * back, 0.5 * high, side * wide)
            b.cylinder("body", p.steel, *knob, 0.5 * high)
    else:
        for f in np.linspace(0.009, rng.uniform(0.026, 0.045), int(rng.integers(4, 8))):
            b.box("body", BLACK, at(f, 0), (1.02 * wide, 1.4 * high, 0.002))
        port = at(0.52 * p.length, 0.6 * high, 0.2 * wide)
        b.box("body", BLACK, port, (0.64 * wide, 0.85 * high, 0.04))
    front, seam = max(rng.uniform(0.6, 0.99) * back, p.hold + 0.42 * p.palm + 0.08), -0.75 * high
    rows = [(-0.015, seam - 0.004, seam + 0.003, 0.6 * wide), (0.007, p.low, seam + 0.004, wide)]
    rows += [(0.6 * front, p.low, seam, wide), (front, p.low + 0.007, seam, wide)]
    bar(b, "body", p.body, rows, boxiness=0.85)
    if rng.random() < 0.5:
        _hammer(b, p, -0.002, -0.2 * high, rng.uniform(0.015, 0.022))


def revolver(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a frame around a fluted cylinder, and a hammer."""
    back, front, strap = 0.028, p.length - 0.014, 0.45 * p.high
    rear, full = (0, 0.75 * p.low, -0.2 * p.high, 0.7 * p.wide), (p.low, p.high, p.wide)
    bar(b, "body", p.steel, [rear, (0.011, *full), (back, *full)])
    tip = (p.length, 0.5 * p.low, max(p.high, p.bore), p.wide)
    bar(b, "body", p.steel, [(front, *full), tip])
    for heights in ((p.low, 0.86 * p.low), (strap, p.high)):
        block(b, "body", p.steel, (back - 0.004, front + 0.004), heights, 0.8 * p.wide)
    _hammer(b, p, 0.006, 0.3 * p.high, rng.uniform(0.019, 0.027))
    radius, up = 0.42 * (p.high - 2 * p.low) / 2, 0.42 * (p.high + 2 * p.low) / 2
    a, rings = 2 * np.pi * np.arange(48) / 48, []
    flute = rng.uniform(0.1, 0.2) * np.maximum(0, np.cos(int(rng.integers(5, 8)) * a)) ** 2
    for t, groove in ((0.02, 0), (0.35, 0), (0.98, 1)):
        r, f = radius * (1 - groove * flute), back + t * (front - back)
        rings.append(np.column_stack([r * np.cos(a), up + r * np.sin(a), np.full(48, -f)]))
    b.loft("magazine", p.steel, rings)


def receiver(b: Builder, rng: Rng, p: Plan, boxiness: float) -> None:
    """Add a receiver, of one piece or of two halves, with a port and a cocking handle."""
    low, high, wide, seam = p.low, p.high, p.wide, 0.35 * p.low
    nose, front = rng.uniform(-0.3, 0.5) * low, rng.uniform(0.5, 0.9) * p.length
    if boxiness and rng.random() < 0.6:  # a long upper and a shorter lower half
        front, top = max(front, min(p.well + 0.045, p.length)), seam + 0.004
        rows = [(0.01, 0.6 * low, top, 0.8 * wide), (0.04, low, top, wide)]
        bar(b, "body", p.body, [*rows, (front, low - 0.2 * nose, top, 0.96 * wide)], 0.85)
        low, nose = seam, 0.0
    rows = [(0, low + 0.01, high * rng.uniform(0.6, 1), 0.9 * wide), (0.05, low, high, wide)]
    rows += [(p.length - 0.03, low, high, wide), (p.length, low - nose, high - 0.006, 0.92 * wide)]
    bar(b, "body", p.body, rows, boxiness)
    port = at(0.6 * p.length, 0.45 * high, 0.25 * wide)
    b.box("body", BLACK, port, (0.52 * wide, 0.5 * high, rng.uniform(0.05, 0.08)))
    handle = at(rng.uniform(0.4, 0.8) * p.length, 0.3 * high)
    b.cylinder("body", p.steel, handle, handle + (0.9 * wide, 0, 0), 0.006, segments=10)


def action(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a round action in a stock, with a bolt's handle."""
    rows = ((-0.04, 0.6), (-0.03, 1.0), (p.length - 0.04, 1.0), (p.length, 0.8))
    radii = [p.high * swell for _, swell in rows]
    b.tube("body", p.steel, [at(f, 0.004) for f, _ in rows], radii, segments=14)
    b.box("body", BLACK, at(0.1, 0.6 * p.high, 0.4 * p.high), (0.7 * p.high, 0.7 * p.high, 0.07))
    if rng.random() < 0.75:
        knob = at(-0.01, -0.035, 0.07)
        bolt = bend([at(0.0, 0.008), at(-0.005, 0.0, 0.035), knob], 0.02, 3)
        b.tube("body", p.steel, bolt, 0.006, segments=8)
        b.ellipsoid("body", p.steel, knob, (0.012, 0.012, 0.012), segments=10)


def sides(b: Builder, rng: Rng, p: Plan, levered: bool) -> None:
    """Add a receiver of flat sides; a lever around the hand, and a hammer."""
    rows = [(0, p.low + 0.012, p.high - 0.01, 0.7 * p.wide), (0.03, p.low, p.high, p.wide)]
    front = (p.length, p.low + rng.uniform(0, 0.01), p.high, p.wide)
    bar(b, "body", p.steel, [*rows, front], boxiness=0.65)
    if levered:
        f, drop = p.hold, p.low - rng.uniform(0.045, 0.06)
        path = [(f + 0.1, p.low + 0.01), (f + 0.09, drop), (f - 0.02, drop)]
        path += [(f - 0.1, drop - 0.02), (f - 0.12, p.low - 0.02), (f - 0.03, p.low + 0.01)]
        sweep(b, "body", p.steel, bend(path, 0.03, 3), depth=0.008, width=0.014)
        _hammer(b, p, 0.004, 0.5 * p.high, 0.026)


def _tube(b: Builder, skin: Material, start: float, rows: ArrayLike, place: Pair = (0, 0)) -> None:
    """Add a barrel from `start` through (forward, radius) rows, with a dark bore in its muzzle."""
    stations = np.asarray(rows, float)
    path, r = [at(f, *place) for f in (start, *stations[:, 0])], stations[-1, 1]
    b.tube("barrel", skin, path, [stations[0, 1], *stations[:, 1]], segments=16)
    b.cylinder("barrel", BLACK, path[-1] - at(0.01, 0), path[-1] + at(0.002, 0), 0.6 * r)


def bare(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a barrel, straight or tapered."""
    middle, slim = (p.length + p.end) / 2, rng.uniform(0.75, 1.0) * p.bore
    _tube(b, p.steel, 0.4 * p.length, [(p.length, p.bore), (middle, slim), (p.end, slim)])


def lug(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a barrel with a rod or a lug below it, and perhaps a rib above."""
    back, low = p.length - 0.01, -2.2 * p.bore
    _tube(b, p.steel, back, [(p.end, p.bore)])
    front, rod = p.length + rng.uniform(0.5, 1.0) * (p.end - p.length), rng.random() < 0.35
    if rod:
        b.cylinder("barrel", p.steel, at(back, low), at(front, low), 0.45 * p.bore)
    ends = (front - 0.012 if rod else back, front - 0.002)
    block(b, "barrel", p.steel, ends, (low, 0), (0.4 if rod else 1.1) * p.bore)
    if rng.random() < 0.5:
        block(b, "barrel", p.steel, (back, p.end - 0.002), (0, 1.3 * p.bore), 0.7 * p.bore)


def jacket(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a barrel in a perforated jacket; its holes are dark discs on the surface."""
    bare(b, rng, p)
    front, radius = max(p.guard, p.length + 0.04), rng.uniform(1.7, 2.3) * p.bore
    b.cylinder("barrel", p.steel, at(p.length - 0.01, 0), at(front, 0), radius, segments=16)
    for f in np.arange(p.length + 0.018, front - 0.01, 0.03):
        for a in np.radians([0, 60, 120, 180]):
            rim = radius * np.array([np.cos(a), np.sin(a)])
            inner, outer = at(f, *(0.9 * rim)), at(f, *(1.02 * rim))
            b.cylinder("barrel", BLACK, inner, outer, 0.35 * radius, segments=8)


def _hold(b: Builder, rng: Rng, p: Plan, ends: Pair, up: float, tall: float, wide: float) -> None:
    """Add what the front hand holds around the barrel: plain, ribbed or slotted."""
    (back, front), taper, boxy = ends, rng.uniform(0.7, 1.1), rng.uniform(0.1, 0.9)
    half, slim = tall / 2, taper * tall / 2
    rows = [(back, up - half, up + half, wide), (front, up - slim, up + slim, taper * wide)]
    bar(b, "body", p.hand, rows, boxy)
    style = draw(rng, ["plain", "ribs", "slots"])
    for t in np.linspace(0, 1, int(rng.integers(5, 10)))[1:-1]:
        f, scale = back + t * (front - back), 1 + (taper - 1) * t
        rib, across = 0.54 * scale * tall, 1.08 * scale * wide
        if style == "ribs":
            block(b, "body", p.hand, (f - 0.006, f + 0.006), (up - rib, up + rib), across, boxy)
        elif style == "slots":
            b.box("body", BLACK, at(f, up), (0.945 * across, 0.55 * rib, 0.022))


def guarded(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a barrel in a handguard."""
    bare(b, rng, p)
    ends, tall = (p.length - 0.005, max(p.guard, p.length + 0.05)), rng.uniform(0.042, 0.07)
    _hold(b, rng, p, ends, min(0.0, p.high - 0.55 * tall), tall, rng.uniform(0.8, 1.1) * p.wide)


def split(b: Builder, rng: Rng, p: Plan, offsets: tuple[tuple[int, int], ...], front: str) -> None:
    """Add barrels with (side, up) `offsets` in radii, and a pump or a wedge of wood below them."""
    for side, up in offsets:
        _tube(b, p.steel, 0.4 * p.length, [(p.end, 0.9 * p.bore)], (up * p.bore, side * p.bore))
    low, reach = p.bore * (min(up for _, up in offsets) - 2.05), p.end - p.length
    if front != "wedge":
        full = p.length + rng.uniform(0.75, 0.97) * reach
        b.cylinder("magazine", p.steel, at(p.length - 0.02, low), at(full, low), 0.9 * p.bore)
        ring = (full - 0.02, full - 0.008)
        block(b, "barrel", p.steel, ring, (low - p.bore, p.bore), 2.1 * p.bore, 0.2)
    back, tip = p.length - 0.01, p.length + rng.uniform(0.3, 0.65) * reach
    if front == "pump":
        back += rng.uniform(0.01, 0.2) * reach
        _hold(b, rng, p, (back, tip), low, 3.4 * p.bore, 3.6 * p.bore)
    else:
        wide = (3 + 1.4 * max(side for side, _ in offsets)) * p.bore
        deep = low - (0.9 if front == "wood" else 0.15) * p.bore
        rows = [(back, deep, 0, wide), (0.2 * back + 0.8 * tip, 0.9 * deep, 0, wide)]
        bar(b, "body", p.hand, [*rows, (tip, 0.5 * deep, 0, 0.6 * wide)], boxiness=0.35)


def muzzle(b: Builder, rng: Rng, p: Plan, rows: list[Pair]) -> None:
    """Put a body of (forward, radius in bores) rows over the muzzle."""
    scale = rng.uniform(0.7, 1.3) * (0.5 if p.kind == "pistol" else 1)
    _tube(b, BLACK, p.end - 0.02, [(p.end + scale * f, p.bore * r) for f, r in rows])


_BRAKE = [(0.0, 1.8), (0.014, 1.8), (0.015, 1.2), (0.025, 1.2), (0.026, 1.8), (0.04, 1.8)]
_SILENCER = [(0, 2.1), (0.24, 2.1)]
_SHORT = ("compact", "machine_pistol", "bullpup")
_RECEIVER = (*_SHORT, "service", "support")
BODIES = (
    Component.of("slide", 2.2, slide, {"kind": ("pistol",)}, opened=False),
    Component.of("toggle", 1, slide, {"kind": ("pistol",)}, opened=True),
    Component("revolver", 1, revolver, {"kind": ("revolver",)}),
    Component.of("tube", 1, receiver, {"kind": ("compact",)}, boxiness=0.0),
    Component.of("box", 1.3, receiver, {"kind": _RECEIVER}, boxiness=0.85),
    Component("action", 1, action, {"kind": ("bolt",)}),
    Component.of("sides", 1.6, sides, {"kind": ("hunting",)}, levered=False),
    Component.of("lever", 0.8, sides, {"kind": ("hunting",)}, levered=True),
)
_SIDES, _ONE = {"body": ("sides",)}, ((0, 0),)
BARRELS = (
    Component("bare", 1, bare, {"kind": ("pistol", "revolver", "bolt", *_SHORT, "support")}),
    Component("lug", 1.6, lug, {"kind": ("revolver",)}),
    Component("jacket", 0.8, jacket, {"kind": ("compact", "support")}),
    Component("guard", 2.2, guarded, {"kind": ("compact", "service", "support")}),
    Component.of("pump", 1, split, _SIDES, offsets=_ONE, front="pump"),
    Component.of("lever", 1, split, {"body": ("lever",)}, offsets=_ONE, front="wood"),
    Component.of("side", 0.5, split, _SIDES, offsets=((-1, 0), (1, 0)), front="wedge"),
    Component.of("over", 0.5, split, _SIDES, offsets=((0, 0), (0, -2)), front="wedge"),
)
MUZZLES = (
    Component("plain", 1.8, nothing),
    Component.of("brake", 0.6, muzzle, {"kind": ("bolt", *_RECEIVER)}, rows=_BRAKE),
    Component.of("hider", 0.9, muzzle, {"kind": _RECEIVER}, rows=[(0, 1.3), (0.06, 1.7)]),
    Component.of("silencer", 0.25, muzzle, {"kind": ("pistol", *_RECEIVER)}, rows=_SILENCER),
)
