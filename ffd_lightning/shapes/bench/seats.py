"""Seats of benches, and what carries them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.bench.plan import Plan
from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.boards import beam, slats
from ffd_lightning.shapes.kit.legs import (
    add_leg,
    add_legs,
    add_trestle,
    draw_leg_style,
    square_post,
)
from ffd_lightning.shapes.kit.paths import bend, corners
from ffd_lightning.shapes.kit.vectors import UP, vec


def boards(b: Builder, rng: Rng, p: Plan, part: str = "seat", z: float = 0.0) -> None:
    """Add a level deck of boards."""
    count = int(rng.integers(2, 9)) if p.depth > 0.3 else int(rng.integers(1, 4))
    pitch = p.depth / count
    first, last = (vec(0, p.seat - p.thick / 2, z + s * (p.depth - pitch) / 2) for s in (-1, 1))
    size = (p.length, p.thick, pitch * (0.85 if count > 1 else 1.0))
    slats(b, part, p.wood, first, last, size, count)
    for x in p.xs if part == "seat" else ():
        ends = (
            vec(x, p.under - 0.018, z - 0.46 * p.depth),
            vec(x, p.under - 0.018, z + 0.46 * p.depth),
        )
        beam(b, part, p.frame, *ends, width=0.03, height=0.04)


def board(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one board, often with a cushion."""
    size, middle = vec(p.length, p.thick, p.depth), vec(0, p.seat - p.thick / 2, 0)
    b.rounded_box("seat", p.wood, middle, size, rng.uniform(0.01, 0.12), edge=0.4 * p.thick)
    if rng.random() < 0.4:
        soft = rng.uniform(0.03, 0.08)
        size = (p.length - 2.2 * p.side, soft, p.depth - p.side - 0.04)
        b.rounded_box("seat", p.cover, (0, p.seat + 0.45 * soft, -0.01), size, 0.04)


