"""Lanterns."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import UP, vec
from ffd_lightning.shapes.lamp.bodies import add_foot, outline, turned
from ffd_lightning.shapes.lamp.cords import add_cord, add_rose
from ffd_lightning.shapes.lamp.materials import draw_metal, draw_shade_material
from ffd_lightning.shapes.lamp.shades import add_bulb


def lantern(rng: Rng) -> Builder:
    """Build a glazed, roofed lantern: on a post, on a ceiling chain, or standing with a handle."""
    b = Builder()
    metal = draw_metal(rng)
    sides = "square" if rng.random() < 0.55 else "hexagon"
    mount = draw(rng, ["post", "chain", "stand"], [0.5, 0.25, 0.25])
    wide, tall = rng.uniform(0.1, 0.17), rng.uniform(0.22, 0.42)
    low = 0.0
    if mount == "post":
        low = rng.uniform(0.7, 1.5)
        add_foot(b, rng, metal, rng.uniform(0.12, 0.17), rng.uniform(0.06, 0.16))
        stem = rng.uniform(0.02, 0.035)
        rows = [(2 * stem, 0.02), (2 * stem, 0.2 * low), (1.2 * stem, 0.22 * low)]
        rows += [(stem, 0.9 * low)]
        rows += [(1.8 * stem, 0.92 * low), (stem, 0.94 * low), (2 * stem, low)]
        turned(b, "pole", metal, rows, outline(draw(rng, ["round", "hexagon"]), 20))
    top = low + tall + _case(b, rng, metal, sides, wide=wide, low=low, tall=tall)
    if mount == "chain":
        length = rng.uniform(0.1, 0.6)
        add_rose(b, metal, 0.07, vec(0, top + length, 0))
        add_cord(b, metal, vec(0, top + length, 0), length + 0.01)
    elif mount == "stand":
        a = np.linspace(0, np.pi, 21)
        rise = top - low - tall + rng.uniform(0.03, 0.12)
        loop = np.stack([0.7 * wide * np.cos(a), low + tall + rise * np.sin(a), 0 * a], 1)
        b.tube("arm", metal, loop, 0.008, segments=8)
    return b


def _case(
    b: Builder, rng: Rng, metal: Material, sides: str, *, wide: float, low: float, tall: float
) -> float:
    """Add the floor, posts, panes, candle and roof of a lantern; return the roof's height.

    The glazed part is `tall` from `low` on; `wide` is its radius at the top.
    """
    section = outline(sides)
    waist = wide * rng.uniform(0.55, 1.0)
    at = vec(0, low, 0)
    floor = [(0.9 * waist, 0), (1.1 * waist, 0.012), (1.1 * waist, 0.03)]
    turned(b, "base", metal, floor, section, at)
    pane = pick_material(rng, "glass") if rng.random() < 0.75 else draw_shade_material(rng, 0)
    rows = np.array([(0.93 * waist, 0.025), (0.93 * wide, tall)])
    turned(b, "shade", pane, rows, section, at)
    for x, z in section[::3]:
        ends = np.array([(x * waist, 0.02, z * waist), (x * wide, tall, z * wide)]) + at
        b.tube("shade", metal, ends, 0.009, segments=6)
    add_bulb(b, metal, at + 0.03 * UP, 0.5 * tall)
    rise, eave = wide * rng.uniform(0.4, 1.1), rng.uniform(1.12, 1.35) * wide
    t = np.linspace(0, 1, 6)
    curve = eave + (0.16 * wide - eave) * t ** rng.uniform(0.6, 1.2)
    roof = [(eave, -0.02), *np.stack([curve, rise * t], 1)]
    turned(b, "shade", metal, roof, section, at + tall * UP)
    ball = [(0.1 * wide, -0.01), (0.2 * wide, 0.15 * wide), (0.05 * wide, 0.4 * wide)]
    b.lathe("shade", metal, ball, at + (tall + rise) * UP, segments=14)
    return rise + 0.3 * wide
