"""Open boats."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.vectors import UP, about_y, about_z, vec
from ffd_lightning.shapes.watercraft.hull import Hull, bulwark, open_hull, plank, tint
from ffd_lightning.shapes.watercraft.motorboats import outboard


def rowboat(rng: Rng) -> Builder:
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
        length=length,
        beam=length * rng.uniform(*slim),
        depth=depth,
        widest=0.5,
        transom=transom,
        fineness=rng.uniform(0.6, 0.9),
        fullness=rng.uniform(1.6, 2.8),
        sheer=(sheer, sheer * rng.uniform(0.3, 1.0)),
        rake=(rng.uniform(0.02, 0.12), 0.05),
        lift=(rng.uniform(0.2, 0.7) * depth, 0.3 * depth),
    )
    wood = plank(rng)
    paints = ("white", "red", "green", "blue", "navy", "orange")
    outer = wood if rng.random() < 0.4 else tint(rng, *paints)
    trim = plank(rng)
    open_hull(b, hull, outer, 0.014)
    bulwark(b, hull, trim, height=0.01, thickness=0.022, part="rail")
    for t in np.linspace(0.3, 0.85, int(rng.integers(2, 5))):
        low, width = hull.top(t) - 0.25 * depth, 1.9 * hull.half(t)
        size = (width, 0.016, rng.uniform(0.06, 0.1))
        b.rounded_box("seat", trim, (0, low, hull.z(t)), size, 0.01)
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


def _oars(b: Builder, rng: Rng, hull: Hull, wood: Material, pairs: int) -> None:
    """Add pairs of oars in their locks, swung out or laid along the boat."""
    swing, dip = rng.uniform(-25, 60), rng.uniform(-0.25, 0.0)
    for t in np.linspace(0.45, 0.65, pairs) if pairs > 1 else [0.5]:
        for side in (-1, 1):
            lock = hull.edge(t, side, up=0.03)
            b.cylinder("oar", tint(rng, "grey"), lock - 0.03 * UP, lock, 0.008, segments=8)
            a = np.radians(swing)
            way = vec(side * np.cos(a), dip, np.sin(a))
            out, grip = rng.uniform(0.3, 0.36) * hull.length, 0.6 * hull.half(t)
            end = lock + out * way
            b.cylinder("oar", wood, lock - grip * way, end, 0.01, segments=8)
            turn = about_y(-side * swing) @ about_z(side * np.degrees(dip))
            b.rounded_box("oar", wood, end + 0.07 * way, (0.17, 0.012, 0.055), 0.02, turn=turn)
