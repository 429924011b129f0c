"""Sofas: straight, chesterfield, camelback, sectional, chaise, daybed, curved."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ffd_lightning.shapes.parts.furniture import (
    UP,
    LegStyle,
    add_leg,
    add_legs,
    arc,
    corners,
    draw,
    fill_side,
    pad,
    rails,
    sheet,
)
from ffd_lightning.shapes.parts.upholstery import (
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
from ffd_lightning.shapes.shapes import (
    Array,
    Builder,
    Family,
    pick_material,
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


def _back_grid(s: Seating, xs: Array, rises: Array) -> Array:
    """Return the points of a back, (n, m, 3), at `xs` (m,) and `rises` (n, m) above the seat."""
    return np.array([[back_point(s, x, y) for x, y in zip(xs, row, strict=True)] for row in rises])


def _camelback(rng: np.random.Generator) -> Builder:
    """Build a sofa with an arched or double-arched back on visible legs."""
    b = Builder()
    s = draw_seating(rng, int(rng.integers(2, 4)), arms=("rolled", "slope", "padded"))
    s = replace(s, foot=rng.uniform(0.1, 0.22), back=rng.uniform(0.28, 0.42))
    add_base(b, s)
    add_seat_cushions(b, replace(s, seats=1) if rng.random() < 0.5 else s)
    humps, swell = int(rng.integers(1, 4)), rng.uniform(0.08, 0.2)
    u = np.linspace(-1, 1, 33)
    arch = np.abs(np.sin(np.pi * humps * (u + 1) / 2)) ** (2 if humps == 1 else 0.7)
    tops = s.back + swell * arch
    width = (s.width + s.arm) / 2
    rows = np.linspace(0, 1, 7)[:, None] * (tops + 0.2) - 0.2
    grid = _back_grid(s, u * width, rows)
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
    s = draw_seating(rng, 1, arms=("rolled", "flare", "box"))
    s = replace(s, width=rng.uniform(1.25, 1.75), depth=rng.uniform(0.6, 0.78))
    s = replace(s, arm_rise=rng.uniform(0.22, 0.42), thick=rng.uniform(0.1, 0.16), rake=4.0)
    head = int(rng.choice([-1, 1]))
    add_base(b, s)
    cushion = (s.width + 0.5 * s.arm, s.cushion, s.depth - s.thick)
    at = (-head * 0.25 * s.arm, s.seat - s.cushion / 2, -0.5 * s.thick)
    b.rounded_box("seat", s.pillows, at, cushion, 0.1, 0.4 * s.cushion)
    add_arm(b, s, head)
    length = rng.uniform(0.45, 0.95)
    low, fall = rng.uniform(0.06, 0.15), rng.uniform(0.7, 2.0)
    u = np.linspace(0, 1, 21)
    edge = head * (s.width / 2 + 0.5 * s.arm)
    xs = edge - head * u * length * (s.width + 0.3 * s.arm)
    tops = low + (s.arm_rise - low) * (0.5 + 0.5 * np.cos(np.pi * u**fall))
    rows = np.linspace(0, 1, 6)[:, None] * (tops + 0.1) - 0.1
    grid = _back_grid(s, xs, rows)
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
        fill, gap = draw(rng, ["bars", "slats", "panel"]), rng.uniform(0.08, 0.16)
        fill_side(b, frame, tops[2:], deck, "back", fill, gap)
        for pair in (tops[[0, 3]], tops[[1, 2]]):
            pair[:, 1] = pair[:, 1].min()
            fill_side(b, frame, pair, deck, "arm", fill, gap)
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


def _curved(rng: np.random.Generator) -> Builder:
    """Build a sofa bent around its front: part of a ring, its back along the outside."""
    b = Builder()
    s = draw_seating(rng, int(rng.integers(2, 6)))
    half = np.radians(rng.uniform(35, 95))
    outer = max(s.seats * 0.36 / half + 0.3, 1.0)
    inner = outer - s.depth
    angles = np.linspace(-half, half, 33)
    arc(b, "seat", s.cover, (inner + 0.02, outer), (s.foot, s.seat - 0.8 * s.cushion), angles)
    cuts = np.linspace(-half, half, s.seats + 1)
    for start, end in pairwise(cuts):
        gap = 0.004 / outer
        part = np.linspace(start + gap, end - gap, 9)
        radii = (inner, outer - 0.7 * s.thick)
        arc(b, "seat", s.pillows, radii, (s.seat - s.cushion, s.seat), part)
    fall = rng.uniform(0.0, 0.75) * s.back
    tops = s.seat + s.back - fall * np.abs(angles / half) ** rng.uniform(2, 5)
    arc(b, "back", s.cover, (outer - s.thick, outer + 0.02), (s.foot + 0.02, tops), angles)
    if rng.random() < 0.45:
        wide = s.arm / outer
        for side in (-1, 1):
            ends = side * (half + np.linspace(0, wide, 3))
            top = s.seat + min(s.arm_rise, s.back - fall)
            arc(b, "arm", s.cover, (inner, outer + 0.01), (s.foot, top), ends)
    style = LegStyle("round", 0.055, ((0.0, 0.7), (0.5, 0.85), (1.0, 1.0)))
    for r in (inner + 0.09, outer - 0.09):
        for angle in np.linspace(-0.93, 0.93, 3 if half < 1 else 5) * half:
            foot = np.array([r * np.sin(angle), 0, r * np.cos(angle)])
            add_leg(b, "leg", s.frame, style, foot + (s.foot + 0.02) * UP, foot)
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
