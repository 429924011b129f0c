"""Chairs hung from one bent tube."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, pick_material
from ffd_lightning.shapes.kit.boards import pad
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.upholstery import draw_cover
from ffd_lightning.shapes.kit.vectors import UP, lean, vec


def cantilever(rng: Rng) -> Builder:
    """Build a chair hung from one bent tube without rear legs."""
    b = Builder()
    metal, cover = pick_material(rng, "metal"), draw_cover(rng)
    half, seat = rng.uniform(0.2, 0.26), rng.uniform(0.42, 0.48)
    front, rear = -rng.uniform(0.2, 0.27), rng.uniform(0.18, 0.24)
    rise, degrees = rng.uniform(0.32, 0.55), rng.uniform(6, 20)
    r, slope = rng.uniform(0.011, 0.018), rng.uniform(0.0, 0.05)
    tip = lean(degrees) @ vec(0, rise, 0)
    left = [(-half, seat + tip[1] - slope, rear + tip[2]), (-half, seat - slope, rear)]
    left += [(-half, seat, front), (-half, r, front + rng.uniform(-0.03, 0.06))]
    left += [(-half, r, rear + rng.uniform(0.0, 0.08))]
    right = [(-x, y, z) for x, y, z in left[::-1]]
    b.tube("leg", metal, bend(left + right, rng.uniform(0.05, 0.12)), r, segments=10)
    thickness = rng.uniform(0.015, 0.07)
    pitch = np.degrees(np.arctan2(slope, rear - front))
    size = (2 * half - 0.5 * r, thickness, 0.97 * (rear - front))
    middle = (0, seat - slope / 2 + 0.3 * thickness, (front + rear) / 2)
    b.rounded_box("seat", cover, middle, size, 0.05, turn=lean(pitch))
    low = rng.uniform(0.2, 0.55) * rise
    center = lean(degrees) @ vec(0, (low + rise) / 2, -0.2 * thickness)
    panel = (2 * half + 2 * r, rise - low + 0.03, max(0.03, thickness))
    pad(b, "back", cover, center + (seat - slope) * UP + vec(0, 0, rear), panel, 0.04, degrees)
    if rng.random() < 0.5:
        level, wood = rng.uniform(0.17, 0.24), pick_material(rng, "wood")
        z = rear + np.tan(np.radians(degrees)) * (level + slope)
        for x in (-half - r, half + r):
            path = [(x, seat + level, z), (x, seat + level, front + 0.06), (x, seat, front + 0.08)]
            b.tube("arm", metal, bend(path, 0.06), r, segments=8)
            rest = (0.035, 0.022, 0.6 * (z - front))
            b.rounded_box("arm", wood, (x, seat + level + r, (z + front) / 2), rest, 0.012)
    return b
