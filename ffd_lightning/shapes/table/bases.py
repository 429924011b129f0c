"""What carries a table's top."""

from __future__ import annotations

from functools import partial

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng, draw
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.legs import add_legs, add_trestle, draw_leg_style, square_post
from ffd_lightning.shapes.kit.paths import bend, circle
from ffd_lightning.shapes.kit.vectors import UP, about_y, vec
from ffd_lightning.shapes.table.plan import Plan
from ffd_lightning.shapes.table.storage import case, chests


def legs(b: Builder, rng: Rng, p: Plan) -> None:
    """Add straight legs; those at the very corners are square posts."""
    style = draw_leg_style(rng, (p.side, p.side), 0.12)
    style = square_post(p.side) if p.inset < 0.6 * p.side else style
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
        b.tube("leg", p.base, path, list(radii))


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
            beam(b, "leg", p.base, start, end, width=p.side, height=p.side / 2)


def panels(b: Builder, rng: Rng, p: Plan, waist: float = 0.0) -> None:
    """Add a board at each end, narrower in the middle by up to the part `waist`."""
    x, y, z = p.posts(1)[2]
    waist *= rng.uniform(0.3, 1.0)
    flat = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    for side in (-x, x):
        rings = []
        for t in np.linspace(0, 1, 9):
            reach = p.side / 2, (z - p.z + p.side / 2) * (1 - waist * np.sin(np.pi * t) ** 2)
            rings.append(np.insert(flat * reach, 1, t * y, axis=1) + [side, 0, p.z])
        b.loft("leg", p.base, rings)


def trestle(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two trestles joined by a beam, which is sometimes braced."""
    kind, (x, _, z), thin = draw(rng, ["x", "a", "h", "t"]), p.posts(1)[2], 0.5 * p.side
    for end in (-x, x):
        y = add_trestle(b, p.base, kind, end, z + thin, p.under, p.side)
    beam(b, "support", p.base, (-x, y, 0), (x, y, 0), width=thin, height=p.side)
    for end in (-x, x) if rng.random() < 0.3 else ():
        high = (0.25 * end, p.under - 0.01, 0)
        beam(b, "support", p.base, (end, y, 0), high, width=thin, height=thin)


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
        for end in circle(count=int(rng.integers(3, 6)), radius=reach, height=r, degrees=90.0):
            path = [rise * UP, 0.45 * end + 0.85 * rise * UP, 0.85 * end + 0.25 * rise * UP, end]
            radii = np.array([1.5, 1.3, 1, 1]) * r
            b.tube("leg", p.base, np.array(path) + [x, 0, 0], list(radii), segments=10)
    low, r = (0.7 * rise if foot == "feet" else 0.01), p.side * rng.uniform(0.5, 1.1)
    kinds = ["plain", "turned", "cone"][: 2 if foot == "feet" else 3]
    kind, t = draw(rng, kinds), np.linspace(0, 1, 9)
    if kind == "plain":
        head = rng.uniform(1.5, 3) * r
        rows = [(r, 0), (r, 0.95), (head, 0.97), (head, 1)]
    elif kind == "cone":
        ends = np.minimum(rng.uniform(1.0, 3.5, 2) * r, reach)
        rows = [(ends[0], 0), (r, rng.uniform(0.2, 0.8)), (0.9 * r, 0.9), (ends[1], 1)]
    else:
        rows = list(zip(r * np.array([1.6, *rng.uniform(0.7, 1.7, 7), 1.8]), t, strict=True))
    scaled = [(radius, level * (p.under - low)) for radius, level in rows]
    b.lathe("leg", p.base, scaled, (x, low, 0), segments=28)


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
    degrees, length = float(np.degrees(np.arctan2(depth, width))), 0.95 * np.hypot(width, depth)
    for way in (-degrees, degrees):
        size = (length, p.under, 0.6 * p.side)
        b.rounded_box("leg", p.base, (0, p.under / 2, 0), size, 0.01, turn=about_y(way))


def bracket(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one upright board and a foot below a top that reaches over a sofa or a bed."""
    (width, depth), thick = 2 * p.half * (1, rng.uniform(0.4, 1.0)), 0.6 * p.side
    middle, size = ((thick - width) / 2, p.under / 2, 0), (thick, p.under, depth)
    b.rounded_box("leg", p.base, middle, size, 0.1 * thick, segments=4)
    foot = (width * rng.uniform(0.8, 1.0), thick, depth)
    b.rounded_box("leg", p.base, ((foot[0] - width) / 2, thick / 2, 0), foot, 0.1 * thick)


_BOX = ("rectangle", "square")
_ENDED = (*_BOX, "rounded", "bowed")
_LOW = ("coffee", "side")
_FREE = ("solid", "planks", "framed", "tray")  # no leaves in the way
BASES = (
    Component("legs", 4.5, legs),
    Component("cabriole", 0.7, cabriole, {"use": ("dining", *_LOW, "console")}),
    Component("sled", 1.2, sled, {"shape": _ENDED, "top": _FREE}),
    Component("panels", 2, panels, {"shape": _ENDED, "top": _FREE}),
    Component("curved", 0.7, partial(panels, waist=0.6), {"shape": _ENDED, "top": _FREE}),
    Component("trestle", 1.5, trestle, {"use": ("dining", "coffee", "bar"), "shape": _ENDED}),
    Component("pedestal", 2.5, pedestal, {"use": ("dining", "bar", *_LOW), "top": _FREE}),
    Component("drum", 1, drum, {"use": _LOW, "top": _FREE}),
    Component("crossed", 0.7, crossed, {"use": ("dining", *_LOW), "top": _FREE}),
    Component("bracket", 1, bracket, {"use": ("side",), "shape": _BOX, "top": _FREE}),
    Component("case", 1.8, case, {"use": _LOW, "shape": _BOX, "top": _FREE}),
    Component("chests", 7, chests, {"use": ("desk",), "shape": ("rectangle",)}),
)
