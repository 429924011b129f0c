"""Pillows thrown on sofas."""

from __future__ import annotations

from ffd_lightning.shapes.kit import Builder, Rng, pick_material
from ffd_lightning.shapes.kit.boards import pad
from ffd_lightning.shapes.kit.seat_backs import back_point
from ffd_lightning.shapes.kit.upholstery import Seating


def throw_pillows(b: Builder, rng: Rng, s: Seating) -> None:
    """Throw up to three small pillows against the back."""
    for _ in range(int(rng.integers(0, 4)) if rng.random() < 0.5 else 0):
        size, x = rng.uniform(0.3, 0.42), rng.uniform(-0.38, 0.38) * s.width
        at = back_point(s, x, 0.46 * size, -0.95 * s.thick)
        cover = pick_material(rng, "fabric")
        pad(b, "back", cover, at, (size, size, 0.11), 0.06, s.rake + 12)