def pad(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a thick pad, often buttoned or in two or three parts, on a frame."""
    count = int(rng.choice([1, 2, 3], p=[0.7, 0.15, 0.15]))
    wide, middle = p.length / count, p.seat - p.thick / 2
    for i in range(count):
        x = (i + 0.5 - count / 2) * wide
        size = (0.995 * wide, p.thick, p.depth)
        b.rounded_box(
            "seat", p.cover, (x, middle, 0), size, rng.uniform(0.03, 0.06), edge=0.4 * p.thick
        )
    frame = (0.97 * p.length, 0.05, 0.95 * p.depth)
    b.rounded_box("seat", p.frame, (0, p.under - 0.01, 0), frame, 0.01)
    for x in np.linspace(-0.42, 0.42, round(p.length / 0.17)) if rng.random() < 0.4 else ():
        for z in np.linspace(-0.3, 0.3, 3):
            button = [(0.016, -0.004), (0.018, 0.002), (0.009, 0.009)]
            at = (x * p.length, p.seat, z * p.depth)
            b.lathe("seat", p.frame, button, at, segments=8)


def slab(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a slab of stone."""
    size = (p.length, p.thick, p.depth)
    b.rounded_box(
        "seat",
        p.wood,
        (0, p.seat - p.thick / 2, 0),
        size,
        0.05,
        edge=rng.uniform(0.008, 0.03),
        segments=6,
    )


def legs(b: Builder, rng: Rng, p: Plan) -> None:
    """Add pairs of legs, straight or splayed, with rails below the seat and between the legs."""
    style = draw_leg_style(rng, (p.side, p.side), hairpin=0.12)
    reach, splay = p.depth / 2 - p.side / 2, rng.choice([0.0, rng.uniform(0.0, 0.08)])
    tops = np.array([(x, p.under, z) for x in p.xs for z in (-reach + splay, reach - splay)])
    out = vec(1 + splay / p.length, 0, 1 + splay / reach)
    add_legs(b, "leg", p.frame, style, tops, tops * out)
    if not style.plain:
        return
    kind, t, tall = (
        draw(rng, ["apron", "pairs", "both", "none"]),
        rng.uniform(0.2, 0.5),
        rng.uniform(0.05, 0.1),
    )
    points = tops * (t + (1 - t) * out * vec(1, 0, 1)) * vec(1, 0, 1) + t * p.under * UP
    for i in range(0, len(tops), 2) if kind in ("pairs", "both") else ():
        beam(b, "leg", p.frame, points[i], points[i + 1], width=0.025, height=0.03)
    for i in (0, 1) if kind in ("apron", "both") else ():
        ends = tops[i] - tall / 2 * UP, tops[i - 2] - tall / 2 * UP
        beam(b, "leg", p.frame, *ends, width=0.022, height=tall)
    for one, two in ((0, 1), (-2, -1)) if kind in ("apron", "both") else ():
        ends = tops[one] - tall / 2 * UP, tops[two] - tall / 2 * UP
        beam(b, "leg", p.frame, *ends, width=0.022, height=tall)


def slabs(b: Builder, rng: Rng, p: Plan) -> None:
    """Add an upright board at each end, and often one on edge between them."""
    wide = rng.uniform(0.6, 1.0) * p.side
    for x in p.xs[[0, -1]]:
        size = (wide, p.under, p.depth * 0.92)
        b.rounded_box("leg", p.frame, (x, p.under / 2, 0), size, 0.01, segments=4)
    if rng.random() < 0.6:
        y, tall = p.under * rng.uniform(0.3, 0.8), rng.uniform(0.1, 0.35) * p.under
        beam(b, "leg", p.frame, (p.xs[0], y, 0), (p.xs[-1], y, 0), width=0.03, height=tall)


def trestles(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two trestles joined by a beam."""
    kind = draw(rng, ["x", "a", "h", "t"])
    for x in p.xs[[0, -1]]:
        y = add_trestle(b, p.frame, kind, x, 0.46 * p.depth, p.under, p.side)
    ends = (p.xs[0], y, 0), (p.xs[-1], y, 0)
    beam(b, "leg", p.frame, *ends, width=0.5 * p.side, height=p.side)


def loops(b: Builder, rng: Rng, p: Plan) -> None:
    """Add loops of tube, as wide as the seat or wider on the floor."""
    r, z, out = 0.22 * p.side, 0.45 * p.depth, rng.choice([0.0, rng.uniform(-0.05, 0.06)])
    for x in p.xs:
        path = [(x, p.under, -z), (x, r, -z - out), (x, r, z + out), (x, p.under, z)]
        b.tube("leg", p.frame, bend(path, rng.uniform(0.04, 0.12)), r, segments=10)
        beam(
            b,
            "leg",
            p.frame,
            (x, p.under - 0.01, -z),
            (x, p.under - 0.01, z),
            width=0.03,
            height=0.02,
        )


def iron(b: Builder, rng: Rng, p: Plan) -> None:
    """Add curved iron legs that are joined in pairs."""
    front, rear, low = -0.42 * p.depth, 0.45 * p.depth, p.under - 0.01
    for x in p.xs:
        path = bend([(x, 0, front - 0.06), (x, 0.5 * low, front + 0.04), (x, low, front)], 0.2)
        b.tube("leg", p.frame, path, 0.018, segments=8)
        path = bend([(x, 0, rear + 0.1), (x, 0.5 * low, rear - 0.05), (x, low, rear)], 0.2)
        b.tube("leg", p.frame, path, 0.018, segments=8)
        for y in (low, 0.45 * low):
            beam(
                b,
                "leg",
                p.frame,
                (x, y, front + 0.02),
                (x, y, rear - 0.03),
                width=0.016,
                height=0.03,
            )


def chest(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box with panels below the seat, on the floor or on short feet."""
    low = rng.choice([0.0, rng.uniform(0.03, 0.35) * p.under])
    size = vec(p.length - 0.02, p.under - low, p.depth - 0.03)
    b.rounded_box("seat", p.frame, (0, (p.under + low) / 2, 0), size, 0.008)
    count = int(rng.integers(1, 6))
    for i in range(count):
        panel = (0.88 * size[0] / count, 0.8 * size[1], 0.03)
        at = ((i + 0.5 - count / 2) * size[0] / count, (p.under + low) / 2, -size[2] / 2)
        b.rounded_box("seat", p.wood, at, panel, 0.008)
    tops = corners(size[0] - p.side, size[2] - p.side, low + 0.005)
    add_legs(b, "leg", p.frame, square_post(p.side), tops, tops * vec(1, 0, 1))


def blocks(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two blocks, flared blocks or turned feet of stone."""
    kind, wide, top = draw(rng, ["block", "flared", "turned"]), rng.uniform(0.08, 0.3), p.under
    for x in p.length / 2 * rng.uniform(0.55, 0.8) * vec(-1, 1, 0)[:2]:
        if kind == "turned":
            radii = np.array([1, 1, 0.6, 0.8, 0.55, 1, 1]) * 0.42 * p.depth
            heights = np.array([0, 0.1, 0.18, 0.45, 0.8, 0.93, 1]) * top
            b.lathe("leg", p.frame, np.column_stack([radii, heights]), (x, 0, 0))
            continue
        flare, levels = 1.5 if kind == "flared" else 1.0, (0, 0.12, 0.3, 0.7, 0.88, 1)
        grown = zip(levels, (flare, flare, 1, 1, flare, flare), strict=True)
        rings = [
            corners(k * wide, (0.5 + 0.2 * k) * p.depth, t * top) + vec(x, 0, 0) for t, k in grown
        ]
        b.loft("leg", p.frame, rings)


def picnic(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a table between two benches on common frames."""
    high, wide = rng.uniform(0.68, 0.8), rng.uniform(0.55, 0.9)
    out, post, state = (
        wide / 2 + rng.uniform(0.2, 0.4),
        square_post(p.side),
        int(rng.integers(1 << 30)),
    )
    table = replace(p, seat=high, depth=wide, length=p.length * rng.uniform(1.0, 1.1))
    boards(b, rng, table, "table")
    for z in (-out, out):
        boards(b, np.random.default_rng(state), p, z=z)
    low, top, tip = p.under - 0.06, table.under, out + 0.45 * p.depth
    for x in p.length * rng.uniform(0.28, 0.4) * np.array([-1, 1]):
        for sign in (-1, 1):
            ends = (x, top, sign * 0.3 * wide), (x, 0, sign * 0.95 * out)
            add_leg(b, "leg", p.frame, post, *ends, (0.7, 1.4))
        beam(b, "leg", p.frame, (x, low, -tip), (x, low, tip), width=0.045, height=0.08)
        ends_ = (x, top - 0.03, -0.45 * wide), (x, top - 0.03, 0.45 * wide)
        beam(b, "leg", p.frame, *ends_, width=0.045, height=0.06)
        beam(b, "leg", p.frame, (x, low, 0), (0.25 * x, top - 0.01, 0), width=0.04, height=0.06)


def nothing(b: Builder, rng: Rng, p: Plan) -> None:
    """Add nothing."""
