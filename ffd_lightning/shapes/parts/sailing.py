"""Sailing craft: sloops, ketches, catamarans and square-riggers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.parts.furniture import draw, sheet
from ffd_lightning.shapes.parts.hulls import (
    House,
    Hull,
    add_house,
    bulwark,
    plank,
    railing,
    solid_hull,
    tint,
    vec,
)
from ffd_lightning.shapes.shapes import Array, Builder, Material, pick_material

_LINE = 0.0035  # radius of ropes
_ALLOY = Material((0.55, 0.57, 0.6))


def _rope(b: Builder, start: ArrayLike, end: ArrayLike) -> None:
    """Add a stay."""
    b.cylinder("mast", Material((0.25, 0.22, 0.2)), start, end, _LINE, segments=5)


def add_sail(
    b: Builder, cloth: Material, corners: ArrayLike, belly: ArrayLike, rows: int = 9, cols: int = 7
) -> None:
    """Add a sail between four corners (4, 3): foot's fore and aft end, head's fore and aft end.

    `belly` (3,) is how far its middle is blown out.
    """
    tack, clew, head, peak = np.asarray(corners, float)
    u = np.linspace(0, 1, rows)[:, None, None]
    v = np.linspace(0, 1, cols)[None, :, None]
    flat = (1 - u) * ((1 - v) * tack + v * clew) + u * ((1 - v) * head + v * peak)
    full = np.sin(np.pi * v**0.8) * np.sin(np.pi * (0.1 + 0.9 * u) ** 0.7)
    sheet(b, "sail", cloth, flat + full * np.asarray(belly, float), 0.006)


def _draw_cloth(rng: np.random.Generator) -> Material:
    """Draw a sail's cloth: mostly white, sometimes tanned, coloured or striped."""
    plain = tint(rng, "white", "white", "white", "cream", "red", "orange", "blue")
    return replace(plain, pattern="stripes", scale=1.2) if rng.random() < 0.2 else plain


def _rig(
    b: Builder, rng: np.random.Generator, spar: Material, cloth: Material, foot: Array,
    height: float, boom: float,
) -> None:  # fmt: skip
    """Add a mast, a boom and its mainsail: pointed, gaff-headed, or furled on the boom."""
    top = foot + vec(0, height, 0)
    b.cylinder("mast", spar, foot, top, 0.014, 0.009, 10)
    low = foot + vec(0, rng.uniform(0.1, 0.14) + 0.05 * height, 0)
    swing = rng.uniform(-0.25, 0.25)
    away = np.array([np.sin(swing), 0.02, np.cos(swing)]) * boom
    b.cylinder("mast", spar, low, low + away, 0.011, segments=8)
    belly = np.array([np.sign(swing) * 0.08 * boom, 0, 0])
    kind = draw(rng, ["pointed", "gaff", "furled"], [0.65, 0.2, 0.15])
    mid, up = low + vec(0, 0.02, 0.012), height - (low - foot)[1] - 0.04
    if kind == "pointed":
        head = mid + vec(0, up, 0)
        roach = rng.uniform(0.03, 0.16) * away
        add_sail(b, cloth, (mid, mid + 0.97 * away, head, head + roach), belly + 0.1 * away)
    elif kind == "gaff":
        throat = mid + vec(0, 0.6 * up, 0)
        peak = throat + 0.62 * away + vec(0, 0.36 * up, 0)
        b.cylinder("mast", spar, throat, peak, 0.009, segments=8)
        add_sail(b, cloth, (mid, mid + 0.97 * away, throat, peak), belly)
    else:
        path = [mid + t * away + vec(0, 0.012, 0) for t in (0.02, 0.1, 0.5, 0.9, 0.98)]
        b.tube("sail", cloth, path, (0.02, 0.035, 0.032, 0.024, 0.012), 10)


