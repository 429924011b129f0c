"""Hulls: open, decked, two or three abreast, and submarines."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Component, Material, Rng
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair, about_y, about_z, lean, vec
from ffd_lightning.shapes.watercraft.plan import Hull, Plan, tint

_RANGES = {  # of beam, depth, transom, fineness, fullness, sheer at the bow, storey
    "skiff": ((0.3, 0.5), (0.09, 0.17), (0.5, 0.9), (0.4, 0.9), (1.6, 4), (0, 0.09), (0.08, 0.1)),
    "canoe": ((0.12, 0.26), (0.07, 0.14), (0, 0.04), (0.5, 0.9), (1.6, 3), (0, 0.22), (0.07, 0.09)),
    "planing": ((0.2, 0.42), (0.09, 0.17), (0.8, 1), (0.5, 1), (1.4, 2.4), (0, 0.09), (0.06, 0.11)),
    "yacht": ((0.2, 0.36), (0.08, 0.15), (0.2, 0.9), (0.7, 1), (1.5, 2.4), (0, 0.09), (0.07, 0.12)),
    "tub": ((0.26, 0.44), (0.14, 0.25), (0.4, 0.9), (0.4, 0.7), (2, 3.5), (0, 0.2), (0.08, 0.12)),
    "galleon": ((0.17, 0.3), (0.1, 0.2), (0.4, 0.8), (0.5, 0.8), (1.8, 3), (0, 0.14), (0.06, 0.09)),
    "freighter": ((0.12, 0.22), (0.06, 0.1), (0.7, 1), (0.3, 0.6), (4, 7), (0, 0.04), (0.02, 0.03)),
    "liner": ((0.11, 0.22), (0.07, 0.13), (0.6, 1), (0.4, 0.9), (3, 5), (0, 0.04), (0.02, 0.04)),
    "navy": ((0.08, 0.16), (0.05, 0.1), (0.5, 0.9), (0.7, 1), (2.2, 3.5), (0, 0.05), (0.024, 0.04)),
    "barge": ((0.16, 0.42), (0.045, 0.11), (0.9, 1), (0.1, 0.3), (5, 9), (0, 0.04), (0.05, 0.09)),
}  # fmt: skip
_STATIONS = 0.55 * np.linspace(0, 1, 17) + 0.45 * np.linspace(0, 1, 17) ** 2
"""Stations (17,) from bow to stern, denser at the bow."""
_COLORS = ("black", "navy", "red", "green", "blue", "orange", "white")


def _draw(rng: Rng, kind: str) -> Plan:
    """Draw the sizes and materials of a watercraft with a hull of a kind."""
    beam, depth, transom, fine, full, sheer, storey = (rng.uniform(*s) for s in _RANGES[kind])
    ends = (sheer, sheer * rng.uniform(0.0, 1.0))
    rake = (depth * rng.uniform(0.0, 1.2), depth * rng.uniform(-0.2, 0.5))
    lift = (depth * rng.uniform(0.1, 0.6), depth * rng.uniform(0.1, 0.5))
    hull = Hull(beam, depth, transom, fine, full, rng.uniform(0.35, 0.6), ends, rake, lift)
    wooden, white = kind in ("skiff", "canoe", "galleon"), kind in ("planing", "yacht", "liner")
    cargo, odd = kind in ("freighter", "barge"), ("orange",) if kind == "tub" else ()
    decks = ("red", "grey", "green") if cargo else ("wood", "wood", "cream")
    more = ("wood",) * 4 if wooden else ("white",) * 5 if white else ()
    paint = tint(rng, "grey") if kind == "navy" else tint(rng, *_COLORS, *more)
    return Plan(
        hull=hull,
        storey=storey,
        paint=paint,
        lower=tint(rng, "red", "black", "navy", "dark"),
        deck=tint(rng, *(("grey", "dark") if kind == "navy" else decks)),
        wall=paint if kind == "navy" else tint(rng, "white", "white", "cream", *odd),
        glass=tint(rng, "window"),
        spar=tint(rng, "wood" if wooden or rng.random() < 0.2 else "grey"),
    )


def _solid(b: Builder, p: Plan, hull: Hull, waterline: float) -> None:
    """Add a decked hull in two colours that meet at the height `waterline`."""
    for material, span in ((p.paint, (waterline, 9.0)), (p.lower, (0.0, waterline))):
        b.loft("hull", material, [hull.profile(t, span) for t in _STATIONS])
    strip = ((-1, 0.0), (-1, 0.004), (1, 0.004), (1, 0.0))
    rings = [[hull.edge(t, s, 0.06 * hull.half(t), y) for s, y in strip] for t in _STATIONS]
    b.loft("deck", p.deck, rings)


def bulwark(b: Builder, p: Plan, height: float, thickness: float, first: float = 0.0) -> None:
    """Add a strip that stands on the deck's edge, on both sides, from the station `first` aft."""
    for side in (-1, 1):
        rings = []
        for t in first + (1 - first) * _STATIONS:
            outer = p.hull.edge(t, side, -0.002)
            inner = p.hull.edge(t, side, min(thickness, 0.6 * p.hull.half(t)))
            high = height * (min(1.0, 0.3 + 12 * (t - first)) if first else 1.0)
            strip = ((outer, -0.003), (outer, high), (inner, high), (inner, -0.003))
            rings.append([point + y * UP for point, y in strip])
        b.loft("hull", p.paint, rings)


