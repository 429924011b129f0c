"""Tables: four-legged, pedestal, trestle, drawer desk, round, nested, two-tier, slab-sided."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.parts.desk import desk
from ffd_lightning.shapes.parts.furniture import (
    UP,
    LegStyle,
    add_leg,
    add_legs,
    beam,
    circle,
    corners,
    draw,
    draw_leg_style,
    rails,
    stretchers,
)
from ffd_lightning.shapes.parts.tabletops import (
    SIZES,
    draw_materials,
    draw_size,
    drawer_fronts,
    rectangular_top,
    round_top,
)
from ffd_lightning.shapes.shapes import Builder, Family, Material, pick_material

PARTS = ("top", "leg", "support", "shelf", "drawer")


def _frame(
    b: Builder,
    rng: np.random.Generator,
    material: Material,
    style: LegStyle,
    size: tuple[float, float, float],
    under: float,
    shelves: Material | None = None,
) -> None:
    """Add four legs, an apron, and perhaps stretchers or a shelf, below a top's underside."""
    width, depth, _ = size
    inset = style.thickness * rng.uniform(1.1, 1.6) + rng.uniform(0, 0.08) * depth
    splay = rng.uniform(0.02, 0.12) * under if rng.random() < 0.35 else 0.0
    splay = min(splay, 0.8 * inset)
    tops = corners(width - 2 * inset, depth - 2 * inset, under + 0.002)
    feet = corners(width - 2 * (inset - splay), depth - 2 * (inset - splay), 0.0)
    add_legs(b, "leg", material, style, tops, feet)
    if not style.plain:
        return
    apron = rng.uniform(0.06, 0.13) * min(1.0, under / 0.6)
    if rng.random() < 0.75:
        level = 1 - (apron / 2 + 0.004) / under
        rails(b, "support", material, feet + level * (tops - feet), 0.022, apron)
    kind = draw(rng, ["none", "box", "h", "x", "shelf"], [0.42, 0.13, 0.15, 0.08, 0.22])
    level = rng.uniform(0.15, 0.4) if kind != "box" else rng.uniform(0.08, 0.25)
    points = feet + level * (tops - feet)
    if kind == "shelf":
        spread = np.ptp(points, axis=0) + style.thickness
        shelf = (spread[0], 0.02, spread[2])
        board = material if shelves is None else shelves
        b.rounded_box("shelf", board, (0, points[0, 1], 0), shelf, 0.02)
    elif kind != "none":
        stretchers(b, "support", material, points, 0.5 * style.thickness, kind)


def _four_legged(rng: np.random.Generator) -> Builder:
    """Build a rectangular table on four legs, sometimes with drawers in its apron."""
    b = Builder()
    size = draw_size(rng, *SIZES)
    top, base = draw_materials(rng)
    thickness = rng.uniform(0.02, 0.05)
    rectangular_top(b, rng, top, size, thickness)
    style = draw_leg_style(rng, (0.035, 0.085))
    under = size[2] - thickness
    _frame(b, rng, base, style, size, under, shelves=base)
    if style.plain and rng.random() < 0.25:
        height = rng.uniform(0.08, 0.14)
        inset = 2.3 * style.thickness + 0.09 * size[1]
        width, depth = size[0] - 2 * inset, size[1] - 2 * inset
        if width > 0.15 and depth > 0.05:
            center = (0, under - height / 2 - 0.004, 0)
            b.box("support", base, center, (width, height, depth))
            columns = max(1, round(width / rng.uniform(0.4, 0.7)))
            metal = pick_material(rng, "metal")
            front = (0.0, under - height / 2, -depth / 2)
            drawer_fronts(b, base, metal, front, (width, height), 1, columns, rng.random() < 0.5)
    return b


def _column(
    b: Builder, rng: np.random.Generator, material: Material, x: float, low: float, top: float
) -> None:
    """Add a plain, conical or turned column at `x` from `low` up to `top`."""
    r, rise = rng.uniform(0.03, 0.07), top - low
    kind = draw(rng, ["plain", "cone", "turned"])
    if kind == "plain":
        rows = [(r, 0), (r, rise - 0.03), (2.2 * r, rise - 0.02), (2.2 * r, rise)]
    elif kind == "cone":
        waist = rng.uniform(0.3, 0.6)
        ends = rng.uniform(1.5, 3.0, 2)
        rows = [(ends[0] * r, 0), (r, waist * rise), (0.9 * r, 0.8 * rise), (ends[1] * r, rise)]
    else:
        levels = np.linspace(0.15, 0.9, 7)
        bulges = rng.uniform(0.7, 1.7, 7)
        rows = [(1.6 * r, 0), *((k * r, t * rise) for k, t in zip(bulges, levels, strict=True))]
        rows += [(1.8 * r, 0.97 * rise), (1.8 * r, rise)]
    b.lathe("leg", material, rows, (x, low, 0), segments=28)