def _stays(b: Builder, hull: Hull, foot: Array, height: float, t: float) -> None:
    """Add the shrouds and the backstay of a mast at station `t`, with spreaders."""
    top, half = foot + vec(0, 0.97 * height, 0), hull.half(t) + abs(hull.x)
    for side in (-1, 1):
        spreader = foot + vec(side * 0.45 * half, 0.55 * height, 0)
        start = foot + vec(0, 0.55 * height, 0)
        b.cylinder("mast", _ALLOY, start, spreader, 0.006, segments=6)
        chain = (side * 0.95 * half, hull.top(t), foot[2] + 0.02)
        _rope(b, chain, spreader)
        _rope(b, spreader, top)


def _jibs(
    b: Builder, rng: np.random.Generator, cloth: Material, bow: Array, foot: Array, height: float
) -> None:
    """Add a forestay and one or two headsails from `bow` to the mast, or a furled one."""
    head = foot + vec(0, rng.uniform(0.75, 0.95) * height, -0.02)
    _rope(b, bow, head)
    if rng.random() < 0.2:
        b.tube(
            "sail",
            cloth,
            [bow + t * (head - bow) for t in (0.04, 0.2, 0.9)],
            (0.01, 0.018, 0.01),
            8,
        )
        return
    side = rng.choice([-1.0, 1.0])
    overlap, count = rng.uniform(-0.1, 0.25), 1 if rng.random() < 0.75 else 2
    for i in range(count):
        start = bow + 0.35 * i * (foot - bow) * (1, 0, 1)
        tack, peak = start + 0.05 * (head - start), start + (0.92 - 0.12 * i) * (head - start)
        reach = (1 + overlap) * (foot - start) if count == 1 else 0.62 * (foot - start)
        clew = start + reach * (1, 0, 1) + vec(side * 0.08, 0.08, 0)
        add_sail(b, cloth, (tack, clew, peak, peak + vec(0, 0, 0.012)), (side * 0.05, 0, 0.02))


def sailboat(rng: np.random.Generator) -> Builder:
    """Build a sloop or a ketch on one hull with a keel, a cabin and a cockpit."""
    b = Builder()
    length = rng.uniform(0.9, 1.3)
    beam, depth = length * rng.uniform(0.22, 0.34), rng.uniform(0.1, 0.16)
    hull = Hull(
        length, beam, depth, rng.uniform(0.5, 0.65), rng.uniform(0.25, 0.85),
        rng.uniform(0.75, 1.0), rng.uniform(1.5, 2.2),
        (rng.uniform(0.02, 0.09), rng.uniform(0, 0.04)),
        (rng.uniform(0.05, 0.25), rng.uniform(-0.05, 0.12)), (0.6 * depth, 0.6 * depth),
    )  # fmt: skip
    wall = tint(rng, "white", "cream") if rng.random() < 0.6 else plank(rng)
    paint = tint(rng, "white", "white", "navy", "red", "green", "black")
    spar = pick_material(rng, draw(rng, ["wood", "metal"], [0.35, 0.65]))
    solid_hull(b, hull, paint, tint(rng, "red", "navy", "black", "blue"), 0.5 * depth, plank(rng))
    bulwark(b, hull, wall, rng.uniform(0.008, 0.03))
    _keel(b, rng, hull)
    deck, roof = hull.top(0.5) - 0.005, rng.uniform(0.05, 0.09)
    front, back = hull.z(rng.uniform(0.27, 0.36)), hull.z(rng.uniform(0.58, 0.68))
    house = House(0.55 * beam, (front, back), (deck, deck + roof), (1.6, 0.1), 0.25, 0.03)
    add_house(b, house, wall, tint(rng, "window"), "panes", 0.0, (0.35, 0.75))
    _cockpit(b, rng, hull, back, wall)
    height = length * rng.uniform(1.0, 1.45)
    ketch = rng.random() < 0.25
    t = rng.uniform(0.36, 0.42) if not ketch else 0.34
    foot, cloth = np.array([0, deck, hull.z(t)]), _draw_cloth(rng)
    boom = hull.z(0.9 if not ketch else 0.7) - foot[2]
    _rig(b, rng, spar, cloth, foot, height, boom)
    _stays(b, hull, foot, height, t)
    bow = hull.edge(0.01, 0, up=0.02) * (0, 1, 1)
    if rng.random() < 0.3:
        tip = bow + vec(0, 0.03, -rng.uniform(0.1, 0.22))
        b.cylinder("mast", spar, bow + vec(0, -0.01, 0.1), tip, 0.013, 0.009, 8)
        bow = tip
    _jibs(b, rng, cloth, bow, foot, height)
    stern = hull.edge(0.98, 0) * (0, 1, 1)
    if ketch:
        mizzen = np.array([0, hull.top(0.78), hull.z(0.78)])
        _rig(b, rng, spar, cloth, mizzen, 0.65 * height, 0.26 * length)
    else:
        _rope(b, stern, foot + vec(0, height, 0))
    if rng.random() < 0.5:
        railing(b, hull, spar, 0.06, (0.02, 0.25), 5)
    return b