def _railing(b: Builder, p: Plan, height: float, last: float) -> None:
    """Add posts and two wires along the deck's edge, from the bow to the station `last`."""
    places = np.linspace(0.02, last, 7)
    left, right = (np.array([p.hull.edge(t, s, 0.008) for t in places]) for s in (-1, 1))
    for foot in (*left, *right):
        b.cylinder("rail", p.spar, foot, foot + height * UP, 0.0025, segments=5)
    for level in (0.55 * height, height):
        b.tube("rail", p.spar, np.concatenate([left[::-1], right]) + level * UP, 0.0025, segments=5)


def decked(b: Builder, rng: Rng, kind: str) -> Plan:
    """Add a hull with a deck, a bulwark or a railing, and what else its kind has."""
    p = _draw(rng, kind)
    _solid(b, p, p.hull, rng.uniform(0.3, 0.55) * p.hull.depth)
    bulwark(b, p, rng.uniform(0.1, 0.5) * p.storey, 0.01)
    if kind in ("planing", "yacht", "liner", "navy") and rng.random() < 0.6:
        _railing(b, p, 0.6 * p.storey, rng.uniform(0.24, 0.34))
    if kind == "yacht":
        _keel(b, rng, p)
    elif kind == "galleon":
        _wales(b, rng, p)
    elif kind == "freighter" and rng.random() < 0.6:
        depth = p.hull.depth
        nose = (0, 0.4 * depth, p.hull.z(0, 0.4 * depth) + 0.012)
        b.ellipsoid("hull", p.lower, nose, (0.15 * depth, 0.22 * depth, 0.05), segments=12)
    return p


