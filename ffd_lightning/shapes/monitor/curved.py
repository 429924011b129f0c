"""Screens bent around the viewer."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import vec
from ffd_lightning.shapes.monitor.panel import draw_case
from ffd_lightning.shapes.monitor.stands import FEET, foot


def curved(rng: Rng) -> Builder:
    """Build a wide screen bent around the viewer, on a V-shaped or flat foot."""
    b = Builder()
    case = draw_case(rng)
    width, ratio = rng.uniform(0.8, 1.3), rng.uniform(0.36, 0.6)
    height, sag = width * ratio, rng.uniform(0.06, 0.16) * width
    thickness, bezel = rng.uniform(0.02, 0.05), rng.uniform(0.008, 0.03)
    low = foot(b, rng, case, width, draw(rng, FEET))
    bottom = low + rng.uniform(0.03, 0.16)
    u, v = np.linspace(-0.5, 0.5, 17), np.linspace(0, 1, 5)

    def bent(inset: float, z: float) -> np.ndarray:
        x = u * (width - 2 * inset)
        y = bottom + inset + v * (height - 2 * inset)
        depth = z - sag * (x / (0.5 * width)) ** 2
        grid = [np.broadcast_to(a, (len(v), len(u))) for a in (x, y[:, None], depth)]
        return np.stack(grid, -1)

    sheet(b, "frame", case.frame, bent(0.0, 0.0), thickness)
    sheet(b, "screen", case.screen, bent(bezel, -thickness / 2), 0.006)
    sheet(b, "back", case.back, bent(0.16 * height, 0.7 * thickness), thickness)
    size = (rng.uniform(0.15, 0.35) * width, 0.5 * height, 0.05)
    middle = vec(0, bottom + 0.5 * height, 1.3 * thickness)
    b.rounded_box("back", case.back, middle, size, 0.02)
    start, end = vec(0, 0.4 * low, middle[2] + 0.07), middle + vec(0, 0, 0.01)
    beam(b, "stand", case.stand, start, end, width=rng.uniform(0.05, 0.14), height=0.03)
    for i in range(int(rng.integers(1, 5))):
        spot = vec(0.06 * i - 0.1, bottom + 0.4 * bezel, -0.4 * thickness)
        tip = spot - vec(0, 0, 0.2 * thickness)
        b.cylinder("button", case.accent, spot, tip, 0.3 * bezel, segments=8)
    return b
