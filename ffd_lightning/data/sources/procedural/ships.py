"""Ships: freighters and tankers, warships and carriers, liners and ferries, submarines."""

from __future__ import annotations

import numpy as np

from ffd_lightning.data.sources.procedural.furniture import draw
from ffd_lightning.data.sources.procedural.hulls import (
    House,
    Hull,
    add_house,
    bulwark,
    funnel,
    mast,
    railing,
    solid_hull,
    tint,
)
from ffd_lightning.data.sources.procedural.shapes import Builder, Material, pick_material, rotation


def freighter(rng: np.random.Generator) -> Builder:
    """Build a long ship with its bridge aft: containers, hatches and cranes, or tanks."""
    b = Builder()
    length = rng.uniform(1.5, 2.2)
    beam, depth = length * rng.uniform(0.13, 0.2), length * rng.uniform(0.07, 0.11)
    hull = Hull(
        length, beam, depth, rng.uniform(0.3, 0.45), rng.uniform(0.7, 0.95), rng.uniform(0.4, 0.6),
        rng.uniform(4, 7), (rng.uniform(0.02, 0.08), 0.01),
        (rng.uniform(0.02, 0.1), rng.uniform(0.0, 0.06)), (0.0, 0.5 * depth),
    )  # fmt: skip
    deck = tint(rng, "red", "grey", "green", "dark")
    paint = tint(rng, "navy", "black", "red", "green", "blue", "grey", "orange")
    solid_hull(
        b, hull, paint, tint(rng, "red", "red", "black"), rng.uniform(0.3, 0.55) * depth, deck
    )
    bulwark(b, hull, paint, rng.uniform(0.015, 0.035), (0.0, 0.18))
    if rng.random() < 0.6:
        nose = (0, 0.3 * depth, hull.z(0, 0.3 * depth) + 0.02)
        b.ellipsoid("hull", tint(rng, "red"), nose, (0.03, 0.035, 0.09), 12)
    wall, glass = tint(rng, "white", "cream"), tint(rng, "window")
    aft = rng.uniform(0.76, 0.86)
    front = _bridge(b, rng, hull, wall, glass, aft)
    bow = hull.z(0.17)
    load = draw(rng, ["containers", "hatches", "tanks", "pipes"], [0.4, 0.25, 0.15, 0.2])
    add = {"containers": _containers, "hatches": _hatches, "tanks": _tanks, "pipes": _pipes}[load]
    add(b, rng, hull, (bow, front - 0.03))
    mast(b, wall, hull.edge(0.08, 0) * (0, 1, 1), rng.uniform(0.1, 0.18), 1)
    return b


def _bridge(
    b: Builder, rng: np.random.Generator, hull: Hull, wall: Material, glass: Material, t: float
) -> float:
    """Add a tower of cabins with bridge wings and a funnel at a station; return its front's z."""
    z, foot = hull.z(t), hull.top(t)
    long, storey = rng.uniform(0.1, 0.17), rng.uniform(0.04, 0.05)
    floors = int(rng.integers(3, 6))
    width = hull.beam * rng.uniform(0.6, 0.85)
    for i in range(floors):
        y = foot + i * storey
        shape = House(
            width, (z + 0.01 * i, z + long - 0.012 * i), (y, y + storey + 0.001), (0, 0), 0
        )
        add_house(b, shape, wall, glass, "band" if i == floors - 1 else "panes", 0.004)
    high = foot + floors * storey
    wing = (rng.uniform(0.9, 1.05) * hull.beam, 0.4 * storey, 0.25 * long)
    b.box("cabin", wall, (0, high - 0.8 * storey, z + 0.03 + 0.01 * floors), wing)
    mast(b, wall, np.array([0, high, z + 0.4 * long]), rng.uniform(0.08, 0.15), 2)
    size = np.array([0.3 * hull.beam, rng.uniform(0.6, 0.95) * floors * storey, 0.08])
    funnel(b, wall, tint(rng, "red", "blue", "black", "orange"), (0, foot, z + long + 0.05), size)
    return z