def _keel(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a fin keel, sometimes with a bulb, and a rudder; or one long keel."""
    drop, root = rng.uniform(0.06, 0.26), rng.uniform(0.38, 0.46)
    fins = [(root, root + rng.uniform(0.08, 0.2), drop), (0.88, 0.95, 0.8 * drop)]
    if rng.random() < 0.3:
        fins = [(0.3, 0.93, 0.5 * drop)]
    elif rng.random() < 0.4:
        at = (0, -drop, p.hull.z(root + 0.07, 0))
        b.ellipsoid("keel", p.lower, at, (0.025, 0.025, rng.uniform(0.07, 0.14)), segments=12)
    for start, end, down in fins:
        high, z = p.hull.keel((start + end) / 2) + 0.03, p.hull.z((start + end) / 2, 0)
        reach = (0, -down - high, 0.25 * down)
        fin(b, "keel", p.lower, vec(0, high, z), reach, (end - start, 0.025))


def _wales(b: Builder, rng: Rng, p: Plan) -> None:
    """Add painted strakes along the sides and perhaps a row of gun ports."""
    trim, black = tint(rng, "orange", "cream", "black", "red"), tint(rng, "black")
    for drop in np.linspace(0.06, 0.26, int(rng.integers(1, 4))) * p.hull.depth:
        for side in (-1, 1):
            edge = [p.hull.edge(t, side, -0.002, -drop) for t in np.linspace(0.03, 1.0, 13)]
            b.tube("hull", trim, edge, 0.005, segments=5)
    for t in np.linspace(0.25, 0.85, int(rng.integers(6, 12))) if rng.random() < 0.5 else ():
        center = p.hull.edge(t, 0, up=-0.36 * p.hull.depth)
        b.box("gun", black, center, (2 * p.hull.half(t) + 0.004, 0.018, 0.02))


def opened(b: Builder, rng: Rng, kind: str) -> Plan:
    """Add an undecked hull with a closed stern, a gunwale and floor boards."""
    p, thick = _draw(rng, kind), 0.012
    hull = p.hull
    skins = [(hull.profile(t), hull.profile(t, inset=thick)) for t in _STATIONS]
    rings = [np.concatenate([outside, inside[::-1]]) for outside, inside in skins]
    b.loft("hull", p.paint, rings, caps=False)
    b.loft("hull", p.paint, [hull.profile(1.0) - vec(0, 0, thick), hull.profile(1.0)])
    bulwark(b, replace(p, paint=p.deck), 0.01, 0.02)
    b.box("deck", p.deck, (0, 0.2 * hull.depth + thick, 0.07), (0.45 * hull.beam, 0.01, 0.56))
    return p


def twin(b: Builder, rng: Rng) -> Plan:
    """Add two or three slender hulls, a bridge deck across them, and often a net before it."""
    p = _draw(rng, "yacht")
    gap, wide = rng.uniform(0.14, 0.28), rng.uniform(0.07, 0.13)
    hull = replace(p.hull, sheer=(0, 0))
    for x in (-gap, gap) if rng.random() < 0.75 else (-gap, 0, gap):
        _solid(b, p, replace(hull, beam=wide, x=x), 0.4 * hull.depth)
    front, tip, y = rng.uniform(-0.3, -0.22), hull.z(0.05), hull.depth
    size = (2 * gap + 0.6 * wide, 0.045, 0.4 - front)
    b.rounded_box("deck", p.deck, (0, y - 0.02, (front + 0.4) / 2), size, 0.03)
    if rng.random() < 0.7:
        b.cylinder("mast", p.spar, (-gap, y, tip), (gap, y, tip), 0.012, segments=10)
        net = [[(x, y - 0.01, z) for x in (-gap, 0, gap)] for z in (tip, front + 0.02)]
        sheet(b, "deck", tint(rng, "dark"), net, 0.005)
    return replace(p, hull=Hull(2 * gap + wide, y))


def submarine(b: Builder, rng: Rng) -> Plan:
    """Add a spindle with planes, tail fins and a screw, and sometimes a flat deck on it."""
    paint, dark = tint(rng, "dark", "black", "grey", "navy", "orange"), tint(rng, "dark", "black")
    r, nose, tail = rng.uniform(0.045, 0.11), rng.uniform(0.06, 0.25), rng.uniform(0.2, 0.5)
    ahead, axis = nose * (1 - np.cos(np.linspace(0, np.pi / 2, 9))), vec(0, r, 0)
    t = np.concatenate([ahead, np.linspace(1 - tail, 1, 11)])
    front = np.sqrt(np.maximum(1 - (1 - t / nose) ** 2, 0.0004))
    rear = 1 - 0.88 * np.clip((t - 1 + tail) / tail, 0, 1) ** 1.8
    rows = np.column_stack([r * np.where(t < nose, front, rear), 0.5 - t])
    b.lathe("hull", paint, rows, axis, turn=lean(-90))
    if rng.random() < 0.5:
        size = (rng.uniform(0.6, 1.2) * r, 0.3 * r, rng.uniform(0.4, 0.66))
        b.rounded_box("deck", dark, (0, 1.95 * r, -0.05), size, 0.4 * r, edge=0.012)
    turn, reach = 45.0 * (rng.random() < 0.25), rng.uniform(1.1, 1.8) * r
    for k in range(4):
        way = about_z(turn + 90 * k) @ vec(reach, 0, 0) + vec(0, 0, 0.01)
        fin(b, "keel", paint, axis + vec(0, 0, 0.43), way, (0.08, 0.012))
    b.cylinder("engine", dark, axis + vec(0, 0, 0.49), axis + vec(0, 0, 0.515), 0.16 * r)
    radii = r * vec(0.17, 0.36, 0.03)
    for spin in map(about_z, np.linspace(0, 360, int(rng.integers(3, 8)), endpoint=False)):
        center, turned = axis + spin @ vec(0, 0.42 * r, 0.5), spin @ about_y(145)
        b.ellipsoid("engine", dark, center, radii, segments=8, turn=turned)
    return Plan(Hull(2 * r, 2 * r), 0.7 * r, paint, dark, dark, paint, dark, dark)


def fin(b: Builder, part: str, paint: Material, root: Array, reach: ArrayLike, size: Pair) -> None:
    """Add a streamlined fin from `root` along `reach`; `size` is its chord and thickness."""
    out = np.asarray(reach, float)
    side = np.cross((0, 0, 1.0), out)
    side /= np.linalg.norm(side)
    s = np.array([(-0.5, 0), (-0.42, 0.6), (-0.2, 1), (0.1, 0.8), (0.5, 0.08)])
    foil = np.concatenate([s, s[-1:0:-1] * (1, -1)])
    section = foil[:, :1] * vec(0, 0, size[0]) + foil[:, 1:] * side * size[1] / 2
    b.loft(part, paint, [root + t * out + (1 - 0.3 * t**2) * section for t in (0, 0.5, 0.97, 1)])


_OPENED = {"skiff": 1.2, "canoe": 0.8}
_DECKED = {"planing": 2.2, "yacht": 1.7, "tub": 1.3, "galleon": 1.2, "freighter": 1.5, "liner": 1,
           "navy": 1.3, "barge": 0.9}  # fmt: skip
HULLS = (
    *(Component.of(kind, weight, opened, kind=kind) for kind, weight in _OPENED.items()),
    *(Component.of(kind, weight, decked, kind=kind) for kind, weight in _DECKED.items()),
    Component("catamaran", 0.9, twin),
    Component("submarine", 0.7, submarine),
)
