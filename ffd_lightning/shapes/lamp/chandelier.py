"""Chandeliers."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import UP, Array, about_y, vec
from ffd_lightning.shapes.lamp.bodies import outline, turned, turned_rows
from ffd_lightning.shapes.lamp.cords import add_cord, add_rose, hang_shade
from ffd_lightning.shapes.lamp.materials import draw_body_material, draw_metal
from ffd_lightning.shapes.lamp.shades import FLIP, Shade, add_bulb, add_shade, draw_shade

CUPS = {"bell": 0.35, "empire": 0.35, "bowl": 0.3}


def chandelier(rng: Rng) -> Builder:
    """Build a turned column with curved arms around it, a candle or a cup on each."""
    b = Builder()
    metal = draw_metal(rng)
    tall, drop = rng.uniform(0.25, 0.5), rng.uniform(0.1, 0.5)
    add_rose(b, metal, 0.07, vec(0, tall + drop, 0))
    add_cord(b, metal, vec(0, tall + drop, 0), drop)
    column = metal if rng.random() < 0.6 else draw_body_material(rng)
    vase = turned_rows(rng, radius=rng.uniform(0.04, 0.08), height=tall, neck=0.012)
    turned(b, "pole", column, vase, outline("round", 16))
    rows = [(0.004, -0.06), (0.018, -0.045), (0.02, -0.03), (0.008, -0.01), (0.02, 0.005)]
    b.lathe("pole", metal, rows, segments=12)
    head = draw(rng, ["candle", "up", "down"], [0.4, 0.3, 0.3])
    size = rng.uniform(0.05, 0.085)
    shade = draw_shade(rng, size, size * rng.uniform(1.1, 1.8), CUPS, fine=False, glass=0.3)
    tiers = 2 if rng.random() < 0.25 and head == "candle" else 1
    most = 8 if head == "candle" and tiers == 1 else 6
    reach, count = rng.uniform(0.28, 0.5), int(rng.integers(3, most + 1))
    for tier in range(tiers):
        out = reach * (1 - 0.45 * tier)
        number = max(3, count - 2 * tier)
        path = _arm_path(rng, head, out, rng.uniform(0.05, 0.25) * tall, tall)
        path = path + 0.4 * tier * tall * UP
        for i in range(number):
            turn = about_y(360.0 * i / number + 30 * tier)
            _arm(b, metal, shade, head, path @ turn.T)
    if tiers == 1 and rng.random() < 0.3:
        a = np.linspace(0, 2 * np.pi, 37)
        level = np.interp(0.6 * reach, path[:, 0], path[:, 1])
        ring = np.stack([0.6 * reach * np.cos(a), np.full(37, level), 0.6 * reach * np.sin(a)], 1)
        b.tube("arm", metal, ring, 0.008, segments=8)
    return b


def _arm_path(rng: Rng, head: str, reach: float, start: float, tall: float) -> Array:
    """Draw an arm's path (p, 3) from the column out along x: a scroll, a bow or straight."""
    kind = draw(rng, ["scroll", "bow", "straight"], [0.5, 0.3, 0.2])
    rise = rng.uniform(0.0, 0.5) * tall
    if kind == "straight":
        middle = (reach / 2, start + rise / 4, 0)
        return np.array([(0, start, 0), middle, (reach, start + rise / 2, 0)])
    sag = rng.uniform(0.2, 0.5) * tall * (-1 if head != "down" else 1)
    points = [(0.0, start, 0.0), (0.45 * reach, start + sag, 0.0)]
    if kind == "scroll":
        points = [(0, start, 0), (0.3 * reach, start - 0.8 * sag, 0), (0.6 * reach, start + sag, 0)]
    return bend([*points, (reach, start + sag / 2, 0), (reach, start + rise, 0)], reach, 3)


def _arm(b: Builder, metal: Material, shade: Shade, head: str, path: Array) -> None:
    """Add one arm along `path` and, at its end, a candle, or a cup that opens up or down."""
    b.tube("arm", metal, path, 0.008, segments=6)
    end = path[-1]
    if head == "down":
        hang_shade(b, shade, metal, end + 0.005 * UP, 0.07)
        return
    profile = [(0.01, -0.012), (0.03, 0), (0.032, 0.012), (0.015, 0.014)]
    b.lathe("arm", metal, profile, end, segments=10)
    if head == "up":
        add_shade(b, shade, metal, end, FLIP)
        add_bulb(b, metal, end, 0.06)
        return
    wax = Material((0.93, 0.9, 0.82))
    b.cylinder("bulb", wax, end, end + 0.08 * UP, 0.012, segments=8)
    flame = [(0.006, 0), (0.012, 0.015), (0.009, 0.03), (0.001, 0.045)]
    b.lathe("bulb", Material((1.0, 0.9, 0.6)), flame, end + 0.08 * UP, segments=8)
