"""What the components of a table share: outline, sizes, materials, where its legs stand. Metres."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.sections import corner_arcs, superellipse
from ffd_lightning.shapes.kit.vectors import Array, Pair


@dataclass(frozen=True)
class Plan:
    """A table's sizes and materials; the middle of its top is above the origin."""

    outline: Array  # of the top as (x, z) from above, (k, 2)
    corners: Array  # points of the outline near which legs stand, (n, 2)
    height: float  # of the top's upper side
    thick: float  # of the top
    side: float  # thickness of a leg or a panel
    inset: float  # how far inside the outline the middles of the legs' tops are
    splay: float  # how much further out their feet are
    top: Material  # what the top is of
    base: Material  # what carries it is of
    z: float = 0.0  # where the middle is, other than 0 if pulled out from another table

    @property
    def half(self) -> Array:
        """Half the width and half the depth."""
        return np.asarray(np.abs(self.outline).max(0))

    @property
    def under(self) -> float:
        """Height of the top's lower side, a little above it so that legs reach in."""
        return self.height - self.thick + 0.002

    def at(self, flat: Array, level: float, inset: float) -> Array:
        """Return points of the outline, (n, 2), moved inward by `inset`, at a height, (n, 3)."""
        return np.insert(flat * (1 - inset / self.half), 1, level, axis=1) + [0, 0, self.z]

    def posts(self, t: float) -> Array:
        """Return the middles of the legs (n, 3) at `t`, 0 at their feet, 1 at their tops."""
        return self.at(self.corners, t * self.under, self.inset - self.splay * (1 - t))

    def body(
        self, b: Builder, part: str, material: Material, rows: Sequence[Pair], caps: bool = True
    ) -> None:
        """Add a body with the table's outline, less an inset at each height: (inset, height)."""
        b.loft(part, material, [self.at(self.outline, y, inset) for inset, y in rows], caps)

    def slab(self, b: Builder, part: str, material: Material, levels: Pair, inset: float) -> None:
        """Add a board between two levels with the table's outline, less `inset`."""
        (low, high), ease = levels, 0.25 * (levels[1] - levels[0])
        rows = [(inset + ease, low), (inset, low + ease), (inset, high - ease)]
        self.body(b, part, material, [*rows, (inset + ease, high)])

    def band(self, b: Builder, part: str, material: Material, levels: Pair, insets: Pair) -> None:
        """Add a rim between two levels and two insets, the outer and the inner one."""
        rows = [(insets[i], levels[j]) for i, j in ((0, 0), (0, 1), (1, 1), (1, 0), (0, 0))]
        self.body(b, part, material, rows, caps=False)


def draw_plan(rng: Rng, outline: Array, corners: Array, height: float, *, flush: bool) -> Plan:
    """Draw a table with an outline; `flush` if its legs may be at the very corners."""
    small = float(np.abs(outline).max(0).min())
    side = min(rng.uniform(0.03, 0.07) * rng.choice([1.0, 1.8], p=[0.6, 0.4]), 0.25 * small)
    inset, splay = 0.7 * side + rng.uniform(0.0, 0.12) * small, 0.0
    if rng.random() < 0.4:
        inset += rng.uniform(0.0, 0.25) * small
        splay = rng.uniform(0.2, 1.1) * inset
    elif flush and rng.random() < 0.5:
        inset = side / 2
    thick = rng.uniform(0.015, 0.05) * rng.choice([1.0, 2.2], p=[0.75, 0.25])
    kind = draw(rng, ["wood", "paint", "plastic", "metal", "glass"], [0.55, 0.17, 0.1, 0.06, 0.12])
    top = base = pick_material(rng, kind)
    if kind == "glass" or rng.random() < 0.65:
        base = pick_material(rng, draw(rng, ["wood", "metal", "paint"], [0.45, 0.35, 0.2]))
    return Plan(outline, corners, height, thick, side, inset, splay, top, base)


USES = (  # they draw width, depth, height
    Component.of("dining", 2, Rng.uniform, low=(1.1, 0.7, 0.66), high=(2.6, 1.15, 0.8)),
    Component.of("coffee", 3, Rng.uniform, low=(0.6, 0.4, 0.24), high=(1.6, 0.9, 0.54)),
    Component.of("side", 3.2, Rng.uniform, low=(0.28, 0.28, 0.34), high=(0.68, 0.66, 0.84)),
    Component.of("bar", 1.4, Rng.uniform, low=(0.5, 0.4, 0.9), high=(1.7, 0.75, 1.2)),
    Component.of("console", 1.8, Rng.uniform, low=(0.7, 0.22, 0.64), high=(1.8, 0.45, 0.95)),
    Component.of("desk", 2.8, Rng.uniform, low=(0.9, 0.45, 0.68), high=(1.9, 0.9, 0.8)),
)

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


BOX = ("rectangle", "square")
"""The shapes with four right angles, whose legs may stand at the very corners."""
_ROUND = {"use": ("dining", "coffee", "side", "bar")}
SHAPES = (
    Component("rectangle", 8, rectangle),
    Component.of("rounded", 2, rectangle, round_=1.0),
    Component("square", 2, square, _ROUND),
    Component("circle", 3, circle, _ROUND),
    Component("oval", 1.5, oval, {"use": ("dining", "coffee")}),
    Component.of("hexagon", 0.5, circle, _ROUND, count=6),
    Component.of("octagon", 0.5, circle, _ROUND, count=8),
    Component.of("pebble", 1, circle, {"use": ("coffee", "side")}, wave=0.1),
    Component("bowed", 1.5, bowed, {"use": ("dining", "coffee", "console", "desk", "bar")}),
    Component("half", 1.5, half_round, {"use": ("console",)}),
)
