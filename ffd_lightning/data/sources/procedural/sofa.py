"""Sofas: straight, chesterfield, camelback, sectional, chaise, daybed, curved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.data.sources.procedural.furniture import (
    UP,
    LegStyle,
    add_legs,
    corners,
    draw,
    pad,
    rails,
    sheet,
    slats,
)
from ffd_lightning.data.sources.procedural.shapes import Array, Builder, Family, pick_material
from ffd_lightning.data.sources.procedural.upholstery import (
    Seating,
    add_arm,
    add_base,
    add_feet,
    add_loose_back,
    add_seat_cushions,
    add_tight_back,
    add_tufts,
    back_point,
    draw_seating,
)

PARTS = ("seat", "back", "arm", "leg")


def _pillows(b: Builder, rng: np.random.Generator, s: Seating) -> None:
    """Throw up to three small pillows against the back."""
    for _ in range(int(rng.integers(0, 4)) if rng.random() < 0.5 else 0):
        size, x = rng.uniform(0.3, 0.42), rng.uniform(-0.38, 0.38) * s.width
        at = back_point(s, x, 0.46 * size, -0.95 * s.thick)
        cover = pick_material(rng, "fabric")
        pad(b, "back", cover, at, (size, size, 0.11), 0.06, s.rake + 12)


def _straight(rng: np.random.Generator) -> Builder:
    """Build a sofa for one to four with any arms and a tight or cushioned back."""
    b = Builder()
    s = draw_seating(rng, int(rng.choice([1, 2, 3, 4], p=[0.1, 0.35, 0.4, 0.15])))
    add_base(b, s)
    one = replace(s, seats=1) if rng.random() < 0.2 else s
    add_seat_cushions(b, one)
    kind = draw(rng, ["loose", "tight", "tufted"], [0.55, 0.3, 0.15])
    if kind == "loose":
        add_loose_back(b, s, rng.uniform(0.0, 0.14))
    else:
        add_tight_back(b, s, s.width + s.arm)
        if kind == "tufted":
            add_tufts(b, s, s.width, int(rng.integers(2, 4)), 4 * s.seats)
    for side in (-1, 1):
        add_arm(b, s, side)
    add_feet(b, rng, s)
    _pillows(b, rng, s)
    return b


def _chesterfield(rng: np.random.Generator) -> Builder:
    """Build a sofa whose rolled arms run on into a rolled, buttoned back of the same height."""
    b = Builder()
    s = draw_seating(rng, int(rng.integers(1, 5)), arms=("rolled",))
    rise = rng.uniform(0.24, 0.34)
    s = replace(s, arm_rise=rise, back=rise, rake=4.0, arm=rng.uniform(0.17, 0.25), pillows=s.cover)
    add_base(b, s)
    add_seat_cushions(b, s, front=0.03)
    add_tight_back(b, s, s.width + s.arm)
    r = 0.58 * s.arm
    crest = np.array([0, s.seat + rise - 0.3 * r, s.depth / 2 - 0.3 * s.thick])
    half = np.array([s.span / 2, 0, 0])
    b.cylinder("back", s.cover, crest - half, crest + half, r)
    add_tufts(b, s, s.width, int(rng.integers(2, 4)), 5 * s.seats)
    for side in (-1, 1):
        add_arm(b, s, side)
    add_feet(b, rng, s)
    return b


def _camelback(rng: np.random.Generator) -> Builder:
    """Build a sofa with an arched or double-arched back on visible legs."""
    b = Builder()
    s = draw_seating(rng, int(rng.integers(2, 4)), arms=("rolled", "slope", "padded"))
    s = replace(s, foot=rng.uniform(0.1, 0.22), back=rng.uniform(0.28, 0.42))
    add_base(b, s)
    add_seat_cushions(b, replace(s, seats=1) if rng.random() < 0.5 else s)
    humps, swell = int(rng.integers(1, 4)), rng.uniform(0.08, 0.2)
    u = np.linspace(-1, 1, 33)
    arch = np.cos(np.pi * u / 2) ** 2 if humps == 1 else np.abs(np.cos(np.pi * u * humps / 2)) ** 0.7
    tops = s.back + swell * arch
    width = (s.width + s.arm) / 2
    levels = np.linspace(0, 1, 7)
    grid = [[back_point(s, x * width, -0.2 + t * (top + 0.2)) for x, top in zip(u, tops, strict=True)]
            for t in levels]  # fmt: skip
    sheet(b, "back", s.cover, grid, 0.8 * s.thick)
    for side in (-1, 1):
        add_arm(b, s, side)
    add_feet(b, rng, s)
    _pillows(b, rng, s)
    return b


def _sectional(rng: np.random.Generator) -> Builder:
    """Build a sofa with a chaise or a second row of seats along one side."""
    b = Builder()
    s = draw_seating(rng, int(rng.integers(2, 5)), arms=("box", "padded", "slope"))
    side, reach = int(rng.choice([-1, 1])), rng.uniform(0.5, 1.3)
    add_base(b, s)
    add_seat_cushions(b, s)
    add_loose_back(b, s, rng.uniform(0.0, 0.12))
    wide = s.width / s.seats
    x, z = side * (s.width - wide) / 2, -s.depth / 2 - reach / 2
    top = s.seat - 0.8 * s.cushion
    size = (wide + 0.04, top - s.foot, reach + 0.08)
    b.rounded_box("seat", s.cover, (x, (top + s.foot) / 2, z + 0.04), size, 0.03)
    parts = 1 if reach < 0.8 else 2
    for i in range(parts):
        at = (x, s.seat - s.cushion / 2, -s.depth / 2 - (i + 0.5) * reach / parts)
        cushion = (0.98 * wide, s.cushion, 0.99 * reach / parts)
        b.rounded_box("seat", s.pillows, at, cushion, 0.05, 0.4 * s.cushion)
    full = parts == 2 or rng.random() < 0.4
    add_arm(b, s, -side)
    deep = s.depth + reach if full else 0.97 * s.depth
    if parts == 2:
        _side_back(b, s, side, deep)
    else:
        add_arm(b, s, side, deep)
    end = corners(wide - 0.1, 0.0, 0.0)[:2] + np.array([x, 0, z - reach / 2 + 0.08])
    style = LegStyle("square", 0.05, ((0.0, 0.8), (1.0, 1.0)))
    add_legs(b, "leg", s.frame, style, end + (s.foot + 0.02) * UP, end)
    add_feet(b, rng, s)
    _pillows(b, rng, s)
    return b


def _side_back(b: Builder, s: Seating, side: int, deep: float) -> None:
    """Add a back along the side of an L, as high as the main one."""
    x, z = side * (s.width + s.arm) / 2, s.depth / 2 - deep / 2
    top = s.seat + 0.9 * s.back
    size = (s.arm, top - s.foot, deep)
    b.rounded_box("back", s.cover, (x, (top + s.foot) / 2, z), size, 0.04)


def _chaise(rng: np.random.Generator) -> Builder:
    """Build a long seat with a head end, and a back that falls away along one side."""
    b = Builder()
    s = draw_seating(rng, 1, arms=("rolled", "flare", "slope", "box"))
    s = replace(s, width=rng.uniform(1.25, 1.75), depth=rng.uniform(0.6, 0.78))
    s = replace(s, arm_rise=rng.uniform(0.22, 0.42), thick=rng.uniform(0.1, 0.16), rake=4.0)
    head = int(rng.choice([-1, 1]))
    add_base(b, s)
    cushion = (s.width + 0.5 * s.arm, s.cushion, s.depth - (s.thick if s.thick else 0))
    at = (-head * 0.25 * s.arm, s.seat - s.cushion / 2, -0.5 * s.thick)
    b.rounded_box("seat", s.pillows, at, cushion, 0.1, 0.4 * s.cushion)
    add_arm(b, s, head)
    length = rng.uniform(0.45, 0.95)
    low, fall = rng.uniform(0.06, 0.15), rng.uniform(0.7, 2.0)
    u = np.linspace(0, 1, 21)
    edge = head * (s.width / 2 + 0.5 * s.arm)
    xs = edge - head * u * length * (s.width + 0.3 * s.arm)
    tops = low + (s.arm_rise - low) * (0.5 + 0.5 * np.cos(np.pi * u**fall))
    grid = [[back_point(s, x, -0.1 + t * (top + 0.1)) for x, top in zip(xs, tops, strict=True)]
            for t in np.linspace(0, 1, 6)]  # fmt: skip
    sheet(b, "back", s.cover, grid, 0.8 * s.thick)
    add_feet(b, rng, s, s.width)
    if rng.random() < 0.5:
        r = rng.uniform(0.07, 0.1)
        mid = np.array([head * (s.width / 2 - r), s.seat + r, -0.3 * s.thick])
        half = np.array([0, 0, 0.4 * s.depth])
        b.cylinder("arm", pick_material(rng, "fabric"), mid - half, mid + half, r)
    return b


def _daybed(rng: np.random.Generator) -> Builder:
    """Build a mattress on a frame of legs and rails, with bolsters or a slatted back and ends."""
    b = Builder()
    frame = pick_material(rng, draw(rng, ["wood", "metal", "paint"], [0.6, 0.25, 0.15]))
    cover = pick_material(rng, draw(rng, ["fabric", "leather"]))
    width, depth = rng.uniform(1.5, 2.1), rng.uniform(0.72, 0.95)
    deck, soft = rng.uniform(0.2, 0.34), rng.uniform(0.09, 0.2)
    post = rng.uniform(0.045, 0.07)
    back = rng.uniform(0.35, 0.55) if rng.random() < 0.7 else 0.0
    ends = rng.uniform(0.5, 1.0) * back if back else 0.0
    feet = corners(width - post, depth - post, 0.0)
    tops = feet + (deck + np.array([[ends], [ends], [back], [back]])) * UP
    style = LegStyle("square", post, ((0.0, 0.8), (0.3, 1.0), (0.6, 1.0), (1.0, 1.0)))
    add_legs(b, "leg", frame, style, tops, feet)
    rails(b, "seat", frame, feet + (deck - 0.05) * UP, 0.03, 0.1)
    mattress = (width - 2 * post, soft, depth - 2 * post)
    b.rounded_box("seat", cover, (0, deck + soft / 2 - 0.01, 0), mattress, 0.07, 0.35 * soft)
    if back:
        _slatted_side(b, rng, frame, tops[2:], deck, "back")
        for left, right in ((0, 3), (1, 2)):
            low = np.minimum(tops[left], tops[right])[1]
            pair = np.array([tops[left], tops[right]])
            pair[:, 1] = low
            _slatted_side(b, rng, frame, pair, deck, "arm")
    level, r = deck + soft, rng.uniform(0.07, 0.11)
    if back and rng.random() < 0.7:
        count = int(rng.integers(2, 4))
        wide = mattress[0] / count
        for i in range(count):
            at = ((i + 0.5) * wide - mattress[0] / 2, level + 0.18, depth / 2 - post - 0.1)
            pad(b, "back", pick_material(rng, "fabric"), at, (0.97 * wide, 0.38, 0.14), 0.06, 14)
    else:
        for x in (-1, 1):
            mid = np.array([x * (mattress[0] / 2 - r), level + 0.95 * r, 0])
            half = np.array([0, 0, 0.42 * depth])
            b.cylinder("arm", cover, mid - half, mid + half, r)
    return b


def _slatted_side(
    b: Builder, rng: np.random.Generator, frame: object, tops: Array, deck: float, part: str
) -> None:
    """Fill the space between two posts that end at `tops`, (2, 3), with a rail and slats."""


def _curved(rng: np.random.Generator) -> Builder:
    """Build a sofa bent around its front: part of a ring, its back along the outside."""
    b = Builder()
    return b


FAMILIES: dict[str, Family] = {
    "straight": _straight,
    "chesterfield": _chesterfield,
    "camelback": _camelback,
    "sectional": _sectional,
    "chaise": _chaise,
    "daybed": _daybed,
    "curved": _curved,
}
