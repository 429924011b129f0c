"""Outlines of tables and their corners, as a plan has them, and tops."""

from __future__ import annotations

from functools import partial

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng, pick_material
from ffd_lightning.shapes.kit.boards import slats
from ffd_lightning.shapes.kit.sections import corner_arcs, superellipse
from ffd_lightning.shapes.kit.vectors import Array, vec
from ffd_lightning.shapes.table.plan import Plan

Shape = tuple[Array, Array]
"""An outline, (k, 2), and the corners near which legs stand, (n, 2)."""
_SIGNS = np.array([(-1.0, -1), (1, -1), (1, 1), (-1, 1)])


def rectangle(rng: Rng, width: float, depth: float, round_: float = 0.1) -> Shape:
    """Return a rectangle; `round_` is how round its corners are at most, 1 for half circles."""
    half = np.array([width, depth]) / 2
    radius = half.min() * rng.uniform(0.3 * round_, round_)
    signs, arcs = corner_arcs(6)
    return signs * (half - radius) + radius * arcs, _SIGNS * (half - 0.3 * radius)


def square(rng: Rng, width: float, depth: float) -> Shape:
    """Return a square."""
    return rectangle(rng, depth, depth)


def circle(rng: Rng, width: float, depth: float, count: int = 48, wave: float = 0.0) -> Shape:
    """Return a circle, a polygon with `count` corners or, with a `wave`, a free form."""
    a = 2 * np.pi * (np.arange(count) + 0.5) / count
    waves = np.cos(3 * a) + rng.uniform(0, 2.2) * np.cos(2 * a + rng.uniform(0, 6.3))
    radii = rng.uniform(0.45, 0.65) * depth * (1 + wave * waves)
    outline = np.stack([np.sin(a), -np.cos(a)], 1) * radii[:, None]
    legs = int(rng.choice([3, 4, 6], p=[0.35, 0.5, 0.15])) if count > 8 else count // 2
    return outline, outline[count // legs // 2 :: count // legs]


def oval(rng: Rng, width: float, depth: float) -> Shape:
    """Return an ellipse, more or less squared."""
    half = np.array([width, depth]) / 2
    return superellipse(rng.uniform(0.0, 0.6), 40) * half, _SIGNS * 0.72 * half


def bowed(rng: Rng, width: float, depth: float) -> Shape:
    """Return a rectangle whose long sides swing out or in, sometimes as the tree did."""
    x, bow = np.linspace(-1, 1, 15), rng.uniform(-0.4, 0.4)
    waves = rng.choice([0.0, 0.02]) * rng.normal(size=(2, 15))
    z = depth / 2 * (1 - max(bow, 0) * x**2 + min(bow, 0) * (1 - x**2) + waves)
    front, back = np.stack([width / 2 * x, -z[0]], 1), np.stack([width / 2 * x, z[1]], 1)
    return np.concatenate([front, back[::-1]]), _SIGNS * np.abs(front[0]) * (1, 0.95)


def half_round(rng: Rng, width: float, depth: float) -> Shape:
    """Return half an ellipse whose straight side is at the back."""
    corners = [1.5, 2.0, 1.0] if rng.random() < 0.4 else [1.3, 1.7, 2.0, 1.0]
    a = np.pi * np.array([*np.linspace(1, 2, 30), *corners])
    points = np.stack([width / 2 * np.cos(a), depth / 2 + depth * np.sin(a)], 1)
    return points[:30], points[30:]


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


_BOX = ("rectangle", "square")
_ROUND = {"use": ("dining", "coffee", "side", "bar")}
SHAPES = (
    Component("rectangle", 8, rectangle),
    Component("rounded", 2, partial(rectangle, round_=1.0)),
    Component("square", 2, square, _ROUND),
    Component("circle", 3, circle, _ROUND),
    Component("oval", 1.5, oval, {"use": ("dining", "coffee")}),
    Component("hexagon", 0.5, partial(circle, count=6), _ROUND),
    Component("octagon", 0.5, partial(circle, count=8), _ROUND),
    Component("pebble", 1, partial(circle, wave=0.1), {"use": ("coffee", "side")}),
    Component("bowed", 1.5, bowed, {"use": ("dining", "coffee", "console", "desk", "bar")}),
    Component("half", 1.5, half_round, {"use": ("console",)}),
)
_EVEN = tuple(shape.name for shape in SHAPES if shape.name not in ("pebble", "half"))
TOPS = (
    Component("solid", 8, solid),
    Component("planks", 1.5, planks, {"shape": _BOX}),
    Component("framed", 1.2, framed, {"shape": _EVEN}),
    Component("tray", 2, tray, {"use": ("coffee", "side")}),
    Component("leaves", 2.5, leaves, {"use": ("dining", "side"), "shape": _BOX}),
)
