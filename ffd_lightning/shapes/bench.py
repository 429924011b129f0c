"""Benches: park, plank, picnic, upholstered, settle, stone, curved, spindle-backed."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ffd_lightning.shapes.parts.furniture import (
    UP,
    LegStyle,
    add_leg,
    add_legs,
    arc,
    beam,
    bend,
    corners,
    draw,
    draw_leg_style,
    fill_side,
    lean,
    pad,
    rails,
)
from ffd_lightning.shapes.parts.park_bench import add_boards, draw_bench_size, park
from ffd_lightning.shapes.parts.upholstery import draw_cover
from ffd_lightning.shapes.shapes import (
    Builder,
    Family,
    Material,
    pick_material,
)

PARTS = ("seat", "back", "arm", "leg", "table")

_STRAIGHT = ((0.0, 1.0), (0.5, 1.0), (1.0, 1.0))


def _plank(rng: np.random.Generator) -> Builder:
    """Build a backless bench: boards on legs, slab ends, crossed legs or trestles."""
    b = Builder()
    length, depth, height = draw_bench_size(rng)
    depth *= 0.85
    top = pick_material(rng, draw(rng, ["wood", "paint", "plastic"], [0.75, 0.15, 0.1]))
    base = top if rng.random() < 0.5 else pick_material(rng, draw(rng, ["metal", "wood"]))
    under = add_boards(b, rng, top, (length, depth, height), int(rng.integers(1, 6))) + 0.002
    reach, half = length / 2 * rng.uniform(0.72, 0.92), 0.42 * depth
    kind = draw(rng, ["legs", "slabs", "cross", "loops"])
    if kind == "legs":
        style = draw_leg_style(rng, (0.035, 0.07), hairpin=0.2)
        out = rng.uniform(1.0, 1.08)
        tops = corners(2 * reach, 1.8 * half, under)
        feet = tops * np.array([out, 0, out])
        add_legs(b, "leg", base, style, tops, feet)
        if style.plain:
            rails(b, "leg", base, feet + 0.9 * (tops - feet), 0.02, 0.07)
            if rng.random() < 0.4:
                level = rng.uniform(0.25, 0.45) * height
                shelf = (2 * reach, depth, level)
                add_boards(b, rng, base, shelf, int(rng.integers(3, 6)))
        return b
    thick = rng.uniform(0.03, 0.06)
    for x in (-reach, reach):
        _plank_end(b, base, kind, x, half, under, thick)
    if kind != "loops" or rng.random() < 0.5:
        y = height * (0.5 if kind == "cross" else rng.uniform(0.3, 0.9))
        beam(b, "leg", base, (-reach, y, 0), (reach, y, 0), 0.03, rng.uniform(0.03, 0.08))
    return b


def _plank_end(
    b: Builder, base: Material, kind: str, x: float, half: float, top: float, thick: float
) -> None:
    """Carry a plank at `x` by a slab, a cross or a loop that reaches +-`half` along z."""
    if kind == "slabs":
        b.rounded_box("leg", base, (x, top / 2, 0), (thick, top, 1.9 * half), 0.01, segments=4)
    elif kind == "cross":
        post = LegStyle("square", thick, _STRAIGHT)
        for sign in (-1, 1):
            high, low = (x, top, -sign * half), (x, 0, sign * half)
            add_leg(b, "leg", base, post, high, low, (0.7 + 0.2 * sign, 1.5))
    else:
        path = [(x, top, -half), (x, 0.014, -half), (x, 0.014, half), (x, top, half)]
        b.tube("leg", base, bend(path, 0.04), 0.014, 10)
        beam(b, "leg", base, (x, top - 0.01, -half), (x, top - 0.01, half), 0.03, 0.02)


def _picnic(rng: np.random.Generator) -> Builder:
    """Build a table and two benches on common A-frames."""
    b = Builder()
    wood = pick_material(rng, draw(rng, ["wood", "paint"], [0.8, 0.2]))
    base = wood if rng.random() < 0.6 else pick_material(rng, "metal")
    length, height, seat = rng.uniform(1.2, 2.2), rng.uniform(0.7, 0.78), rng.uniform(0.42, 0.47)
    depth, out = rng.uniform(0.6, 0.85), rng.uniform(0.58, 0.72)
    table = (length, depth, height)
    under = add_boards(b, rng, wood, table, int(rng.integers(4, 7)), part="table")
    wide = rng.uniform(0.22, 0.32)
    stretch, boards = length * rng.uniform(0.9, 1.0), int(rng.integers(1, 4))
    for z in (-out, out):
        low = add_boards(b, rng, wood, (stretch, wide, seat), boards, z)
    post = LegStyle("square", rng.uniform(0.045, 0.07), _STRAIGHT)
    reach = length * rng.uniform(0.3, 0.38)
    for x in (-reach, reach):
        for sign in (-1, 1):
            foot = (x, 0, sign * out * 0.95)
            add_leg(b, "leg", base, post, (x, under, sign * 0.3 * depth), foot, (0.7, 1.4))
        tip = out + 0.45 * wide
        beam(b, "leg", base, (x, low - 0.04, -tip), (x, low - 0.04, tip), 0.045, 0.08)
        ends = (x, under - 0.03, -0.45 * depth), (x, under - 0.03, 0.45 * depth)
        beam(b, "leg", base, *ends, 0.045, 0.06)
        beam(b, "leg", base, (x, low - 0.04, 0), (0.25 * x, under - 0.01, 0), 0.04, 0.06)
    return b


def _upholstered(rng: np.random.Generator) -> Builder:
    """Build a padded seat on legs, perhaps buttoned, with scrolled ends or a low back."""
    b = Builder()
    length, depth, height = draw_bench_size(rng)
    cover, soft = draw_cover(rng), rng.uniform(0.07, 0.16)
    frame = pick_material(rng, draw(rng, ["wood", "metal"], [0.7, 0.3]))
    cushion = (length, soft, depth)
    b.rounded_box("seat", cover, (0, height - soft / 2, 0), cushion, 0.05, 0.4 * soft)
    under = height - soft
    if rng.random() < 0.6:
        size = (0.98 * length, 0.05, 0.96 * depth)
        b.rounded_box("seat", frame, (0, under - 0.015, 0), size, 0.01)
    style = draw_leg_style(rng, (0.035, 0.07), hairpin=0.12)
    xs = np.linspace(-1, 1, 2 if length < 1.5 else 3) * (length / 2 - 0.09)
    z = depth / 2 - 0.08
    tops = np.array([(x, under - 0.01, side) for side in (-z, z) for x in xs])
    add_legs(b, "leg", frame, style, tops, tops * np.array([1, 0, 1]))
    if rng.random() < 0.5:
        rows, columns = int(rng.integers(2, 4)), round(length / 0.17)
        for x in np.linspace(-0.42, 0.42, columns) * length:
            for at in np.linspace(-0.3, 0.3, rows) * depth:
                button = [(0.016, -0.004), (0.018, 0.002), (0.009, 0.009)]
                b.lathe("seat", frame, button, (x, height, at), 8)
    kind = draw(rng, ["none", "ends", "back"], [0.35, 0.35, 0.3])
    rise, thick = rng.uniform(0.15, 0.4), rng.uniform(0.06, 0.1)
    middle = height + (rise - soft) / 2
    for side in (-1, 1) if kind == "ends" else ():
        x = side * (length / 2 + 0.02)
        b.rounded_box("arm", cover, (x, middle, 0), (thick, rise + soft, depth), 0.02)
        roll = np.array([x + side * 0.3 * thick, height + rise, 0])
        half = np.array([0, 0, depth / 2])
        b.cylinder("arm", cover, roll - half, roll + half, 0.75 * thick)
    if kind == "back":
        size = (length, rise + soft, thick)
        pad(b, "back", cover, (0, middle, depth / 2), size, 0.05, rng.uniform(2, 10))
    return b


def _settle(rng: np.random.Generator) -> Builder:
    """Build a chest or frame with a high back and closed or barred ends."""
    b = Builder()
    length, depth, height = draw_bench_size(rng)
    wood = pick_material(rng, draw(rng, ["wood", "paint"], [0.7, 0.3]))
    post, rise = rng.uniform(0.045, 0.07), rng.uniform(0.3, 0.8)
    arm = min(rng.uniform(0.18, 0.3), rise)
    feet = corners(length - post, depth - post, 0.0)
    tops = feet + np.array([[arm], [arm], [rise], [rise]]) * UP + height * UP
    style = LegStyle("square", post, ((0.0, 1.0), (0.3, 1.0), (0.6, 1.0), (1.0, 1.0)))
    add_legs(b, "leg", wood, style, tops, feet)
    add_boards(b, rng, wood, (length - post, depth, height), 1)
    if rng.random() < 0.5:
        low = rng.uniform(0.02, 0.1)
        chest = (length - post, height - low - 0.01, depth - post)
        b.rounded_box("seat", wood, (0, (height + low) / 2, 0), chest, 0.008)
        count = int(rng.integers(2, 5))
        for i in range(count):
            x = ((i + 0.5) / count - 0.5) * chest[0]
            panel = (0.85 * chest[0] / count, 0.65 * chest[1], 0.03)
            at = (x, (height + low) / 2, -chest[2] / 2)
            b.rounded_box("seat", wood, at, panel, 0.008)
    else:
        rails(b, "leg", wood, feet + (height - 0.07) * UP, 0.025, 0.08)
    fill, gap = draw(rng, ["bars", "slats", "panel"]), rng.uniform(0.07, 0.14)
    fill_side(b, wood, tops[2:], height, "back", fill, gap)
    for pair in (tops[[0, 3]], tops[[1, 2]]):
        pair[:, 1] = pair[:, 1].min()
        fill_side(b, wood, pair, height, "arm", fill, gap)
    if rng.random() < 0.5:
        soft = rng.uniform(0.04, 0.09)
        size = (length - 2.2 * post, soft, depth - 1.5 * post)
        b.rounded_box("seat", draw_cover(rng), (0, height + 0.45 * soft, 0), size, 0.04)
    return b


def _pedestal(
    b: Builder, stone: Material, kind: str, x: float, plan: tuple[float, float], top: float
) -> None:
    """Add a block, a flared block or a turned foot at `x`, `plan` (width, depth), up to `top`."""
    if kind == "turned":
        r = 0.48 * plan[1]
        radii = np.array([1, 1, 0.6, 0.8, 0.55, 1, 1]) * r
        heights = [0, 0.05, 0.09, 0.45 * top, 0.8 * top, top - 0.03, top]
        b.lathe("leg", stone, np.column_stack([radii, heights]), (x, 0, 0))
        return
    flare = 1.5 if kind == "flared" else 1.0
    rings = []
    for t, k in zip((0, 0.12, 0.3, 0.7, 0.88, 1), (flare, flare, 1, 1, flare, flare), strict=True):
        ring = corners(k * plan[0], (0.7 + 0.3 * k) * plan[1], t * top)
        rings.append(ring + np.array([x, 0, 0]))
    b.loft("leg", stone, rings)


def _stone(rng: np.random.Generator) -> Builder:
    """Build a heavy slab on two blocks or turned pedestals, sometimes with a slab back."""
    b = Builder()
    length, depth, height = draw_bench_size(rng)
    grey = rng.uniform(0.45, 0.85)
    color = (grey, grey * rng.uniform(0.93, 1.0), grey * rng.uniform(0.82, 0.98))
    stone = Material(color, "speckle", 3.0, seed=int(rng.integers(1 << 30)))
    thick, edge = rng.uniform(0.06, 0.15), rng.uniform(0.008, 0.03)
    slab = (length, thick, depth)
    b.rounded_box("seat", stone, (0, height - thick / 2, 0), slab, 0.05, edge, segments=6)
    under, reach = height - thick + 0.002, length / 2 * rng.uniform(0.6, 0.85)
    kind, wide = draw(rng, ["blocks", "turned", "flared"]), rng.uniform(0.08, 0.2)
    for x in (-reach, reach):
        _pedestal(b, stone, kind, x, (wide, 0.75 * depth), under)
    if rng.random() < 0.35:
        rise, t = rng.uniform(0.28, 0.5), rng.uniform(0.05, 0.1)
        at = (0, height + rise / 2 - 0.01, depth / 2 - 0.6 * t)
        pad(b, "back", stone, at, (length, rise, t), rng.uniform(0.02, 0.2), rng.uniform(0, 6))
    return b


def _curved(rng: np.random.Generator) -> Builder:
    """Build a bench bent around its front: bows of boards on posts, with or without a back."""
    b = Builder()
    _, depth, height = draw_bench_size(rng)
    wood = pick_material(rng, draw(rng, ["wood", "paint"], [0.75, 0.25]))
    base = pick_material(rng, draw(rng, ["metal", "wood"]))
    half, inner = np.radians(rng.uniform(25, 120)), rng.uniform(0.55, 1.3)
    angles = np.linspace(-half, half, 29)
    count, thick = int(rng.integers(1, 6)), rng.uniform(0.03, 0.06)
    edges = np.linspace(inner, inner + depth, count + 1)
    gap = 0.15 * depth / count if count > 1 else 0.0
    for start, end in pairwise(edges):
        arc(b, "seat", wood, (start, end - gap), (height - thick, height), angles)
    back, rows = rng.uniform(0.25, 0.45), int(rng.integers(1, 4))
    backed = rng.random() < 0.55
    if backed:
        levels = np.linspace(0.4, 1.0, rows + 1) * back + height
        outer = inner + depth
        for low, high in pairwise(levels):
            arc(b, "back", wood, (outer, outer + 0.03), (low, high - 0.15 * (high - low)), angles)
    style = LegStyle(draw(rng, ["square", "round"]), rng.uniform(0.045, 0.08), _STRAIGHT)
    for angle in np.linspace(-0.92, 0.92, max(3, round(2 * half * inner / 0.7))) * half:
        out = np.array([np.sin(angle), 0, np.cos(angle)])
        for r in (inner + 0.12 * depth, inner + 0.85 * depth):
            foot = r * out
            add_leg(b, "leg", base, style, foot + (height - thick + 0.003) * UP, foot)
        level = (height - thick - 0.02) * UP
        beam(
            b, "leg", base, (inner + 0.03) * out + level, (inner + depth) * out + level, 0.04, 0.04
        )
        if backed:
            foot = (inner + depth - 0.012) * out
            beam(b, "back", base, foot + level, foot + (height + 0.97 * back) * UP, 0.03, 0.025)
    return b


def _spindle(rng: np.random.Generator) -> Builder:
    """Build a long wooden seat on splayed turned legs with a back of spindles and open arms."""
    b = Builder()
    length, depth, height = draw_bench_size(rng)
    wood = pick_material(rng, draw(rng, ["wood", "paint"], [0.65, 0.35]))
    thick = rng.uniform(0.03, 0.05)
    seat = (length, thick, depth)
    b.rounded_box("seat", wood, (0, height - thick / 2, 0), seat, 0.12, 0.4 * thick)
    style = draw_leg_style(rng, (0.035, 0.05), hairpin=0.0)
    xs = np.linspace(-1, 1, 2 if length < 1.4 else int(rng.integers(3, 5))) * (length / 2 - 0.1)
    splay = rng.uniform(0.02, 0.08)
    for x in xs:
        points = []
        for side in (-1, 1):
            top = np.array([x, height - thick + 0.003, side * (depth / 2 - 0.1)])
            foot = np.array([x + splay * np.sign(x), 0, top[2] + side * splay])
            add_leg(b, "leg", wood, style, top, foot)
            points.append(foot + 0.35 * (top - foot))
        b.cylinder("leg", wood, points[0], points[1], 0.012, segments=10)
    _spindle_back(b, rng, wood, length, depth, height)
    return b


def _spindle_back(
    b: Builder,
    rng: np.random.Generator,
    wood: Material,
    length: float,
    depth: float,
    height: float,
) -> None:
    """Add raked spindles below a crest, and perhaps arms, to a seat of these dimensions."""
    rise, degrees = rng.uniform(0.3, 0.55), rng.uniform(6, 15)
    turn, foot = lean(degrees), np.array([0, height - 0.01, depth / 2 - 0.04])
    half, radius = length / 2 - 0.05, rng.uniform(0.007, 0.012)
    for x in np.linspace(-half, half, round(length / rng.uniform(0.07, 0.14))):
        low, high = foot + turn @ np.array([x, 0, 0]), foot + turn @ np.array([x, rise, 0])
        b.cylinder("back", wood, low, high, radius, segments=8)
    crest = (length - 0.02, rng.uniform(0.05, 0.12), 0.026)
    pad(b, "back", wood, foot + turn @ np.array([0, rise, 0]), crest, 0.02, degrees)
    if rng.random() < 0.3:
        return
    level = rng.uniform(0.18, 0.24)
    rear = foot + turn @ np.array([0, level, 0])
    for x in (-half, half):
        front = (x, height + level, -depth / 2 + 0.06)
        beam(b, "arm", wood, front, (x, *rear[1:]), 0.05, 0.022)
        for z in (-depth / 2 + 0.1, -depth / 2 + 0.24):
            ends = (x, height - 0.01, z), (x, height + level, z)
            b.cylinder("arm", wood, *ends, 0.012, segments=8)


FAMILIES: dict[str, Family] = {
    "park": park,
    "plank": _plank,
    "picnic": _picnic,
    "upholstered": _upholstered,
    "settle": _settle,
    "stone": _stone,
    "curved": _curved,
    "spindle": _spindle,
}
