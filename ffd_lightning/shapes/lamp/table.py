"""Table lamps."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.sections import eased_disc
from ffd_lightning.shapes.kit.vectors import about_y, vec
from ffd_lightning.shapes.lamp.bodies import add_foot, ball, outline, turned, turned_rows
from ffd_lightning.shapes.lamp.materials import draw_body_material, draw_metal
from ffd_lightning.shapes.lamp.shades import CLOTH, add_bulb, add_harp, add_shade, draw_shade


def table(rng: Rng) -> Builder:
    """Build a body on a foot, and a shade on top of it."""
    b = Builder()
    metal, material = draw_metal(rng), draw_body_material(rng)
    radius, height = rng.uniform(0.05, 0.14), rng.uniform(0.16, 0.46)
    foot = 0.0
    if rng.random() < 0.6:
        foot = rng.uniform(0.012, 0.035)
        add_foot(b, rng, metal if rng.random() < 0.5 else material, rng.uniform(0.08, 0.13), foot)
    _body(b, rng, material, metal, radius=radius, low=foot - 0.002, high=foot + height)
    size = rng.uniform(0.11, 0.24), rng.uniform(0.12, 0.3)
    shade = draw_shade(rng, max(size[0], 1.15 * radius), size[1], CLOTH)
    low = foot + height + rng.uniform(0.01, 0.08)
    b.cylinder("pole", metal, (0, foot + height - 0.01, 0), (0, low + 0.16 * size[1], 0), 0.01)
    holder, top = low + 0.15 * size[1], low + size[1]
    bulb = min(0.1, 0.6 * size[1])
    add_bulb(b, metal, (0, holder, 0), bulb)
    add_harp(b, metal, holder, top, 0.45 * bulb)
    add_shade(b, shade, metal, (0, top, 0))
    return b


def _body(
    b: Builder,
    rng: Rng,
    material: Material,
    metal: Material,
    *,
    radius: float,
    low: float,
    high: float,
) -> None:
    """Add the body of a table lamp between two heights, `radius` at its widest."""
    rise, at = high - low, vec(0, low, 0)
    kinds = ["vase", "stack", "block", "loop", "legs", "column"]
    kind = draw(rng, kinds, [0.4, 0.16, 0.14, 0.08, 0.1, 0.12])
    if kind == "vase":
        section = draw(rng, ["round", "fluted", "hexagon", "square"], [0.7, 0.14, 0.08, 0.08])
        twist = rng.uniform(-150, 150) if section in ("fluted", "square") else 0.0
        rows = turned_rows(rng, radius, rise, 0.016)
        turned(b, "base", material, rows, outline(section), at, twist)
    elif kind == "stack":
        _stack(b, rng, material, metal, radius, low, high)
    elif kind == "block":
        top = rng.uniform(0.5, 1.2) * radius
        rows = np.array([(radius, 0), (top, 0.97 * rise), (0.92 * top, rise)])
        section = draw(rng, ["square", "hexagon", "round", "oval"])
        turned(b, "base", material, rows, outline(section), at)
    elif kind == "loop":
        a = np.linspace(-0.5 * np.pi, 1.5 * np.pi, 33)
        half, thick = rise / 2, rng.uniform(0.012, 0.028)
        wide = rng.uniform(0.4, 1.0) * half
        flat = np.stack([wide * np.cos(a), half + (half - 0.8 * thick) * np.sin(a), 0 * a], 1)
        b.tube("base", material, flat + at, thick)
        b.lathe("base", metal, [(0.06, -0.005), (0.06, 0.012), (0.02, 0.02)], at)
    elif kind == "legs":
        count = int(rng.integers(3, 5))
        style = LegStyle(draw(rng, ["round", "square"]), 0.024, ((0, 0.6), (0.5, 0.9), (1, 1)))
        tops, feet = circle(count, 0.015, high - 0.01), circle(count, 0.9 * radius + 0.03, low)
        add_legs(b, "base", material, style, tops, feet)
        b.cylinder("base", metal, (0, high - 0.04, 0), (0, high, 0), 0.032)
    else:
        slim = rng.uniform(0.012, 0.03)
        b.cylinder("base", material, at, (0, high, 0), slim, segments=24)
        b.lathe("base", metal, [(0.09, 0), (0.09, 0.012), (slim, 0.025)], at)


def _stack(
    b: Builder,
    rng: Rng,
    material: Material,
    metal: Material,
    radius: float,
    low: float,
    high: float,
) -> None:
    """Thread two to five balls, discs or blocks on a rod, smaller toward the top."""
    b.cylinder("pole", metal, (0, low, 0), (0, high, 0), 0.01)
    count, kind = int(rng.integers(2, 6)), draw(rng, ["ball", "disc", "block"])
    shares = np.linspace(1, rng.uniform(0.5, 1.1), count)
    sizes = shares / shares.sum() * (high - low)
    second = draw_body_material(rng)
    foot = low
    for i, size in enumerate(sizes):
        skin = second if i % 2 else material
        wide = radius * shares[i]
        middle = vec(0, foot + size / 2, 0)
        if kind == "ball":
            ball(b, "base", skin, middle, np.array([0.9 * wide, 0.52 * size]))
        elif kind == "disc":
            half, edge = 0.5 * size, 0.12 * size
            b.lathe("base", skin, eased_disc(wide, -half, half, edge), middle)
        else:
            turn = about_y(i * 45.0 if i % 2 else 0.0)
            b.rounded_box("base", skin, middle, (1.5 * wide, size, 1.5 * wide), 0.01, turn=turn)
        foot += size