def _containers(b: Builder, rng: np.random.Generator, hull: Hull, z: tuple[float, float]) -> None:
    """Stack containers of a few colours in bays along the deck."""
    colors = [pick_material(rng, "paint") for _ in range(5)]
    long, tall = rng.uniform(0.1, 0.14), rng.uniform(0.038, 0.05)
    columns = int(rng.integers(4, 7))
    bays = max(1, int((z[1] - z[0]) / (1.1 * long)))
    wide = 0.92 * hull.beam / columns
    most = int(rng.integers(2, 5))
    for bay in range(bays):
        at = z[0] + (bay + 0.5) * (z[1] - z[0]) / bays
        t = at / hull.length + 0.5
        for column in range(columns):
            x = (column - (columns - 1) / 2) * wide
            if abs(x) + wide / 2 > hull.half(t):
                continue
            for row in range(max(1, most - int(rng.integers(0, 2)) - (bay == 0))):
                center = (x, hull.top(t) + (row + 0.5) * tall + 0.006, at)
                color = colors[int(rng.integers(len(colors)))]
                b.box("cargo", color, center, (0.95 * wide, 0.97 * tall, long))


def _hatches(b: Builder, rng: np.random.Generator, hull: Hull, z: tuple[float, float]) -> None:
    """Add hatch covers, with a pair of derricks or a crane between them."""
    cover, steel = tint(rng, "grey", "green", "red", "cream"), tint(rng, "cream", "grey", "orange")
    count = int(rng.integers(3, 6))
    pitch = (z[1] - z[0]) / count
    wide, tall = rng.uniform(0.55, 0.75) * hull.beam, rng.uniform(0.025, 0.05)
    jib = rng.random() < 0.6
    for i in range(count):
        at = z[0] + (i + 0.5) * pitch
        y = hull.top(at / hull.length + 0.5)
        b.rounded_box("cargo", cover, (0, y + tall / 2, at), (wide, tall, 0.66 * pitch), 0.01)
        b.rounded_box("cargo", cover, (0, y + tall, at), (0.9 * wide, 0.012, 0.6 * pitch), 0.01)
        if i == 0:
            continue
        foot = np.array([0, y, at - pitch / 2])
        head = foot + (0, rng.uniform(0.16, 0.2), 0)
        b.cylinder("mast", steel, foot, head, 0.022, 0.016, 12)
        if jib:
            b.box("mast", steel, head, (0.06, 0.05, 0.06))
            tip = head + np.array([0, 0.08, -0.85 * pitch])
            b.cylinder("mast", steel, head, tip, 0.011, 0.007, 8)
        else:
            for side in (-1, 1):
                tip = foot + np.array([side * 0.3 * hull.beam, 0.15, -0.6 * pitch])
                b.cylinder("mast", steel, foot + (0, 0.03, 0), tip, 0.008, segments=8)


def _tanks(b: Builder, rng: np.random.Generator, hull: Hull, z: tuple[float, float]) -> None:
    """Add the domes of gas tanks, joined by a catwalk."""
    paint = tint(rng, "orange", "white", "grey", "blue")
    radius = 0.42 * hull.beam
    count = max(2, int((z[1] - z[0]) / (2.15 * radius)))
    pitch = (z[1] - z[0]) / count
    radii = (radius, rng.uniform(0.7, 1.0) * radius, min(radius, 0.48 * pitch))
    for i in range(count):
        b.ellipsoid("cargo", paint, (0, hull.depth, z[0] + (i + 0.5) * pitch), radii, 22)
    walk = (0.03, 0.012, z[1] - z[0])
    b.box("deck", tint(rng, "grey"), (0, hull.depth + radii[1], (z[0] + z[1]) / 2), walk)


def _pipes(b: Builder, rng: np.random.Generator, hull: Hull, z: tuple[float, float]) -> None:
    """Add a tanker's pipes, manifold and vents."""
    steel = tint(rng, "grey", "red", "cream")
    y = hull.depth + 0.03
    count = int(rng.integers(3, 6))
    for x in np.linspace(-0.15, 0.15, count) * hull.beam:
        b.cylinder("cargo", steel, (x, y, z[0]), (x, y, z[1]), 0.009, segments=8)
    for at in np.linspace(*z, 9):
        b.box("cargo", steel, (0, y - 0.014, at), (0.4 * hull.beam, 0.036, 0.012))
    middle = (z[0] + z[1]) / 2
    for at in middle + np.linspace(-0.06, 0.06, 4):
        ends = np.array([(-0.45, y + 0.02, 0), (0.45, y + 0.02, 0)]) * (hull.beam, 1, 1) + (
            0,
            0,
            at,
        )
        b.cylinder("cargo", steel, *ends, 0.009, segments=8)
        b.box("cargo", steel, (0, y, at), (0.7 * hull.beam, 0.03, 0.01))
    for side in (-1, 1):
        foot = np.array([side * 0.2 * hull.beam, hull.depth, middle - 0.12])
        b.cylinder("mast", steel, foot, foot + (0, 0.16, 0), 0.012, segments=10)
        tip = foot + (side * 0.02, 0.14, 0.15)
        b.cylinder("mast", steel, foot + (0, 0.1, 0), tip, 0.007, segments=8)


