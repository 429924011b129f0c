"""Tugs and trawlers."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, pick_material
from ffd_lightning.shapes.kit.vectors import UP, vec
from ffd_lightning.shapes.watercraft.hull import Hull, bulwark, plank, solid_hull, tint
from ffd_lightning.shapes.watercraft.superstructure import House, add_house, funnel, mast


def workboat(rng: Rng) -> Builder:
    """Build a tug or a trawler: a stout hull with fenders, a wheelhouse, a funnel and a boom."""
    b = Builder()
    length = rng.uniform(0.9, 1.25)
    beam, depth = length * rng.uniform(0.28, 0.38), rng.uniform(0.16, 0.24)
    hull = Hull(
        length=length,
        beam=beam,
        depth=depth,
        widest=rng.uniform(0.42, 0.55),
        transom=rng.uniform(0.5, 0.85),
        fineness=rng.uniform(0.45, 0.65),
        fullness=rng.uniform(2, 3),
        sheer=(rng.uniform(0.07, 0.2), rng.uniform(0, 0.05)),
        rake=(rng.uniform(0.02, 0.12), rng.uniform(0, 0.05)),
        lift=(0.3 * depth, 0.3 * depth),
    )
    paint = tint(rng, "red", "navy", "green", "black", "blue", "white", "orange")
    wall, glass = tint(rng, "white", "cream", "orange", "white"), tint(rng, "window")
    solid_hull(b, hull, paint, tint(rng, "red", "black", "dark"), 0.4 * depth, plank(rng))
    bulwark(b, hull, paint, height=rng.uniform(0.04, 0.07), thickness=0.02)
    y, storey = hull.top(0.5) - 0.005, rng.uniform(0.1, 0.13)
    aft = rng.random() < 0.35
    z = hull.z(0.58 if aft else rng.uniform(0.24, 0.3))
    wide, long = rng.uniform(0.5, 0.65) * beam, rng.uniform(0.26, 0.36) * length
    low = House(
        width=wide, z=(z, z + long), y=(y, y + storey), slope=(0.0, 0.0), taper=0.0, chamfer=0.03
    )
    add_house(b, low, wall, glass, windows="panes", roof=0.012, band=(0.5, 0.8))
    at, y = z + rng.uniform(0.02, 0.06), y + storey
    wheel = House(
        width=0.82 * wide,
        z=(at, at + 0.5 * long),
        y=(y, y + storey),
        slope=(rng.uniform(-0.2, 0.2), 0),
        taper=0.04,
    )
    add_house(b, wheel, wall, glass, windows="band", roof=0.02)
    mast(b, tint(rng, "grey", "orange"), vec(0, y + storey, at + 0.3 * long), height=0.2, arms=2)
    if rng.random() < 0.65:
        size = vec(0.1, rng.uniform(0.12, 0.2), 0.09)
        funnel(b, wall, tint(rng, "red", "blue", "black"), (0, y, z + 0.83 * long), size)
    if rng.random() < 0.5:
        _fenders(b, rng, hull)
    _gear(b, rng, hull, z + long, aft)
    return b


def _fenders(b: Builder, rng: Rng, hull: Hull) -> None:
    """Hang tyres along the sides."""
    rubber, a = pick_material(rng, "rubber"), np.linspace(0, 2 * np.pi, 11)
    for t in np.linspace(0.18, 0.9, int(rng.integers(5, 9))):
        for side in (-1, 1):
            middle = hull.edge(t, side, -0.02, -0.02)
            ring = middle + 0.04 * np.stack([0 * a, np.cos(a), np.sin(a)], 1)
            b.tube("rail", rubber, ring, 0.016, segments=6)


def _gear(b: Builder, rng: Rng, hull: Hull, start: float, ahead: bool) -> None:
    """Add a derrick with its boom, a winch and crates: `ahead` of the house or abaft `start`."""
    t = 0.4 if ahead else 0.7
    z = hull.z(t)
    y, steel = hull.top(t), tint(rng, "orange", "grey", "cream")
    foot = vec(0, y, z if ahead else max(z, start + 0.06))
    end = foot + rng.uniform(0.3, 0.5) * UP
    b.cylinder("mast", steel, foot, end, radius=0.018, radius_end=0.012, segments=10)
    way = -1 if ahead else 1
    boom = foot + vec(0, rng.uniform(0.22, 0.34), way * 0.24)
    b.cylinder("mast", steel, foot + 0.07 * UP, boom, 0.011, segments=8)
    b.cylinder("mast", steel, boom, foot + 0.29 * UP, 0.004, segments=5)
    winch = foot + vec(0, 0.035, 0.07 * way)
    left = winch - vec(0.08, 0, 0)
    b.cylinder("cargo", tint(rng, "dark"), left, winch + vec(0.08, 0, 0), 0.03, segments=14)
    crate = pick_material(rng, "plastic")
    for x in np.linspace(-0.25, 0.25, int(rng.integers(0, 4))) * hull.beam:
        center = (x, y + 0.025, foot[2] + 0.16 * way)
        b.rounded_box("cargo", crate, center, (0.07, 0.05, 0.06), 0.008)
