"""Self-loading pistols."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.firearm.fittings import add_hammer, barrel, grip, iron_sights, trigger
from ffd_lightning.shapes.firearm.materials import BLACK, draw_furniture, draw_steel
from ffd_lightning.shapes.firearm.swept import Cut, at, bar, even_bar, sweep
from ffd_lightning.shapes.kit import Builder, Material, Rng


def _slide(b: Builder, rng: Rng, steel: Material, length: float, tall: float, wide: float) -> None:
    """Add a pistol's slide from 0 forward to `length`, its serrations, port, barrel and sights."""
    low, high = -0.5 * tall, 0.5 * tall
    nose = rng.uniform(0.0, 0.35) * tall
    rows = [
        Cut(forward=0, low=low, high=high, width=wide),
        Cut(forward=length - 0.06, low=low, high=high, width=wide),
        Cut(forward=length, low=low + nose, high=high, width=0.9 * wide),
    ]
    bar(b, "body", steel, rows, boxiness=rng.uniform(0.75, 0.95))
    end = length + rng.uniform(0.005, 0.05)
    barrel(b, steel, start=length - 0.05, end=end, up=0.1 * tall, radius=0.26 * tall)
    for f in np.linspace(0.04, rng.uniform(0.12, 0.2), int(rng.integers(4, 8))):
        b.box("body", BLACK, at(f, 0), (1.02 * wide, 0.7 * tall, 0.008))
    port = rng.uniform(0.14, 0.2)
    center = at(0.52 * length, 0.3 * tall, 0.2 * wide)
    b.box("body", BLACK, center, (0.64 * wide, 0.42 * tall, port))
    height = rng.uniform(0.025, 0.045)
    iron_sights(b, BLACK, rear=0.04, front=length - 0.04, base=high, height=height)


def _open_slide(
    b: Builder, rng: Rng, steel: Material, length: float, tall: float, wide: float
) -> None:
    """Add a short bolt housing behind a slender barrel that stands free."""
    low, high = -0.5 * tall, 0.5 * tall
    back = rng.uniform(0.42, 0.55) * length
    rows = [
        Cut(forward=0, low=low, high=0.8 * high, width=0.8 * wide),
        Cut(forward=0.12 * back, low=low, high=high, width=wide),
        Cut(forward=back, low=low, high=high, width=wide),
        Cut(forward=back + 0.05, low=low, high=0.6 * high, width=0.7 * wide),
    ]
    bar(b, "body", steel, rows, boxiness=0.7)
    radius = rng.uniform(0.24, 0.34) * tall
    end = length + rng.uniform(0, 0.25)
    barrel(b, steel, start=back, end=end, up=0.05 * tall, radius=radius, taper=0.75)
    for side in (-1, 1):
        knob = at(0.3 * back, 0.3 * tall)
        b.cylinder("body", steel, knob, knob + at(0, 0.02, 0.62 * side * wide), 0.25 * tall)
    height = rng.uniform(0.03, 0.05)
    iron_sights(b, steel, rear=0.3 * back, front=length - 0.03, base=0.3 * tall, height=height)


def pistol(rng: Rng) -> Builder:
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
    rows = [
        Cut(forward=-0.07, low=-0.5 * tall, high=-0.42 * tall, width=0.6 * wide),
        Cut(forward=0.03, low=under, high=-0.38 * tall, width=wide),
        Cut(forward=0.5 * length, low=under, high=-0.42 * tall, width=wide),
        Cut(forward=front, low=under + 0.03, high=-0.42 * tall, width=wide),
    ]
    bar(b, "body", body, rows, boxiness=0.85)
    top = (0.5 * depth + 0.02, under + 0.04)
    long, flare = rng.uniform(0.4, 0.6), rng.uniform(0, 0.12)
    foot, end = grip(b, panel, top, long, degrees=rake, depth=depth, width=wide, flare=flare)
    plate = [(foot, end + 0.01), (foot - 0.02 * np.sin(np.radians(rake)), end - 0.03)]
    sweep(b, "magazine", steel, plate, depth=1.02 * depth, width=0.8 * wide, boxiness=0.85)
    back = depth
    tip, drop = back + rng.uniform(0.2, 0.27), rng.uniform(0.13, 0.18)
    trigger(b, body, back=back, front=tip, top=under, drop=drop, width=0.4 * wide)
    if rng.random() < 0.55:
        add_hammer(b, steel, forward=-0.01, up=-0.1 * tall, size=rng.uniform(0.07, 0.1))
    if not opened and rng.random() < 0.2:
        muzzle = length + rng.uniform(0.4, 0.7)
        barrel(b, BLACK, start=length, end=muzzle, up=0.1 * tall, radius=rng.uniform(0.06, 0.08))
    elif not opened and front > 0.8 * length and rng.random() < 0.25:
        light = rng.uniform(0.16, 0.22)
        ends = (front - light, front)
        even_bar(b, "sight", BLACK, ends, low=under - 0.09, high=under + 0.03, width=0.1)
    return b
