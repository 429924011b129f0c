"""Sofas around a corner."""

from __future__ import annotations

from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.seat_backs import add_arm, add_loose_back
from ffd_lightning.shapes.kit.upholstery import (
    Seating,
    add_base,
    add_feet,
    add_seat_cushions,
    draw_seating,
)
from ffd_lightning.shapes.kit.vectors import UP, vec
from ffd_lightning.shapes.sofa.pillows import throw_pillows


def sectional(rng: Rng) -> Builder:
    """Build a sofa with a chaise or a second row of seats along one side."""
    b = Builder()
    s = draw_seating(rng, int(rng.integers(2, 5)), arms=("box", "padded", "slope"))
    side, reach = int(rng.choice([-1, 1])), rng.uniform(0.5, 1.3)
    add_base(b, s)
    add_seat_cushions(b, s)
    add_loose_back(b, s, rng.uniform(0.0, 0.12))
    wide = s.width / s.seats
    x, z = side * (s.width - wide) / 2, -s.depth / 2 - reach / 2
    top = s.seat - 0.8 * s.cushion
    size = (wide + 0.04, top - s.foot, reach + 0.08)
    b.rounded_box("seat", s.cover, (x, (top + s.foot) / 2, z + 0.04), size, 0.03)
    parts = 1 if reach < 0.8 else 2
    for i in range(parts):
        at = (x, s.seat - s.cushion / 2, -s.depth / 2 - (i + 0.5) * reach / parts)
        cushion = (0.98 * wide, s.cushion, 0.99 * reach / parts)
        b.rounded_box("seat", s.pillows, at, cushion, radius=0.05, edge=0.4 * s.cushion)
    full = parts == 2 or rng.random() < 0.4
    add_arm(b, s, -side)
    deep = s.depth + reach if full else 0.97 * s.depth
    if parts == 2:
        _side_back(b, s, side, deep)
    else:
        add_arm(b, s, side, deep)
    end = corners(wide - 0.1, 0.0, 0.0)[:2] + vec(x, 0, z - reach / 2 + 0.08)
    style = LegStyle("square", 0.05, ((0.0, 0.8), (1.0, 1.0)))
    add_legs(b, "leg", s.frame, style, end + (s.foot + 0.02) * UP, end)
    add_feet(b, rng, s)
    throw_pillows(b, rng, s)
    return b


def _side_back(b: Builder, s: Seating, side: int, deep: float) -> None:
    """Add a back along the side of an L, as high as the main one."""
    x, z = side * (s.width + s.arm) / 2, s.depth / 2 - deep / 2
    top = s.seat + 0.9 * s.back
    size = (s.arm, top - s.foot, deep)
    b.rounded_box("back", s.cover, (x, (top + s.foot) / 2, z), size, 0.04)