def _navy_hull(rng: np.random.Generator, b: Builder, grey: Material, slim: float) -> Hull:
    """Add the hull of a warship, `slim` its beam over its length."""
    length = rng.uniform(1.6, 2.2)
    depth = length * rng.uniform(0.06, 0.085)
    hull = Hull(
        length, slim * length, depth, rng.uniform(0.5, 0.6), rng.uniform(0.6, 0.8),
        rng.uniform(0.75, 1.0), rng.uniform(2.2, 3.5), (rng.uniform(0.04, 0.09), 0.0),
        (rng.uniform(0.06, 0.16), 0.0), (0.1 * depth, 0.5 * depth),
    )  # fmt: skip
    lower = tint(rng, "red", "black", "dark")
    solid_hull(b, hull, grey, lower, rng.uniform(0.3, 0.45) * depth, tint(rng, "dark", "grey"))
    return hull


def warship(rng: np.random.Generator) -> Builder:
    """Build a destroyer or battleship: turrets fore and aft of stepped houses and funnels."""
    b = Builder()
    grey, dark, glass = tint(rng, "grey"), tint(rng, "dark"), tint(rng, "window")
    hull = _navy_hull(rng, b, grey, rng.uniform(0.1, 0.14))
    y, long, storey = hull.depth, hull.length, rng.uniform(0.045, 0.06)
    caliber, barrels = rng.uniform(0.7, 1.3), int(rng.integers(1, 4))
    low = House(rng.uniform(0.6, 0.85) * hull.beam, (-0.2 * long, rng.uniform(0.18, 0.3) * long),
                (y, y + storey), (0.4, 0.2), 0.12)  # fmt: skip
    add_house(b, low, grey, glass, "none", 0.0)
    height = y + storey
    for i in range(int(rng.integers(2, 4))):
        at = (-0.18 + 0.03 * i) * long
        tier = House((0.6 - 0.1 * i) * hull.beam, (at, at + (0.15 - 0.03 * i) * long),
                     (height, height + storey), (0.3, 0.1), 0.12)  # fmt: skip
        add_house(b, tier, grey, glass, "band" if i else "panes", 0.006 if i else 0.0)
        height += storey
    _tower(b, rng, np.array([0, height, -0.09 * long]), grey)
    for k in range(int(rng.integers(1, 4))):
        foot = (0.0, y + storey, (0.02 + 0.085 * k) * long)
        if foot[2] + 0.07 < low.z[1]:
            size = np.array([0.3 * hull.beam, rng.uniform(0.1, 0.15), 0.11])
            funnel(b, grey, dark, foot, size)
    for place in (0.16, 0.24) if rng.random() < 0.5 else (0.2,):
        step = storey * 0.8 * (place > 0.2)
        _turret(b, grey, (0, hull.top(place) + step, hull.z(place)), caliber, barrels, False)
    rear = 0.9 if low.z[1] < 0.25 * long else 0.93
    if rng.random() < 0.6:
        _turret(b, grey, (0, hull.top(rear), hull.z(rear)), caliber, barrels, True)
    else:
        pad = (0.8 * hull.beam, 0.012, 0.16)
        b.box("deck", dark, (0, hull.top(rear) + 0.008, hull.z(rear)), pad)
    railing(b, hull, grey, 0.03, (0.03, 0.3), 9)
    return b


