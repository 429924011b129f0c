"""Watercraft: from rowing boats, speedboats, yachts and tugs to ships, under sail or power."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.parts.furniture import draw
from ffd_lightning.shapes.parts.hulls import (
    House,
    Hull,
    add_house,
    bulwark,
    funnel,
    mast,
    open_hull,
    plank,
    solid_hull,
    tint,
    vec,
)
from ffd_lightning.shapes.parts.motorboats import motor_yacht, outboard, speedboat
from ffd_lightning.shapes.parts.naval import carrier, submarine, warship
from ffd_lightning.shapes.parts.sailing import catamaran, sailboat, tall_ship
from ffd_lightning.shapes.parts.ships import freighter, liner
from ffd_lightning.shapes.shapes import (
    Builder,
    Family,
    Material,
    pick_material,
    rotation,
)

PARTS = (
    "hull", "deck", "cabin", "mast", "sail", "keel", "funnel", "engine", "cargo", "gun", "seat",
    "oar", "rail",
)  # fmt: skip


def _rowboat(rng: np.random.Generator) -> Builder:
    """Build an open boat with thwarts and oars: a dinghy, a canoe or a gondola."""
    b = Builder()
    kind = draw(rng, ["dinghy", "canoe", "gondola"], [0.5, 0.3, 0.2])
    length = rng.uniform(0.9, 1.3)
    slim = {"dinghy": (0.3, 0.42), "canoe": (0.15, 0.22), "gondola": (0.12, 0.17)}[kind]
    transom = rng.uniform(0.45, 0.8) if kind == "dinghy" else 0.03
    rise = {"dinghy": (0.02, 0.07), "canoe": (0.03, 0.1), "gondola": (0.12, 0.25)}[kind]
    sheer = rng.uniform(*rise)
    depth = length * rng.uniform(0.1, 0.15)
    hull = Hull(
        length, length * rng.uniform(*slim), depth, 0.5, transom, rng.uniform(0.6, 0.9),
        rng.uniform(1.6, 2.8), (sheer, sheer * rng.uniform(0.3, 1.0)),
        (rng.uniform(0.02, 0.12), 0.05), (rng.uniform(0.2, 0.7) * depth, 0.3 * depth),
    )  # fmt: skip
    wood = plank(rng)
    outer = (
        wood if rng.random() < 0.4 else tint(rng, "white", "red", "green", "blue", "navy", "orange")
    )
    trim = plank(rng)
    open_hull(b, hull, outer, 0.014)
    bulwark(b, hull, trim, 0.01, thickness=0.022, part="rail")
    for t in np.linspace(0.3, 0.85, int(rng.integers(2, 5))):
        low, width = hull.top(t) - 0.25 * depth, 1.9 * hull.half(t)
        b.rounded_box(
            "seat", trim, (0, low, hull.z(t)), (width, 0.016, rng.uniform(0.06, 0.1)), 0.01
        )
    _floor(b, hull, trim)
    if kind == "dinghy" and rng.random() < 0.35:
        cowl = tint(rng, "black", "white", "dark", "blue")
        outboard(b, cowl, vec(0, hull.top(1), hull.z(1)), 0.8)
    if kind == "canoe" or rng.random() < 0.75:
        _oars(b, rng, hull, trim, 1 if kind != "dinghy" else int(rng.integers(1, 3)))
    return b


def _floor(b: Builder, hull: Hull, wood: Material) -> None:
    """Add floor boards in an open boat."""
    level = 0.2 * hull.depth + 0.012
    for x in np.linspace(-0.18, 0.18, 4) * hull.beam:
        z = hull.z(0.28), hull.z(0.86)
        size = (0.1 * hull.beam, 0.01, z[1] - z[0])
        b.box("deck", wood, (x, level, (z[0] + z[1]) / 2), size)


def _oars(b: Builder, rng: np.random.Generator, hull: Hull, wood: Material, pairs: int) -> None:
    """Add pairs of oars in their locks, swung out or laid along the boat."""
    swing, dip = rng.uniform(-25, 60), rng.uniform(-0.25, 0.0)
    for t in np.linspace(0.45, 0.65, pairs) if pairs > 1 else [0.5]:
        for side in (-1, 1):
            lock = hull.edge(t, side, up=0.03)
            b.cylinder("oar", tint(rng, "grey"), lock - vec(0, 0.03, 0), lock, 0.008, segments=8)
            a = np.radians(swing)
            way = np.array([side * np.cos(a), dip, np.sin(a)])
            out, grip = rng.uniform(0.3, 0.36) * hull.length, 0.6 * hull.half(t)
            end = lock + out * way
            b.cylinder("oar", wood, lock - grip * way, end, 0.01, segments=8)
            turn = rotation((0, 1, 0), -side * swing) @ rotation((0, 0, 1), side * np.degrees(dip))
            b.rounded_box("oar", wood, end + 0.07 * way, (0.17, 0.012, 0.055), 0.02, turn=turn)


def _workboat(rng: np.random.Generator) -> Builder:
    """Build a tug or a trawler: a stout hull with fenders, a wheelhouse, a funnel and a boom."""
    b = Builder()
    length = rng.uniform(0.9, 1.25)
    beam, depth = length * rng.uniform(0.28, 0.38), rng.uniform(0.16, 0.24)
    hull = Hull(
        length, beam, depth, rng.uniform(0.42, 0.55), rng.uniform(0.5, 0.85),
        rng.uniform(0.45, 0.65), rng.uniform(2, 3), (rng.uniform(0.07, 0.2), rng.uniform(0, 0.05)),
        (rng.uniform(0.02, 0.12), rng.uniform(0, 0.05)), (0.3 * depth, 0.3 * depth),
    )  # fmt: skip
    paint = tint(rng, "red", "navy", "green", "black", "blue", "white", "orange")
    wall, glass = tint(rng, "white", "cream", "orange", "white"), tint(rng, "window")
    solid_hull(b, hull, paint, tint(rng, "red", "black", "dark"), 0.4 * depth, plank(rng))
    bulwark(b, hull, paint, rng.uniform(0.04, 0.07), thickness=0.02)
    y, storey = hull.top(0.5) - 0.005, rng.uniform(0.1, 0.13)
    aft = rng.random() < 0.35
    z = hull.z(0.58 if aft else rng.uniform(0.24, 0.3))
    wide, long = rng.uniform(0.5, 0.65) * beam, rng.uniform(0.26, 0.36) * length
    low = House(wide, (z, z + long), (y, y + storey), (0.0, 0.0), 0.0, 0.03)
    add_house(b, low, wall, glass, "panes", 0.012, (0.5, 0.8))
    at, y = z + rng.uniform(0.02, 0.06), y + storey
    wheel = House(
        0.82 * wide, (at, at + 0.5 * long), (y, y + storey), (rng.uniform(-0.2, 0.2), 0), 0.04
    )
    add_house(b, wheel, wall, glass, "band", 0.02)
    mast(b, tint(rng, "grey", "orange"), np.array([0, y + storey, at + 0.3 * long]), 0.2, 2)
    if rng.random() < 0.65:
        size = np.array([0.1, rng.uniform(0.12, 0.2), 0.09])
        funnel(b, wall, tint(rng, "red", "blue", "black"), (0, y, z + 0.83 * long), size)
    if rng.random() < 0.5:
        _fenders(b, rng, hull)
    _gear(b, rng, hull, z + long, aft)
    return b


def _fenders(b: Builder, rng: np.random.Generator, hull: Hull) -> None:
    """Hang tyres along the sides."""
    rubber, a = pick_material(rng, "rubber"), np.linspace(0, 2 * np.pi, 11)
    for t in np.linspace(0.18, 0.9, int(rng.integers(5, 9))):
        for side in (-1, 1):
            middle = hull.edge(t, side, -0.02, -0.02)
            ring = middle + 0.04 * np.stack([0 * a, np.cos(a), np.sin(a)], 1)
            b.tube("rail", rubber, ring, 0.016, 6)


def _gear(b: Builder, rng: np.random.Generator, hull: Hull, start: float, ahead: bool) -> None:
    """Add a derrick with its boom, a winch and crates: `ahead` of the house or abaft `start`."""
    t = 0.4 if ahead else 0.7
    z = hull.z(t)
    y, steel = hull.top(t), tint(rng, "orange", "grey", "cream")
    foot = np.array([0, y, z if ahead else max(z, start + 0.06)])
    b.cylinder("mast", steel, foot, foot + vec(0, rng.uniform(0.3, 0.5), 0), 0.018, 0.012, 10)
    way = -1 if ahead else 1
    boom = foot + np.array([0, rng.uniform(0.22, 0.34), way * 0.24])
    b.cylinder("mast", steel, foot + vec(0, 0.07, 0), boom, 0.011, segments=8)
    b.cylinder("mast", steel, boom, foot + vec(0, 0.29, 0), 0.004, segments=5)
    winch = foot + vec(0, 0.035, 0.07 * way)
    b.cylinder(
        "cargo",
        tint(rng, "dark"),
        winch - vec(0.08, 0, 0),
        winch + vec(0.08, 0, 0),
        0.03,
        segments=14,
    )
    crate = pick_material(rng, "plastic")
    for x in np.linspace(-0.25, 0.25, int(rng.integers(0, 4))) * hull.beam:
        b.rounded_box(
            "cargo", crate, (x, y + 0.025, foot[2] + 0.16 * way), (0.07, 0.05, 0.06), 0.008
        )


FAMILIES: dict[str, Family] = {
    "rowboat": _rowboat,
    "speedboat": speedboat,
    "motor_yacht": motor_yacht,
    "workboat": _workboat,
    "sailboat": sailboat,
    "catamaran": catamaran,
    "tall_ship": tall_ship,
    "freighter": freighter,
    "warship": warship,
    "carrier": carrier,
    "liner": liner,
    "submarine": submarine,
}
