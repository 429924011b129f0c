"""Watercraft: from rowing boats, speedboats, yachts and tugs to ships, under sail or power."""

from __future__ import annotations

import numpy as np

from ffd_lightning.data.sources.procedural.furniture import bend, draw
from ffd_lightning.data.sources.procedural.hulls import (
    House,
    Hull,
    add_house,
    bulwark,
    funnel,
    mast,
    open_hull,
    plank,
    railing,
    solid_hull,
    tint,
)
from ffd_lightning.data.sources.procedural.sailing import catamaran, sailboat, tall_ship
from ffd_lightning.data.sources.procedural.shapes import (
    Array,
    Builder,
    Family,
    Material,
    pick_material,
    rotation,
)
from ffd_lightning.data.sources.procedural.ships import (
    carrier,
    freighter,
    liner,
    submarine,
    warship,
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
    outer = wood if rng.random() < 0.4 else tint(rng, "white", "red", "green", "blue", "navy", "orange")
    trim = plank(rng)
    open_hull(b, hull, outer, 0.014)
    bulwark(b, hull, trim, 0.01, thickness=0.022, part="rail")
    for t in np.linspace(0.3, 0.85, int(rng.integers(2, 5))):
        low, width = hull.top(t) - 0.25 * depth, 1.9 * hull.half(t)
        b.rounded_box("seat", trim, (0, low, hull.z(t)), (width, 0.016, rng.uniform(0.06, 0.1)), 0.01)
    _floor(b, hull, trim)
    if kind == "dinghy" and rng.random() < 0.35:
        _outboard(b, rng, np.array([0, hull.top(1), hull.z(1)]), 0.8)
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
            b.cylinder("oar", tint(rng, "grey"), lock - (0, 0.03, 0), lock, 0.008, segments=8)
            a = np.radians(swing)
            way = np.array([side * np.cos(a), dip, np.sin(a)])
            out, grip = rng.uniform(0.3, 0.36) * hull.length, 0.6 * hull.half(t)
            end = lock + out * way
            b.cylinder("oar", wood, lock - grip * way, end, 0.01, segments=8)
            turn = rotation((0, 1, 0), -side * swing) @ rotation((0, 0, 1), side * np.degrees(dip))
            b.rounded_box("oar", wood, end + 0.07 * way, (0.17, 0.012, 0.055), 0.02, turn=turn)


def _outboard(b: Builder, rng: np.random.Generator, top: Array, size: float) -> None:
    """Add an outboard motor behind the top of the stern."""
    cowl, dark = tint(rng, "black", "white", "dark", "blue"), tint(rng, "dark")
    head = top + np.array([0, 0.06, 0.05]) * size
    b.rounded_box("engine", cowl, head, np.array([0.08, 0.1, 0.12]) * size, 0.03 * size)
    b.box("engine", dark, top + np.array([0, -0.04, 0.05]) * size, np.array([0.035, 0.2, 0.05]) * size)
    low = top + np.array([0, -0.17, 0.06]) * size
    b.ellipsoid("engine", dark, low, np.array([0.022, 0.022, 0.07]) * size, 10)
    b.box("engine", dark, low + np.array([0, -0.03, 0]) * size, np.array([0.01, 0.05, 0.05]) * size)
    for k in range(3):
        turn = rotation((0, 0, 1), 120 * k) @ rotation((0, 1, 0), 35)
        center = low + turn @ np.array([0, 0.025, 0]) * size + np.array([0, 0, 0.07]) * size
        b.ellipsoid("engine", dark, center, np.array([0.014, 0.026, 0.004]) * size, 8, turn)


def _planing_hull(rng: np.random.Generator, length: float, beam: float, depth: float) -> Hull:
    """Draw a V-shaped hull with a broad stern."""
    return Hull(
        length, beam, depth, rng.uniform(0.55, 0.7), rng.uniform(0.82, 0.95), rng.uniform(0.6, 0.85),
        rng.uniform(1.4, 2.2), (rng.uniform(0.02, 0.09), 0.0),
        (rng.uniform(0.08, 0.22), rng.uniform(-0.03, 0.04)), (0.6 * depth, 0.1 * depth),
    )  # fmt: skip


def _speedboat(rng: np.random.Generator) -> Builder:
    """Build a runabout with a windscreen, seats in a cockpit and motors, or a centre console."""
    b = Builder()
    length = rng.uniform(0.9, 1.2)
    depth = length * rng.uniform(0.12, 0.17)
    hull = _planing_hull(rng, length, length * rng.uniform(0.3, 0.42), depth)
    paint = tint(rng, "white", "red", "blue", "navy", "orange", "black", "green")
    deck = plank(rng) if rng.random() < 0.35 else tint(rng, "white", "cream")
    solid_hull(b, hull, paint, tint(rng, "white", "black", "navy", "red"), 0.45 * depth, deck)
    front, back = rng.uniform(0.36, 0.48), rng.uniform(0.86, 0.94)
    y, z = hull.top(front), (hull.z(front), hull.z(back))
    wide = 1.5 * hull.half(front)
    b.box("deck", tint(rng, "dark", "teak"), (0, hull.top(0.7) + 0.005, (z[0] + z[1]) / 2),
          (wide, 0.012, z[1] - z[0]))  # fmt: skip
    bulwark(b, hull, paint, rng.uniform(0.03, 0.06), (front - 0.05, 1.0), 0.03)
    cover = pick_material(rng, draw(rng, ["leather", "fabric"]))
    kind = draw(rng, ["screen", "console", "hardtop"], [0.5, 0.25, 0.25])
    if kind == "screen":
        _windscreen(b, rng, y, z[0], wide, rng.uniform(0.05, 0.1))
    else:
        _console(b, rng, hull, z[0] + 0.06, kind == "hardtop", deck)
    rows = 1 if z[1] - z[0] < 0.42 else 2
    for i in range(rows):
        at = z[0] + (0.5 + 0.36 * i) * (z[1] - z[0])
        for x in (-0.24 * wide, 0.24 * wide) if i == 0 else (0.0,):
            _seat(b, cover, (x, hull.top(0.7), at), 0.32 * wide if i == 0 else 0.8 * wide)
    motors = int(rng.integers(0, 4))
    for x in (np.arange(motors) - (motors - 1) / 2) * 0.11:
        _outboard(b, rng, np.array([x, hull.top(1) + 0.01, hull.z(1)]), 1.0)
    if rng.random() < 0.6:
        railing(b, hull, tint(rng, "grey"), 0.04, (0.02, front - 0.06), 5)
    return b


def _windscreen(
    b: Builder, rng: np.random.Generator, y: float, z: float, width: float, height: float
) -> None:
    """Add a raked, wrapped windscreen in a frame."""
    glass, metal = pick_material(rng, "glass"), tint(rng, "grey", "dark")
    a, lean = np.linspace(-0.5, 0.5, 9) * np.pi, rng.uniform(0.4, 1.0) * height
    foot = np.stack([0.5 * width * np.sin(a), y + 0 * a, z + 0.12 - 0.14 * np.cos(a)], 1)
    head = foot * (0.9, 1, 1) + (0, height, lean)
    rings = []
    for low, high in zip(foot, head, strict=True):
        rings.append([low, high, high + (0, 0, 0.008), low + (0, 0, 0.008)])
    b.loft("cabin", glass, rings)
    b.tube("cabin", metal, head, 0.006, 6)
    b.tube("cabin", metal, foot, 0.007, 6)


def _console(
    b: Builder, rng: np.random.Generator, hull: Hull, z: float, tall: bool, wall: Material
) -> None:
    """Add a steering console with a small screen, under a hard top on posts if `tall`."""
    y, wide = hull.top(0.55), 0.45 * hull.beam
    size = House(wide, (z, z + 0.15), (y, y + 0.1), (0.5, 0.0), 0.1)
    add_house(b, size, wall, tint(rng, "window"), "none", 0.0)
    metal = tint(rng, "grey", "white")
    screen = (0.9 * wide, 0.06, 0.008)
    b.box("cabin", pick_material(rng, "glass"), (0, y + 0.125, z + 0.07), screen, rotation((1, 0, 0), 25))
    if not tall:
        return
    roof = y + rng.uniform(0.22, 0.28)
    for x in (-0.5, 0.5):
        for at, top in ((z + 0.03, z + 0.05), (z + 0.15, z + 0.2)):
            b.cylinder("cabin", metal, (x * wide, y, at), (x * wide, roof, top), 0.008, segments=8)
    b.rounded_box("cabin", wall, (0, roof, z + 0.12), (1.25 * wide, 0.024, 0.3), 0.04)


def _seat(b: Builder, cover: Material, at: tuple[float, float, float], width: float) -> None:
    """Add a seat that faces the bow."""
    middle = np.array(at)
    b.rounded_box("seat", cover, middle + (0, 0.025, 0), (width, 0.05, 0.1), 0.02)
    turn = rotation((1, 0, 0), 10)
    b.rounded_box("seat", cover, middle + (0, 0.07, 0.05), (width, 0.1, 0.03), 0.012, turn=turn)


def _motor_yacht(rng: np.random.Generator) -> Builder:
    """Build a yacht with one to three raked decks, an arch or a mast, and a bow rail."""
    b = Builder()
    length = rng.uniform(1.2, 1.8)
    depth = length * rng.uniform(0.1, 0.14)
    hull = _planing_hull(rng, length, length * rng.uniform(0.2, 0.29), depth)
    white, glass = tint(rng, "white", "white", "cream", "grey"), tint(rng, "window")
    paint = tint(rng, "white", "white", "navy", "black", "grey", "blue", "red")
    solid_hull(b, hull, paint, tint(rng, "red", "navy", "black"), 0.4 * depth, plank(rng))
    bulwark(b, hull, white, rng.uniform(0.015, 0.045))
    front, back = rng.uniform(0.26, 0.4), rng.uniform(0.74, 0.86)
    z0, z1, y = hull.z(front), hull.z(back), hull.top(0.55) - 0.005
    storey, rake = rng.uniform(0.075, 0.1), rng.uniform(0.4, 1.6)
    width = 0.8 * min(hull.beam, 2.3 * hull.half(front))
    windows = draw(rng, ["band", "panes"], [0.75, 0.25])
    for _ in range(int(rng.integers(1, 4))):
        tier = House(width, (z0, z1), (y, y + storey), (rake, rng.uniform(-0.4, 0.3)), 0.2, 0.04)
        add_house(b, tier, white, glass, windows, 0.008)
        y, width = y + storey + 0.008, 0.85 * width
        z0 += rake * storey + rng.uniform(0.03, 0.1) * length
        z1 -= rng.uniform(0.03, 0.12) * length
        if z1 - z0 < 0.2:
            break
    _arch(b, rng, white, y, (z0 + z1) / 2 + 0.03, 0.8 * width)
    _sports_deck(b, rng, hull, white, y)
    swim = (1.6 * hull.half(1.0), 0.02, 0.09)
    b.rounded_box("deck", plank(rng), (0, 0.5 * depth, hull.z(1.0, 0.5 * depth) + 0.035), swim, 0.02)
    railing(b, hull, tint(rng, "grey"), 0.05, (0.02, rng.uniform(0.3, 0.5)), 8)
    return b


def _arch(
    b: Builder, rng: np.random.Generator, paint: Material, y: float, z: float, width: float
) -> None:
    """Add a radar arch with domes, or a signal mast."""
    if rng.random() < 0.4:
        mast(b, paint, np.array([0, y, z]), rng.uniform(0.1, 0.2), 2)
        return
    rise, half = rng.uniform(0.06, 0.11), width / 2
    ends = [(-half, y - 0.01, z), (-0.8 * half, y + rise, z + 0.06),
            (0.8 * half, y + rise, z + 0.06), (half, y - 0.01, z)]  # fmt: skip
    b.tube("mast", paint, bend(ends, 0.04), 0.016, 8)
    for x in (-0.35, 0.35) if rng.random() < 0.6 else (0.0,):
        b.ellipsoid("mast", paint, (x * width, y + rise + 0.025, z + 0.06), (0.026, 0.03, 0.026), 12)


def _sports_deck(
    b: Builder, rng: np.random.Generator, hull: Hull, paint: Material, y: float
) -> None:
    """Add a sofa aft, sunbeds on the foredeck, and sometimes a tender."""
    cover = pick_material(rng, "fabric")
    t = 0.93
    _seat(b, cover, (0, hull.top(t), hull.z(t)), 1.3 * hull.half(t))
    if rng.random() < 0.6:
        bed = (0.9 * hull.half(0.2), 0.03, 0.1)
        b.rounded_box("seat", cover, (0, hull.top(0.2) + 0.015, hull.z(0.2)), bed, 0.02)


def _workboat(rng: np.random.Generator) -> Builder:
    """Build a tug or a trawler: a stout hull with fenders, a wheelhouse, a funnel and a boom."""
    b = Builder()
    length = rng.uniform(0.9, 1.25)
    beam, depth = length * rng.uniform(0.28, 0.38), rng.uniform(0.16, 0.24)
    hull = Hull(
        length, beam, depth, rng.uniform(0.42, 0.55), rng.uniform(0.5, 0.85), rng.uniform(0.45, 0.65),
        rng.uniform(2, 3), (rng.uniform(0.07, 0.2), rng.uniform(0, 0.05)),
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
    wheel = House(0.82 * wide, (at, at + 0.5 * long), (y, y + storey), (rng.uniform(-0.2, 0.2), 0), 0.04)
    add_house(b, wheel, wall, glass, "band", 0.02)
    mast(b, tint(rng, "grey", "orange"), np.array([0, y + storey, at + 0.3 * long]), 0.2, 2)
    if rng.random() < 0.65:
        size = np.array([0.1, rng.uniform(0.12, 0.2), 0.09])
        funnel(b, wall, tint(rng, "red", "blue", "black"), (0, y, z + 0.83 * long), size)
    if rng.random() < 0.5:
        _fenders(b, rng, hull)
    _gear(b, rng, hull, 0.2 if aft else z + long, 0.5 * hull.z(0.3) if aft else hull.z(0.85), aft)
    return b


def _fenders(b: Builder, rng: np.random.Generator, hull: Hull) -> None:
    """Hang tyres along the sides."""
    rubber, a = pick_material(rng, "rubber"), np.linspace(0, 2 * np.pi, 13)
    for t in np.linspace(0.18, 0.9, int(rng.integers(5, 9))):
        for side in (-1, 1):
            middle = hull.edge(t, side, -0.02, -0.02)
            ring = middle + 0.04 * np.stack([0 * a, np.cos(a), np.sin(a)], 1)
            b.tube("rail", rubber, ring, 0.016, 7)


def _gear(
    b: Builder, rng: np.random.Generator, hull: Hull, start: float, end: float, ahead: bool
) -> None:
    """Add what stands on the working deck: a derrick with its boom, a winch, boxes of fish."""
    t = 0.4 if ahead else 0.7
    z = hull.z(t)
    y, steel = hull.top(t), tint(rng, "orange", "grey", "cream")
    foot = np.array([0, y, z if ahead else max(z, start + 0.06)])
    b.cylinder("mast", steel, foot, foot + (0, rng.uniform(0.3, 0.5), 0), 0.018, 0.012, 10)
    way = -1 if ahead else 1
    boom = foot + np.array([0, rng.uniform(0.22, 0.34), way * 0.24])
    b.cylinder("mast", steel, foot + (0, 0.07, 0), boom, 0.011, segments=8)
    b.cylinder("mast", steel, boom, foot + (0, 0.29, 0), 0.004, segments=5)
    winch = foot + (0, 0.035, 0.07 * way)
    b.cylinder("cargo", tint(rng, "dark"), winch - (0.08, 0, 0), winch + (0.08, 0, 0), 0.03, segments=14)
    crate = pick_material(rng, "plastic")
    for x in np.linspace(-0.25, 0.25, int(rng.integers(0, 4))) * hull.beam:
        b.rounded_box("cargo", crate, (x, y + 0.025, foot[2] + 0.16 * way), (0.07, 0.05, 0.06), 0.008)


FAMILIES: dict[str, Family] = {
    "rowboat": _rowboat,
    "speedboat": _speedboat,
    "motor_yacht": _motor_yacht,
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
