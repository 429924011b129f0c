"""Telephones in two pieces: clamshells and sliders."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.cellphone.body import Body, add_half, lid_at, tile, upright
from ffd_lightning.shapes.cellphone.edges import aerial, camera, side_buttons
from ffd_lightning.shapes.cellphone.finish import Finish, draw_finish
from ffd_lightning.shapes.cellphone.front import display, earpiece, home_button, keypad, navigation
from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.kit.vectors import lean, vec


def flip(rng: Rng) -> Builder:
    """Build a clamshell, open by 105 to 178 degrees or shut, with a barrel hinge."""
    b = Builder()
    finish = draw_finish(rng)
    width, tall = rng.uniform(0.4, 0.6), rng.uniform(0.52, 0.6)
    depth, radius = rng.uniform(0.06, 0.12), width * rng.uniform(0.05, 0.3)
    opening = 0.0 if rng.random() < 0.2 else rng.uniform(105, 178)
    # The lid bends towards the viewer; the keys lean back so that the screen can be seen.
    fold = 180 - opening
    pose = lean(fold * rng.uniform(0.5, 1.0) if opening else 0.0)
    lower = Body(pose @ vec(0, tall / 2, 0), width, tall, depth, pose)
    hinge = lower.at(0, 0.5)
    tip, height = pose @ lean(-fold), tall * rng.uniform(0.9, 1.0)
    upper = lid_at(hinge, tip, width=width, height=height, depth=depth * rng.uniform(0.7, 1.0))
    for half in (lower, upper):
        add_half(b, rng, finish, half, radius)
    barrel = 0.5 * depth
    for x, part in ((-0.36, finish.body), (0.0, finish.trim), (0.36, finish.body)):
        reach = vec((0.2 if x == 0 else 0.1) * width, 0, 0)
        middle = hinge + vec(x * width, 0, 0)
        b.cylinder("body", part, middle - reach, middle + reach, barrel, segments=20)
    share, icons = rng.uniform(0.68, 0.82), rng.random() < 0.3
    display(b, rng, finish, upper, low=-0.28, high=0.32, share=share, icons=icons)
    earpiece(b, rng, upper, 0.4)
    navigation(b, rng, finish, lower, 0.26, rng.uniform(0.24, 0.34))
    share = rng.uniform(0.74, 0.84)
    keypad(b, rng, finish, lower, low=-0.44, high=0.08, share=share, rows=4, columns=3)
    outer = (0.5 * width, rng.uniform(0.15, 0.35) * tall, 0.014)
    if rng.random() < 0.7:
        spot = upper.behind(0, rng.uniform(-0.1, 0.2))
        tile(b, "screen", finish.screen, upper, spot, outer, 0.1 * width)
    if rng.random() < 0.4:
        aerial(b, rng, finish, lower, int(rng.choice([-1, 1])))
    side_buttons(b, rng, finish, lower)
    return b


def slider(rng: Rng) -> Builder:
    """Build a telephone whose screen half has slid up, or aside, from its keys."""
    b = Builder()
    finish = draw_finish(rng)
    aside = rng.random() < 0.4
    width = rng.uniform(0.44, 0.56)
    tall, depth = rng.uniform(0.82, 0.95), rng.uniform(0.05, 0.09)
    radius, slide = width * rng.uniform(0.04, 0.2), rng.uniform(0.3, 0.42)
    lower = upright(width, tall, depth)
    shift = vec(slide * 1.2 * width, 0, 0) if aside else vec(0, slide * tall, 0)
    upper = Body(lower.center + shift - vec(0, 0, 0.98 * depth), width, tall, depth, np.eye(3))
    for half in (lower, upper):
        add_half(b, rng, finish, half, radius)
    low, share = (-0.4, rng.uniform(0.82, 0.92))
    icons = bool(rng.random() < 0.5)
    display(b, rng, finish, upper, low=low + 0.14, high=0.4, share=share - 0.05, icons=icons)
    if rng.random() < 0.6:
        navigation(b, rng, finish, upper, low + 0.03, 0.24)
    else:
        home_button(b, rng, finish, upper, low, 0.09)
    earpiece(b, rng, upper, 0.45)
    if aside:
        _side_keys(b, rng, finish, lower, 1.2 * slide)
    else:
        keypad(b, rng, finish, lower, low=-0.46, high=slide - 0.53, share=0.82, rows=4, columns=3)
    side_buttons(b, rng, finish, lower)
    camera(b, rng, finish, lower)
    return b


def _side_keys(b: Builder, rng: Rng, finish: Finish, body: Body, share: float) -> None:
    """Fill the strip `share` of the width that a lid slid aside leaves free with small keys."""
    center = body.at(-0.5 + share / 2, 0, -body.depth / 2)
    strip = Body(center, share * body.width, body.height, body.depth, body.turn)
    rows = int(rng.integers(9, 12))
    keypad(b, rng, finish, strip, low=-0.44, high=0.44, share=0.84, rows=rows, columns=4)