def _foot(
    b: Builder, rng: np.random.Generator, material: Material, x: float, reach: float
) -> float:
    """Add a disc, a plinth or three to five arched feet; return where the column starts."""
    kind = draw(rng, ["disc", "plinth", "feet"], [0.4, 0.15, 0.45])
    if kind == "disc":
        rise = rng.uniform(0.03, 0.08)
        rows = [(reach, 0), (reach, 0.015), (0.6 * reach, 0.5 * rise), (0.15 * reach, rise)]
        b.lathe("leg", material, rows, (x, 0, 0), segments=40)
        return 0.02
    if kind == "plinth":
        size = (1.4 * reach, 0.04, 1.4 * reach)
        b.rounded_box("leg", material, (x, 0.02, 0), size, 0.03)
        return 0.02
    rise, radius = rng.uniform(0.08, 0.22), rng.uniform(0.018, 0.03)
    for end in circle(int(rng.integers(3, 6)), reach, radius, 90.0):
        knee, ankle = 0.45 * end + 0.85 * rise * UP, 0.85 * end + 0.25 * rise * UP
        path = np.array([rise * UP, knee, ankle, end]) + np.array([x, 0, 0])
        b.tube("leg", material, path, (1.5 * radius, 1.3 * radius, radius, radius), 10)
    return 0.7 * rise


def _pedestal(rng: np.random.Generator) -> Builder:
    """Build a round, oval, square or long top on one column, or on two where it is long."""
    b = Builder()
    top, base = draw_materials(rng)
    height = rng.uniform(*SIZES[draw(rng, ["dining", "bar", "side", "coffee"])][2])
    half = rng.uniform(0.28, 0.65) if height < 0.9 else rng.uniform(0.25, 0.4)
    thickness = rng.uniform(0.02, 0.05)
    shape = draw(rng, ["round", "oval", "polygon", "square", "long"], [0.35, 0.15, 0.1, 0.2, 0.2])
    reach = half * rng.uniform(0.55, 0.75)
    columns = [0.0]
    if shape in ("square", "long"):
        width = 2 * half * (rng.uniform(1.5, 2.2) if shape == "long" else 1.0)
        rectangular_top(b, rng, top, (width, 2 * half, height), thickness, 0.5)
        columns = [-0.27 * width, 0.27 * width] if shape == "long" else columns
    else:
        squash = rng.uniform(0.55, 0.75) if shape == "oval" else 1.0
        reach *= squash
        segments = int(rng.choice([6, 8])) if shape == "polygon" else 40
        round_top(b, top, half, height, thickness, squash, segments=segments)
    state = int(rng.integers(1 << 30))
    for x in columns:  # the same draws for each column, so that a pair matches
        same = np.random.default_rng(state)
        low = _foot(b, same, base, x, reach)
        _column(b, same, base, x, low, height - thickness + 0.002)
    return b


def _trestle(rng: np.random.Generator) -> Builder:
    """Build a long top on two X, A, H or T trestles joined by a beam."""
    b = Builder()
    width, depth, height = draw_size(rng, "dining", "coffee", "bar")
    top, base = draw_materials(rng)
    thickness = rng.uniform(0.025, 0.06)
    rectangular_top(b, rng, top, (width, depth, height), thickness, 0.45)
    under = height - thickness + 0.002
    kind = draw(rng, ["x", "a", "h", "t"])
    reach = width / 2 * rng.uniform(0.55, 0.82)
    spread = depth / 2 * rng.uniform(0.65, 0.85)
    side = rng.uniform(0.05, 0.09)
    for x in (-reach, reach):
        _trestle_end(b, base, kind, x, spread, under, side)
    level = {"x": 0.5, "a": 0.3, "h": rng.uniform(0.2, 0.4), "t": rng.uniform(0.2, 0.5)}[kind]
    y = level * under
    beam(b, "support", base, (-reach, y, 0), (reach, y, 0), 0.5 * side, side)
    if rng.random() < 0.3:
        for x in (-reach, reach):
            end = (0.25 * x, under - 0.01, 0)
            beam(b, "support", base, (x, y, 0), end, 0.5 * side, 0.5 * side)
    return b