def _tower(b: Builder, rng: np.random.Generator, foot: np.ndarray, grey: Material) -> None:
    """Add a lattice or a plated mast with radars."""
    height = rng.uniform(0.16, 0.28)
    top = foot + (0, height, 0)
    if rng.random() < 0.5:
        b.box("mast", grey, foot + (0, height / 2, 0), (0.07, height, 0.07), taper=0.4)
        b.ellipsoid("mast", grey, top, (0.03, 0.035, 0.03), 12)
    else:
        for x, z in ((-1, 1), (1, 1), (0, -1)):
            b.cylinder("mast", grey, foot + (0.04 * x, 0, 0.04 * z), top, 0.007, segments=6)
        panel = (rng.uniform(0.08, 0.14), 0.05, 0.012)
        b.box("mast", grey, foot + (0, 0.7 * height, -0.03), panel, rotation((1, 0, 0), 15))
    for level in (0.6, 0.85):
        at, reach = foot + (0, level * height, 0), rng.uniform(0.06, 0.1)
        b.cylinder("mast", grey, at - (reach, 0, 0), at + (reach, 0, 0), 0.005, segments=6)


def _turret(
    b: Builder, paint: Material, foot: tuple[float, float, float], size: float, barrels: int,
    aft: bool,
) -> None:  # fmt: skip
    """Add a gun turret that points forward, or aft."""
    way = 1.0 if aft else -1.0
    base = np.array(foot)
    b.cylinder("gun", paint, base - (0, 0.05, 0), base + (0, 0.02, 0), 0.05 * size, segments=16)
    middle = base + (0, 0.02 + 0.025 * size, 0)
    b.box("gun", paint, middle, np.array([0.1, 0.05, 0.13]) * size, taper=0.8)
    for x in (np.arange(barrels) - (barrels - 1) / 2) * 0.028 * size:
        start = middle + (x, 0, way * 0.05 * size)
        end = start + np.array([0, 0.03, way * 0.17]) * size
        b.cylinder("gun", paint, start, end, 0.009 * size, 0.007 * size, 10)


def carrier(rng: np.random.Generator) -> Builder:
    """Build an aircraft carrier: a broad flat deck, an island at its side, parked planes."""
    b = Builder()
    grey, dark, glass = tint(rng, "grey"), tint(rng, "dark"), tint(rng, "window")
    hull = _navy_hull(rng, b, grey, rng.uniform(0.12, 0.16))
    y, long, beam = hull.depth + hull.sheer[0], hull.length, hull.beam
    left, right = -rng.uniform(0.75, 1.0) * beam, rng.uniform(0.6, 0.8) * beam
    angle, ends = rng.uniform(0.0, 0.2) * beam, (-0.52 * long - hull.rake[0], 0.5 * long)
    outline = [(-0.4 * beam, ends[0]), (0.4 * beam, ends[0]), (right, -0.3 * long),
               (right, 0.4 * long), (0.45 * beam, ends[1]), (-0.5 * beam, ends[1]),
               (left, 0.3 * long), (left, -0.15 * long), (-0.5 * beam - angle, -0.25 * long)]  # fmt: skip
    ring = np.array([(x, 0.0, z) for x, z in outline])
    slim = ring * (0.92, 1, 0.99)
    b.loft("hull", grey, [ring * (0.6, 1, 0.9) + (0, 0.5 * y, 0), slim + (0, y, 0)])
    b.loft("deck", dark, [ring + (0, y, 0), ring + (0, y + 0.02, 0)])
    white, y = tint(rng, "white"), y + 0.02
    for at in np.linspace(ends[0] + 0.1, ends[1] - 0.1, 14):
        b.box("deck", white, (-0.2 * beam, y, at), (0.012, 0.004, 0.06))
    x, z, up = right - 0.12 * beam, rng.uniform(-0.1, 0.15) * long, 0.05
    for i in range(int(rng.integers(2, 5))):
        size = (0.2 * beam, up, (0.2 - 0.035 * i) * long)
        b.rounded_box("cabin", grey, (x, y + up / 2, z), size, 0.015)
        b.box("cabin", glass, (x, y + 0.65 * up, z), (1.03 * size[0], 0.3 * up, 0.9 * size[2]))
        y += up
    _tower(b, rng, np.array([x, y, z]), grey)
    deck = hull.depth + hull.sheer[0] + 0.02
    for i in range(int(rng.integers(3, 8))):
        _parked(b, grey, (left + 0.18 * beam, deck, (-0.1 + 0.055 * i) * long), 0.09)
    return b


