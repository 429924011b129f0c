"""The housings of telephones."""

from __future__ import annotations

from functools import partial

import numpy as np

from ffd_lightning.shapes.cellphone.plan import Plan, tile
from ffd_lightning.shapes.kit import Builder, Component, Rng
from ffd_lightning.shapes.kit.vectors import UP, vec


def plate(b: Builder, rng: Rng, p: Plan) -> None:
    """Add each body as one plate, mostly with a back of its own set in."""
    edge, inlaid = rng.uniform(0.1, 0.45), rng.random() < 0.6
    for body in (p.main,) if p.lid is None else (p.main, p.lid):
        size = (body.width, body.height, body.depth)
        rim = min(edge * body.depth, 0.06 * body.width)
        tile(b, "body", p.finish.body, body, body.center, size, p.radius, rim, segments=5)
        if inlaid:
            inset = (0.9 * body.width, 0.94 * body.height, 0.3 * body.depth)
            place = body.behind(0, 0, -0.14 * body.depth)
            tile(b, "body", p.finish.back, body, place, inset, 0.9 * p.radius)


def halves(b: Builder, rng: Rng, p: Plan) -> None:
    """Add each body as two shells of different material, front and back."""
    del rng
    for body in (p.main,) if p.lid is None else (p.main, p.lid):
        size = (body.width, body.height, 0.6 * body.depth)
        edge = min(0.2 * body.depth, 0.06 * body.width)
        front, rear = body.at(0, 0, -0.3 * body.depth), body.at(0, 0, -0.7 * body.depth)
        tile(b, "body", p.finish.body, body, front, size, p.radius, edge)
        block = (0.99 * size[0], 0.99 * size[1], size[2])
        tile(b, "body", p.finish.back, body, rear, block, p.radius, edge)


def shell(b: Builder, rng: Rng, p: Plan, palm: bool) -> None:
    """Add a rounded housing, narrower or wider in the middle; its back may fill the palm."""
    body, waist, squareness = p.main, rng.uniform(-0.12, 0.14), rng.uniform(3.5, 9)
    bulge = rng.uniform(0.15, 0.55) if palm else 0.0
    a = 2 * np.pi * np.arange(28) / 28
    section = np.stack([np.cos(a), np.zeros(28), np.sin(a)], 1)
    section = np.sign(section) * np.abs(section) ** (2 / squareness)
    tilt = rng.uniform(-0.1, 0.1)
    ends = np.array([0.0, 0.015, 0.05, 0.12])
    t = np.concatenate([ends, np.linspace(0.2, 0.8, 7), 1 - ends[::-1]])
    nose = rng.uniform(0.5, 0.85)  # how blunt the ends are
    blunt = np.minimum(1.0, nose + (1 - nose) * np.sqrt(np.minimum(t, 1 - t) / 0.12))
    wide = blunt * (1 - waist * np.sin(np.pi * t) ** 2 + tilt * (t - 0.5))
    deep = np.minimum(1.0, 0.6 + 0.4 * np.sqrt(np.minimum(t, 1 - t) / 0.05))
    rings = []
    for level, w, d in zip(t, wide, deep, strict=True):
        ring = section * vec(w * body.width / 2, 1, d * body.depth / 2)
        ring[ring[:, 2] > 0, 2] *= 1 + bulge * np.sin(np.pi * level)
        rings.append((ring + (level - 0.5) * body.height * UP) @ body.turn.T + body.center)
    b.loft("body", p.finish.body, rings)


_WHOLE = {"form": ("slab", "bar", "brick")}
HOUSINGS = (
    Component("plate", 3, plate),
    Component("halves", 2, halves),
    Component("shell", 3, partial(shell, palm=False), _WHOLE),
    Component("palm", 1.5, partial(shell, palm=True), {"form": ("bar", "brick")}),
)
