"""Padded chairs."""

from __future__ import annotations

from dataclasses import replace

from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.kit.seat_backs import (
    add_arm,
    add_loose_back,
    add_tight_back,
    add_tufts,
    back_point,
)
from ffd_lightning.shapes.kit.upholstery import add_base, add_feet, add_seat_cushions, draw_seating
from ffd_lightning.shapes.kit.vectors import lean


def armchair(rng: Rng) -> Builder:
    """Build a padded chair with any arms, sometimes with wings beside a high back."""
    b = Builder()
    s = draw_seating(rng, 1)
    winged = s.arms != "open" and rng.random() < 0.35
    back = rng.uniform(0.55, 0.72) if winged else s.back
    s = replace(s, width=rng.uniform(0.48, 0.64), depth=rng.uniform(0.68, 0.86), back=back)
    add_base(b, s)
    add_seat_cushions(b, s, front=0.02)
    if rng.random() < 0.6 or winged:
        add_tight_back(b, s, s.width + 0.6 * s.arm)
        if rng.random() < 0.4:
            add_tufts(b, s, width=s.width, rows=int(rng.integers(3, 5)), columns=4)
    else:
        add_loose_back(b, s, rng.uniform(0.0, 0.12))
    for side in (-1, 1):
        add_arm(b, s, side)
        if winged:
            low, high = s.arm_rise - 0.05, 0.95 * s.back
            x, out = side * (s.width / 2 + 0.3 * s.arm), -rng.uniform(0.1, 0.14)
            turn = lean(s.rake)
            wing = (0.06, high - low, s.thick - 2 * out)
            center = back_point(s, x, (low + high) / 2, out)
            b.rounded_box("back", s.cover, center, wing, 0.03, turn=turn)
    add_feet(b, rng, s)
    return b
