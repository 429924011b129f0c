"""Revolvers."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.firearm.fittings import add_hammer, barrel, trigger
from ffd_lightning.shapes.firearm.materials import draw_furniture, draw_steel
from ffd_lightning.shapes.firearm.swept import Cut, at, bar, even_bar, sweep
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import Array, Pair


def _fluted(radius: float, flutes: int, depth: float) -> Array:
    """Return the outline (48, 2) of a revolver's cylinder."""
    a = 2 * np.pi * np.arange(48) / 48
    r = radius * (1 - depth * np.maximum(0, np.cos(flutes * a)) ** 2)
    return np.stack([r * np.cos(a), r * np.sin(a)], 1)


def _cylinder(b: Builder, steel: Material, rng: Rng, ends: Array, radius: float) -> None:
    """Add a revolver's fluted cylinder between two `ends` along the barrel, about height 0."""
    back, front = ends
    count = int(rng.integers(5, 8))
    plain, flute = _fluted(radius, count, 0), _fluted(radius, count, rng.uniform(0.1, 0.2))
    waist = back + 0.35 * (front - back)
    outlines = ((back, 0.96 * plain), (back + 0.01, plain), (waist, plain), (front, flute))
    rings = [np.column_stack([outline, np.full(48, -f)]) for f, outline in outlines]
    b.loft("magazine", steel, rings)


def revolver(rng: Rng) -> Builder:
    """Draw a revolver."""
    b, steel, panel = Builder(), draw_steel(rng), draw_furniture(rng, wood=0.75)
    radius, drum = rng.uniform(0.1, 0.14), rng.uniform(0.22, 0.32)
    bore, wide = 0.62 * radius, rng.uniform(0.8, 1.0) * radius
    length, thick = rng.uniform(0.15, 0.85), rng.uniform(0.045, 0.06)
    back, top = -0.5 * drum, bore + 1.2 * thick
    front, strap = back + drum, 1.05 * radius
    _cylinder(b, steel, rng, np.array([back + 0.006, front - 0.006]), radius)
    rows = [
        Cut(forward=back - 0.13, low=-1.3 * radius, high=0.3 * bore, width=0.7 * wide),
        Cut(forward=back - 0.08, low=-1.45 * radius, high=strap, width=wide),
        Cut(forward=back, low=-1.45 * radius, high=1.1 * strap, width=wide),
    ]
    bar(b, "body", steel, rows)
    rows = [
        Cut(forward=front, low=-1.45 * radius, high=1.1 * strap, width=wide),
        Cut(forward=front + 0.06, low=-0.5 * radius, high=top, width=wide),
    ]
    bar(b, "body", steel, rows)
    for low, high in ((-1.5 * radius, -0.98 * radius), (0.98 * radius, 1.1 * strap + 0.01)):
        even_bar(b, "body", steel, (back - 0.02, front + 0.02), low, high, 0.8 * wide)
    _revolver_barrel(b, rng, steel, (front, front + 0.05 + length), bore, thick)
    _revolver_grip(b, rng, panel, (back - 0.09, -0.8 * radius), wide)
    drop = rng.uniform(0.15, 0.19)
    tip, under = back + rng.uniform(0.22, 0.28), -1.4 * radius
    trigger(b, steel, back=back - 0.04, front=tip, top=under, drop=drop, width=0.5 * wide)
    add_hammer(b, steel, forward=back - 0.1, up=0.5 * bore, size=rng.uniform(0.09, 0.12))
    return b


def _revolver_barrel(
    b: Builder, rng: Rng, steel: Material, ends: Pair, up: float, thick: float
) -> None:
    """Add the barrel, with or without a lug below and a rib above, and the front sight."""
    start, end = ends
    barrel(b, steel, start, end, up, thick, taper=rng.uniform(0.75, 1.0))
    lug = draw(rng, ["none", "rod", "half", "full"], [0.3, 0.25, 0.2, 0.25])
    if lug == "rod":
        b.cylinder("barrel", steel, at(start, 0), at(start + 0.7 * (end - start), 0), 0.5 * thick)
    elif lug != "none":
        f = end if lug == "full" else start + 0.6 * (end - start)
        rows = [
            Cut(forward=start, low=-0.6 * thick, high=up, width=thick),
            Cut(forward=f - 0.02, low=-0.6 * thick, high=up, width=thick),
            Cut(forward=f, low=0, high=up, width=thick),
        ]
        bar(b, "barrel", steel, rows)
    if rng.random() < 0.5:
        rib = (start, end - 0.01)
        width = 0.7 * thick
        even_bar(b, "barrel", steel, rib, low=up, high=up + 1.25 * thick, width=width, boxiness=0.9)
    tall = rng.uniform(0.03, 0.06)
    blade = [
        Cut(forward=end - 0.12, low=up + 0.8 * thick, high=up + 1.1 * thick, width=0.02),
        Cut(forward=end - 0.04, low=up + 0.6 * thick, high=up + 1.1 * thick + tall, width=0.02),
        Cut(forward=end - 0.015, low=up + 0.6 * thick, high=up + 1.1 * thick + tall, width=0.02),
    ]
    bar(b, "sight", steel, blade, boxiness=0.95)


def _revolver_grip(b: Builder, rng: Rng, panel: Material, top: Pair, wide: float) -> None:
    """Add a curved handle: a plough, a bird's head or a broad target grip."""
    length, rake = rng.uniform(0.4, 0.58), rng.uniform(12, 30)
    style = draw(rng, ["plough", "bird", "target"])
    a = np.radians(rake)
    f, up = top
    knee = (f - 0.45 * length * np.sin(a) - 0.05, up - 0.5 * length * np.cos(a))
    sway = {"plough": 0.9, "bird": 0.35, "target": 0.75}[style]
    foot = (knee[0] - sway * length * np.sin(a) * 0.5, up - length * np.cos(a))
    path = bend([(f + 0.03, up + 0.06), knee, foot], 0.6 * length, 7)
    t = np.linspace(0, 1, len(path))
    depths = {
        "plough": 0.19 + 0.09 * t**2,
        "bird": 0.2 - 0.03 * t - 0.08 * t**6,
        "target": 0.22 + 0.05 * np.sin(3 * t) + 0.04 * t,
    }[style]
    depth = depths * rng.uniform(0.9, 1.15)
    sweep(b, "grip", panel, path, depth=depth, width=wide * (1 + 0.25 * t), boxiness=0.4)