def _parked(b: Builder, paint: Material, at: tuple[float, float, float], size: float) -> None:
    """Add a small jet on deck, its nose turned inboard."""
    middle = np.array(at) + (0, 0.16 * size, 0)
    b.ellipsoid("cargo", paint, middle, np.array([0.5, 0.11, 0.09]) * size, 10)
    delta = np.array([(0.3, 0, 0), (-0.35, 0, 0.45), (-0.45, 0, 0.45),
                      (-0.45, 0, -0.45), (-0.35, 0, -0.45)]) * size  # fmt: skip
    b.loft("cargo", paint, [delta + middle, delta + middle + (0, 0.05 * size, 0)])
    b.box(
        "cargo",
        paint,
        middle + np.array([-0.38, 0.15, 0]) * size,
        (0.16 * size, 0.25 * size, 0.006),
    )
    b.box("cargo", paint, middle - (0, 0.1 * size, 0), (0.1 * size, 0.16 * size, 0.1 * size))


def liner(rng: np.random.Generator) -> Builder:
    """Build a cruise ship, an ocean liner or a ferry: many decks of cabins and funnels."""
    b = Builder()
    length = rng.uniform(1.4, 2.2)
    beam, depth = rng.uniform(0.24, 0.32), rng.uniform(0.14, 0.2)
    hull = Hull(
        length, beam, depth, rng.uniform(0.35, 0.5), rng.uniform(0.6, 0.85), rng.uniform(0.6, 0.85),
        rng.uniform(3, 5), (rng.uniform(0.02, 0.06), 0.01), (rng.uniform(0.05, 0.15), 0.02),
        (0, 0.3 * depth),
    )  # fmt: skip
    white, glass = tint(rng, "white", "white", "cream"), tint(rng, "window")
    paint = tint(rng, "white", "navy", "black", "red", "blue")
    solid_hull(b, hull, paint, tint(rng, "red", "blue", "black"), 0.35 * depth, tint(rng, "teak"))
    bulwark(b, hull, paint, 0.02, (0.0, 0.2))
    floors, storey = int(rng.integers(2, 6)), rng.uniform(0.04, 0.055)
    front, back = rng.uniform(-0.32, -0.24) * length, rng.uniform(0.36, 0.44) * length
    steps, y = rng.uniform(0.2, 0.9, 2) * 0.05 * length, hull.top(0.5)
    wide = 1.96 * hull.half(front / length + 0.5)
    for i in range(floors):
        tier = House(wide * (1 - 0.03 * i), (front + steps[0] * i, back - steps[1] * i),
                     (y, y + storey), (0.2, 0.0), 0.0)  # fmt: skip
        add_house(b, tier, white, glass, "panes", 0.006, (0.3, 0.75))
        y += storey
    z = (front + steps[0] * floors, front + steps[0] * floors + 0.16 * length)
    top = House(0.8 * wide, z, (y, y + storey), (0.25, 0))
    add_house(b, top, white, glass, "band")
    mast(b, white, np.array([0, y + storey, z[1] - 0.08]), rng.uniform(0.1, 0.2), 2)
    size = np.array([rng.uniform(0.07, 0.1), rng.uniform(0.12, 0.22), rng.uniform(0.11, 0.16)])
    stack = tint(rng, "red", "orange", "white", "blue", "black")
    count = int(rng.integers(1, 5)) if floors < 5 else 1
    rear = back - steps[1] * floors - 0.1
    for at in np.linspace(z[1] + 0.1, rear, count) if count > 1 else [0.6 * rear]:
        funnel(b, stack, tint(rng, "black", "white"), (0, y, at), size)
    for at in np.linspace(front + 0.15, back - 0.2, int(rng.integers(3, 7))):
        for side in (-1, 1):
            boat = (side * (wide / 2 + 0.012), hull.top(0.5) + 0.3 * storey, at)
            b.ellipsoid("cargo", tint(rng, "orange"), boat, (0.018, 0.018, 0.05), 10)
    return b


