"""Flat screens of the desk: one, or several on one post."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.vectors import about_y, vec
from ffd_lightning.shapes.monitor.panel import add_panel, draw_case, draw_panel, moved
from ffd_lightning.shapes.monitor.stands import FEET, foot, neck, side_speaker


def desktop(rng: Rng) -> Builder:
    """Build a flat screen on a base with a neck, some turned upright or with side speakers."""
    b = Builder()
    case = draw_case(rng)
    upright = rng.random() < 0.12
    panel = draw_panel(rng, rng.uniform(0.5, 1.1), rng.uniform(-2, 15), upright)
    width = max(panel.width, 0.6 * panel.height)
    low = foot(b, rng, case, width, draw(rng, FEET, [0.4, 0.4, 0.2]))
    rise = low + panel.width * rng.uniform(0.05, 0.28) + panel.height / 2
    panel = moved(panel, vec(0, rise, -0.05 * width))
    add_panel(b, rng, case, panel)
    neck(b, rng, case, low, panel)
    if rng.random() < 0.25 and not upright:
        for side in (-1, 1):
            side_speaker(b, rng, case, panel, side)
    return b


def multiple(rng: Rng) -> Builder:
    """Build two to four panels, side by side, above each other or both, on one post."""
    b = Builder()
    case = draw_case(rng)
    panel = draw_panel(rng, rng.uniform(0.5, 0.7), 0.0)
    columns, rows = [(2, 1), (3, 1), (1, 2), (2, 2)][int(rng.choice(4, p=[0.4, 0.25, 0.2, 0.15]))]
    angle = rng.uniform(0, 25) if columns > 1 else 0.0
    low = foot(b, rng, case, (0.7 + 0.45 * columns) * panel.width, draw(rng, FEET))
    bottom = low + rng.uniform(0.05, 0.2) + panel.height / 2
    bar = 2.2 * panel.thickness + 0.03
    step = 1.03 * panel.width
    levels = bottom + np.arange(rows) * 1.04 * panel.height
    for y in levels:
        for offset in np.arange(columns) - (columns - 1) / 2:
            swing = np.radians(angle * offset)  # each outer edge comes towards the viewer
            inner = max(abs(offset) - 0.5, 0.0)
            x = np.sign(offset) * step * (inner + 0.5 * np.cos(swing))
            place = vec(x, y, -0.5 * step * np.sin(abs(swing)))
            turned = moved(panel, place, about_y(angle * offset))
            add_panel(b, rng, case, turned)
            knob = turned.at(0, 0, 0.3 * panel.thickness)
            beam(b, "stand", case.stand, knob, (0.8 * x, y, bar), width=0.03, height=0.05)
        if columns > 1:
            reach = 0.4 * columns * (columns - 1) / 2 * step
            start = (-reach, y, bar)
            beam(b, "stand", case.stand, start, (reach, y, bar), width=0.025, height=0.04)
    b.cylinder("stand", case.stand, (0, 0.3 * low, bar), (0, levels[-1] + 0.06, bar), 0.022)
    b.rounded_box("base", case.stand, (0, low / 2, bar), (0.12, low, 0.1), 0.01)
    return b
