"""Warships and aircraft carriers."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.vectors import UP, Array, Triple, lean, vec
from ffd_lightning.shapes.watercraft.hull import Hull, railing, solid_hull, tint
from ffd_lightning.shapes.watercraft.superstructure import House, add_house, funnel


def _navy_hull(rng: Rng, b: Builder, grey: Material, slim: float) -> Hull:
    """Add the hull of a warship, `slim` its beam over its length."""
    length = rng.uniform(1.6, 2.2)
    depth = length * rng.uniform(0.06, 0.085)
    hull = Hull(
        length=length,
        beam=slim * length,
        depth=depth,
        widest=rng.uniform(0.5, 0.6),
        transom=rng.uniform(0.6, 0.8),
        fineness=rng.uniform(0.75, 1.0),
        fullness=rng.uniform(2.2, 3.5),
        sheer=(rng.uniform(0.04, 0.09), 0.0),
        rake=(rng.uniform(0.06, 0.16), 0.0),
        lift=(0.1 * depth, 0.5 * depth),
    )
    lower = tint(rng, "red", "black", "dark")
    solid_hull(b, hull, grey, lower, rng.uniform(0.3, 0.45) * depth, tint(rng, "dark", "grey"))
    return hull


def warship(rng: Rng) -> Builder:
    """Build a destroyer or battleship: turrets fore and aft of stepped houses and funnels."""
    b = Builder()
    grey, dark, glass = tint(rng, "grey"), tint(rng, "dark"), tint(rng, "window")
    hull = _navy_hull(rng, b, grey, rng.uniform(0.1, 0.14))
    y, long, storey = hull.depth, hull.length, rng.uniform(0.045, 0.06)
    caliber, barrels = rng.uniform(0.7, 1.3), int(rng.integers(1, 4))
    low = House(
        width=rng.uniform(0.6, 0.85) * hull.beam,
        z=(-0.2 * long, rng.uniform(0.18, 0.3) * long),
        y=(y, y + storey),
        slope=(0.4, 0.2),
        taper=0.12,
    )
    add_house(b, low, grey, glass, windows="none", roof=0.0)
    height = y + storey
    for i in range(int(rng.integers(2, 4))):
        at = (-0.18 + 0.03 * i) * long
        tier = House(
            width=(0.6 - 0.1 * i) * hull.beam,
            z=(at, at + (0.15 - 0.03 * i) * long),
            y=(height, height + storey),
            slope=(0.3, 0.1),
            taper=0.12,
        )
        add_house(b, tier, grey, glass, windows="band" if i else "panes", roof=0.006 if i else 0.0)
        height += storey
    _tower(b, rng, vec(0, height, -0.09 * long), grey)
    for k in range(int(rng.integers(1, 4))):
        foot = (0.0, y + storey, (0.02 + 0.085 * k) * long)
        if foot[2] + 0.07 < low.z[1]:
            size = vec(0.3 * hull.beam, rng.uniform(0.1, 0.15), 0.11)
            funnel(b, grey, dark, foot, size)
    for place in (0.16, 0.24) if rng.random() < 0.5 else (0.2,):
        step = storey * 0.8 * (place > 0.2)
        _turret(b, grey, (0, hull.top(place) + step, hull.z(place)), caliber, barrels)
    rear = 0.9 if low.z[1] < 0.25 * long else 0.93
    if rng.random() < 0.6:
        _turret(b, grey, (0, hull.top(rear), hull.z(rear)), caliber, barrels, aft=True)
    else:
        pad = (0.8 * hull.beam, 0.012, 0.16)
        b.box("deck", dark, (0, hull.top(rear) + 0.008, hull.z(rear)), pad)
    railing(b, hull, grey, height=0.03, span=(0.03, 0.3), posts=9)
    return b


def _tower(b: Builder, rng: Rng, foot: Array, grey: Material) -> None:
    """Add a lattice or a plated mast with radars."""
    height = rng.uniform(0.16, 0.28)
    top = foot + height * UP
    if rng.random() < 0.5:
        b.box("mast", grey, foot + height / 2 * UP, (0.07, height, 0.07), taper=0.4)
        b.ellipsoid("mast", grey, top, (0.03, 0.035, 0.03), segments=12)
    else:
        for x, z in ((-1, 1), (1, 1), (0, -1)):
            b.cylinder("mast", grey, foot + vec(0.04 * x, 0, 0.04 * z), top, 0.007, segments=6)
        panel = (rng.uniform(0.08, 0.14), 0.05, 0.012)
        b.box("mast", grey, foot + vec(0, 0.7 * height, -0.03), panel, turn=lean(15))
    for level in (0.6, 0.85):
        at, reach = foot + level * height * UP, rng.uniform(0.06, 0.1)
        b.cylinder("mast", grey, at - vec(reach, 0, 0), at + vec(reach, 0, 0), 0.005, segments=6)


def _turret(
    b: Builder, paint: Material, foot: Triple, size: float, barrels: int, aft: bool = False
) -> None:
    """Add a gun turret that points forward, or aft."""
    way = 1.0 if aft else -1.0
    base = np.array(foot)
    low = base - 0.05 * UP
    b.cylinder("gun", paint, low, base + 0.02 * UP, 0.05 * size, segments=16)
    middle = base + (0.02 + 0.025 * size) * UP
    b.box("gun", paint, middle, vec(0.1, 0.05, 0.13) * size, taper=0.8)
    for x in (np.arange(barrels) - (barrels - 1) / 2) * 0.028 * size:
        start = middle + vec(x, 0, way * 0.05 * size)
        end = start + vec(0, 0.03, way * 0.17) * size
        radius = 0.009 * size
        b.cylinder("gun", paint, start, end, radius=radius, radius_end=0.007 * size, segments=10)


def carrier(rng: Rng) -> Builder:
    """Build an aircraft carrier: a broad flat deck, an island at its side, parked planes."""
    b = Builder()
    grey, dark, glass = tint(rng, "grey"), tint(rng, "dark"), tint(rng, "window")
    hull = _navy_hull(rng, b, grey, rng.uniform(0.12, 0.16))
    y, long, beam = hull.depth + hull.sheer[0], hull.length, hull.beam
    left, right = -rng.uniform(0.75, 1.0) * beam, rng.uniform(0.6, 0.8) * beam
    angle, ends = rng.uniform(0.0, 0.2) * beam, (-0.52 * long - hull.rake[0], 0.5 * long)
    outline = [
        *((-0.4 * beam, ends[0]), (0.4 * beam, ends[0]), (right, -0.3 * long), (right, 0.4 * long)),
        *((0.45 * beam, ends[1]), (-0.5 * beam, ends[1]), (left, 0.3 * long), (left, -0.15 * long)),
        (-0.5 * beam - angle, -0.25 * long),
    ]
    ring = np.array([(x, 0.0, z) for x, z in outline])
    slim = ring * vec(0.92, 1, 0.99)
    b.loft("hull", grey, [ring * vec(0.6, 1, 0.9) + 0.5 * y * UP, slim + y * UP])
    b.loft("deck", dark, [ring + y * UP, ring + (y + 0.02) * UP])
    white, y = tint(rng, "white"), y + 0.02
    for at in np.linspace(ends[0] + 0.1, ends[1] - 0.1, 14):
        b.box("deck", white, (-0.2 * beam, y, at), (0.012, 0.004, 0.06))
    x, z, up = right - 0.12 * beam, rng.uniform(-0.1, 0.15) * long, 0.05
    for i in range(int(rng.integers(2, 5))):
        size = (0.2 * beam, up, (0.2 - 0.035 * i) * long)
        b.rounded_box("cabin", grey, (x, y + up / 2, z), size, 0.015)
        b.box("cabin", glass, (x, y + 0.65 * up, z), (1.03 * size[0], 0.3 * up, 0.9 * size[2]))
        y += up
    _tower(b, rng, vec(x, y, z), grey)
    deck = hull.depth + hull.sheer[0] + 0.02
    for i in range(int(rng.integers(3, 8))):
        _parked(b, grey, (left + 0.18 * beam, deck, (-0.1 + 0.055 * i) * long), 0.09)
    return b


def _parked(b: Builder, paint: Material, at: Triple, size: float) -> None:
    """Add a small jet on deck, its nose turned inboard."""
    middle = np.array(at) + 0.16 * size * UP
    b.ellipsoid("cargo", paint, middle, vec(0.5, 0.11, 0.09) * size, segments=10)
    plan = [(0.3, 0), (-0.35, 0.45), (-0.45, 0.45), (-0.45, -0.45), (-0.35, -0.45)]
    delta = np.array([(x, 0, z) for x, z in plan]) * size
    b.loft("cargo", paint, [delta + middle, delta + middle + 0.05 * size * UP])
    b.box("cargo", paint, middle + vec(-0.38, 0.15, 0) * size, (0.16 * size, 0.25 * size, 0.006))
    b.box("cargo", paint, middle - 0.1 * size * UP, (0.1 * size, 0.16 * size, 0.1 * size))
