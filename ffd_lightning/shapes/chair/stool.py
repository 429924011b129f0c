"""Stools, low and at a bar."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, rails
from ffd_lightning.shapes.kit.legs import add_legs, draw_leg_style
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.upholstery import draw_cover
from ffd_lightning.shapes.kit.vectors import vec


def stool(rng: Rng) -> Builder:
    """Build a low or bar stool: round or square seat, three or four legs or one column."""
    b = Builder()
    height = rng.uniform(0.6, 0.82) if rng.random() < 0.65 else rng.uniform(0.4, 0.5)
    half, soft = rng.uniform(0.15, 0.22), rng.uniform(0.03, 0.1)
    frame = pick_material(rng, draw(rng, ["wood", "metal", "paint"]))
    cover = draw_cover(rng) if rng.random() < 0.6 else frame
    ease = 0.4 * soft
    if rng.random() < 0.6:
        radii = [half - ease, half, half, half - ease, 0.4 * half]
        heights = height + np.array([-soft, ease - soft, -ease, 0, 0.004])
        b.lathe("seat", cover, np.column_stack([radii, heights]), segments=44)
    else:
        size = (2 * half, soft, 1.8 * half)
        center = (0, height - soft / 2, 0)
        b.rounded_box("seat", cover, center, size, rng.uniform(0.02, 0.12), segments=5)
    _stool_base(b, rng, frame, half, height - soft + 0.004)
    if height > 0.55 and rng.random() < 0.5:
        _stool_back(b, rng, frame, cover, half, height)
    return b


def _stool_base(b: Builder, rng: Rng, frame: Material, half: float, top: float) -> None:
    """Carry a stool's seat, `half` wide from its middle, by a column or three or four legs."""
    if rng.random() < 0.35:
        foot = half * rng.uniform(0.9, 1.3)
        radii = [foot, foot, 0.3 * foot, 0.03, 0.03, 0.5 * half]
        heights = [0, 0.012, 0.035, 0.06, top - 0.03, top]
        b.lathe("leg", frame, np.column_stack([radii, heights]))
        if top > 0.5:
            ring = circle(count=24, radius=0.8 * half, height=0.35 * top)
            b.tube("leg", frame, [*ring, ring[0]], 0.009, segments=8)
            beam(b, "leg", frame, ring[0], ring[12], width=0.012, height=0.012)
        return
    count = int(rng.integers(3, 5))
    style, turn = draw_leg_style(rng, (0.026, 0.045), 0.0), 90.0 + 180.0 / count
    tops = circle(count, 0.72 * half, top, turn)
    feet = circle(count=count, radius=half * rng.uniform(0.85, 1.4), height=0.0, degrees=turn)
    add_legs(b, "leg", frame, style, tops, feet)
    for level in np.sort(rng.uniform(0.2, 0.6, int(rng.integers(0, 3)))):
        rails(b, "leg", frame, feet + level * (tops - feet), width=0.018, height=0.022)


def _stool_back(
    b: Builder, rng: Rng, frame: Material, cover: Material, half: float, top: float
) -> None:
    """Add a low curved backrest on two posts behind a stool's seat."""
    rise, tall = rng.uniform(0.16, 0.35), rng.uniform(0.06, 0.16)
    reach, spread = 1.02 * half, np.radians(rng.uniform(35, 75))
    for sign in (-1, 1):
        a = 0.6 * sign * spread
        foot = vec(0.85 * reach * np.sin(a), top - 0.02, 0.85 * reach * np.cos(a))
        head = vec(reach * np.sin(a), top + rise, reach * np.cos(a))
        b.cylinder("back", frame, foot, head, 0.011, segments=8)
    angles = np.linspace(-spread, spread, 11)
    heights = top + rise + np.linspace(-0.5, 0.5, 4) * tall
    grid = [[(reach * np.sin(a), y, reach * np.cos(a)) for a in angles] for y in heights]
    sheet(b, "back", cover, grid, rng.uniform(0.018, 0.035))
