"""Garden chairs of boards."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, slats
from ffd_lightning.shapes.kit.legs import add_leg, square_post
from ffd_lightning.shapes.kit.vectors import lean, vec


def slatted(rng: Rng) -> Builder:
    """Build a low garden chair of boards with broad arms and a raked, fanned back."""
    b = Builder()
    wood = pick_material(rng, draw(rng, ["wood", "paint"], [0.6, 0.4]))
    half, front = rng.uniform(0.24, 0.32), rng.uniform(0.32, 0.4)
    drop, depth = rng.uniform(0.06, 0.16), rng.uniform(0.45, 0.56)
    rise, degrees, board = rng.uniform(0.5, 0.8), rng.uniform(15, 32), 0.02
    pitch = np.degrees(np.arctan2(drop, depth))
    turn, start = lean(pitch), vec(0, front, -depth / 2)
    end = start + turn @ vec(0, 0, depth)
    count = int(rng.integers(5, 9))
    gap = depth / count
    first, last = start + 0.4 * gap * turn[:, 2], end - 0.4 * gap * turn[:, 2]
    slats(b, "seat", wood, first, last, (2 * half, board, 0.8 * gap), count, turn)
    tilt, planks = lean(degrees), int(rng.integers(4, 8))
    fan, arch = rng.uniform(0.0, 0.25), rng.uniform(0.0, 0.18)
    for i in range(planks):
        u = (i + 0.5) / planks * 2 - 1
        tall = rise * (1 - arch * u * u)
        low = end + tilt @ vec(u * half * 0.95, -0.03, 0)
        high = end + tilt @ vec(u * half * (0.95 + fan), tall, 0)
        beam(b, "back", wood, low, high, width=board, height=1.6 * half / planks)
    arm = front + rng.uniform(0.16, 0.24)
    level = (arm - end[1]) / np.cos(np.radians(degrees))
    for up in (0.75 * rise, level):
        center = end + tilt @ vec(0, up, 0.018)
        b.rounded_box("back", wood, center, (2 * half + 0.1, 0.06, board), 0.005, turn=tilt)
    rear = float((end + tilt @ vec(0, level, 0))[2])
    post = square_post(0.06)
    rest = (rng.uniform(0.08, 0.14), 0.024, rear + 0.1 + depth / 2)
    for side in (-1, 1):
        x = side * (half + 0.04)
        b.rounded_box("arm", wood, (x, arm, (rear + 0.02 - depth / 2) / 2), rest, 0.03)
        for z in (-depth / 2 + 0.02, rear):
            add_leg(b, "leg", wood, post, (x, arm - 0.005, z), (x, 0, z), (0.5, 1.3))
        inner = side * (half + 0.01)
        rail = (inner, front - 0.06, -depth / 2), (inner, end[1] - 0.06, rear + 0.02)
        beam(b, "seat", wood, *rail, width=0.025, height=0.09)
    return b
