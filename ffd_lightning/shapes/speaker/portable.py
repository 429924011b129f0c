"""Portable speakers."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import UP, about_y, about_z, lean, vec
from ffd_lightning.shapes.speaker.boxes import Cabinet, Units, add_cabinet
from ffd_lightning.shapes.speaker.drivers import Finish, add_driver, draw_cloth, draw_finish
from ffd_lightning.shapes.speaker.fittings import add_feet, add_handle, add_knobs


def portable(b: Builder, rng: Rng) -> None:
    """Build a lying or upright tube in cloth, or a boombox with a handle."""
    finish, kind = draw_finish(rng), draw(rng, ["tube", "can", "boombox"], [0.3, 0.25, 0.45])
    if kind == "boombox":
        _boombox(b, rng, finish)
        return
    radius, half = rng.uniform(0.04, 0.07), rng.uniform(0.05, 0.14)
    cloth = pick_material(rng, "fabric") if rng.random() < 0.6 else draw_cloth(rng)
    turn, center = np.eye(3), (half + 0.012) * UP
    if kind == "tube":  # its axis points to +x
        turn, center = about_z(-90), radius * UP
    rows = [(radius, -0.93 * half), (radius, 0.0), (radius, 0.93 * half)]
    b.lathe("grille", cloth, rows, center, segments=36, turn=turn)
    cap = [(1.03, 0.88), (1.05, 0.94), (1.0, 1.0), (0.85, 1.03), (0.8, 0.99)]
    cap_rows = np.array(cap) * (radius, half)
    for degrees in (180, 0):
        b.lathe("body", finish.body, cap_rows, center, segments=36, turn=turn @ lean(degrees))
    if kind == "tube":
        for sign in (-1, 1):
            middle = center + vec(sign * 1.1 * half, 0, 0)
            add_driver(b, finish, "woofer", middle, 0.75 * radius, about_y(90.0 * -sign))
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


def _boombox(b: Builder, rng: Rng, finish: Finish) -> None:
    """Add a wide box with two or four drivers around a panel, knobs above, and a handle."""
    wide, tall, deep = rng.uniform(0.4, 0.65), rng.uniform(0.18, 0.32), rng.uniform(0.1, 0.16)
    cabinet = Cabinet(wide, tall, deep, (0, 0.012, 0), bevel=rng.uniform(0.008, 0.025))
    side: Units = [("woofer", tall * rng.uniform(0.3, 0.44))]
    if rng.random() < 0.4:
        side.insert(0, ("tweeter", 0.12 * tall))
    units = [*side, ("blank", 0.45 * tall), *side[::-1]]
    add_cabinet(b, cabinet, finish, cabinet.bays(units, across=True))
    add_feet(b, finish.rim, cabinet)
    metal, y = pick_material(rng, "metal"), 0.012 + tall / 2
    size = (0.75 * tall, 0.02, rng.uniform(0.3, 0.6) * tall)
    center, pane = (0, y - 0.08 * tall, 0), (0, y - 0.08 * tall, -0.008)
    b.rounded_box("panel", metal, center, size, radius=0.01, edge=0.004, turn=lean(-90))
    window = (0.8 * size[0], 0.012, 0.5 * size[2])
    b.rounded_box("panel", finish.rim, pane, window, radius=0.006, edge=0.003, turn=lean(-90))
    ends = [(x * tall, y + 0.38 * tall, -0.002) for x in (-0.3, 0.3)]
    add_knobs(b, metal, ends, 0.05 * tall, int(rng.integers(2, 6)))
    reach = rng.uniform(0.3, 0.46) * wide
    top = [(x, 0.008 + tall, deep / 2) for x in (-reach, reach)]
    add_handle(b, finish.rim, top, rng.uniform(0.04, 0.09), 0.009)
