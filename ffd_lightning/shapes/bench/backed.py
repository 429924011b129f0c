"""Wooden benches with a back: settles and spindle-backed ones."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.bench.boards import add_boards, draw_bench_size
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, enclose, pad, rails
from ffd_lightning.shapes.kit.legs import LegStyle, add_leg, add_legs, draw_leg_style
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.upholstery import draw_cover
from ffd_lightning.shapes.kit.vectors import UP, lean, vec


def settle(rng: Rng) -> Builder:
    """Build a chest or frame with a high back and closed or barred ends."""
    b = Builder()
    length, depth, height = draw_bench_size(rng)
    wood = pick_material(rng, draw(rng, ["wood", "paint"], [0.7, 0.3]))
    post, rise = rng.uniform(0.045, 0.07), rng.uniform(0.3, 0.8)
    arm = min(rng.uniform(0.18, 0.3), rise)
    feet = corners(length - post, depth - post, 0.0)
    tops = feet + np.array([[arm], [arm], [rise], [rise]]) * UP + height * UP
    style = LegStyle("square", post, ((0.0, 1.0), (0.3, 1.0), (0.6, 1.0), (1.0, 1.0)))
    add_legs(b, "leg", wood, style, tops, feet)
    add_boards(b, rng, wood, (length - post, depth, height), 1)
    if rng.random() < 0.5:
        low = rng.uniform(0.02, 0.1)
        chest = (length - post, height - low - 0.01, depth - post)
        b.rounded_box("seat", wood, (0, (height + low) / 2, 0), chest, 0.008)
        count = int(rng.integers(2, 5))
        for i in range(count):
            x = ((i + 0.5) / count - 0.5) * chest[0]
            panel = (0.85 * chest[0] / count, 0.65 * chest[1], 0.03)
            at = (x, (height + low) / 2, -chest[2] / 2)
            b.rounded_box("seat", wood, at, panel, 0.008)
    else:
        rails(b, "leg", wood, feet + (height - 0.07) * UP, width=0.025, height=0.08)
    fill, gap = draw(rng, ["bars", "slats", "panel"]), rng.uniform(0.07, 0.14)
    enclose(b, wood, tops, deck=height, fill=fill, gap=gap)
    if rng.random() < 0.5:
        soft = rng.uniform(0.04, 0.09)
        size = (length - 2.2 * post, soft, depth - 1.5 * post)
        b.rounded_box("seat", draw_cover(rng), (0, height + 0.45 * soft, 0), size, 0.04)
    return b


def spindle(rng: Rng) -> Builder:
    """Build a long wooden seat on splayed turned legs with a back of spindles and open arms."""
    b = Builder()
    length, depth, height = draw_bench_size(rng)
    wood = pick_material(rng, draw(rng, ["wood", "paint"], [0.65, 0.35]))
    thick = rng.uniform(0.03, 0.05)
    seat = (length, thick, depth)
    b.rounded_box("seat", wood, (0, height - thick / 2, 0), seat, radius=0.12, edge=0.4 * thick)
    style = draw_leg_style(rng, (0.035, 0.05), hairpin=0.0)
    xs = np.linspace(-1, 1, 2 if length < 1.4 else int(rng.integers(3, 5))) * (length / 2 - 0.1)
    splay = rng.uniform(0.02, 0.08)
    for x in xs:
        points = []
        for side in (-1, 1):
            top = vec(x, height - thick + 0.003, side * (depth / 2 - 0.1))
            foot = vec(x + splay * np.sign(x), 0, top[2] + side * splay)
            add_leg(b, "leg", wood, style, top, foot)
            points.append(foot + 0.35 * (top - foot))
        b.cylinder("leg", wood, points[0], points[1], 0.012, segments=10)
    _spindle_back(b, rng, wood, length, depth, height)
    return b


def _spindle_back(
    b: Builder, rng: Rng, wood: Material, length: float, depth: float, height: float
) -> None:
    """Add raked spindles below a crest, and perhaps arms, to a seat of these dimensions."""
    rise, degrees = rng.uniform(0.3, 0.55), rng.uniform(6, 15)
    turn, foot = lean(degrees), vec(0, height - 0.01, depth / 2 - 0.04)
    half, radius = length / 2 - 0.05, rng.uniform(0.007, 0.012)
    for x in np.linspace(-half, half, round(length / rng.uniform(0.07, 0.14))):
        low, high = foot + turn @ vec(x, 0, 0), foot + turn @ vec(x, rise, 0)
        b.cylinder("back", wood, low, high, radius, segments=8)
    crest = (length - 0.02, rng.uniform(0.05, 0.12), 0.026)
    pad(b, "back", wood, foot + turn @ vec(0, rise, 0), crest, 0.02, degrees)
    if rng.random() < 0.3:
        return
    level = rng.uniform(0.18, 0.24)
    rear = foot + turn @ vec(0, level, 0)
    for x in (-half, half):
        front = (x, height + level, -depth / 2 + 0.06)
        beam(b, "arm", wood, front, (x, *rear[1:]), width=0.05, height=0.022)
        for z in (-depth / 2 + 0.1, -depth / 2 + 0.24):
            ends = (x, height - 0.01, z), (x, height + level, z)
            b.cylinder("arm", wood, *ends, 0.012, segments=8)