def _keel(b: Builder, rng: np.random.Generator, hull: Hull) -> None:
    """Add a fin keel, sometimes with a bulb, and a rudder; or one long keel."""
    paint, drop = tint(rng, "red", "dark", "navy"), rng.uniform(0.12, 0.24)
    if rng.random() < 0.3:
        spans = [(0.3, 0.93, 0.45 * drop)]
    else:
        root = rng.uniform(0.38, 0.44)
        spans = [(root, root + rng.uniform(0.12, 0.2), drop), (0.88, 0.95, 0.8 * drop)]
    for start, end, down in spans:
        z = hull.z(start, 0), hull.z(end, 0)
        shape = House(0.03, z, (-down, 0.05), (-0.2, 0.25), -0.01, 0.012)
        b.loft("keel", paint, [shape.ring(0), shape.ring(1)])
    if len(spans) == 2 and rng.random() < 0.4:
        at = (0, -drop, hull.z(spans[0][0] + 0.08, 0))
        b.ellipsoid("keel", paint, at, (0.03, 0.025, 0.11), 12)


def _cockpit(
    b: Builder, rng: np.random.Generator, hull: Hull, front: float, wall: Material
) -> None:
    """Add a coaming about a dark well, with a wheel or a tiller."""
    y, end = hull.top(0.8), hull.z(0.93)
    width = 0.52 * min(hull.beam, 2.2 * hull.half(0.9))
    middle, long = (front + end) / 2, end - front
    b.box("deck", tint(rng, "dark", "teak"), (0, y + 0.004, middle), (width, 0.012, long))
    for side in (-1, 1):
        b.rounded_box(
            "deck", wall, (side * width / 2, y + 0.015, middle), (0.025, 0.04, long), 0.01
        )
    metal, at = tint(rng, "grey"), np.array([0, y + 0.07, front + 0.65 * long])
    if rng.random() < 0.5:
        a = np.linspace(0, 2 * np.pi, 15)
        wheel = at + 0.05 * np.stack([np.cos(a), np.sin(a), 0 * a], 1)
        b.tube("deck", metal, wheel, 0.005, 6)
        b.cylinder("deck", metal, at + vec(0, 0, 0.01), at + vec(0, -0.07, 0.01), 0.01, segments=8)
    else:
        b.cylinder(
            "deck", metal, (0, y + 0.05, end - 0.4 * long), (0, y + 0.02, end), 0.007, segments=8
        )


