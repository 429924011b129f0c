"""Tops of tables, what carries them, and what is below and on them."""

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng, draw, nothing, pick_material
from ffd_lightning.shapes.kit.boards import beam, slats
from ffd_lightning.shapes.kit.legs import (
    LegStyle,
    add_legs,
    add_trestles,
    draw_leg_style,
    stretchers,
)
from ffd_lightning.shapes.kit.paths import bend, circle, corners
from ffd_lightning.shapes.kit.vectors import UP, Array, about_y, vec
from ffd_lightning.shapes.table.plan import BOX, SHAPES, Plan


def solid(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board."""
    p.slab(b, "top", p.top, (p.height - p.thick, p.height), 0.0)


def planks(b: Builder, rng: Rng, p: Plan) -> None:
    """Add boards side by side."""
    (width, depth), count = 2 * p.half, int(rng.integers(4, 8))
    middle, offset = vec(0, p.height - p.thick / 2, p.z), vec(0, 0, (depth - depth / count) / 2)
    board = (width, p.thick, depth / count - rng.uniform(0.004, 0.012))
    wood = p.top if p.top.alpha == 1 else p.base
    slats(b, "top", wood, middle - offset, middle + offset, board, count)


def framed(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a panel in a rim, often of another material."""
    rim, border = pick_material(rng, "wood"), p.half.min() * rng.uniform(0.08, 0.25)
    low = p.height - p.thick
    p.band(b, "top", rim, (low, p.height), (0.0, border))
    p.slab(b, "top", p.top, (low + 0.2 * p.thick, p.height - 0.15 * p.thick), 0.9 * border)


def tray(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board with a raised rim."""
    solid(b, rng, p)
    levels = p.height - p.thick / 2, p.height + rng.uniform(0.02, 0.07)
    p.band(b, "top", p.top, levels, (-0.004, 0.012))


def leaves(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board with two leaves that hang down at its ends or at its front and back."""
    solid(b, rng, p)
    drop, axis, thick = p.under * rng.uniform(0.3, 0.8), int(rng.choice([0, 2])), 0.8 * p.thick
    size = vec(1.96 * p.half[0], drop, 1.96 * p.half[1])
    out = np.eye(3)[axis] * (0.5 * size[axis] / 0.98 + 0.004)
    size[axis] = thick
    for side in (-1, 1):
        middle = side * out + vec(0, p.height - drop / 2 - 0.2 * p.thick, 0)
        b.rounded_box("top", p.top, middle, size, 0.3 * thick)


def apron(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a rim below the top, between the legs."""
    low, half = p.under - rng.uniform(0.06, 0.25) * min(p.under, 0.7), 0.25 * p.side
    p.band(b, "support", p.base, (low, p.under), (p.inset - half, p.inset + half))


def joined(b: Builder, rng: Rng, p: Plan) -> None:
    """Join the legs by rails, around, across or to a hub, often below an apron."""
    if rng.random() < 0.5:
        apron(b, rng, p)
    points, size = p.posts(rng.uniform(0.12, 0.45)), rng.uniform(0.35, 0.7) * p.side
    if len(points) == 4:
        stretchers(b, "support", p.base, points, size, draw(rng, ["box", "h", "x"]))
        return
    for point in points:
        beam(b, "support", p.base, point, points.mean(0), size, size)


def shelves(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one to three shelves between the legs."""
    count = int(rng.integers(1, np.clip(p.under / 0.2, 2, 4)))
    thick, material = rng.uniform(0.006, 0.018), p.top if rng.random() < 0.5 else p.base
    for t in np.linspace(rng.uniform(0.08, 0.45), 1, count + 1)[:-1]:
        level, inset = t * p.under, p.inset - p.splay * (1 - t) - 0.3 * p.side
        p.slab(b, "shelf", material, (level - thick, level + thick), inset)


def beamed(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board on edge from end to end."""
    t, tall = rng.uniform(0.3, 0.85), rng.uniform(0.08, 0.28) * p.under
    left, right = (p.posts(t)[list(ends)].mean(0) for ends in ((0, 3), (1, 2)))
    beam(b, "support", p.base, left, right, 0.4 * p.side, tall)


def _chest(b: Builder, rng: Rng, p: Plan, center: Array, size: Array, rows: int) -> None:
    """Add a box with rows of drawers at its front, in two columns or more if it is wide."""
    b.rounded_box("support", p.base, center, size, 0.006, segments=1)
    front = p.base if rng.random() < 0.6 else pick_material(rng, draw(rng, ["wood", "paint"]))
    metal, columns = pick_material(rng, "metal"), max(1, round(size[0] / rng.uniform(0.4, 0.9)))
    width, height = 0.97 * size[0] / columns, 0.97 * size[1] / rows
    gap, handle = 0.06 * min(width, height), rng.choice([0.025, 0.35 * width])
    face, knob = (width - gap, height - gap, 0.024), (handle, 0.018, 0.034)
    for i in range(rows * columns):
        x, y = (i % columns + 0.5 - columns / 2) * width, (i // columns + 0.5 - rows / 2) * height
        middle = center + (x, y, -size[2] / 2 - 0.008)
        b.rounded_box("drawer", front, middle, face, 0.008, segments=1)
        b.rounded_box("drawer", metal, middle - vec(0, 0, 0.024), knob, 0.007, segments=1)


def drawers(b: Builder, rng: Rng, p: Plan) -> None:
    """Add drawers below the top between the legs, in a row or hanging down at one end."""
    size = vec(2 * (p.half[0] - p.inset) - 0.9 * p.side, 0, 2 * (p.half[1] - p.inset))
    size[1], rows, x = min(rng.uniform(0.1, 0.25), 0.4 * p.under), 1, 0.0
    if size[0] > 0.8 and rng.random() < 0.5:
        wide = size[0] * rng.uniform(0.25, 0.4)
        x, rows = rng.choice([-1, 1]) * (size[0] - wide) / 2, int(rng.integers(1, 4))
        size = vec(wide, rng.uniform(0.25, 0.6) * p.under, size[2])
    _chest(b, rng, p, vec(x, p.under - size[1] / 2, p.z), size, rows)


def _standing(b: Builder, rng: Rng, p: Plan, ends: tuple[float, ...], size: Array) -> None:
    """Add chests alike at each x of `ends`, on the floor or on short legs; size (width, depth)."""
    low, state = rng.choice([0.0, rng.uniform(0.05, 0.35) * p.under]), int(rng.integers(1 << 30))
    box = np.insert(size, 1, p.under - low)
    rows = int(rng.integers(1, np.clip(box[1] // 0.1, 2, 5)))
    for x in ends:
        same = np.random.default_rng(state)  # so that a pair matches
        _chest(b, same, p, vec(x, low + box[1] / 2, 0), box, rows)
        if low:
            tops = corners(size[0] - 0.04, size[1] - 0.04, low + 0.004) + vec(x, 0, 0)
            add_legs(b, "leg", p.base, LegStyle("square", 0.035), tops, tops * vec(1, 0, 1))


def case(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a chest below the whole top."""
    _standing(b, rng, p, (0.0,), 1.96 * p.half)


def chests(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a chest at one end or at both ends of a desk, often with a panel behind the knees."""
    width, depth = 1.96 * p.half
    wide, both = width * rng.uniform(0.2, 0.38), rng.random() < 0.5
    x = rng.choice([-1, 1]) * (width - wide) / 2
    _standing(b, rng, p, (x, -x) if both else (x,), np.array([wide, depth]))
    if not both:
        middle = (-np.sign(x) * (width - 0.03) / 2, p.under / 2, 0)
        b.rounded_box("leg", p.base, middle, (0.03, p.under, depth), 0.005)
    if rng.random() < 0.6:
        z, drop = depth * rng.uniform(0.1, 0.45), p.under * rng.uniform(0.3, 0.75)
        b.box("support", p.base, (0, p.under - drop / 2, z), (width - 0.03, drop, 0.018))


def hutch(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one to three shelves with compartments along the back of a desk's top."""
    (width, depth), levels = 1.96 * p.half, int(rng.integers(1, 4))
    deep, rise = rng.uniform(0.2, 0.4) * depth, levels * rng.uniform(0.13, 0.26)
    z = (depth - deep) / 2
    for y in p.height + np.arange(1, levels + 1) * rise / levels:
        b.rounded_box("shelf", p.base, (0, y - 0.01, z), (width, 0.02, deep), 0.005)
    for x in np.linspace(-0.49, 0.49, int(rng.integers(2, 6))) * width:
        b.box("shelf", p.base, (x, p.height + rise / 2 - 0.01, z), (0.018, rise, deep))


def wing(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a second, narrower top at right angles to a desk's end, on a panel."""
    wide, long, side = rng.uniform(0.38, 0.55), rng.uniform(0.5, 1.0), rng.choice([-1, 1])
    x, near = side * (p.half[0] - wide / 2), 0.01 - p.half[1]
    middle, size = (x, p.height - p.thick / 2, near - long / 2), (wide, p.thick, long + 0.01)
    b.rounded_box("top", p.top, middle, size, 0.01)
    middle, size = (x, p.under / 2, near + 0.04 - long), (0.92 * wide, p.under, 0.03)
    b.rounded_box("leg", p.base, middle, size, 0.005)


def legs(b: Builder, rng: Rng, p: Plan) -> None:
    """Add straight legs; those at the very corners are square posts."""
    style = draw_leg_style(rng, (p.side, p.side), 0.12)
    style = LegStyle("square", p.side) if p.inset < 0.6 * p.side else style
    add_legs(b, "leg", p.base, style, p.posts(1), p.posts(0))


def cabriole(b: Builder, rng: Rng, p: Plan) -> None:
    """Add legs with a knee that swings out and a slender ankle."""
    bulge = rng.uniform(0.03, 0.12) * p.under
    for top in p.posts(1):
        out = (top - vec(0, 0, p.z)) * vec(1, 0, 1)
        out *= bulge / np.linalg.norm(out)
        shifts = [(0.0, 0.0), (-0.18, 0.8), (-0.65, -0.3), (0.015 / p.under - 1, 0.5)]
        path = bend([top + up * p.under * UP + x * out for up, x in shifts], 0.5 * p.under, 4)
        radii = np.interp(path[:, 1] / p.under, (0, 0.3, 0.8), (0.7, 0.5, 1.2)) * p.side / 2
        b.tube("leg", p.base, path, radii)


def sled(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a loop of tube or of flat bars at each end."""
    flat, half = rng.random() < 0.5, p.side / 4 * UP
    tops, feet = p.posts(1) - half, p.posts(0) + half
    for i, j in ((0, 3), (1, 2)):
        if not flat:
            path = bend([tops[i], feet[i], feet[j], tops[j]], 0.08)
            b.tube("leg", p.base, path, p.side / 4, segments=10)
        bars = [(feet[i], feet[j]), (feet[i] - half, tops[i]), (feet[j] - half, tops[j])]
        for start, end in [(tops[i], tops[j]), *(bars if flat else ())]:
            beam(b, "leg", p.base, start, end, p.side, p.side / 2)


def panels(b: Builder, rng: Rng, p: Plan, waist: float = 0.0) -> None:
    """Add a board at each end, narrower in the middle by up to the part `waist`."""
    x, y, z = p.posts(1)[2]
    waist *= rng.uniform(0.3, 1.0)
    rings = []
    for t in np.linspace(0, 1, 9):
        reach = (z - p.z + p.side / 2) * (1 - waist * np.sin(np.pi * t) ** 2)
        rings.append(corners(p.side, 2 * reach, t * y, p.z))
    for side in (-x, x):
        b.loft("leg", p.base, [ring + vec(side, 0, 0) for ring in rings])


def trestle(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two trestles joined by a beam, which is sometimes braced."""
    (x, _, z), thin = p.posts(1)[2], 0.5 * p.side
    y = add_trestles(b, rng, p.base, "support", (-x, x), (z + thin, p.under, p.side))
    for end in (-x, x) if rng.random() < 0.3 else ():
        beam(b, "support", p.base, (end, y, 0), (0.25 * end, p.under - 0.01, 0), thin, thin)


def pedestal(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one column, or two alike below a long top."""
    width, depth = p.half
    reach, state = depth * rng.uniform(0.45, 0.9), int(rng.integers(1 << 30))
    for x in (-0.52 * width, 0.52 * width) if width > 1.6 * depth else (0.0,):
        _column(b, np.random.default_rng(state), p, x, reach)


def _column(b: Builder, rng: Rng, p: Plan, x: float, reach: float) -> None:
    """Add a plain, conical or turned column at `x` on a disc, a plinth or arched feet."""
    foot, rise, r = draw(rng, ["disc", "plinth", "feet"]), rng.uniform(0.03, 0.08), 0.4 * p.side
    if foot == "disc":
        rows = [(reach, 0), (reach, 0.015), (0.6 * reach, 0.5 * rise), (0.15 * reach, rise)]
        b.lathe("leg", p.base, rows, (x, 0, 0), segments=40)
    elif foot == "plinth":
        size = (1.4 * reach, 0.5 * rise, 1.4 * reach)
        b.rounded_box("leg", p.base, (x, 0.25 * rise, 0), size, 0.03)
    else:
        rise = rng.uniform(0.15, 0.5) * p.under
        for end in circle(int(rng.integers(3, 6)), reach, r, 90.0):
            path = [rise * UP, 0.45 * end + 0.85 * rise * UP, 0.85 * end + 0.25 * rise * UP, end]
            radii = np.array([1.5, 1.3, 1, 1]) * r
            b.tube("leg", p.base, np.array(path) + [x, 0, 0], radii, segments=10)
    low, r = (0.7 * rise if foot == "feet" else 0.01), p.side * rng.uniform(0.5, 1.1)
    kind = draw(rng, ["plain", "turned", "cone"][: 2 if foot == "feet" else 3])
    if kind == "plain":
        head = rng.uniform(1.5, 3) * r
        rows = [(r, 0), (r, 0.95), (head, 0.97), (head, 1)]
    elif kind == "cone":
        ends = np.minimum(rng.uniform(1.0, 3.5, 2) * r, reach)
        rows = [(ends[0], 0), (r, rng.uniform(0.2, 0.8)), (0.9 * r, 0.9), (ends[1], 1)]
    else:
        radii = r * np.array([1.6, *rng.uniform(0.7, 1.7, 7), 1.8])
        rows = list(zip(radii, np.linspace(0, 1, 9), strict=True))
    b.lathe("leg", p.base, np.array(rows) * (1, p.under - low), (x, low, 0))


def drum(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a body with the top's outline, straight, waisted, bulged or conical."""
    insets = p.half.min() * rng.uniform(0.0, 0.5, 3)
    if rng.random() < 0.4:
        insets[:] = insets[0]
    curve = np.polyfit((0, 0.5, 1), insets, 2)
    rows = [(max(float(np.polyval(curve, t)), 0.0), t * p.under) for t in np.linspace(0, 1, 9)]
    p.body(b, "leg", p.base, rows)


def crossed(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two upright boards that cross below the middle."""
    width, depth = p.half * rng.uniform(1.2, 1.7)
    degrees = float(np.degrees(np.arctan2(depth, width)))
    size = (0.95 * np.hypot(width, depth), p.under, 0.6 * p.side)
    for way in (-degrees, degrees):
        b.rounded_box("leg", p.base, (0, p.under / 2, 0), size, 0.01, turn=about_y(way))


def bracket(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one upright board and a foot below a top that reaches over a sofa or a bed."""
    (width, depth), thick = 2 * p.half * (1, rng.uniform(0.4, 1.0)), 0.6 * p.side
    middle, size = ((thick - width) / 2, p.under / 2, 0), (thick, p.under, depth)
    b.rounded_box("leg", p.base, middle, size, 0.1 * thick, segments=4)
    foot = (width * rng.uniform(0.8, 1.0), thick, depth)
    b.rounded_box("leg", p.base, ((foot[0] - width) / 2, thick / 2, 0), foot, 0.1 * thick)


_ENDED = (*BOX, "rounded", "bowed")
_LOW = ("coffee", "side")
_FREE = {"top": ("solid", "planks", "framed", "tray")}  # no leaves in the way
_PLAIN = _FREE | {"shape": _ENDED}
_EVEN = tuple(shape.name for shape in SHAPES if shape.name not in ("pebble", "half"))
TOPS = (
    Component("solid", 8, solid),
    Component("planks", 1.5, planks, {"shape": BOX}),
    Component("framed", 1.2, framed, {"shape": _EVEN}),
    Component("tray", 2, tray, {"use": _LOW}),
    Component("leaves", 2.5, leaves, {"use": ("dining", "side"), "shape": BOX}),
)
BASES = (
    Component("legs", 4.5, legs),
    Component("cabriole", 0.7, cabriole, {"use": ("dining", *_LOW, "console")}),
    Component("sled", 1.2, sled, _PLAIN),
    Component("panels", 2, panels, _PLAIN),
    Component.of("curved", 0.7, panels, _PLAIN, waist=0.6),
    Component("trestle", 1.5, trestle, {"use": ("dining", "coffee", "bar"), "shape": _ENDED}),
    Component("pedestal", 2.5, pedestal, _FREE | {"use": ("dining", "bar", *_LOW)}),
    Component("drum", 1, drum, _FREE | {"use": _LOW}),
    Component("crossed", 0.7, crossed, _FREE | {"use": ("dining", *_LOW)}),
    Component("bracket", 1, bracket, _FREE | {"use": ("side",), "shape": BOX}),
    Component("case", 1.8, case, _FREE | {"use": _LOW, "shape": BOX}),
    Component("chests", 7, chests, {"use": ("desk",), "shape": ("rectangle",)}),
)
_DESK = {"use": ("desk",), "shape": ("rectangle",)}
_JOINED = ("legs", "panels", "sled")
BRACES = (
    Component("none", 1.2, nothing),
    Component("apron", 2, apron, {"base": ("legs", "cabriole")}),
    Component("joined", 1.5, joined, {"base": ("legs",)}),
    Component("shelves", 3, shelves, {"base": _JOINED, "use": (*_LOW, "console", "bar")}),
    Component("beam", 2, beamed, {"base": ("panels", "curved")}),
)
_OPEN = {"base": (*_JOINED, "cabriole"), "shape": BOX, "brace": ("none", "shelves")}
_NESTED = {"use": _LOW, "shape": BOX, "base": _JOINED, "brace": ("none",)}
EXTRAS = (
    Component("none", 3, nothing),
    Component("drawers", 2.5, drawers, _OPEN),
    Component("hutch", 1.5, hutch, _DESK),
    Component("wing", 1.0, wing, _DESK),
    Component("nest", 1.5, nothing, _NESTED),
)
