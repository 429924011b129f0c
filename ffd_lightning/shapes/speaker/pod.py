"""Pods: round bodies around one driver."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.vectors import UP, Array, about_y, lean, vec
from ffd_lightning.shapes.speaker.drivers import Finish, add_driver, add_skin, draw_finish


def pod(rng: Rng) -> Builder:
    """Build an egg, a ball or a drum around one driver, on a neck, on legs or on the ground."""
    b, finish = Builder(), draw_finish(rng)
    add_pod(b, rng, finish, rng.uniform(0.09, 0.16), np.zeros(3))
    return b


def add_pod(
    b: Builder, rng: Rng, finish: Finish, radius: float, at: Array, yaw: float = 0.0
) -> None:
    """Add a pod that stands at `at`."""
    stretch, tilt = rng.uniform(0.8, 1.6), rng.uniform(0, 25)
    kind = draw(rng, ["ground", "neck", "legs"], [0.25, 0.45, 0.3])
    neck = rng.uniform(0.1, 1.6) * radius
    low = {"ground": -0.03 * radius, "neck": neck, "legs": 0.35 * radius}[kind]
    turn = about_y(yaw) @ lean(tilt)
    center = at + (low + stretch * radius) * UP
    if kind == "neck":
        wide = radius * rng.uniform(0.6, 1.0)
        rows = np.array([(1, 0), (1, 0.08), (0.85, 0.14), (0.1, 0.17)]) * (wide, radius)
        b.lathe("stand", finish.rim, rows, at, segments=28)
        b.cylinder("stand", finish.rim, at + 0.02 * UP, center, 0.14 * radius)
    elif kind == "legs":
        for x, y, z in circle(count=3, radius=0.65 * radius, height=0, degrees=yaw + 90):
            foot = at + vec(x, y, z)
            head = center + vec(0.6 * x, -0.6 * stretch * radius, 0.6 * z)
            b.tube("stand", finish.rim, [foot, head], (0.05 * radius, 0.1 * radius))
    else:
        b.lathe("stand", finish.rim, radius * np.array([(0.6, 0), (0.5, 0.15), (0.3, 0.2)]), at)
    _add_body(b, rng, finish, center, turn, radius=radius, stretch=stretch)


def _add_body(
    b: Builder, rng: Rng, finish: Finish, center: Array, turn: Array, radius: float, stretch: float
) -> None:
    """Add a body turned about the forward axis, cut off at the front, where its driver sits.

    `stretch` is how much taller than wide it is.
    """
    blunt, length = rng.uniform(0.4, 1.0), radius * rng.uniform(0.8, 1.5)
    a = np.linspace(rng.uniform(0.75, 1.15), np.pi - 0.08, 16)
    rows = np.stack(
        [radius * np.sin(a) ** blunt, length * np.sign(np.cos(a)) * np.abs(np.cos(a)) ** blunt], 1
    )
    oval = turn @ np.diag([1, stretch, 1])
    add_skin(b, "body", finish.body, rows, center, oval)
    add_skin(b, "body", finish.body, [rows[-1], (0.02 * radius, rows[-1, 1])], center, oval)
    mouth, out = rows[0]
    r = mouth * rng.uniform(0.8, 0.95) * min(1.0, stretch)
    front = center - turn @ vec(0, 0, out)
    spare = mouth * stretch - r
    shift = -0.85 * spare if stretch > 1.15 else 0.0
    a = 2 * np.pi * np.arange(24) / 24
    disc = np.stack([np.cos(a), np.sin(a), 0 * a], 1)
    rings = [mouth * disc * vec(1, stretch, 1), 0.93 * r * disc + shift * UP]
    b.loft("body", finish.rim, [ring @ turn.T + front for ring in rings], caps=False)
    add_driver(b, finish, "woofer", front + turn @ (shift * UP), r, turn)
    treble = 0.75 * spare
    if shift and treble > 0.12 * r:
        place = turn @ vec(0, shift + r + treble, -0.01 * r)
        add_driver(b, finish, "tweeter", front + place, treble, turn)
