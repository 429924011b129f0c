"""Firearms: pistol, revolver, and the long guns."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.parts.furniture import bend, draw
from ffd_lightning.shapes.parts.gun_parts import (
    BLACK,
    at,
    bar,
    barrel,
    draw_furniture,
    draw_steel,
    grip,
    iron_sights,
    sweep,
    trigger,
)
from ffd_lightning.shapes.parts.long_gun import (
    assault_rifle,
    hunting_rifle,
    machine_gun,
    shotgun,
    submachine_gun,
)
from ffd_lightning.shapes.shapes import Array, Builder, Family, Material

PARTS = ("barrel", "body", "grip", "trigger", "magazine", "stock", "sight")


def _slide(
    b: Builder, rng: np.random.Generator, steel: Material, length: float, tall: float, wide: float
) -> None:
    """Add a pistol's slide from 0 forward to `length`, its serrations, port, barrel and sights."""
    low, high = -0.5 * tall, 0.5 * tall
    nose = rng.uniform(0.0, 0.35) * tall
    rows = [(0, low, high, wide), (length - 0.06, low, high, wide)]
    rows += [(length, low + nose, high, 0.9 * wide)]
    bar(b, "body", steel, rows, rng.uniform(0.75, 0.95))
    barrel(b, steel, length - 0.05, length + rng.uniform(0.005, 0.05), 0.1 * tall, 0.26 * tall)
    for f in np.linspace(0.04, rng.uniform(0.12, 0.2), int(rng.integers(4, 8))):
        b.box("body", BLACK, at(f, 0), (1.02 * wide, 0.7 * tall, 0.008))
    port = rng.uniform(0.14, 0.2)
    b.box(
        "body", BLACK, at(0.52 * length, 0.3 * tall, 0.2 * wide), (0.64 * wide, 0.42 * tall, port)
    )
    iron_sights(b, BLACK, 0.04, length - 0.04, high, rng.uniform(0.025, 0.045))


def _open_slide(
    b: Builder, rng: np.random.Generator, steel: Material, length: float, tall: float, wide: float
) -> None:
    """Add a short bolt housing behind a slender barrel that stands free."""
    low, high = -0.5 * tall, 0.5 * tall
    back = rng.uniform(0.42, 0.55) * length
    rows = [(0, low, 0.8 * high, 0.8 * wide), (0.12 * back, low, high, wide)]
    rows += [(back, low, high, wide), (back + 0.05, low, 0.6 * high, 0.7 * wide)]
    bar(b, "body", steel, rows, 0.7)
    radius = rng.uniform(0.24, 0.34) * tall
    barrel(b, steel, back, length + rng.uniform(0, 0.25), 0.05 * tall, radius, taper=0.75)
    for side in (-1, 1):
        knob = at(0.3 * back, 0.3 * tall)
        b.cylinder("body", steel, knob, knob + at(0, 0.02, 0.62 * side * wide), 0.25 * tall)
    iron_sights(b, steel, 0.3 * back, length - 0.03, 0.3 * tall, rng.uniform(0.03, 0.05))


def _hammer(b: Builder, steel: Material, forward: float, up: float, size: float) -> None:
    """Add a spur hammer that leans back from (forward, up)."""
    path = np.array([(0.3, -0.5), (0, 0.4), (-0.25, 0.9), (-0.8, 1.0)]) * size
    sweep(b, "trigger", steel, path + np.array([forward, up]), 0.35 * size, 0.45 * size)


def pistol(rng: np.random.Generator) -> Builder:
    """Draw a self-loading pistol."""
    b, steel = Builder(), draw_steel(rng)
    body = draw_steel(rng) if rng.random() < 0.6 else draw_furniture(rng, wood=0)
    panel = draw_furniture(rng) if rng.random() < 0.6 else body
    length, tall, wide = rng.uniform(0.7, 1.05), rng.uniform(0.13, 0.18), rng.uniform(0.11, 0.15)
    depth, rake = rng.uniform(0.22, 0.29), rng.uniform(8, 28)
    opened = rng.random() < 0.3
    (_open_slide if opened else _slide)(b, rng, steel, length, tall, wide)
    under = -0.5 * tall - rng.uniform(0.05, 0.09)
    front = length * rng.uniform(0.75, 0.98)
    if opened:
        front = max(0.65 * front, depth + 0.3)
    rows = [(-0.07, -0.5 * tall, -0.42 * tall, 0.6 * wide), (0.03, under, -0.38 * tall, wide)]
    rows += [(0.5 * length, under, -0.42 * tall, wide), (front, under + 0.03, -0.42 * tall, wide)]
    bar(b, "body", body, rows, 0.85)
    top = (0.5 * depth + 0.02, under + 0.04)
    foot, end = grip(b, panel, top, rng.uniform(0.4, 0.6), rake, depth, wide, rng.uniform(0, 0.12))
    plate = [(foot, end + 0.01), (foot - 0.02 * np.sin(np.radians(rake)), end - 0.03)]
    sweep(b, "magazine", steel, plate, 1.02 * depth, 0.8 * wide, 0.85)
    back = depth
    trigger(
        b, body, back, back + rng.uniform(0.2, 0.27), under, rng.uniform(0.13, 0.18), 0.4 * wide
    )
    if rng.random() < 0.55:
        _hammer(b, steel, -0.01, -0.1 * tall, rng.uniform(0.07, 0.1))
    if not opened and rng.random() < 0.2:
        barrel(
            b, BLACK, length, length + rng.uniform(0.4, 0.7), 0.1 * tall, rng.uniform(0.06, 0.08)
        )
    elif not opened and front > 0.8 * length and rng.random() < 0.25:
        light = rng.uniform(0.16, 0.22)
        rows = [(f, under - 0.09, under + 0.03, 0.1) for f in (front - light, front)]
        bar(b, "sight", BLACK, rows)
    return b