def _trestle_end(
    b: Builder, material: Material, kind: str, x: float, spread: float, top: float, side: float
) -> None:
    """Add one trestle at `x`: its feet and head reach +-`spread` along z."""
    post = LegStyle("square", side, ((0.0, 1.0), (0.5, 1.0), (1.0, 1.0)))
    ends = {"x": (-1.0, 1.0), "a": (0.3, 1.0), "h": (0.7, 0.7), "t": (0.0, 0.0)}[kind]
    for sign in (-1, 1) if kind != "t" else (1,):
        high = (x, top - 0.5 * side, sign * ends[0] * spread)
        low = (x, 0.0, sign * ends[1] * spread)
        add_leg(b, "leg", material, post, high, low, (0.8, 2.0 if kind == "t" else 1.0))
    head = (0.9 * side, side, 2 * spread + side)
    b.rounded_box("support", material, (x, top - side / 2, 0), head, 0.01)
    if kind in ("h", "t"):
        b.rounded_box("leg", material, (x, side / 2, 0), head, 0.2 * side)
    if kind == "a":
        beam(b, "support", material, (x, 0.3 * top, -0.75 * spread), (x, 0.3 * top, 0.75 * spread),
             0.5 * side, 0.7 * side)  # fmt: skip


def _round(rng: np.random.Generator) -> Builder:
    """Build a round or oval top on three to five legs, or a drum."""
    b = Builder()
    top, base = draw_materials(rng)
    height = rng.uniform(*SIZES[draw(rng, ["dining", "bar", "side", "coffee"])][2])
    radius = rng.uniform(0.22, 0.4) if rng.random() < 0.5 or height > 0.8 else rng.uniform(0.4, 0.7)
    squash = rng.uniform(0.6, 0.85) if rng.random() < 0.25 else 1.0
    thickness = rng.uniform(0.02, 0.05)
    round_top(b, top, radius, height, thickness, squash)
    under, oval = height - thickness + 0.002, np.array([1, 1, squash])
    if rng.random() < 0.12:
        waist = radius * rng.uniform(0.45, 0.95)
        rows = [(0.85 * radius, 0), (waist, under / 2), (0.85 * radius, under)]
        b.lathe("leg", base, rows, segments=40, squash=squash)
        return b
    style = draw_leg_style(rng, (0.035, 0.06))
    count = int(rng.integers(3, 6))
    turn = 90.0 + 180.0 / count
    tops = circle(count, radius * rng.uniform(0.55, 0.8), under, turn) * oval
    feet = circle(count, radius * rng.uniform(0.7, 1.05), 0, turn) * oval
    add_legs(b, "leg", base, style, tops, feet)
    kind = draw(rng, ["none", "shelf", "apron", "spokes"], [0.25, 0.3, 0.3, 0.15])
    level = rng.uniform(0.2, 0.4)
    points = feet + level * (tops - feet)
    if kind == "shelf":
        reach = float(np.linalg.norm((points / oval)[0, [0, 2]]))
        round_top(b, base, 1.02 * reach, level * under, 0.02, squash, "shelf")
    elif kind == "apron" and style.plain:
        rails(b, "support", base, feet + 0.94 * (tops - feet), 0.02, 0.11 * under)
    elif kind == "spokes" and style.plain:
        hub = np.array([0, level * under, 0])
        for point in points:
            beam(b, "support", base, point, hub, 0.025, 0.025)
        b.cylinder("support", base, hub - (0, 0.02, 0), hub + 0.02 * UP, 0.045)
    return b


def _nested(rng: np.random.Generator) -> Builder:
    """Build two or three tables of one design, each smaller one pulled out from the last."""
    b = Builder()
    width, depth, height = draw_size(rng, "side", "coffee")
    top, base = draw_materials(rng)
    panel, side = rng.random() < 0.35, rng.uniform(0.025, 0.045)
    pull = np.array([0, 0, -rng.uniform(0.12, 0.35)])
    style = LegStyle(draw(rng, ["square", "round"]), side, ((0, 0.8), (0.5, 0.9), (1, 1)))
    rail = draw(rng, ["sides", "box", "none"])
    for i in range(int(rng.integers(2, 4))):
        w = width - i * max(0.17 * width, 3.2 * side)
        d, h = (1 - 0.1 * i) * depth, (1 - 0.16 * i) * height
        at = pull * i * np.array([width, 0, depth])
        slab = (w, side * 0.8, d)
        b.rounded_box("top", top, at + (h - 0.4 * side) * UP, slab, 0.02, 0.01)
        under = h - 0.8 * side + 0.002
        feet = corners(w - 1.2 * side, d - 1.6 * side, 0.0) + at
        if panel:
            for x in (-0.5, 0.5):
                board = (0.7 * side, under, d - 0.5 * side)
                offset = np.array([x * (w - 1.4 * side), under / 2, 0])
                b.rounded_box("leg", base, at + offset, board, 0.01)
            continue
        add_legs(b, "leg", base, style, feet + under * UP, feet)
        low = feet + side / 2 * UP
        if rail == "sides":
            beam(b, "support", base, low[0], low[3], 0.7 * side, 0.7 * side)
            beam(b, "support", base, low[1], low[2], 0.7 * side, 0.7 * side)
        elif rail == "box":
            rails(b, "support", base, feet + (under - 0.03) * UP, 0.015, 0.06)
    return b


