"""Projection televisions and wooden consoles."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, pick_material
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import Pair, Triple, lean, vec
from ffd_lightning.shapes.monitor.panel import Case, draw_case
from ffd_lightning.shapes.monitor.tube import add_bezel, add_bulged_screen


def projection(rng: Rng) -> Builder:
    """Build a floor-standing set: a big screen above a grille, or a wooden console on legs."""
    b = Builder()
    case = draw_case(rng)
    width, depth = rng.uniform(0.9, 1.4), rng.uniform(0.35, 0.55)
    console = rng.random() < 0.4
    body = pick_material(rng, "wood") if console else case.frame
    case = Case(body, case.back, case.stand, case.screen, case.accent)
    height = width * rng.uniform(0.6, 0.75)
    low = rng.uniform(0.12, 0.3) if console else rng.uniform(0.2, 0.5) * height
    border = rng.uniform(0.04, 0.08)
    y, lip = low + height / 2, 0.08
    hole = (width - 2 * border, height - 2 * border)
    if console:
        hole = (hole[0] - rng.uniform(0.25, 0.35) * width, hole[1])
    x = 0.0 if not console else (width - 2 * border - hole[0]) / 2
    size = (hole[0] + 0.02, hole[1] + 0.02)
    if console:
        b.rounded_box("frame", body, (0, y, depth / 2), (width, height, depth), 0.01)
        inner = vec(x, y, 0.0)
        b.rounded_box("frame", case.back, inner, (size[0], size[1], 0.03), 0.03)
        add_bulged_screen(b, case, (x, y, -0.015), (0.92 * size[0], 0.92 * size[1]), 0.03)
        _console_panel(b, rng, case, (border - width / 2, x - size[0] / 2), y=y, tall=hole[1])
        style = LegStyle("round", 0.05, ((0, 0.5), (0.5, 0.75), (1, 1)))
        tops = corners(0.85 * width, 0.75 * depth, low + 0.01, depth / 2)
        spread = (tops - vec(0, low + 0.01, depth / 2)) * rng.uniform(1.0, 1.1)
        spread = spread + vec(0, 0, depth / 2)
        add_legs(b, "base", body, style, tops, spread)
        return b
    add_bezel(b, case, (0, y, 0), (width, height), hole, 0.0, lip)
    add_bulged_screen(b, case, (0, y, 0.0), size, 0.0)
    _hood(b, rng, case, (width, height, depth), low)
    _grille(b, rng, case, (width, low), lip)
    return b


def _console_panel(b: Builder, rng: Rng, case: Case, span: Pair, y: float, tall: float) -> None:
    """Add dials above a loudspeaker cloth between the x of `span`, `tall` about `y`."""
    x, wide = sum(span) / 2, span[1] - span[0] - 0.04
    b.box("speaker", case.back, (x, y - 0.2 * tall, -0.004), (wide, 0.55 * tall, 0.015))
    for dy in np.linspace(-0.45, 0.05, int(rng.integers(5, 11))) * tall:
        b.box("speaker", case.accent, (x, y + dy, -0.008), (wide, 0.012, 0.015))
    for i in range(int(rng.integers(1, 3))):
        radius = min(0.35 * wide, 0.07)
        rows = [(radius, 0), (radius, 0.02), (0.6 * radius, 0.025), (0.55 * radius, 0.05)]
        spot = (x, y + (0.36 - 0.2 * i) * tall, 0.004)
        b.lathe("button", case.accent, rows, spot, segments=20, turn=lean(-90))


def _hood(b: Builder, rng: Rng, case: Case, size: Triple, low: float) -> None:
    """Add the sloping housing behind a projection screen of `size` (width, height, depth)."""
    width, height, depth = size
    peak, back = rng.uniform(0.4, 0.8), rng.uniform(0.6, 0.9)
    y, upper = low + 0.01, low + 0.98 * height
    profile = [(y, 0.02), (y, depth), (y + 0.25 * height, depth)]
    profile += [(upper, peak * 0.5 * depth), (upper, 0.02)]
    section = np.array(profile)
    rings = []
    for side in (-1, 1):
        reach = np.where(section[:, 1] > 0.5 * depth, 0.49 * back, 0.49)
        rings.append(np.stack([side * reach * width, section[:, 0], section[:, 1]], 1))
    b.loft("back", case.back, rings)


def _grille(b: Builder, rng: Rng, case: Case, size: Pair, lip: float) -> None:
    """Add the pedestal below a projection screen, `size` (width, height), with its loudspeakers."""
    width, height = size
    deep = rng.uniform(0.28, 0.34)
    inset = rng.uniform(0.0, 0.06)
    box = (width - inset, height + 0.01, deep)
    z = deep / 2 - lip / 2 + 0.01
    b.rounded_box("base", case.frame, (0, height / 2, z), box, 0.015)
    front = z - deep / 2
    for side in (-1, 1) if rng.random() < 0.6 else (0,):
        wide = 0.42 * width if side else 0.85 * width
        place = vec(side * 0.24 * width, 0.5 * height, front)
        b.box("speaker", case.back, place, (wide, 0.7 * height, 0.02))
        for dy in np.linspace(-0.3, 0.3, int(rng.integers(4, 10))) * height:
            b.box("speaker", case.accent, place + vec(0, dy, -0.006), (wide, 0.01, 0.016))
    for i in range(int(rng.integers(2, 6))):
        spot = vec((i - 2) * 0.05, 0.93 * height, front)
        b.cylinder("button", case.accent, spot, spot - vec(0, 0, 0.012), 0.012, segments=10)
