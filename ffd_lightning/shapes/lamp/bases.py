"""What carries a lamp's stem, and turned bodies. Bases return how far they stand out, if at all."""

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, draw, nothing
from ffd_lightning.shapes.kit.vectors import UP, Array, about_y, lean
from ffd_lightning.shapes.lamp.plan import Plan, Socket

_SIDES = {"square": 4, "hexagon": 6, "few": 14, "fluted": 56}


def outline(kind: str) -> Array:
    """Return a unit cross-section (k, 2): of `_SIDES`, "round" or "oval"."""
    count = _SIDES.get(kind, 28)
    a = 2 * np.pi * (np.arange(count) + 0.5) / count
    r = {"square": 1.2, "fluted": 1 + 0.05 * np.cos(7 * a)}.get(kind, 1)
    return np.stack([r * np.cos(a), r * np.sin(a) * (0.6 if kind == "oval" else 1)], 1)


ROUND = outline("round")


def turned(
    b: Builder, part: str, skin: Material, rows: ArrayLike, s: Socket, shape: Array = ROUND,
    twist: float = 0.0,
) -> None:  # fmt: skip
    """Add `shape` (k, 2), scaled along (radius, height) rows and twisted; closed rows: a shell."""
    profile, rings = np.asarray(rows, float), []
    for (r, h), degrees in zip(profile, np.linspace(0, twist, len(profile)), strict=True):
        flat = np.column_stack([r * shape[:, 0], np.full(len(shape), h), r * shape[:, 1]])
        rings.append(flat @ about_y(degrees).T @ s.turn.T + s.at)
    b.loft(part, skin, rings, caps=bool((profile[0] != profile[-1]).any()))


_ARCH = np.linspace(0, 1.45, 7)
_FEET = {  # (radius, height) rows relative to the foot's
    "disc": [(1, 0), (1, 0.85), (0.97, 1), (0.1, 1)],
    "steps": [(1, 0), (1, 0.5), (0.78, 0.5), (0.75, 1), (0.1, 1)],
    "dome": [(1, 0), *np.stack([np.cos(_ARCH), 0.3 + 0.7 * np.sin(_ARCH)], 1)],
}


def foot(b: Builder, rng: Rng, p: Plan, kind: str) -> float:
    """Add a foot on the floor, flat or tall, round or with corners."""
    shape = draw(rng, ["round", "square", "hexagon"], [0.7, 0.2, 0.1])
    height = p.radius * (rng.uniform(0.1, 0.3) if rng.random() < 0.7 else rng.uniform(0.3, 0.9))
    rows = np.array(_FEET[kind]) * (p.radius, height)
    skin = p.metal if rng.random() < 0.5 else p.body
    turned(b, "base", skin, rows, Socket(0 * UP), outline(shape))
    return height - 0.002


def rose(b: Builder, rng: Rng, p: Plan) -> float:
    """Add the round plate or cup at the ceiling."""
    tall = rng.uniform(0.02, 0.06)
    rows = np.array([(0.2, -1), (0.7, -0.85), (1, -0.25), (1, 0)]) * (p.radius, tall)
    b.lathe("base", p.metal, rows)
    return 0.005 - tall


def plate(b: Builder, rng: Rng, p: Plan) -> float:
    """Add a plate on the wall, with more or less rounded corners."""
    size, radius = (2 * p.radius, 0.024, p.height), rng.uniform(0.1, 1.0) * p.radius
    b.rounded_box("base", p.metal, (0, 0, -0.012), size, radius, edge=0.008, turn=lean(-90))
    return 0.02


_ON_FOOT = ("none", "vase", "stack", "block", "loop", "pole", "jointed", "branches")
_ROOM = {"place": ("table", "floor", "desk", "garden"), "stem": (*_ON_FOOT, "tree", "bow")}
_HUNG = {"place": ("ceiling",), "stem": ("none", "cord", "chandelier", "drops", "wheel")}
BASES = (
    Component("bare", 1.5, nothing, {"stem": ("vase", "stack", "block", "tripod")}),
    Component("bare", 1, nothing, {"stem": ("cords",)}),
    *(Component.of(kind, 1, foot, _ROOM, kind=kind) for kind in _FEET),
    Component("rose", 1, rose, _HUNG),
    Component("plate", 1, plate, {"place": ("wall",)}),
)
