"""Sofas whose back rises and falls: camelbacks and chaises longues."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, pick_material
from ffd_lightning.shapes.kit.seat_backs import add_arm, back_point
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.upholstery import (
    Seating,
    add_base,
    add_feet,
    add_seat_cushions,
    draw_seating,
)
from ffd_lightning.shapes.kit.vectors import Array, vec
from ffd_lightning.shapes.sofa.pillows import throw_pillows


def _back_grid(s: Seating, xs: Array, rises: Array) -> Array:
    """Return the points of a back, (n, m, 3), at `xs` (m,) and `rises` (n, m) above the seat."""
    return np.array([[back_point(s, x, y) for x, y in zip(xs, row, strict=True)] for row in rises])


def camelback(rng: Rng) -> Builder:
    """Build a sofa with an arched or double-arched back on visible legs."""
    b = Builder()
    s = draw_seating(rng, int(rng.integers(2, 4)), arms=("rolled", "slope", "padded"))
    s = replace(s, foot=rng.uniform(0.1, 0.22), back=rng.uniform(0.28, 0.42))
    add_base(b, s)
    add_seat_cushions(b, replace(s, seats=1) if rng.random() < 0.5 else s)
    humps, swell = int(rng.integers(1, 4)), rng.uniform(0.08, 0.2)
    u = np.linspace(-1, 1, 33)
    arch = np.abs(np.sin(np.pi * humps * (u + 1) / 2)) ** (2 if humps == 1 else 0.7)
    tops = s.back + swell * arch
    width = (s.width + s.arm) / 2
    rows = np.linspace(0, 1, 7)[:, None] * (tops + 0.2) - 0.2
    grid = _back_grid(s, u * width, rows)
    sheet(b, "back", s.cover, grid, 0.8 * s.thick)
    for side in (-1, 1):
        add_arm(b, s, side)
    add_feet(b, rng, s)
    throw_pillows(b, rng, s)
    return b


def chaise(rng: Rng) -> Builder:
    """Build a long seat with a head end, and a back that falls away along one side."""
    b = Builder()
    s = draw_seating(rng, 1, arms=("rolled", "flare", "box"))
    s = replace(s, width=rng.uniform(1.25, 1.75), depth=rng.uniform(0.6, 0.78))
    s = replace(s, arm_rise=rng.uniform(0.22, 0.42), thick=rng.uniform(0.1, 0.16), rake=4.0)
    head = int(rng.choice([-1, 1]))
    add_base(b, s)
    cushion = (s.width + 0.5 * s.arm, s.cushion, s.depth - s.thick)
    at = (-head * 0.25 * s.arm, s.seat - s.cushion / 2, -0.5 * s.thick)
    b.rounded_box("seat", s.pillows, at, cushion, radius=0.1, edge=0.4 * s.cushion)
    add_arm(b, s, head)
    length = rng.uniform(0.45, 0.95)
    low, fall = rng.uniform(0.06, 0.15), rng.uniform(0.7, 2.0)
    u = np.linspace(0, 1, 21)
    edge = head * (s.width / 2 + 0.5 * s.arm)
    xs = edge - head * u * length * (s.width + 0.3 * s.arm)
    tops = low + (s.arm_rise - low) * (0.5 + 0.5 * np.cos(np.pi * u**fall))
    rows = np.linspace(0, 1, 6)[:, None] * (tops + 0.1) - 0.1
    grid = _back_grid(s, xs, rows)
    sheet(b, "back", s.cover, grid, 0.8 * s.thick)
    add_feet(b, rng, s, s.width)
    if rng.random() < 0.5:
        r = rng.uniform(0.07, 0.1)
        mid = vec(head * (s.width / 2 - r), s.seat + r, -0.3 * s.thick)
        half = vec(0, 0, 0.4 * s.depth)
        b.cylinder("arm", pick_material(rng, "fabric"), mid - half, mid + half, r)
    return b
