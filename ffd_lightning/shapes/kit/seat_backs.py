"""Backs and arms of padded seats. Metres."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder
from ffd_lightning.shapes.kit.boards import beam, pad
from ffd_lightning.shapes.kit.upholstery import Seating
from ffd_lightning.shapes.kit.vectors import Array, about_z, lean, vec


def back_point(s: Seating, x: float, rise: float, out: float = 0.0) -> Array:
    """Return the point at `x`, `rise` above the seat along the back, `out` behind its middle."""
    foot = vec(0, s.seat, s.depth / 2 - 0.55 * s.thick)
    return foot + lean(s.rake) @ vec(x, rise, out)


def add_tight_back(b: Builder, s: Seating, width: float) -> None:
    """Add one padded panel as the back."""
    low = -0.5 * s.seat
    size = (width, s.back - low, s.thick)
    pad(b, "back", s.cover, back_point(s, 0, (s.back + low) / 2), size, 0.4 * s.thick, s.rake)


def add_loose_back(b: Builder, s: Seating, overhang: float) -> None:
    """Add a thin panel and a cushion per seat before it, `overhang` higher than the panel."""
    low, rise, wide = -0.5 * s.seat, s.back - overhang, s.width / s.seats
    panel = (s.width + s.arm, rise - low, 0.5 * s.thick)
    center = back_point(s, 0, (rise + low) / 2, 0.25 * s.thick)
    pad(b, "back", s.cover, center, panel, 0.04, s.rake)
    for i in range(s.seats):
        x = (i + 0.5) * wide - s.width / 2
        size = (0.98 * wide, s.back + 0.01, 0.85 * s.thick)
        at = back_point(s, x, s.back / 2, -0.35 * s.thick)
        pad(b, "back", s.pillows, at, size, 0.07, s.rake + 3)


def add_tufts(b: Builder, s: Seating, width: float, rows: int, columns: int) -> None:
    """Add staggered buttons on the front of a tight back."""
    for row in range(rows):
        shift = 0.5 * (row % 2)
        for column in range(columns - row % 2):
            x = ((column + shift + 0.5) / columns - 0.5) * width
            at = back_point(s, x, s.back * (0.25 + 0.6 * row / max(rows - 1, 1)), -0.5 * s.thick)
            button = [(0.011, -0.005), (0.014, 0.0), (0.008, 0.007)]
            b.lathe("back", s.frame, button, at, segments=8, turn=lean(s.rake - 90))


def add_arm(b: Builder, s: Seating, side: int, depth: float | None = None) -> None:
    """Add the arm on `side` (-1 or 1), as deep as the sofa unless told otherwise."""
    deep = 0.97 * s.depth if depth is None else depth
    x, z = side * (s.width + s.arm) / 2, s.depth / 2 - deep / 2
    top, low = s.seat + s.arm_rise, s.foot
    middle, size = (x, (top + low) / 2, z), (s.arm, top - low, deep)
    if s.arms == "box":
        b.rounded_box("arm", s.cover, middle, size, 0.12 * s.arm)
    elif s.arms == "padded":
        b.rounded_box("arm", s.cover, middle, (0.9 * s.arm, top - low, 0.98 * deep), 0.02)
        soft = (1.1 * s.arm, 0.5 * s.arm, deep)
        b.rounded_box("arm", s.cover, (x, top, z), soft, 0.25 * s.arm)
    elif s.arms == "rolled":
        r = 0.58 * s.arm
        b.rounded_box("arm", s.cover, middle, (0.8 * s.arm, top - low, 0.98 * deep), 0.02)
        axis = vec(x + side * 0.15 * s.arm, top - 0.3 * r, z)
        half = vec(0, 0, deep / 2)
        b.cylinder("arm", s.cover, axis - half, axis + half, r)
    elif s.arms == "slope":
        _sloping_arm(b, s, x, z, deep)
    elif s.arms == "flare":
        turn = about_z(-side * 11.0)
        b.rounded_box("arm", s.cover, (x, *middle[1:]), (0.8 * s.arm, *size[1:]), 0.03, turn=turn)
    else:
        _open_arm(b, s, x)


def _sloping_arm(b: Builder, s: Seating, x: float, z: float, deep: float) -> None:
    """Add an arm whose top swings down from the back to the seat at the front."""
    t = np.linspace(0, 1, 9)
    tops = s.seat + 0.02 + (s.arm_rise + 0.12) * (1 - np.cos(np.pi * t)) / 2
    rings = []
    for fraction, top in zip(t, tops, strict=True):
        flat = np.array([(-0.5, 0), (0.5, 0), (0.5, 0.93), (0.36, 1), (-0.36, 1), (-0.5, 0.93)])
        xy = flat * np.array([s.arm, top - s.foot]) + np.array([x, s.foot])
        rings.append(np.column_stack([xy, np.full(6, z + (fraction - 0.5) * deep)]))
    b.loft("arm", s.cover, rings)


def _open_arm(b: Builder, s: Seating, x: float) -> None:
    """Add a wooden or metal arm: two uprights from the floor and a rest."""
    top, side = s.seat + s.arm_rise, 0.9 * s.arm
    front, rear = -0.42 * s.depth, 0.42 * s.depth
    for z in (front, rear):
        beam(b, "arm", s.frame, (x, 0, z), (x, top, z), width=0.7 * side, height=0.7 * side)
    start = (x, s.foot + 0.06, front)
    beam(b, "arm", s.frame, start, (x, s.foot + 0.06, rear), width=0.5 * side, height=side)
    rest = (1.3 * side, 0.03, rear - front + 0.12)
    b.rounded_box("arm", s.frame, (x, top, 0), rest, 0.4 * side)
