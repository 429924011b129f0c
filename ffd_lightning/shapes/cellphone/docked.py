"""Cordless handsets in their cradles."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.cellphone.body import Body, shell, upright
from ffd_lightning.shapes.cellphone.edges import aerial
from ffd_lightning.shapes.cellphone.finish import draw_finish
from ffd_lightning.shapes.cellphone.front import display, earpiece, keypad, navigation
from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.kit.vectors import about_y, lean, vec


def docked(rng: Rng) -> Builder:
    """Build a slender cordless handset, tipped back in its charging cradle."""
    b = Builder()
    finish = draw_finish(rng)
    width = rng.uniform(0.26, 0.38)
    body = upright(width, 1.0, width * rng.uniform(0.35, 0.6))
    tip = lean(rng.uniform(5, 25))
    body = Body(tip @ vec(0, 0.55, 0), width, 1.0, body.depth, tip)
    waist, square = rng.uniform(-0.1, 0.15), rng.uniform(3, 6)
    shell(b, rng, "body", finish.body, body, waist=waist, squareness=square, palm=0.3)
    split = rng.uniform(0.02, 0.12)
    display(b, rng, finish, body, low=split, high=split + rng.uniform(0.14, 0.24), share=0.72)
    navigation(b, rng, finish, body, split - 0.07, 0.3)
    rows = int(rng.integers(4, 6))
    keypad(b, rng, finish, body, low=-0.3, high=split - 0.14, share=0.74, rows=rows, columns=3)
    earpiece(b, rng, body, 0.42)
    if rng.random() < 0.5:
        aerial(b, rng, finish, body, int(rng.choice([-1, 1])))
    reach, rise = width * rng.uniform(0.75, 1.2), rng.uniform(0.1, 0.24)
    rim = max(0.62 * width, 0.8 * body.depth)
    profile = [(reach, 0), (reach, 0.03), (0.5 * (reach + rim), 0.55 * rise), (rim, rise)]
    profile += [(0.9 * rim, 0.98 * rise), (0.85 * rim, 0.4 * rise)]
    center = (0, 0, 0.1 * body.depth)
    squash = rng.uniform(0.75, 1.0)
    if rng.random() < 0.5:
        b.lathe("stand", finish.back, profile, center, segments=36, squash=squash)
    else:
        turn = about_y(45)
        b.lathe("stand", finish.back, np.array(profile) * (1.25, 1), center, segments=4, turn=turn)
    return b
