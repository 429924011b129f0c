"""Motorboats: runabouts, centre consoles and yachts, and the motors they hang at the stern."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import UP, Array, Triple, about_y, about_z, lean, vec
from ffd_lightning.shapes.watercraft.hull import Hull, bulwark, plank, railing, solid_hull, tint
from ffd_lightning.shapes.watercraft.superstructure import House, add_house, mast


def outboard(b: Builder, cowl: Material, top: Array, size: float) -> None:
    """Add an outboard motor behind the top of the stern."""
    dark = Material((0.2, 0.21, 0.23))
    head, low = top + size * vec(0, 0.06, 0.05), top + size * vec(0, -0.17, 0.06)
    b.rounded_box("engine", cowl, head, size * vec(0.08, 0.1, 0.12), 0.03 * size)
    b.box("engine", dark, top + size * vec(0, -0.04, 0.05), size * vec(0.035, 0.2, 0.05))
    b.ellipsoid("engine", dark, low, size * vec(0.022, 0.022, 0.07), segments=10)
    b.box("engine", dark, low - size * vec(0, 0.03, 0), size * vec(0.01, 0.05, 0.05))
    for k in range(3):
        turn = about_z(120 * k) @ about_y(35)
        center = low + size * (turn @ vec(0, 0.025, 0) + vec(0, 0, 0.07))
        b.ellipsoid("engine", dark, center, size * vec(0.014, 0.026, 0.004), segments=8, turn=turn)


def _planing_hull(rng: Rng, length: float, beam: float, depth: float) -> Hull:
    """Draw a V-shaped hull with a broad stern."""
    return Hull(
        length=length,
        beam=beam,
        depth=depth,
        widest=rng.uniform(0.55, 0.7),
        transom=rng.uniform(0.82, 0.95),
        fineness=rng.uniform(0.6, 0.85),
        fullness=rng.uniform(1.4, 2.2),
        sheer=(rng.uniform(0.02, 0.09), 0.0),
        rake=(rng.uniform(0.08, 0.22), rng.uniform(-0.03, 0.04)),
        lift=(0.6 * depth, 0.1 * depth),
    )


def speedboat(rng: Rng) -> Builder:
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
    center = (0, hull.top(0.7) + 0.005, (z[0] + z[1]) / 2)
    b.box("deck", tint(rng, "dark", "teak"), center, (wide, 0.012, z[1] - z[0]))
    span = (front - 0.05, 1.0)
    bulwark(b, hull, paint, height=rng.uniform(0.03, 0.06), span=span, thickness=0.03)
    cover = pick_material(rng, draw(rng, ["leather", "fabric"]))
    kind = draw(rng, ["screen", "console", "hardtop"], [0.5, 0.25, 0.25])
    if kind == "screen":
        _windscreen(b, rng, y=y, z=z[0], width=wide, height=rng.uniform(0.05, 0.1))
    else:
        _console(b, rng, hull, z[0] + 0.06, kind == "hardtop", deck)
    rows = 1 if z[1] - z[0] < 0.42 else 2
    for i in range(rows):
        at = z[0] + (0.5 + 0.36 * i) * (z[1] - z[0])
        for x in (-0.24 * wide, 0.24 * wide) if i == 0 else (0.0,):
            _seat(b, cover, (x, hull.top(0.7), at), 0.32 * wide if i == 0 else 0.8 * wide)
    motors, cowl = int(rng.integers(0, 4)), tint(rng, "black", "white", "dark", "blue")
    for x in (np.arange(motors) - (motors - 1) / 2) * 0.11:
        outboard(b, cowl, vec(x, hull.top(1) + 0.01, hull.z(1)), 1.0)
    if rng.random() < 0.6:
        railing(b, hull, tint(rng, "grey"), height=0.04, span=(0.02, front - 0.06), posts=5)
    return b


def _windscreen(b: Builder, rng: Rng, y: float, z: float, width: float, height: float) -> None:
    """Add a raked, wrapped windscreen in a frame."""
    glass, metal = pick_material(rng, "glass"), tint(rng, "grey", "dark")
    a, lean = np.linspace(-0.5, 0.5, 9) * np.pi, rng.uniform(0.4, 1.0) * height
    foot = np.stack([0.5 * width * np.sin(a), y + 0 * a, z + 0.12 - 0.14 * np.cos(a)], 1)
    head = foot * vec(0.9, 1, 1) + vec(0, height, lean)
    rings = []
    for low, high in zip(foot, head, strict=True):
        rings.append([low, high, high + vec(0, 0, 0.008), low + vec(0, 0, 0.008)])
    b.loft("cabin", glass, rings)
    b.tube("cabin", metal, head, 0.006, segments=6)
    b.tube("cabin", metal, foot, 0.007, segments=6)


def _console(b: Builder, rng: Rng, hull: Hull, z: float, tall: bool, wall: Material) -> None:
    """Add a steering console with a small screen, under a hard top on posts if `tall`."""
    y, wide = hull.top(0.55), 0.45 * hull.beam
    size = House(width=wide, z=(z, z + 0.15), y=(y, y + 0.1), slope=(0.5, 0.0), taper=0.1)
    add_house(b, size, wall, tint(rng, "window"), windows="none", roof=0.0)
    metal = tint(rng, "grey", "white")
    screen = (0.9 * wide, 0.06, 0.008)
    b.box("cabin", pick_material(rng, "glass"), (0, y + 0.125, z + 0.07), screen, turn=lean(25))
    if not tall:
        return
    roof = y + rng.uniform(0.22, 0.28)
    for x in (-0.5, 0.5):
        for at, top in ((z + 0.03, z + 0.05), (z + 0.15, z + 0.2)):
            b.cylinder("cabin", metal, (x * wide, y, at), (x * wide, roof, top), 0.008, segments=8)
    b.rounded_box("cabin", wall, (0, roof, z + 0.12), (1.25 * wide, 0.024, 0.3), 0.04)


def _seat(b: Builder, cover: Material, at: Triple, width: float, size: float = 1.0) -> None:
    """Add a seat that faces the bow; `size` scales its height and depth."""
    middle, turn = np.array(at), lean(10)
    low, back = (width, 0.05 * size, 0.1 * size), (width, 0.1 * size, 0.03 * size)
    place = middle + size * vec(0, 0.07, 0.05)
    b.rounded_box("seat", cover, middle + 0.025 * size * UP, low, 0.02, segments=2)
    b.rounded_box("seat", cover, place, back, 0.012, turn=turn, segments=2)


def motor_yacht(rng: Rng) -> Builder:
    """Build a yacht with one to three raked decks, an arch or a mast, and a bow rail."""
    b = Builder()
    length = rng.uniform(1.2, 1.8)
    depth = length * rng.uniform(0.1, 0.14)
    hull = _planing_hull(rng, length, length * rng.uniform(0.2, 0.29), depth)
    white, glass = tint(rng, "white", "white", "cream", "grey"), tint(rng, "window")
    paint = tint(rng, "white", "white", "navy", "black", "grey", "blue", "red")
    solid_hull(b, hull, paint, tint(rng, "red", "navy", "black"), 0.4 * depth, plank(rng))
    bulwark(b, hull, white, height=rng.uniform(0.015, 0.045))
    front, back = rng.uniform(0.26, 0.4), rng.uniform(0.74, 0.86)
    z0, z1, y = hull.z(front), hull.z(back), hull.top(0.55) - 0.005
    storey, rake = rng.uniform(0.075, 0.1), rng.uniform(0.4, 1.6)
    width = 0.8 * min(hull.beam, 2.3 * hull.half(front))
    windows = draw(rng, ["band", "panes"], [0.75, 0.25])
    for _ in range(int(rng.integers(1, 4))):
        tier = House(
            width=width,
            z=(z0, z1),
            y=(y, y + storey),
            slope=(rake, rng.uniform(-0.4, 0.3)),
            taper=0.2,
            chamfer=0.04,
        )
        add_house(b, tier, white, glass, windows=windows, roof=0.008)
        y, width = y + storey + 0.008, 0.85 * width
        z0 += rake * storey + rng.uniform(0.03, 0.1) * length
        z1 -= rng.uniform(0.03, 0.12) * length
        if z1 - z0 < 0.2:
            break
    _arch(b, rng, white, y=y, z=(z0 + z1) / 2 + 0.03, width=0.8 * width)
    _sports_deck(b, rng, hull)
    swim = (1.6 * hull.half(1.0), 0.02, 0.09)
    center = (0, 0.5 * depth, hull.z(1.0, 0.5 * depth) + 0.035)
    b.rounded_box("deck", plank(rng), center, swim, 0.02)
    railing(b, hull, tint(rng, "grey"), height=0.05, span=(0.02, rng.uniform(0.3, 0.5)), posts=8)
    return b


def _arch(b: Builder, rng: Rng, paint: Material, y: float, z: float, width: float) -> None:
    """Add a radar arch with domes, or a signal mast."""
    if rng.random() < 0.4:
        mast(b, paint, vec(0, y, z), height=rng.uniform(0.1, 0.2), arms=2)
        return
    rise, half = rng.uniform(0.06, 0.11), width / 2
    ends = [(-half, y - 0.01, z), (-0.8 * half, y + rise, z + 0.06)]
    ends += [(-x, up, at) for x, up, at in ends[::-1]]
    b.tube("mast", paint, bend(ends, 0.04), 0.016, segments=8)
    for x in (-0.35, 0.35) if rng.random() < 0.6 else (0.0,):
        center = (x * width, y + rise + 0.025, z + 0.06)
        b.ellipsoid("mast", paint, center, (0.026, 0.03, 0.026), segments=12)


def _sports_deck(b: Builder, rng: Rng, hull: Hull) -> None:
    """Add a sofa aft and sometimes a sunbed on the foredeck."""
    cover = pick_material(rng, "fabric")
    t = 0.9
    _seat(b, cover, (0, hull.top(t) - 0.01, hull.z(t)), 1.1 * hull.half(t), 0.7)
    if rng.random() < 0.6:
        bed = (0.9 * hull.half(0.2), 0.03, 0.1)
        b.rounded_box("seat", cover, (0, hull.top(0.2) + 0.015, hull.z(0.2)), bed, 0.02)