def _fluted(radius: float, flutes: int, depth: float) -> Array:
    """Return the outline (48, 2) of a revolver's cylinder."""
    a = 2 * np.pi * np.arange(48) / 48
    r = radius * (1 - depth * np.maximum(0, np.cos(flutes * a)) ** 2)
    return np.stack([r * np.cos(a), r * np.sin(a)], 1)


def _cylinder(
    b: Builder, steel: Material, rng: np.random.Generator, ends: Array, radius: float
) -> None:
    """Add a revolver's fluted cylinder between two `ends` along the barrel, about height 0."""
    back, front = ends
    count = int(rng.integers(5, 8))
    plain, flute = _fluted(radius, count, 0), _fluted(radius, count, rng.uniform(0.1, 0.2))
    waist = back + 0.35 * (front - back)
    rings = [
        np.column_stack([outline, np.full(48, -f)])
        for f, outline in (
            (back, 0.96 * plain),
            (back + 0.01, plain),
            (waist, plain),
            (front, flute),
        )
    ]
    b.loft("magazine", steel, rings)


def revolver(rng: np.random.Generator) -> Builder:
    """Draw a revolver."""
    b, steel, panel = Builder(), draw_steel(rng), draw_furniture(rng, wood=0.75)
    radius, drum = rng.uniform(0.1, 0.14), rng.uniform(0.22, 0.32)
    bore, wide = 0.62 * radius, rng.uniform(0.8, 1.0) * radius
    length, thick = rng.uniform(0.15, 0.85), rng.uniform(0.045, 0.06)
    back, top = -0.5 * drum, bore + 1.2 * thick
    front, strap = back + drum, 1.05 * radius
    _cylinder(b, steel, rng, np.array([back + 0.006, front - 0.006]), radius)
    bar(
        b,
        "body",
        steel,
        [
            (back - 0.13, -1.3 * radius, 0.3 * bore, 0.7 * wide),
            (back - 0.08, -1.45 * radius, strap, wide),
            (back, -1.45 * radius, 1.1 * strap, wide),
        ],
    )
    bar(
        b,
        "body",
        steel,
        [(front, -1.45 * radius, 1.1 * strap, wide), (front + 0.06, -0.5 * radius, top, wide)],
    )
    for low, high in ((-1.5 * radius, -0.98 * radius), (0.98 * radius, 1.1 * strap + 0.01)):
        bar(b, "body", steel, [(f, low, high, 0.8 * wide) for f in (back - 0.02, front + 0.02)])
    _revolver_barrel(b, rng, steel, (front, front + 0.05 + length), bore, thick)
    _revolver_grip(b, rng, panel, (back - 0.09, -0.8 * radius), wide)
    drop = rng.uniform(0.15, 0.19)
    trigger(b, steel, back - 0.04, back + rng.uniform(0.22, 0.28), -1.4 * radius, drop, 0.5 * wide)
    _hammer(b, steel, back - 0.1, 0.5 * bore, rng.uniform(0.09, 0.12))
    return b


def _revolver_barrel(
    b: Builder,
    rng: np.random.Generator,
    steel: Material,
    ends: tuple[float, float],
    up: float,
    thick: float,
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
            (start, -0.6 * thick, up, thick),
            (f - 0.02, -0.6 * thick, up, thick),
            (f, 0, up, thick),
        ]
        bar(b, "barrel", steel, rows)
    if rng.random() < 0.5:
        rows = [(f, up, up + 1.25 * thick, 0.7 * thick) for f in (start, end - 0.01)]
        bar(b, "barrel", steel, rows, 0.9)
    tall = rng.uniform(0.03, 0.06)
    blade = [(end - 0.12, up + 0.8 * thick, up + 1.1 * thick, 0.02)]
    blade += [(end - f, up + 0.6 * thick, up + 1.1 * thick + tall, 0.02) for f in (0.04, 0.015)]
    bar(b, "sight", steel, blade, 0.95)


def _revolver_grip(
    b: Builder, rng: np.random.Generator, panel: Material, top: tuple[float, float], wide: float
) -> None:
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
    sweep(b, "grip", panel, path, depths * rng.uniform(0.9, 1.15), wide * (1 + 0.25 * t), 0.4)


FAMILIES: dict[str, Family] = {
    "pistol": pistol,
    "revolver": revolver,
    "assault_rifle": assault_rifle,
    "hunting_rifle": hunting_rifle,
    "shotgun": shotgun,
    "submachine_gun": submachine_gun,
    "machine_gun": machine_gun,
}
