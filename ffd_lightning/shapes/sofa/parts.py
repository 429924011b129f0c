"""What a sofa stands on, its seats, its backs and its arms."""

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng, draw, nothing, pick_material
from ffd_lightning.shapes.kit.boards import beam, pad, rails, slats
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.upholstery import ARMS, Seating, armed, boxed
from ffd_lightning.shapes.kit.vectors import UP, Array, vec


def plinth(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a box on a plinth."""
    s.add_base(b)
    inset, tall = rng.choice([0.03, 0.2]), s.foot + 0.02
    size = (s.width + s.arm - inset, tall, s.depth - inset)
    dark = pick_material(rng, "rubber") if rng.random() < 0.5 else s.frame
    b.rounded_box("leg", dark, (0, tall / 2, 0), size, 0.02)


def sled(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a box on frames of bars."""
    s.add_base(b)
    bar, half, z = rng.uniform(0.018, 0.04), s.width / 2 - 0.06, s.depth / 2 - 0.08
    for x in np.linspace(-half, half, 3 if half > 0.9 else 2):
        ring = [(x, 0, z), (x, s.foot, z), (x, s.foot, -z), (x, 0, -z)]
        rails(b, "leg", s.frame, np.array(ring) + bar / 2 * UP, bar, bar)


def frame(b: Builder, rng: Rng, s: Seating) -> None:
    """Add rails and a board on long legs."""
    width, depth = s.width + s.arm - 0.04, s.depth - 0.04
    rails(b, "seat", s.frame, corners(width, depth, s.deck - 0.04), 0.035, 0.08)
    b.box("seat", s.frame, (0, s.deck - 0.02, 0), (width, 0.03, depth))
    replace(s, foot=s.deck - 0.03).add_feet(b, rng, s.width + s.arm + 0.06)


def slab(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a box on a broad board on short legs."""
    over = rng.uniform(0.02, 0.2)
    size = (s.span + over, 0.045, s.depth + over)
    b.rounded_box("leg", s.frame, (0, s.foot - 0.018, 0), size, 0.03, edge=0.01)
    boxed(b, rng, s)


def cushions(b: Builder, rng: Rng, s: Seating, wide: float) -> None:
    """Add cushions about as wide as told."""
    one = replace(s, seats=max(1, round(s.width / wide)))
    one.add_seat_cushions(b, rng.uniform(0.0, 0.04))


def each(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a cushion at each seat, sometimes two."""
    low = s.cushion * (rng.uniform(0.4, 0.6) if rng.random() < 0.3 else 0)
    if low:
        replace(s, seats=1, seat=s.seat - s.cushion + low, cushion=low).add_seat_cushions(b)
    replace(s, cushion=s.cushion - low).add_seat_cushions(b, rng.uniform(0.0, 0.04))


_LONG = {"layout": ("straight", "stool", "longue")}
BASES = (
    Component("feet", 5, boxed),
    Component("plinth", 2, plinth),
    Component("sled", 1, sled),
    Component("frame", 3, frame),
    Component("slab", 0.6, slab, _LONG),
)
SEATS = (
    Component("each", 5, each),
    Component.of("bench", 2, cushions, wide=5),
    Component.of("rolls", 0.8, cushions, _LONG, wide=0.22),
)


def loose(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a panel and a cushion per seat before it, sometimes pillows."""
    s.add_loose_back(b, rng.uniform(0.0, 0.35) * s.back)
    _pillows(b, rng, s)


def _pillows(b: Builder, rng: Rng, s: Seating) -> None:
    """Throw up to three small pillows against the back."""
    for _ in range(int(rng.integers(0, 4)) if rng.random() < 0.4 else 0):
        size, x = rng.uniform(0.3, 0.42), rng.uniform(-0.38, 0.38) * s.width
        cover, at = pick_material(rng, "fabric"), (x, 0.46 * size, -0.95 * s.thick)
        s.add_pad(b, cover, at, (size, size, 0.11), 0.06, 12)


def tight(b: Builder, rng: Rng, s: Seating) -> None:
    """Add one padded panel, sometimes buttoned."""
    s.add_tight_back(b, s.width + s.arm)
    if rng.random() < 0.4:
        s.add_tufts(b, int(rng.integers(2, 4)), 3 * s.seats)


def rolled(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a buttoned panel and a roll on it that runs on into the arms."""
    s.add_tight_back(b, s.width + s.arm)
    s.add_tufts(b, int(rng.integers(2, 4)), 4 * s.seats)
    r, half = 0.58 * s.arm, vec(s.span / 2, 0, 0)
    crest = vec(0, s.seat + s.back - 0.3 * r, s.depth / 2 - 0.3 * s.thick)
    b.cylinder("back", s.cover, crest - half, crest + half, r)


def _outlined(b: Builder, s: Seating, xs: Array, tops: Array) -> None:
    """Add a back up to `tops` above the seat at `xs`."""
    rows = np.linspace(0, 1, 7)[:, None] * (tops + 0.15) - 0.15
    grid = [[s.point(x, y) for x, y in zip(xs, row, strict=True)] for row in rows]
    sheet(b, "back", s.cover, grid, 0.8 * s.thick)


def camel(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a back with up to a hump per seat."""
    humps, u = int(rng.integers(1, s.seats + 1)), np.linspace(-1, 1, 33)
    arch = np.abs(np.sin(np.pi * humps * (u + 1) / 2)) ** (2 if humps == 1 else 0.7)
    tops = 0.8 * s.back + rng.uniform(0.08, 0.25) * arch
    _outlined(b, s, u * (s.width + s.arm) / 2, tops)
    _pillows(b, rng, s)


def falling(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a back that falls away from the end that has the arm."""
    u, low, wide = np.linspace(0, 1, 21), rng.uniform(0.06, 0.15), s.width + 0.6 * s.arm
    xs = s.ends[0] * (wide / 2 - u * rng.uniform(0.45, 0.97) * wide)
    fall = 0.5 + 0.5 * np.cos(np.pi * u ** rng.uniform(0.7, 2.0))
    _outlined(b, s, xs, low + (max(s.arm_rise, 0.2) - low) * fall)


def channels(b: Builder, rng: Rng, s: Seating) -> None:
    """Add upright rolls side by side, their tops level or in an arch."""
    wide, count = s.width + s.arm, max(3, s.seats * int(rng.integers(1, 4)))
    low, arch = -0.3 * s.seat, rng.uniform(0.0, 0.4) * (rng.random() < 0.5)
    for u in (np.arange(count) + 0.5) / count * 2 - 1:
        top = s.back * (1 - arch * u * u)
        size = (1.02 * wide / count, top - low, s.thick)
        s.add_pad(b, s.cover, (u * wide / 2, (top + low) / 2, 0), size, 0.08)


def rests(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a low panel and a thick rest for the head on it at each seat."""
    low = rng.uniform(0.5, 0.75) * s.back
    replace(s, back=low).add_tight_back(b, s.width + s.arm)
    size = (0.96 * s.each, s.back - low + 0.03, 0.8 * s.thick)
    for x in s.places:
        at = (x, (s.back + low) / 2, -0.1 * s.thick)
        s.add_pad(b, s.pillows, at, size, 0.06, rng.choice([0, 8]))


def railing(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a railing around the back and both ends, often cushions before it."""
    tops = corners(s.width + s.arm - 0.04, s.depth - 0.04, s.deck + s.back)
    tops[:2, 1] -= rng.uniform(0.0, 0.6) * s.back
    for top in tops:
        beam(b, "back", s.frame, top * vec(1, 0, 1), top, 0.05, 0.05)
    fill, gap = draw(rng, ["bars", "slats", "panel"]), rng.uniform(0.08, 0.2)
    _fill_side(b, s, tops[2:], "back", fill, gap)
    for pair in (tops[[0, 3]], tops[[1, 2]]):
        pair[:, 1] = pair[:, 1].min()
        _fill_side(b, s, pair, "arm", fill, gap)
    soft = rng.uniform(0.1, 0.2)
    for x in s.places if rng.random() < 0.7 else ():
        at = (x, s.seat + 0.17, s.depth / 2 - 0.09 - soft / 2)
        pad(b, "back", s.pillows, at, (0.97 * s.each, 0.38, soft), 0.06, 10)


def _fill_side(b: Builder, s: Seating, tops: Array, part: str, fill: str, gap: float) -> None:
    """Fill the space between two posts, `tops` (2, 3): with bars or slats `gap` apart, a panel."""
    first, last = tops - 0.03 * UP
    beam(b, part, s.frame, first, last, 0.03, 0.05)
    rise, middle = first[1] - (s.deck - 0.04), (first + last) / 2
    length = float(np.linalg.norm(last - first))
    if fill == "bars":
        for t in np.linspace(0, 1, round(length / gap) + 1)[1:-1]:
            point = first + t * (last - first)
            b.cylinder(part, s.frame, point, point - rise * UP, 0.011, segments=8)
        return
    tall, count = (0.5 * gap, max(1, round(rise / gap))) if fill == "slats" else (rise, 1)
    size = (0.018, tall, length) if part == "arm" else (length, tall, 0.018)
    low, high = middle - (rise - tall / 2) * UP, middle - tall / 2 * UP
    slats(b, part, s.frame, low, high, size, count)


def bolsters(b: Builder, rng: Rng, s: Seating) -> None:
    """Add rolls that lie on the ends of the seat."""
    r, half = rng.uniform(0.07, 0.12), vec(0, 0, 0.46 * (s.depth - s.thick))
    for side in s.ends:
        middle = vec(side * (s.width / 2 - r), s.seat + 0.93 * r, -s.thick / 2)
        b.cylinder("arm", s.pillows, middle - half, middle + half, r)


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
    *(Component(name, 1, armed, {"back": _PADDED}) for name in ARMS if name != "rolled"),
    Component("rolled", 1, armed, {"back": (*_PADDED, "rolled")}),
    Component("none", 1.2, nothing, _BROAD | {"back": ("railing", *_PADDED)}),
    Component("bolsters", 1, bolsters, {"back": ("tight", "channels", "open", "loose"), **_BROAD}),
)
