"""The bodies of telephones: materials, box-like housings, plates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.cellphone.finish import Finish
from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.vectors import UP, Array, Triple, lean, vec

_FLAT = lean(90)  # rounded_box rounds the edges along its y: this turns y to z


@dataclass(frozen=True)
class Body:
    """A box-like housing: its middle, size and orientation.

    Attributes:
        center: (3,).
        width, height, depth: overall.
        turn: (3, 3) rotation about the centre.
    """

    center: Array
    width: float
    height: float
    depth: float
    turn: Array

    def at(self, x: float, y: float, out: float = 0.0) -> Array:
        """Return the point `out` before the front, at x and y from -0.5 to 0.5 of the size."""
        local = vec(x * self.width, y * self.height, -self.depth / 2 - out)
        return np.asarray(self.turn @ local + self.center)

    def behind(self, x: float, y: float, out: float = 0.0) -> Array:
        """Return the point `out` behind the back, at x and y from -0.5 to 0.5 of the size."""
        return self.at(x, y, -self.depth - out)


def upright(width: float, height: float, depth: float) -> Body:
    """Return a body that stands on the ground, facing -z."""
    return Body(vec(0, height / 2, 0), width, height, depth, np.eye(3))


def tile(
    b: Builder,
    part: str,
    material: Material,
    body: Body,
    center: Array,
    size: Triple,
    radius: float,
    edge: float | None = None,
    segments: int = 3,
) -> None:
    """Add a plate of `size` (width, height, depth), rounded by `radius` as seen from the front."""
    box = (size[0], size[2], size[1])
    turn = body.turn @ _FLAT
    b.rounded_box(
        part, material, center, box, radius=radius, edge=edge, turn=turn, segments=segments
    )


def shell(
    b: Builder,
    rng: Rng,
    part: str,
    material: Material,
    body: Body,
    waist: float = 0.0,
    squareness: float = 5.0,
    palm: float = 0.0,
) -> None:
    """Add a rounded housing, narrower by `waist` in the middle, wider above or below.

    Its cross-section is a superellipse of the exponent `squareness`, so its front stays flat;
    its back bulges by the share `palm`.
    """
    a = 2 * np.pi * np.arange(28) / 28
    section = np.stack([np.cos(a), np.zeros(28), np.sin(a)], 1)
    section = np.sign(section) * np.abs(section) ** (2 / squareness)
    tilt = rng.uniform(-0.06, 0.06)
    ends = np.array([0.0, 0.015, 0.05, 0.12])
    t = np.concatenate([ends, np.linspace(0.2, 0.8, 7), 1 - ends[::-1]])
    nose = rng.uniform(0.5, 0.85)  # how blunt the ends are
    blunt = np.minimum(1.0, nose + (1 - nose) * np.sqrt(np.minimum(t, 1 - t) / 0.12))
    wide = blunt * (1 - waist * np.sin(np.pi * t) ** 2 + tilt * (t - 0.5))
    deep = np.minimum(1.0, 0.6 + 0.4 * np.sqrt(np.minimum(t, 1 - t) / 0.05))
    rings = []
    for level, w, d in zip(t, wide, deep, strict=True):
        ring = section * vec(w * body.width / 2, 1, d * body.depth / 2)
        ring[ring[:, 2] > 0, 2] *= 1 + palm * np.sin(np.pi * level)
        rings.append((ring + (level - 0.5) * body.height * UP) @ body.turn.T + body.center)
    b.loft(part, material, rings)


def add_half(b: Builder, rng: Rng, finish: Finish, body: Body, radius: float) -> None:
    """Add one half of a folding or sliding telephone, its two shells of different material."""
    size = (body.width, body.height, 0.6 * body.depth)
    edge = 0.2 * body.depth
    tile(b, "body", finish.body, body, body.at(0, 0, -0.3 * body.depth), size, radius, edge=edge)
    block = (0.99 * size[0], 0.99 * size[1], size[2])
    tile(b, "body", finish.back, body, body.at(0, 0, -0.7 * body.depth), block, radius, edge=edge)


def lid_at(hinge: Array, tip: Array, width: float, height: float, depth: float) -> Body:
    """Return the lid of a clamshell: it ends at the hinge, tipped by `tip` from upright."""
    return Body(hinge + tip @ vec(0, height / 2, depth / 2), width, height, depth, tip)
