"""Sloops, ketches and catamarans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import UP, vec
from ffd_lightning.shapes.watercraft.hull import Hull, bulwark, plank, railing, solid_hull, tint
from ffd_lightning.shapes.watercraft.rig import add_jibs, add_rig, add_rope, add_stays, draw_cloth
from ffd_lightning.shapes.watercraft.superstructure import House, add_house


def sailboat(rng: Rng) -> Builder:
    """Build a sloop or a ketch on one hull with a keel, a cabin and a cockpit."""
    b = Builder()
    length = rng.uniform(0.9, 1.3)
    beam, depth = length * rng.uniform(0.22, 0.34), rng.uniform(0.1, 0.16)
    hull = Hull(
        length=length,
        beam=beam,
        depth=depth,
        widest=rng.uniform(0.5, 0.65),
        transom=rng.uniform(0.25, 0.85),
        fineness=rng.uniform(0.75, 1.0),
        fullness=rng.uniform(1.5, 2.2),
        sheer=(rng.uniform(0.02, 0.09), rng.uniform(0, 0.04)),
        rake=(rng.uniform(0.05, 0.25), rng.uniform(-0.05, 0.12)),
        lift=(0.6 * depth, 0.6 * depth),
    )
    wall = tint(rng, "white", "cream") if rng.random() < 0.6 else plank(rng)
    paint = tint(rng, "white", "white", "navy", "red", "green", "black")
    spar = pick_material(rng, draw(rng, ["wood", "metal"], [0.35, 0.65]))
    solid_hull(b, hull, paint, tint(rng, "red", "navy", "black", "blue"), 0.5 * depth, plank(rng))
    bulwark(b, hull, wall, height=rng.uniform(0.008, 0.03))
    _keel(b, rng, hull)
    deck, roof = hull.top(0.5) - 0.005, rng.uniform(0.05, 0.09)
    front, back = hull.z(rng.uniform(0.27, 0.36)), hull.z(rng.uniform(0.58, 0.68))
    house = House(
        width=0.55 * beam,
        z=(front, back),
        y=(deck, deck + roof),
        slope=(1.6, 0.1),
        taper=0.25,
        chamfer=0.03,
    )
    add_house(b, house, wall, tint(rng, "window"), windows="panes", roof=0.0, band=(0.35, 0.75))
    _cockpit(b, rng, hull, back, wall)
    height = length * rng.uniform(1.0, 1.45)
    ketch = rng.random() < 0.25
    t = rng.uniform(0.36, 0.42) if not ketch else 0.34
    foot, cloth = vec(0, deck, hull.z(t)), draw_cloth(rng)
    boom = hull.z(0.9 if not ketch else 0.7) - foot[2]
    add_rig(b, rng, spar, cloth, foot, height, boom)
    add_stays(b, hull, foot, height, t)
    bow = hull.edge(0.01, 0, up=0.02) * vec(0, 1, 1)
    if rng.random() < 0.3:
        tip = bow + vec(0, 0.03, -rng.uniform(0.1, 0.22))
        start = bow + vec(0, -0.01, 0.1)
        b.cylinder("mast", spar, start, tip, radius=0.013, radius_end=0.009, segments=8)
        bow = tip
    add_jibs(b, rng, cloth, bow, foot, height)
    stern = hull.edge(0.98, 0) * vec(0, 1, 1)
    if ketch:
        mizzen = vec(0, hull.top(0.78), hull.z(0.78))
        add_rig(b, rng, spar, cloth, mizzen, 0.65 * height, 0.26 * length)
    else:
        add_rope(b, stern, foot + height * UP)
    if rng.random() < 0.5:
        railing(b, hull, spar, height=0.06, span=(0.02, 0.25), posts=5)
    return b


def _keel(b: Builder, rng: Rng, hull: Hull) -> None:
    """Add a fin keel, sometimes with a bulb, and a rudder; or one long keel."""
    paint, drop = tint(rng, "red", "dark", "navy"), rng.uniform(0.12, 0.24)
    if rng.random() < 0.3:
        spans = [(0.3, 0.93, 0.45 * drop)]
    else:
        root = rng.uniform(0.38, 0.44)
        spans = [(root, root + rng.uniform(0.12, 0.2), drop), (0.88, 0.95, 0.8 * drop)]
    for start, end, down in spans:
        z = hull.z(start, 0), hull.z(end, 0)
        shape = House(
            width=0.03, z=z, y=(-down, 0.05), slope=(-0.2, 0.25), taper=-0.01, chamfer=0.012
        )
        b.loft("keel", paint, [shape.ring(0), shape.ring(1)])
    if len(spans) == 2 and rng.random() < 0.4:
        at = (0, -drop, hull.z(spans[0][0] + 0.08, 0))
        b.ellipsoid("keel", paint, at, (0.03, 0.025, 0.11), segments=12)


def _cockpit(b: Builder, rng: Rng, hull: Hull, front: float, wall: Material) -> None:
    """Add a coaming about a dark well, with a wheel or a tiller."""
    y, end = hull.top(0.8), hull.z(0.93)
    width = 0.52 * min(hull.beam, 2.2 * hull.half(0.9))
    middle, long = (front + end) / 2, end - front
    b.box("deck", tint(rng, "dark", "teak"), (0, y + 0.004, middle), (width, 0.012, long))
    for side in (-1, 1):
        center = (side * width / 2, y + 0.015, middle)
        b.rounded_box("deck", wall, center, (0.025, 0.04, long), 0.01)
    metal, at = tint(rng, "grey"), vec(0, y + 0.07, front + 0.65 * long)
    if rng.random() < 0.5:
        a = np.linspace(0, 2 * np.pi, 15)
        wheel = at + 0.05 * np.stack([np.cos(a), np.sin(a), 0 * a], 1)
        b.tube("deck", metal, wheel, 0.005, segments=6)
        b.cylinder("deck", metal, at + vec(0, 0, 0.01), at + vec(0, -0.07, 0.01), 0.01, segments=8)
    else:
        start = (0, y + 0.05, end - 0.4 * long)
        b.cylinder("deck", metal, start, (0, y + 0.02, end), 0.007, segments=8)


def catamaran(rng: Rng) -> Builder:
    """Build two slender hulls under a bridge deck with a saloon, a mast and sails."""
    b = Builder()
    length = rng.uniform(0.9, 1.3)
    gap, depth = length * rng.uniform(0.19, 0.25), rng.uniform(0.13, 0.18)
    wall, glass = tint(rng, "white", "white", "cream", "grey"), tint(rng, "window")
    paint = tint(rng, "white", "white", "navy", "grey", "red")
    lower = tint(rng, "navy", "red", "black")
    shape = Hull(
        length=length,
        beam=0.11 * length,
        depth=depth,
        widest=0.5,
        transom=rng.uniform(0.5, 0.9),
        fineness=0.8,
        fullness=rng.uniform(1.8, 2.6),
        sheer=(0.02, 0.0),
        rake=(rng.uniform(-0.02, 0.06), 0.04),
        lift=(0.3 * depth, 0.5 * depth),
    )
    for side in (-1, 1):
        solid_hull(b, replace(shape, x=side * gap), paint, lower, 0.4 * depth, wall)
    front, back = shape.z(rng.uniform(0.3, 0.38)), shape.z(0.9)
    y = depth - 0.01
    center = (0, y - 0.02, (front + back) / 2)
    b.rounded_box("deck", wall, center, (2 * gap, 0.06, back - front), 0.03)
    saloon = rng.random() < 0.75
    foot = vec(0, y, front + 0.12 * length)
    if saloon:
        roof = rng.uniform(0.09, 0.13)
        z = (front + 0.04, front + rng.uniform(0.35, 0.45) * length)
        house = House(
            width=1.7 * gap, z=z, y=(y, y + roof), slope=(1.2, -0.2), taper=0.35, chamfer=0.06
        )
        add_house(b, house, wall, glass, windows="band", roof=0.0, band=(0.35, 0.8))
        foot = foot + (roof - 0.02) * UP
    tip = shape.z(0.04)
    b.cylinder("mast", tint(rng, "grey"), (-gap, depth, tip), (gap, depth, tip), 0.014, segments=10)
    xs = (-0.85 * gap, 0.0, 0.85 * gap)
    net = [[(x, y, at) for x in xs] for at in (tip, front + 0.02)]
    sheet(b, "deck", tint(rng, "dark"), net, 0.006)
    spar, cloth = pick_material(rng, "metal"), draw_cloth(rng)
    height = length * rng.uniform(1.0, 1.4)
    add_rig(b, rng, spar, cloth, foot, height, back - foot[2] - 0.04)
    add_stays(b, replace(shape, x=gap), foot, height, 0.5)
    add_jibs(b, rng, cloth, vec(0, depth + 0.02, tip), foot, height)
    for side in (-1, 1):
        rudder = (side * gap, -0.01, shape.z(0.95))
        b.box("keel", lower, rudder, (0.012, 0.5 * depth, 0.05))
    return b
