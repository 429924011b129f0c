"""Ships with cargo."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import UP, Pair, vec
from ffd_lightning.shapes.watercraft.hull import Hull, bulwark, solid_hull, tint
from ffd_lightning.shapes.watercraft.superstructure import House, add_house, funnel, mast


def freighter(rng: Rng) -> Builder:
    """Build a long ship with its bridge aft: containers, hatches and cranes, or tanks."""
    b = Builder()
    length = rng.uniform(1.5, 2.2)
    beam, depth = length * rng.uniform(0.13, 0.2), length * rng.uniform(0.07, 0.11)
    hull = Hull(
        length=length,
        beam=beam,
        depth=depth,
        widest=rng.uniform(0.3, 0.45),
        transom=rng.uniform(0.7, 0.95),
        fineness=rng.uniform(0.4, 0.6),
        fullness=rng.uniform(4, 7),
        sheer=(rng.uniform(0.02, 0.08), 0.01),
        rake=(rng.uniform(0.02, 0.1), rng.uniform(0.0, 0.06)),
        lift=(0.0, 0.5 * depth),
    )
    deck = tint(rng, "red", "grey", "green", "dark")
    paint = tint(rng, "navy", "black", "red", "green", "blue", "grey", "orange")
    lower, waterline = tint(rng, "red", "red", "black"), rng.uniform(0.3, 0.55) * depth
    solid_hull(b, hull, paint, lower, waterline, deck)
    bulwark(b, hull, paint, height=rng.uniform(0.015, 0.035), span=(0.0, 0.18))
    if rng.random() < 0.6:
        nose = (0, 0.3 * depth, hull.z(0, 0.3 * depth) + 0.02)
        b.ellipsoid("hull", tint(rng, "red"), nose, (0.03, 0.035, 0.09), segments=12)
    wall, glass = tint(rng, "white", "cream"), tint(rng, "window")
    aft = rng.uniform(0.76, 0.86)
    front = _bridge(b, rng, hull, wall, glass, aft)
    bow = hull.z(0.17)
    load = draw(rng, ["containers", "hatches", "tanks", "pipes"], [0.4, 0.25, 0.15, 0.2])
    add = {"containers": _containers, "hatches": _hatches, "tanks": _tanks, "pipes": _pipes}[load]
    add(b, rng, hull, (bow, front - 0.03))
    mast(b, wall, hull.edge(0.08, 0) * vec(0, 1, 1), height=rng.uniform(0.1, 0.18), arms=1)
    return b


def _bridge(b: Builder, rng: Rng, hull: Hull, wall: Material, glass: Material, t: float) -> float:
    """Add a tower of cabins with bridge wings and a funnel at a station; return its front's z."""
    z, foot = hull.z(t), hull.top(t)
    long, storey = rng.uniform(0.1, 0.17), rng.uniform(0.04, 0.05)
    floors = int(rng.integers(3, 6))
    width = hull.beam * rng.uniform(0.6, 0.85)
    for i in range(floors):
        y = foot + i * storey
        shape = House(
            width=width,
            z=(z + 0.01 * i, z + long - 0.012 * i),
            y=(y, y + storey + 0.001),
            slope=(0, 0),
            taper=0,
        )
        add_house(b, shape, wall, glass, windows="band" if i == floors - 1 else "panes", roof=0.004)
    high = foot + floors * storey
    wing = (rng.uniform(0.9, 1.05) * hull.beam, 0.4 * storey, 0.25 * long)
    b.box("cabin", wall, (0, high - 0.8 * storey, z + 0.03 + 0.01 * floors), wing)
    mast(b, wall, vec(0, high, z + 0.4 * long), height=rng.uniform(0.08, 0.15), arms=2)
    size = vec(0.3 * hull.beam, rng.uniform(0.6, 0.95) * floors * storey, 0.08)
    funnel(b, wall, tint(rng, "red", "blue", "black", "orange"), (0, foot, z + long + 0.05), size)
    return z


def _containers(b: Builder, rng: Rng, hull: Hull, z: Pair) -> None:
    """Stack containers of a few colours in bays along the deck."""
    colors = [pick_material(rng, "paint") for _ in range(5)]
    long, tall = rng.uniform(0.11, 0.15), rng.uniform(0.038, 0.05)
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


def _hatches(b: Builder, rng: Rng, hull: Hull, z: Pair) -> None:
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
        foot = vec(0, y, at - pitch / 2)
        head = foot + rng.uniform(0.16, 0.2) * UP
        b.cylinder("mast", steel, foot, head, radius=0.022, radius_end=0.016, segments=12)
        if jib:
            b.box("mast", steel, head, (0.06, 0.05, 0.06))
            tip = head + vec(0, 0.08, -0.85 * pitch)
            b.cylinder("mast", steel, head, tip, radius=0.011, radius_end=0.007, segments=8)
        else:
            for side in (-1, 1):
                tip = foot + vec(side * 0.3 * hull.beam, 0.15, -0.6 * pitch)
                b.cylinder("mast", steel, foot + 0.03 * UP, tip, 0.008, segments=8)


def _tanks(b: Builder, rng: Rng, hull: Hull, z: Pair) -> None:
    """Add the domes of gas tanks, joined by a catwalk."""
    paint = tint(rng, "orange", "white", "grey", "blue")
    radius = 0.42 * hull.beam
    count = max(2, int((z[1] - z[0]) / (2.15 * radius)))
    pitch = (z[1] - z[0]) / count
    radii = (radius, rng.uniform(0.7, 1.0) * radius, min(radius, 0.48 * pitch))
    for i in range(count):
        b.ellipsoid("cargo", paint, (0, hull.depth, z[0] + (i + 0.5) * pitch), radii, segments=22)
    walk = (0.03, 0.012, z[1] - z[0])
    b.box("deck", tint(rng, "grey"), (0, hull.depth + radii[1], (z[0] + z[1]) / 2), walk)


def _pipes(b: Builder, rng: Rng, hull: Hull, z: Pair) -> None:
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
        ends = vec(-0.45 * hull.beam, y + 0.02, at), vec(0.45 * hull.beam, y + 0.02, at)
        b.cylinder("cargo", steel, ends[0], ends[1], 0.009, segments=8)
        b.box("cargo", steel, (0, y, at), (0.7 * hull.beam, 0.03, 0.01))
    for side in (-1, 1):
        foot = vec(side * 0.2 * hull.beam, hull.depth, middle - 0.12)
        b.cylinder("mast", steel, foot, foot + 0.16 * UP, 0.012, segments=10)
        tip = foot + vec(side * 0.02, 0.14, 0.15)
        b.cylinder("mast", steel, foot + 0.1 * UP, tip, 0.007, segments=8)
