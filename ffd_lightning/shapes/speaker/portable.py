"""Portable speakers."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import UP, about_y, about_z, lean, vec
from ffd_lightning.shapes.speaker.drivers import (
    FORWARD,
    Finish,
    add_driver,
    draw_cloth,
    draw_finish,
)
from ffd_lightning.shapes.speaker.enclosure import Cabinet, Units, add_cabinet, row_of_bays
from ffd_lightning.shapes.speaker.fittings import add_feet, add_handle, add_knobs

SIDEWAYS = about_z(-90)
"""Turns what is upright so that it points to +x."""


def portable(rng: Rng) -> Builder:
    """Build a lying or upright tube in cloth, or a boombox with a handle."""
    b, finish = Builder(), draw_finish(rng)
    kind = draw(rng, ["tube", "can", "boombox"], [0.3, 0.25, 0.45])
    if kind == "boombox":
        _boombox(b, rng, finish)
        return b
    radius, half = rng.uniform(0.04, 0.07), rng.uniform(0.05, 0.14)
    cloth = pick_material(rng, "fabric") if rng.random() < 0.6 else draw_cloth(rng)
    turn, center = (SIDEWAYS, radius * UP) if kind == "tube" else (np.eye(3), (half + 0.012) * UP)
    rows = [(radius, -0.93 * half), (radius, 0.0), (radius, 0.93 * half)]
    b.lathe("grille", cloth, rows, center, segments=36, turn=turn)
    for sign in (-1, 1):
        flip = turn @ lean(0 if sign > 0 else 180)
        cap = [(1.03, 0.88), (1.05, 0.94), (1.0, 1.0), (0.85, 1.03), (0.8, 0.99)]
        b.lathe("body", finish.body, np.array(cap) * (radius, half), center, segments=36, turn=flip)
    if kind == "tube":
        for sign in (-1, 1):
            out = about_y(90.0 * -sign)
            middle = center + vec(sign * 1.1 * half, 0, 0)
            add_driver(b, finish, "woofer", middle, 0.75 * radius, out)
            foot = (0.25 * half, 0.3 * radius, radius)
            b.rounded_box("stand", finish.rim, (sign * 0.5 * half, 0.1 * radius, 0), foot, 0.01)
    else:
        b.lathe("stand", finish.rim, [(0.8 * radius, 0), (0.9 * radius, 0.02)], segments=32)
        rows = [(0.5 * radius, 0), (0.5 * radius, 0.008), (0.42 * radius, 0.012)]
        b.lathe("panel", finish.rim, rows, (0, 2.02 * half + 0.012, 0))
    if rng.random() < 0.5:
        ends = np.array([(-0.6, 0, 0), (0.6, 0, 0)]) * (half if kind == "tube" else radius)
        rise = 0.94 * radius if kind == "tube" else half
        add_handle(b, finish.rim, ends + center + rise * UP, rng.uniform(0.03, 0.07), 0.005)
    return b


def _boombox(b: Builder, rng: Rng, finish: Finish) -> None:
    """Add a wide box with two or four drivers around a panel, knobs above, and a handle."""
    wide, tall, deep = rng.uniform(0.4, 0.65), rng.uniform(0.18, 0.32), rng.uniform(0.1, 0.16)
    cabinet = Cabinet(
        width=wide, height=tall, depth=deep, foot=(0, 0.012, 0), bevel=rng.uniform(0.008, 0.025)
    )
    side: Units = [("woofer", tall * rng.uniform(0.3, 0.44))]
    if rng.random() < 0.4:
        side.insert(0, ("tweeter", 0.12 * tall))
    space = ("blank", 0.45 * tall)
    bays = row_of_bays(cabinet.face, [*side, space, *side[::-1]], across=True)
    add_cabinet(b, cabinet, finish, bays)
    add_feet(b, finish.rim, wide, deep, 0.012)
    metal, y = pick_material(rng, "metal"), 0.012 + tall / 2
    size = (0.75 * tall, 0.02, rng.uniform(0.3, 0.6) * tall)
    center = (0, y - 0.08 * tall, 0)
    b.rounded_box("panel", metal, center, size, radius=0.01, edge=0.004, turn=FORWARD)
    window = (0.8 * size[0], 0.012, 0.5 * size[2])
    pane = (0, y - 0.08 * tall, -0.008)
    b.rounded_box("panel", finish.rim, pane, window, radius=0.006, edge=0.003, turn=FORWARD)
    ends = [(x * tall, y + 0.38 * tall, -0.002) for x in (-0.3, 0.3)]
    add_knobs(b, metal, ends, 0.05 * tall, int(rng.integers(2, 6)))
    reach = rng.uniform(0.3, 0.46) * wide
    top = np.array([(x, 0.008 + tall, deep / 2) for x in (-reach, reach)])
    add_handle(b, finish.rim, top, rng.uniform(0.04, 0.09), 0.009)
