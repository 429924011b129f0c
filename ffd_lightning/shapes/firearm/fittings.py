"""What handguns and long guns have in common: barrels, grips, magazines, sights."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.firearm.materials import BLACK
from ffd_lightning.shapes.firearm.swept import Cut, at, bar, sweep
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import Pair


def barrel(
    b: Builder,
    material: Material,
    start: float,
    end: float,
    up: float,
    radius: float,
    side: float = 0.0,
    taper: float = 1.0,
) -> None:
    """Add a barrel from `start` forward to `end`, with a dark bore in its muzzle."""
    tip = at(end, up, side)
    breech = at(start, up, side)
    b.tube("barrel", material, [breech, tip], (radius, taper * radius), segments=16)
    b.cylinder("barrel", BLACK, at(end - 0.01, up, side), at(end + 0.002, up, side), 0.6 * radius)


def muzzle(b: Builder, rng: Rng, material: Material, end: float, up: float) -> None:
    """Put a brake, a flash hider, a silencer or nothing over the muzzle at `end`."""
    kind = draw(rng, ["none", "brake", "hider", "silencer"], [0.35, 0.25, 0.28, 0.12])
    if kind == "silencer":
        length, radius = rng.uniform(0.18, 0.35), rng.uniform(0.024, 0.034)
        barrel(b, material, end - 0.06, end + length, up, radius)
    elif kind == "brake":
        for f in (0.0, 0.025, 0.05):
            b.cylinder("barrel", material, at(end + f - 0.018, up), at(end + f, up), 0.024)
        barrel(b, material, start=end - 0.02, end=end + 0.06, up=up, radius=0.017)
    elif kind == "hider":
        barrel(b, material, start=end - 0.03, end=end + 0.05, up=up, radius=0.016, taper=1.35)


def grip(
    b: Builder,
    material: Material,
    top: Pair,
    length: float,
    degrees: float,
    depth: float,
    width: float,
    flare: float = 0.1,
) -> Pair:
    """Add a pistol grip that hangs from `top`, raked back; return (forward, up) of its lower end.

    `flare` is how much deeper its foot is than its waist, as a fraction.
    """
    a = np.radians(degrees)
    t = np.array([0.0, 0.12, 0.35, 0.6, 0.82, 0.95, 1.0])
    path = np.array(top) + length * t[:, None] * np.array([-np.sin(a), -np.cos(a)])
    swell = np.array([1.1, 1.0, 0.96, 1.0, 1 + 0.5 * flare, 1 + flare, 0.9 + flare])
    sweep(b, "grip", material, path, depth=depth * swell, width=width * (0.6 + 0.4 * swell))
    return float(path[-1, 0]), float(path[-1, 1])


def trigger(
    b: Builder, material: Material, back: float, front: float, top: float, drop: float, width: float
) -> None:
    """Add a trigger and its guard, a strap that hangs `drop` below `top`."""
    loop = [(back, top), (back, top - drop), (front - 0.2 * drop, top - drop), (front, top)]
    strap = bend(loop, 0.5 * drop, 4)
    sweep(b, "trigger", material, strap, depth=0.09 * drop, width=width, boxiness=0.9)
    f = back + 0.42 * (front - back)
    blade = [(f, top + 0.01), (f - 0.02 * drop, top - 0.3 * drop)]
    blade += [(f + 0.12 * drop, top - 0.7 * drop)]
    sweep(b, "trigger", material, bend(blade, 0.3 * drop, 3), depth=0.09 * drop, width=0.6 * width)


def magazine(
    b: Builder,
    material: Material,
    top: Pair,
    length: float,
    depth: float,
    width: float,
    degrees: float = 0.0,
    curl: float = 0.0,
) -> None:
    """Add a box magazine below `top` that leans forward by `degrees` and curls on by `curl`."""
    t = np.linspace(0, 1, 9 if curl else 3)
    angles = np.radians(degrees + curl * t)
    steps = np.stack([np.sin(angles), -np.cos(angles)], 1)[:-1] * length / (len(t) - 1)
    path = np.array(top) + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, 0)])
    sweep(b, "magazine", material, path, depth=depth, width=width, boxiness=0.85)
    foot = path[-1] + np.outer([-0.01, 0.015], steps[-1] / np.linalg.norm(steps[-1]))
    sweep(b, "magazine", BLACK, foot, depth=1.12 * depth, width=1.2 * width, boxiness=0.85)


def drum(b: Builder, material: Material, center: Pair, radius: float, depth: float) -> None:
    """Add a drum magazine whose axis runs along the barrel."""
    f, up = center
    rim = 0.12 * depth
    profile = [(0.9, -depth / 2), (1, -depth / 2 + rim), (1, depth / 2 - rim), (0.9, depth / 2)]
    rows = [Cut(t + f, up - radius * r, up + radius * r, 2 * radius * r) for r, t in profile]
    bar(b, "magazine", material, rows, boxiness=0.0)


def scope(b: Builder, rng: Rng, material: Material, middle: float, base: float) -> None:
    """Add a telescopic sight on two rings, above a surface at height `base`."""
    length, radius = rng.uniform(0.24, 0.4), rng.uniform(0.014, 0.021)
    up = base + radius * rng.uniform(1.6, 2.4)
    bell, eye = rng.uniform(1.3, 1.9), rng.uniform(1.2, 1.5)
    stations = np.array([-0.5, -0.28, -0.2, 0.2, 0.3, 0.5]) * length + middle
    radii = radius * np.array([eye, eye, 1, 1, bell, bell])
    b.tube("sight", material, [at(f, up) for f in stations], list(radii), segments=14)
    for f, r in ((stations[0], eye), (stations[-1], bell)):
        b.cylinder("sight", BLACK, at(f - 0.003, up), at(f + 0.003, up), 0.85 * r * radius)
    for f in (middle - 0.13 * length, middle + 0.13 * length):
        b.box("sight", material, at(f, (base + up) / 2 - 0.01), (0.022, up - base + 0.02, 0.025))
        b.cylinder("sight", material, at(f - 0.014, up), at(f + 0.014, up), 1.2 * radius)
    knob = radius * 1.9
    b.cylinder("sight", material, at(middle, up), at(middle, up + knob), 0.7 * radius)
    b.cylinder("sight", material, at(middle, up), at(middle, up, knob), 0.7 * radius)


def iron_sights(
    b: Builder, material: Material, rear: float, front: float, base: float, height: float
) -> None:
    """Add a notch at `rear` and a blade at `front`, both on a surface at height `base`."""
    for side in (-0.6, 0.6):
        center = at(rear, base + 0.4 * height, side * height)
        b.box("sight", material, center, (0.6 * height, 1.2 * height, 0.9 * height))
    blade = at(front, base + 0.4 * height)
    b.box("sight", material, blade, (0.35 * height, 1.2 * height, 1.2 * height), taper=0.8)


def rail(
    b: Builder, part: str, material: Material, back: float, front: float, up: float, width: float
) -> None:
    """Add a toothed mounting rail on top of a surface at height `up`."""
    end = at(front, up + 0.003)
    beam(b, part, material, at(back, up + 0.003), end, width=0.8 * width, height=0.012)
    for f in np.arange(back + 0.01, front - 0.005, 0.03):
        b.box(part, material, at(f, up + 0.012), (width, 0.012, 0.016))


def add_hammer(b: Builder, steel: Material, forward: float, up: float, size: float) -> None:
    """Add a spur hammer that leans back from (forward, up)."""
    path = np.array([(0.3, -0.5), (0, 0.4), (-0.25, 0.9), (-0.8, 1.0)]) * size
    sweep(b, "trigger", steel, path + np.array([forward, up]), depth=0.35 * size, width=0.45 * size)