def catamaran(rng: np.random.Generator) -> Builder:
    """Build two slender hulls under a bridge deck with a saloon, a mast and sails."""
    b = Builder()
    length = rng.uniform(0.9, 1.3)
    gap, depth = length * rng.uniform(0.19, 0.25), rng.uniform(0.13, 0.18)
    wall, glass = tint(rng, "white", "white", "cream", "grey"), tint(rng, "window")
    paint, lower = (
        tint(rng, "white", "white", "navy", "grey", "red"),
        tint(rng, "navy", "red", "black"),
    )
    shape = Hull(
        length, 0.11 * length, depth, 0.5, rng.uniform(0.5, 0.9), 0.8, rng.uniform(1.8, 2.6),
        (0.02, 0.0), (rng.uniform(-0.02, 0.06), 0.04), (0.3 * depth, 0.5 * depth),
    )  # fmt: skip
    for side in (-1, 1):
        solid_hull(b, replace(shape, x=side * gap), paint, lower, 0.4 * depth, wall)
    front, back = shape.z(rng.uniform(0.3, 0.38)), shape.z(0.9)
    y = depth - 0.01
    b.rounded_box(
        "deck", wall, (0, y - 0.02, (front + back) / 2), (2 * gap, 0.06, back - front), 0.03
    )
    saloon = rng.random() < 0.75
    foot = np.array([0, y, front + 0.12 * length])
    if saloon:
        roof = rng.uniform(0.09, 0.13)
        z = (front + 0.04, front + rng.uniform(0.35, 0.45) * length)
        house = House(1.7 * gap, z, (y, y + roof), (1.2, -0.2), 0.35, 0.06)
        add_house(b, house, wall, glass, "band", 0.0, (0.35, 0.8))
        foot = foot + vec(0, roof - 0.02, 0)
    tip = shape.z(0.04)
    b.cylinder("mast", tint(rng, "grey"), (-gap, depth, tip), (gap, depth, tip), 0.014, segments=10)
    net = np.array(
        [[(x, y, at) for x in (-0.85 * gap, 0.0, 0.85 * gap)] for at in (tip, front + 0.02)]
    )
    sheet(b, "deck", tint(rng, "dark"), net, 0.006)
    spar, cloth = pick_material(rng, "metal"), _draw_cloth(rng)
    height = length * rng.uniform(1.0, 1.4)
    _rig(b, rng, spar, cloth, foot, height, back - foot[2] - 0.04)
    _stays(b, replace(shape, x=gap), foot, height, 0.5)
    _jibs(b, rng, cloth, np.array([0, depth + 0.02, tip]), foot, height)
    for side in (-1, 1):
        rudder = (side * gap, -0.01, shape.z(0.95))
        b.box("keel", lower, rudder, (0.012, 0.5 * depth, 0.05))
    return b


def tall_ship(rng: np.random.Generator) -> Builder:
    """Build a galleon, frigate or clipper: a wooden hull and two to four square-rigged masts."""
    b = Builder()
    length = rng.uniform(1.2, 1.7)
    beam, depth = length * rng.uniform(0.17, 0.25), rng.uniform(0.17, 0.25)
    castle = rng.uniform(0.0, 0.12)
    hull = Hull(
        length, beam, depth, rng.uniform(0.4, 0.5), rng.uniform(0.5, 0.75), rng.uniform(0.5, 0.75),
        rng.uniform(1.8, 2.6), (rng.uniform(0.04, 0.1), 0.05 + castle),
        (rng.uniform(0.03, 0.12), rng.uniform(0.0, 0.08)), (0.4 * depth, 0.3 * depth),
    )  # fmt: skip
    wood, spar = plank(rng), pick_material(rng, "wood")
    paint = wood if rng.random() < 0.5 else tint(rng, "black", "navy", "white", "red", "green")
    lower = tint(rng, "red", "teak", "dark", "green")
    solid_hull(b, hull, paint, lower, 0.45 * depth, plank(rng))
    bulwark(b, hull, paint, rng.uniform(0.03, 0.05), thickness=0.02)
    trim = tint(rng, "orange", "cream", "black", "red")
    _wales(b, rng, hull, trim)
    if castle > 0.03:
        poop = House(1.6 * hull.half(0.9), (hull.z(0.72), hull.z(0.99)),
                     (hull.top(0.75), hull.top(0.99) + 0.5 * castle), (0, -0.2), 0.2)  # fmt: skip
        add_house(b, poop, paint, tint(rng, "window", "orange"), "panes", 0.01)
    bow = hull.edge(0.0, 0) * (0, 1, 1)
    tip = bow + vec(0, 0.1, -rng.uniform(0.22, 0.35))
    b.cylinder("mast", spar, bow + vec(0, -0.03, 0.12), tip, 0.018, 0.008, 8)
    masts, height = int(rng.integers(2, 5)), length * rng.uniform(0.65, 0.85)
    places = np.linspace(0.2, 0.8, masts) if masts > 2 else np.array([0.3, 0.62])
    cloth, furled = _draw_cloth(rng), rng.random() < 0.15
    tiers, aft = int(rng.integers(2, 5)), rng.random() < 0.6
    for i, t in enumerate(places):
        foot = np.array([0, hull.top(t) - 0.01, hull.z(t)])
        tall = height * (1.0, 1.12, 0.95, 0.8)[i]
        last = aft and i == masts - 1
        if last:
            _rig(b, rng, spar, cloth, foot, 0.85 * tall, 0.3 * length)
        else:
            _square_rig(b, rng, spar, cloth, foot, tall, 1.2 * beam, tiers, furled)
        for side in (-1, 1):
            for back in (0.0, 0.05):
                chain = hull.edge(t, side) + vec(0, 0.02, back)
                _rope(b, chain, foot + vec(0, 0.62 * tall, 0))
    fore = np.array([0, hull.top(places[0]), hull.z(places[0])])
    _jibs(b, rng, cloth, tip, fore, height)
    return b


