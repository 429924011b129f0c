"""Telephones that are nearly all screen."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.cellphone.body import Body, tile, upright
from ffd_lightning.shapes.cellphone.edges import camera, side_buttons
from ffd_lightning.shapes.cellphone.finish import Finish, draw_finish
from ffd_lightning.shapes.cellphone.front import display, earpiece, home_button
from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import lean, vec


def smartphone(rng: Rng) -> Builder:
    """Build a flat slab that is nearly all screen, some in a bumper or on a prop."""
    b = Builder()
    finish = draw_finish(rng)
    width = rng.uniform(0.44, 0.72)
    body = upright(width, 1.0, width * rng.uniform(0.09, 0.2))
    radius = width * rng.uniform(0.03, 0.22)
    edge = rng.uniform(0.1, 0.45) * body.depth
    if rng.random() < 0.3:
        body = Body(body.center, width, 1.0, body.depth, lean(rng.uniform(12, 32)))
        _prop(b, rng, finish, body)
    size = (width, 1.0, body.depth)
    tile(b, "body", finish.body, body, body.center, size, radius, edge=edge, segments=5)
    plate = (0.95 * width, 0.97, 0.3 * body.depth)
    place = body.behind(0, 0, -0.12 * body.depth)
    tile(b, "body", finish.back, body, place, plate, 0.9 * radius)
    if rng.random() < 0.3:
        _bumper(b, rng, body, radius)
    chin = rng.uniform(0.08, 0.16) if rng.random() < 0.6 else rng.uniform(0.02, 0.04)
    brow = rng.uniform(0.05, 0.14) if chin > 0.05 else rng.uniform(0.02, 0.04)
    share, icons = rng.uniform(0.86, 0.95), bool(rng.random() < 0.5)
    display(b, rng, finish, body, low=-0.5 + chin, high=0.5 - brow, share=share, icons=icons)
    if chin > 0.07:
        home_button(b, rng, finish, body, -0.5 + chin / 2, 0.7 * chin)
    earpiece(b, rng, body, 0.5 - max(brow, 0.05) / 2)
    side_buttons(b, rng, finish, body)
    camera(b, rng, finish, body)
    return b


def _bumper(b: Builder, rng: Rng, body: Body, radius: float) -> None:
    """Wrap a body's edges in a soft case."""
    material = pick_material(rng, draw(rng, ["rubber", "paint", "plastic"]))
    grow = rng.uniform(0.02, 0.05)
    size = (body.width + grow, body.height + grow, 0.7 * body.depth)
    place = body.behind(0, 0, -0.3 * body.depth)
    tile(b, "body", material, body, place, size, radius + grow / 2, edge=0.12 * body.depth)


def _prop(b: Builder, rng: Rng, finish: Finish, body: Body) -> None:
    """Lean a tipped body on a foot: a tray with a back plate."""
    bottom = body.at(0, -0.5, -body.depth / 2)
    thickness, wide = rng.uniform(0.02, 0.05), rng.uniform(0.5, 1.1) * body.width
    hold = body.behind(0, -rng.uniform(0.05, 0.25), 0.01)
    reach = hold[2] - bottom[2] + 0.2
    tray = vec(0, bottom[1] - 0.6 * body.depth - thickness / 2, bottom[2] + reach / 2 - 0.12)
    size = (wide, thickness, reach + 0.04)
    b.rounded_box("stand", finish.trim, tray, size, radius=0.05, edge=0.3 * thickness)
    low = vec(0, tray[1], tray[2] + reach / 2 - 0.06)
    along = hold - low
    length = float(np.linalg.norm(along))
    turn = lean(float(np.degrees(np.arctan2(along[2], along[1]))))
    post = (0.5 * wide, length, 0.03)
    b.rounded_box("stand", finish.trim, (hold + low) / 2, post, 0.012, turn=turn)
    lip = (0.8 * wide, 1.4 * body.depth, 0.03)
    front = vec(0, tray[1] + 0.4 * body.depth, bottom[2] - 0.65 * body.depth)
    b.rounded_box("stand", finish.trim, front, lip, 0.012)
