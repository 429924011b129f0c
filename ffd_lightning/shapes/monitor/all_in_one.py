"""Screens with a computer in them."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import lean, vec
from ffd_lightning.shapes.monitor.panel import Case, Panel, add_panel, draw_case, draw_panel, moved


def all_in_one(rng: Rng) -> Builder:
    """Build a screen with a deep chin on a bent sheet or a hoop, some with a keyboard."""
    b = Builder()
    case = draw_case(rng)
    panel = draw_panel(rng, rng.uniform(0.5, 0.8), rng.uniform(2, 18), chin=rng.uniform(0.04, 0.13))
    gap = rng.uniform(0.06, 0.2)
    panel = moved(panel, vec(0, panel.height / 2 + gap, 0))
    add_panel(b, rng, case, panel)
    wide, deep = rng.uniform(0.2, 0.5) * panel.width, rng.uniform(0.12, 0.22)
    thickness = rng.uniform(0.008, 0.02)
    hold = panel.at(0, rng.uniform(-0.25, 0.0), 0.7 * panel.thickness)
    heel = vec(0, thickness / 2, hold[2] + rng.uniform(0.04, 0.12))
    toe = vec(0, thickness / 2, heel[2] - 1.6 * deep)
    path = bend([hold, heel, toe], 0.06)
    if rng.random() < 0.6:
        sides = np.array([[-wide / 2, 0, 0], [wide / 2, 0, 0]])
        sheet(b, "stand", case.stand, path[:, None] + sides[None], thickness)
    else:
        for x in (-wide / 2, wide / 2):
            b.tube("stand", case.stand, path + vec(x, 0, 0), thickness / 2 + 0.002, segments=10)
        bar = np.array([[-wide / 2, 0, 0], [wide / 2, 0, 0]])
        b.tube("base", case.stand, toe + bar, thickness / 2 + 0.002, segments=10)
    if rng.random() < 0.35:
        _keyboard(b, rng, case, panel, toe[2])
    return b


def _keyboard(b: Builder, rng: Rng, case: Case, panel: Panel, z: float) -> None:
    """Lay a keyboard in front of a screen whose stand ends at `z`."""
    wide, deep = rng.uniform(0.6, 0.85) * panel.width, rng.uniform(0.13, 0.18)
    center = vec(0, 0.012, z - 0.05 - deep / 2)
    tip = lean(-4)
    b.rounded_box("base", case.frame, center, (wide, 0.018, deep), 0.015, turn=tip)
    for i in range(4):
        row = (0.94 * wide, 0.008, 0.17 * deep)
        place = center + tip @ vec(0, 0.011, (i - 1.5) * 0.22 * deep)
        b.rounded_box("button", case.back, place, row, 0.004, turn=tip, segments=1)