def _wales(b: Builder, rng: np.random.Generator, hull: Hull, trim: Material) -> None:
    """Add painted strakes along the sides and perhaps a row of gun ports."""
    for t_level in np.linspace(0.06, 0.26, int(rng.integers(1, 4))):
        for side in (-1, 1):
            path = [hull.edge(t, side, -0.004) - vec(0, t_level * hull.depth, 0)
                    for t in np.linspace(0.03, 1.0, 13)]  # fmt: skip
            b.tube("hull", trim, path, 0.007, 5)
    if rng.random() < 0.55:
        for t in np.linspace(0.25, 0.85, int(rng.integers(6, 12))):
            center = (0, hull.top(t) - 0.34 * hull.depth, hull.z(t))
            wide = 2 * hull.half(t) + 0.004
            b.box("gun", tint(rng, "black"), center, (wide, 0.026, 0.03))


def _square_rig(
    b: Builder, rng: np.random.Generator, spar: Material, cloth: Material, foot: Array,
    height: float, width: float, tiers: int, furled: bool,
) -> None:  # fmt: skip
    """Add a mast with yards and square sails, each narrower than the one below."""
    b.cylinder("mast", spar, foot, foot + vec(0, height, 0), 0.018, 0.008, 10)
    levels = np.linspace(0.16, 0.95, tiers + 1) * height
    ahead = np.array([0, 0, -0.028])
    halves = 0.5 * width * np.linspace(1.0, 0.5, tiers + 1)
    for i in range(tiers):
        low, high = (foot + vec(0, y, 0) + ahead for y in (levels[i] + 0.015, levels[i + 1]))
        reach = np.array([halves[i + 1] * 1.08, 0, 0])
        b.cylinder("mast", spar, high - reach, high + reach, 0.009, segments=6)
        top, bottom = reach * 0.92, np.array([halves[i] * 0.95, 0, 0])
        if furled:
            path = [high + t * top + vec(0, 0.01, 0) for t in (-0.95, -0.4, 0.0, 0.4, 0.95)]
            b.tube("sail", cloth, path, (0.01, 0.02, 0.026, 0.02, 0.01), 7)
        else:
            blown = (0, 0, -rng.uniform(0.05, 0.09))
            sides = (low - bottom, low + bottom, high - top, high + top)
            add_sail(b, cloth, sides, blown, 5, 6)
