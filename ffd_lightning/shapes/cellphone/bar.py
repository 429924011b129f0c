"""Telephones in one piece with keys: candy bars and those with a full keyboard."""

from __future__ import annotations

from ffd_lightning.shapes.cellphone.body import add_half, shell, upright
from ffd_lightning.shapes.cellphone.edges import aerial, camera, side_buttons
from ffd_lightning.shapes.cellphone.finish import draw_finish
from ffd_lightning.shapes.cellphone.front import display, earpiece, keypad, navigation
from ffd_lightning.shapes.kit import Builder, Rng


def candybar(rng: Rng) -> Builder:
    """Build a bar with a small screen above a keypad, some with an aerial."""
    b = Builder()
    finish = draw_finish(rng)
    width = rng.uniform(0.34, 0.5)
    body = upright(width, 1.0, width * rng.uniform(0.24, 0.5))
    palm = rng.uniform(0.1, 0.5) if rng.random() < 0.6 else 0.0
    waist, square = rng.uniform(-0.1, 0.14), rng.uniform(3.5, 8)
    shell(b, rng, "body", finish.body, body, waist=waist, squareness=square, palm=palm)
    split = rng.uniform(-0.06, 0.14)
    share = rng.uniform(0.66, 0.8)
    display(b, rng, finish, body, low=split + 0.04, high=rng.uniform(0.34, 0.4), share=share)
    low = -0.44
    if rng.random() < 0.7:
        navigation(b, rng, finish, body, split - 0.1, rng.uniform(0.26, 0.38))
        split -= 0.17
    rows = int(rng.integers(4, 6))
    high, share = split - 0.02, rng.uniform(0.7, 0.82)
    keypad(b, rng, finish, body, low=low, high=high, share=share, rows=rows, columns=3)
    earpiece(b, rng, body, 0.44)
    if rng.random() < 0.45:
        aerial(b, rng, finish, body, int(rng.choice([-1, 1])))
    side_buttons(b, rng, finish, body)
    if palm == 0.0:
        camera(b, rng, finish, body, center=True)
    return b


def keyboard(rng: Rng) -> Builder:
    """Build a wide telephone with a full keyboard below its screen."""
    b = Builder()
    finish = draw_finish(rng)
    width, height = rng.uniform(0.55, 0.85), rng.uniform(0.9, 1.05)
    body = upright(width, height, width * rng.uniform(0.12, 0.22))
    rounded = bool(rng.random() < 0.5)
    if rounded:
        shell(b, rng, "body", finish.body, body, rng.uniform(-0.05, 0.06), rng.uniform(5, 9))
    else:
        add_half(b, rng, finish, body, width * rng.uniform(0.06, 0.22))
    rows = int(rng.integers(3, 5))
    split = -0.45 + 0.095 * rows + rng.uniform(0.0, 0.04)
    columns = int(rng.integers(7, 11))
    keypad(b, rng, finish, body, low=-0.45, high=split, share=0.86, rows=rows, columns=columns)
    navigation(b, rng, finish, body, split + 0.075, rng.uniform(0.16, 0.22))
    share, icons = rng.uniform(0.76, 0.86), rng.random() < 0.5
    display(b, rng, finish, body, low=split + 0.16, high=0.39, share=share, icons=icons)
    earpiece(b, rng, body, 0.445)
    side_buttons(b, rng, finish, body)
    camera(b, rng, finish, body, center=rounded)
    return b