def submarine(rng: np.random.Generator) -> Builder:
    """Build a submarine: a spindle with a sail, planes, fins, a screw and sometimes a deck."""
    b = Builder()
    paint = tint(rng, "dark", "black", "grey", "navy", "orange", "green")
    dark = tint(rng, "dark", "black")
    length, radius = rng.uniform(1.3, 2.0), rng.uniform(0.085, 0.15)
    nose, tail = rng.uniform(0.08, 0.25), rng.uniform(0.25, 0.45)
    t = np.concatenate([np.linspace(0, nose, 9), np.linspace(1 - tail, 1, 11)])
    share = np.where(t < nose, np.sqrt(np.maximum(1 - (1 - t / nose) ** 2, 0)),
                     1 - 0.88 * np.clip((t - 1 + tail) / tail, 0, 1) ** 1.8)  # fmt: skip
    profile = np.column_stack([radius * np.maximum(share, 0.02), (0.5 - t) * length])
    forward = rotation((1, 0, 0), -90)
    b.lathe("hull", paint, profile, turn=forward, segments=28)
    if rng.random() < 0.5:
        size = (1.1 * radius, 0.25 * radius, rng.uniform(0.5, 0.65) * length)
        b.rounded_box("deck", dark, (0, 0.95 * radius, -0.05 * length), size, 0.4 * radius, 0.02)
    z, tall = rng.uniform(-0.2, 0.02) * length, rng.uniform(0.1, 0.19)
    long = rng.uniform(0.16, 0.3)
    _fin(
        b,
        "cabin",
        paint,
        np.array([0, 0.8 * radius, z]),
        (0, tall + 0.2 * radius, 0),
        long,
        0.06,
        0.88,
    )
    roof = np.array([0, radius + tall - 0.01, z])
    for i in range(int(rng.integers(1, 5))):
        foot = roof + (0, 0, (-0.25 + 0.15 * i) * long)
        b.cylinder("mast", dark, foot, foot + (0, rng.uniform(0.03, 0.14), 0), 0.007, segments=8)
    level = rng.uniform(0.3, 0.7) * tall + radius if rng.random() < 0.6 else 0.0
    at = z if level else -0.3 * length
    for side in (-1, 1):
        reach = (side * (0.13 if level else 0.1 + radius), 0, 0.02)
        _fin(b, "keel", paint, np.array([0, level, at]), reach, 0.09, 0.016, 0.7)
    turn = 45.0 if rng.random() < 0.25 else 0.0
    for k in range(4):
        way = rotation((0, 0, 1), turn + 90 * k) @ np.array([rng.uniform(1.1, 1.6) * radius, 0, 0])
        _fin(
            b, "keel", paint, np.array([0, 0, 0.44 * length]), way + (0, 0, 0.02), 0.13, 0.018, 0.65
        )
    _screw(b, tint(rng, "orange", "grey"), 0.5 * length, 0.75 * radius, int(rng.integers(3, 8)))
    return b


def _fin(
    b: Builder, part: str, paint: Material, root: np.ndarray, reach: tuple[float, float, float],
    chord: float, thickness: float, tip: float,
) -> None:  # fmt: skip
    """Add a streamlined fin from `root` along `reach`, its tip scaled by `tip`."""
    out = np.asarray(reach, float)
    side = np.cross((0, 0, 1.0), out)
    side /= np.linalg.norm(side)
    s = np.array([(-0.5, 0), (-0.42, 0.6), (-0.2, 1), (0.1, 0.8), (0.5, 0.08)])
    foil = np.concatenate([s, s[-1:0:-1] * (1, -1)])
    section = foil[:, :1] * (0, 0, chord) + foil[:, 1:] * side * thickness / 2
    scales = ((0.0, 1.0), (0.5, (1 + tip) / 2), (0.97, tip), (1.0, 0.85 * tip))
    b.loft(part, paint, [root + t * out + scale * section for t, scale in scales])


def _screw(b: Builder, metal: Material, z: float, radius: float, blades: int) -> None:
    """Add a hub and twisted blades about the z axis."""
    b.cylinder(
        "engine", metal, (0, 0, z - 0.02), (0, 0, z + 0.03), 0.25 * radius, 0.08 * radius, 10
    )
    for k in range(blades):
        spin = rotation((0, 0, 1), 360 * k / blades)
        turn = spin @ rotation((0, 1, 0), 90) @ rotation((0, 0, 1), 0) @ rotation((0, 1, 0), 55)
        center = spin @ np.array([0, 0.55 * radius, 0]) + (0, 0, z)
        b.ellipsoid(
            "engine", metal, center, (0.22 * radius, 0.45 * radius, 0.04 * radius), 10, turn
        )
