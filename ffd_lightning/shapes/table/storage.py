"""What is below and on a table's top: rails, shelves, drawers, compartments."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng, draw, nothing, pick_material
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.legs import add_legs, square_post, stretchers
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import Array, vec
from ffd_lightning.shapes.table.plan import Plan


def apron(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a rim below the top, between the legs."""
    low = p.under - rng.uniform(0.06, 0.25) * min(p.under, 0.7)
    insets = p.inset - 0.25 * p.side, p.inset + 0.25 * p.side
    p.band(b, "support", p.base, (low, p.under), insets)


def joined(b: Builder, rng: Rng, p: Plan) -> None:
    """Join the legs by rails, around, across or to a hub, often below an apron."""
    if rng.random() < 0.5:
        apron(b, rng, p)
    t, size = rng.uniform(0.12, 0.45), rng.uniform(0.35, 0.7) * p.side
    points = p.posts(t)
    if len(points) == 4:
        stretchers(b, "support", p.base, points, size, draw(rng, ["box", "h", "x"]))
        return
    hub = points.mean(0)
    for point in points:
        beam(b, "support", p.base, point, hub, width=size, height=size)


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
    beam(b, "support", p.base, left, right, width=0.4 * p.side, height=tall)


def _chest(b: Builder, rng: Rng, p: Plan, center: Array, size: Array, rows: int) -> None:
    """Add a box with rows of drawers at its front, in two columns or more if it is wide."""
    b.rounded_box("support", p.base, center, size, 0.006, segments=1)
    front = p.base if rng.random() < 0.6 else pick_material(rng, draw(rng, ["wood", "paint"]))
    metal, columns = pick_material(rng, "metal"), max(1, round(size[0] / rng.uniform(0.4, 0.9)))
    width, height = 0.97 * size[0] / columns, 0.97 * size[1] / rows
    gap, handle = 0.06 * min(width, height), rng.choice([0.025, 0.35 * width])
    for i in range(rows * columns):
        x = (i % columns + 0.5 - columns / 2) * width
        middle = center + (x, (i // columns + 0.5 - rows / 2) * height, -size[2] / 2 - 0.008)
        face = (width - gap, height - gap, 0.024)
        b.rounded_box("drawer", front, middle, face, 0.008, segments=1)
        knob = (handle, 0.018, 0.034)
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
            add_legs(b, "leg", p.base, square_post(0.035), tops, tops * vec(1, 0, 1))


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
        panel = (0.03, p.under, depth)
        middle = (-np.sign(x) * (width - 0.03) / 2, p.under / 2, 0)
        b.rounded_box("leg", p.base, middle, panel, 0.005)
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
    board = (wide, p.thick, long + 0.01)
    b.rounded_box("top", p.top, (x, p.height - p.thick / 2, near - long / 2), board, 0.01)
    panel = (0.92 * wide, p.under, 0.03)
    b.rounded_box("leg", p.base, (x, p.under / 2, near + 0.04 - long), panel, 0.005)


_BOX = ("rectangle", "square")
_DESK = {"use": ("desk",), "shape": ("rectangle",)}
_LEGS = ("legs", "cabriole")
_PLAIN = ("legs", "panels", "sled")
_LOW = {"use": ("coffee", "side"), "shape": _BOX}
_SHELVED = ("coffee", "side", "console", "bar")
BRACES = (
    Component("none", 1.2, nothing),
    Component("apron", 2, apron, {"base": _LEGS}),
    Component("joined", 1.5, joined, {"base": ("legs",)}),
    Component("shelves", 3, shelves, {"base": _PLAIN, "use": _SHELVED}),
    Component("beam", 2, beamed, {"base": ("panels", "curved")}),
)
_OPEN = {"base": (*_PLAIN, "cabriole"), "shape": _BOX, "brace": ("none", "shelves")}
EXTRAS = (
    Component("none", 3, nothing),
    Component("drawers", 2.5, drawers, _OPEN),
    Component("hutch", 1.5, hutch, _DESK),
    Component("wing", 1.0, wing, _DESK),
    Component("nest", 1.5, nothing, {**_LOW, "base": _PLAIN, "brace": ("none",)}),
)
