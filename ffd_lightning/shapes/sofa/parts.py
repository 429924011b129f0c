"""What a sofa stands on, its seats, its backs and its arms."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng, draw, nothing, pick_material
from ffd_lightning.shapes.kit.boards import beam, pad, rails, slats
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.upholstery import (
    ARMS,
)
from ffd_lightning.shapes.kit.vectors import UP, Array, vec
from ffd_lightning.shapes.sofa.plan import Plan


def feet(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box on short legs; arms that stand on the floor do without."""
    p.add_base(b)
    p.add_feet(b, rng, None if p.ends else p.width + p.arm)


def plinth(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box on a plinth."""
    p.add_base(b)
    inset, tall = rng.choice([0.03, 0.2]), p.foot + 0.02
    size = (p.width + p.arm - inset, tall, p.depth - inset)
    dark = pick_material(rng, "rubber") if rng.random() < 0.5 else p.frame
    b.rounded_box("leg", dark, (0, tall / 2, 0), size, 0.02)


def sled(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box on frames of bars."""
    p.add_base(b)
    bar, half, z = rng.uniform(0.018, 0.04), p.width / 2 - 0.06, p.depth / 2 - 0.08
    for x in np.linspace(-half, half, 3 if half > 0.9 else 2):
        ring = [(x, 0, z), (x, p.foot, z), (x, p.foot, -z), (x, 0, -z)]
        rails(b, "leg", p.frame, np.array(ring) + bar / 2 * UP, bar, bar)


def frame(b: Builder, rng: Rng, p: Plan) -> None:
    """Add rails and a board on long legs."""
    width, depth = p.width + p.arm - 0.04, p.depth - 0.04
    rails(b, "seat", p.frame, corners(width, depth, p.deck - 0.04), 0.035, 0.08)
    b.box("seat", p.frame, (0, p.deck - 0.02, 0), (width, 0.03, depth))
    replace(p, foot=p.deck - 0.03).add_feet(b, rng, p.width + p.arm + 0.06)


def slab(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box on a broad board on short legs."""
    over = rng.uniform(0.02, 0.2)
    size = (p.span + over, 0.045, p.depth + over)
    b.rounded_box("leg", p.frame, (0, p.foot - 0.018, 0), size, 0.03, edge=0.01)
    feet(b, rng, p)


def cushions(b: Builder, rng: Rng, p: Plan, wide: float) -> None:
    """Add cushions about as wide as told."""
    one = replace(p, seats=max(1, round(p.width / wide)))
    one.add_seat_cushions(b, rng.uniform(0.0, 0.04))


def each(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a cushion at each seat, sometimes two."""
    low = p.cushion * (rng.uniform(0.4, 0.6) if rng.random() < 0.3 else 0)
    if low:
        replace(p, seats=1, seat=p.seat - p.cushion + low, cushion=low).add_seat_cushions(b)
    replace(p, cushion=p.cushion - low).add_seat_cushions(b, rng.uniform(0.0, 0.04))


_LONG = {"layout": ("straight", "stool", "longue")}
BASES = (
    Component("feet", 5, feet),
    Component("plinth", 2, plinth),
    Component("sled", 1, sled),
    Component("frame", 3, frame),
    Component("slab", 0.6, slab, _LONG),
)
SEATS = (
    Component("each", 5, each),
    Component("bench", 2, partial(cushions, wide=5)),
    Component("rolls", 0.8, partial(cushions, wide=0.22), _LONG),
)


def loose(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a panel and a cushion per seat before it, sometimes pillows."""
    p.add_loose_back(b, rng.uniform(0.0, 0.35) * p.back)
    _pillows(b, rng, p)


def _pillows(b: Builder, rng: Rng, p: Plan) -> None:
    """Throw up to three small pillows against the back."""
    for _ in range(int(rng.integers(0, 4)) if rng.random() < 0.4 else 0):
        size, x = rng.uniform(0.3, 0.42), rng.uniform(-0.38, 0.38) * p.width
        cover, at = pick_material(rng, "fabric"), (x, 0.46 * size, -0.95 * p.thick)
        p.add_pad(b, cover, at, (size, size, 0.11), 0.06, 12)


def tight(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one padded panel, sometimes buttoned."""
    p.add_tight_back(b, p.width + p.arm)
    if rng.random() < 0.4:
        p.add_tufts(b, int(rng.integers(2, 4)), 3 * p.seats)


def rolled(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a buttoned panel and a roll on it that runs on into the arms."""
    p.add_tight_back(b, p.width + p.arm)
    p.add_tufts(b, int(rng.integers(2, 4)), 4 * p.seats)
    r, half = 0.58 * p.arm, vec(p.span / 2, 0, 0)
    crest = vec(0, p.seat + p.back - 0.3 * r, p.depth / 2 - 0.3 * p.thick)
    b.cylinder("back", p.cover, crest - half, crest + half, r)


def _outlined(b: Builder, p: Plan, xs: Array, tops: Array) -> None:
    """Add a back up to `tops` above the seat at `xs`."""
    rows = np.linspace(0, 1, 7)[:, None] * (tops + 0.15) - 0.15
    grid = [[p.point(x, y) for x, y in zip(xs, row, strict=True)] for row in rows]
    sheet(b, "back", p.cover, grid, 0.8 * p.thick)


def camel(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a back with up to a hump per seat."""
    humps, u = int(rng.integers(1, p.seats + 1)), np.linspace(-1, 1, 33)
    arch = np.abs(np.sin(np.pi * humps * (u + 1) / 2)) ** (2 if humps == 1 else 0.7)
    tops = 0.8 * p.back + rng.uniform(0.08, 0.25) * arch
    _outlined(b, p, u * (p.width + p.arm) / 2, tops)
    _pillows(b, rng, p)


def falling(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a back that falls away from the end that has the arm."""
    u, low, wide = np.linspace(0, 1, 21), rng.uniform(0.06, 0.15), p.width + 0.6 * p.arm
    xs = p.ends[0] * (wide / 2 - u * rng.uniform(0.45, 0.97) * wide)
    fall = 0.5 + 0.5 * np.cos(np.pi * u ** rng.uniform(0.7, 2.0))
    _outlined(b, p, xs, low + (max(p.arm_rise, 0.2) - low) * fall)


def channels(b: Builder, rng: Rng, p: Plan) -> None:
    """Add upright rolls side by side, their tops level or in an arch."""
    wide, count = p.width + p.arm, max(3, p.seats * int(rng.integers(1, 4)))
    low, arch = -0.3 * p.seat, rng.uniform(0.0, 0.4) * (rng.random() < 0.5)
    for u in (np.arange(count) + 0.5) / count * 2 - 1:
        top = p.back * (1 - arch * u * u)
        size = (1.02 * wide / count, top - low, p.thick)
        p.add_pad(b, p.cover, (u * wide / 2, (top + low) / 2, 0), size, 0.08)


def rests(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a low panel and a thick rest for the head on it at each seat."""
    low = rng.uniform(0.5, 0.75) * p.back
    replace(p, back=low).add_tight_back(b, p.width + p.arm)
    size = (0.96 * p.each, p.back - low + 0.03, 0.8 * p.thick)
    for x in p.places:
        at = (x, (p.back + low) / 2, -0.1 * p.thick)
        p.add_pad(b, p.pillows, at, size, 0.06, rng.choice([0, 8]))


def railing(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a railing around the back and both ends, often cushions before it."""
    tops = corners(p.width + p.arm - 0.04, p.depth - 0.04, p.deck + p.back)
    tops[:2, 1] -= rng.uniform(0.0, 0.6) * p.back
    for top in tops:
        beam(b, "back", p.frame, top * vec(1, 0, 1), top, 0.05, 0.05)
    fill, gap = draw(rng, ["bars", "slats", "panel"]), rng.uniform(0.08, 0.2)
    _fill_side(b, p, tops[2:], "back", fill, gap)
    for pair in (tops[[0, 3]], tops[[1, 2]]):
        pair[:, 1] = pair[:, 1].min()
        _fill_side(b, p, pair, "arm", fill, gap)
    soft = rng.uniform(0.1, 0.2)
    for x in p.places if rng.random() < 0.7 else ():
        at = (x, p.seat + 0.17, p.depth / 2 - 0.09 - soft / 2)
        pad(b, "back", p.pillows, at, (0.97 * p.each, 0.38, soft), 0.06, 10)


def _fill_side(b: Builder, p: Plan, tops: Array, part: str, fill: str, gap: float) -> None:
    """Fill the space between two posts, `tops` (2, 3): with bars or slats `gap` apart, a panel."""
    first, last = tops - 0.03 * UP
    beam(b, part, p.frame, first, last, 0.03, 0.05)
    rise, middle = first[1] - (p.deck - 0.04), (first + last) / 2
    length = float(np.linalg.norm(last - first))
    if fill == "bars":
        for t in np.linspace(0, 1, round(length / gap) + 1)[1:-1]:
            point = first + t * (last - first)
            b.cylinder(part, p.frame, point, point - rise * UP, 0.011, segments=8)
        return
    tall, count = (0.5 * gap, max(1, round(rise / gap))) if fill == "slats" else (rise, 1)
    size = (0.018, tall, length) if part == "arm" else (length, tall, 0.018)
    low, high = middle - (rise - tall / 2) * UP, middle - tall / 2 * UP
    slats(b, part, p.frame, low, high, size, count)


def upholstered(b: Builder, rng: Rng, p: Plan) -> None:
    """Add padded or open arms."""
    for side in p.ends:
        p.add_arm(b, side)


def bolsters(b: Builder, rng: Rng, p: Plan) -> None:
    """Add rolls that lie on the ends of the seat."""
    r, half = rng.uniform(0.07, 0.12), vec(0, 0, 0.46 * (p.depth - p.thick))
    for side in p.ends:
        middle = vec(side * (p.width / 2 - r), p.seat + 0.93 * r, -p.thick / 2)
        b.cylinder("arm", p.pillows, middle - half, middle + half, r)


_BROAD = {"layout": ("straight", "stool", "ell", "corner", "u", "curved")}
_BOX = _BROAD | {"base": ("feet", "plinth", "sled", "slab")}
_ALONE = ("straight", "stool")
BACKS = (
    Component("loose", 2, loose, _BROAD),
    Component("tight", 2, tight, _BOX),
    Component("rolled", 1.2, rolled, {"layout": (*_ALONE, "curved"), "base": ("feet", "plinth")}),
    Component("camel", 1.2, camel, _BOX | {"layout": (*_ALONE, "curved")}),
    Component("channels", 1.3, channels, _BOX),
    Component("rests", 1.4, rests, _BROAD),
    Component("railing", 3, railing, {"layout": _ALONE, "base": ("frame",)}),
    Component("open", 0.8, nothing, {"layout": _ALONE}),
    Component("falling", 1, falling, {"layout": ("longue",)}),
)
_PADDED = ("loose", "tight", "camel", "channels", "rests", "open", "falling")
ARM_KINDS = (
    *(Component(name, 1, upholstered, {"back": _PADDED}) for name in ARMS if name != "rolled"),
    Component("rolled", 1, upholstered, {"back": (*_PADDED, "rolled")}),
    Component("none", 1.2, nothing, _BROAD | {"back": ("railing", *_PADDED)}),
    Component("bolsters", 1, bolsters, {"back": ("tight", "channels", "open", "loose"), **_BROAD}),
)