def _two_tier(rng: np.random.Generator) -> Builder:
    """Build a low table with one to three lower shelves between legs, panels or a cross."""
    b = Builder()
    width, depth, height = draw_size(rng, "coffee", "coffee", "side", "console")
    top, base = draw_materials(rng)
    thickness, kind = rng.uniform(0.015, 0.045), draw(rng, ["posts", "panels", "drawers"])
    rectangular_top(b, rng, top, (width, depth, height), thickness)
    under = height - thickness + 0.002
    shelves = int(rng.integers(1, 4)) if height > 0.42 else 1
    levels = np.linspace(rng.uniform(0.12, 0.35), 0.95, shelves + 1)[:-1] * under
    board = np.array([0.94 * width, rng.uniform(0.012, 0.03), 0.9 * depth])
    lower = base if rng.random() < 0.5 else top
    for y in levels:
        b.rounded_box("shelf", lower, (0, y, 0), board, 0.02)
    if kind == "posts":
        style = draw_leg_style(rng, (0.03, 0.07), hairpin=0.0)
        feet = corners(board[0] - 0.9 * style.thickness, board[2] - 0.9 * style.thickness, 0.0)
        add_legs(b, "leg", base, style, feet + under * UP, feet)
        return b
    for x in (-0.5, 0.5):
        panel = (0.025, under, 0.88 * depth)
        b.rounded_box("leg", base, (x * 0.94 * width, under / 2, 0), panel, 0.01)
    if kind == "drawers":
        box = min(0.15, under - levels[-1] - 0.02)
        center = (0, under - box / 2 - 0.004, 0)
        b.box("support", base, center, (0.93 * width, box, 0.82 * depth))
        face = (0, under - box / 2, -0.41 * depth)
        columns = int(rng.integers(1, 4))
        metal = pick_material(rng, "metal")
        drawer_fronts(b, base, metal, face, (0.9 * width, 0.92 * box), 1, columns)
    return b


def _slab(rng: np.random.Generator) -> Builder:
    """Build a parsons table, a waterfall of three slabs, a cube, or a C-shaped side table."""
    b = Builder()
    kind = draw(rng, ["parsons", "waterfall", "cube", "c"], [0.35, 0.35, 0.15, 0.15])
    uses = ("side",) if kind in ("cube", "c") else ("dining", "coffee", "console", "side", "square")
    width, depth, height = draw_size(rng, *uses)
    top, base = draw_materials(rng)
    base = top if rng.random() < 0.6 and top.alpha == 1 else base
    side = rng.uniform(0.035, 0.09) * (0.7 if kind == "c" else 1.0)
    slab = (width, side, depth)
    b.rounded_box("top", top, (0, height - side / 2, 0), slab, 0.2 * side, segments=4)
    under = height - side + 0.002
    if kind == "parsons":
        style = LegStyle("square", side, ((0, 1), (0.25, 1), (0.5, 1), (0.75, 1), (1, 1)))
        feet = corners(width - side, depth - side, 0.0)
        add_legs(b, "leg", base, style, feet + under * UP, feet)
    else:
        ends = {"waterfall": (-1, 1), "cube": (-1, 1), "c": (-1,)}[kind]
        for x in ends:
            center = (x * (width - side) / 2, under / 2, 0)
            b.rounded_box("leg", base, center, (side, under, depth), 0.2 * side, segments=4)
    if kind == "cube" or (kind == "waterfall" and rng.random() < 0.4):
        level = rng.uniform(0.15, 0.5) * under if kind == "waterfall" else side / 2
        inner = (width - 1.9 * side, 0.6 * side, 0.97 * depth)
        b.rounded_box("shelf", base, (0, level, 0), inner, 0.1 * side, segments=4)
    if kind == "cube" and rng.random() < 0.6:
        back = (width - 1.9 * side, under - 0.01, 0.02)
        b.rounded_box("support", base, (0, under / 2, depth / 2 - 0.02), back, 0.008)
    if kind == "c":
        b.rounded_box("leg", base, (0, side / 2, 0), slab, 0.2 * side, segments=4)
    return b


FAMILIES: dict[str, Family] = {
    "four_legged": _four_legged,
    "pedestal": _pedestal,
    "trestle": _trestle,
    "desk": desk,
    "round": _round,
    "nested": _nested,
    "two_tier": _two_tier,
    "slab": _slab,
}
