"""Loudspeakers that are no boxes: portable ones, balls and eggs, horns and megaphones."""

from __future__ import annotations

import numpy as np

from ffd_lightning.data.sources.procedural.facing import Front, knob, plate
from ffd_lightning.data.sources.procedural.furniture import beam, bend, circle, draw, lean
from ffd_lightning.data.sources.procedural.shapes import (
    Array,
    Builder,
    Material,
    pick_material,
    rotation,
)
from ffd_lightning.data.sources.procedural.speaker_parts import Finish, draw_finish, driver

_BRIGHT = ("plastic", "paint", "rubber", "metal")


def portable(rng: np.random.Generator) -> Builder:
    """Build a portable: a lying or upright tube, or a radio recorder with a handle."""
    b = Builder()
    finish = draw_finish(rng, _BRIGHT)
    kind = draw(rng, ["lying", "upright", "recorder"])
    if kind == "recorder":
        _recorder(b, rng, finish)
        return b
    radius = rng.uniform(0.14, 0.3)
    length = radius * (rng.uniform(3.0, 6.0) if kind == "lying" else rng.uniform(1.2, 4.0))
    turn = rotation((0, 0, 1), 90) if kind == "lying" else np.eye(3)
    lift = radius + 0.02 if kind == "lying" else 0.03 + length / 2
    center, bulge = np.array([0, lift, 0]), rng.uniform(0.9, 1.12)
    rows = [(0.9, -0.48), (1, -0.44), (bulge, 0), (1, 0.44), (0.9, 0.48)]
    b.lathe("grille", finish.grille, [(r * radius, t * length) for r, t in rows], center, 32, turn)
    for side in (-1, 1):
        cap = [(0.97, 0.4), (1.04, 0.42), (1.04, 0.49), (0.9, 0.5), (0.88, 0.48)]
        profile = [(r * radius, side * t * length) for r, t in cap]
        b.lathe("cabinet", finish.cabinet, profile, center, 32, turn)
    if kind == "lying":
        for side in (-1, 1):
            face = Front(center + (side * 0.485 * length, 0, 0), rotation((0, 1, 0), -90 * side))
            driver(b, finish, face, (0, 0), 0.75 * radius)
            foot = (0.1 * length, 0.06, 1.2 * radius)
            b.rounded_box("stand", finish.ring, (side * 0.3 * length, 0.03, 0), foot, 0.02)
        top = center + (0, radius * (0.5 + 0.5 * bulge), 0)
    else:
        driver(b, finish, Front(center + (0, 0.485 * length, 0), lean(90)), (0, 0), 0.6 * radius)
        b.cylinder("stand", finish.ring, (0, 0, 0), (0, 0.05, 0), 0.85 * radius, segments=28)
        top = None
    _controls(b, rng, finish, top, center - (0, 0, radius * bulge), length)
    return b


def _controls(
    b: Builder,
    rng: np.random.Generator,
    finish: Finish,
    top: Array | None,
    side: Array,
    length: float,
) -> None:
    """Add buttons and a loop on top of a lying tube (`top`), or a badge and strap at its `side`."""
    if top is None:
        plate(b, "control", finish.metal, Front(side), (0, 0), (0.1, 0.05, 0.04), 0.02)
        return
    face = Front(top, lean(90))
    for i in range(int(rng.integers(2, 5))):
        rows = [(0.03, -0.02), (0.03, 0.006), (0.004, 0.012)]
        knob(b, "control", finish.metal, face, (0.09 * i - 0.1, 0), rows, 14)
    if rng.random() < 0.5:
        reach = 0.38 * length
        path = top + np.array([(-reach, -0.06, 0), (-reach, 0.16, 0), (reach, 0.16, 0),
                               (reach, -0.06, 0)])  # fmt: skip
        b.tube("handle", finish.ring, bend(path, 0.1), 0.02, 10)


def _recorder(b: Builder, rng: np.random.Generator, finish: Finish) -> None:
    """Add a radio recorder: two drivers beside a deck or dial, keys, a handle, an aerial."""
    width, height, depth = rng.uniform(0.9, 1.4), rng.uniform(0.4, 0.6), rng.uniform(0.2, 0.32)
    center = np.array([0, 0.02 + height / 2, 0])
    radius = rng.uniform(0.02, 0.12)
    b.rounded_box("cabinet", finish.cabinet, center, (width, height, depth), radius, 0.02)
    front = Front(center - (0, 0, depth / 2))
    woofer = min(rng.uniform(0.3, 0.42) * height, 0.19 * width)
    for side in (-1, 1):
        driver(b, finish, front, (side * 0.3 * width, -0.05 * height), woofer)
        if rng.random() < 0.5:
            small = (side * 0.13 * width, 0.36 * height)
            driver(b, finish, front, small, 0.06 * height)
        foot = (0.08, 0.03, 0.7 * depth)
        b.rounded_box("stand", finish.ring, (side * 0.35 * width, 0.015, 0), foot, 0.01)
    middle = 2 * (0.3 * width - 1.1 * woofer)
    plate(b, "control", finish.metal, front, (0, -0.12 * height), (middle, 0.5 * height, 0.03), 0.02)
    window = (0.8 * middle, 0.26 * height, 0.045)
    plate(b, "control", Material((0.1, 0.12, 0.14)), front, (0, -0.1 * height), window, 0.015)
    dial = (0.6 * width, 0.1 * height, 0.02)
    plate(b, "control", Material((0.85, 0.8, 0.65)), front, (0, 0.4 * height), dial, 0.01)
    for x in np.linspace(-0.3, 0.3, int(rng.integers(4, 9))) * width:
        key = (0.06, 0.05, 0.1)
        b.rounded_box("control", finish.ring, center + (x, height / 2, -0.2 * depth), key, 0.008)
    reach, rise = 0.44 * width, rng.uniform(0.12, 0.2)
    arch = np.array([(-reach, -0.05, 0), (-reach, rise, 0), (reach, rise, 0), (reach, -0.05, 0)])
    b.tube("handle", finish.metal, bend(arch + center + (0, height / 2, 0), 0.06), 0.022, 10)
    if rng.random() < 0.6:
        start = center + (0.4 * width, height / 2 - 0.02, 0.35 * depth)
        b.cylinder("handle", finish.metal, start, start + (rng.uniform(-0.3, 0.3), 0.5, 0), 0.008,
                   0.005, 8)  # fmt: skip


def ball(rng: np.random.Generator) -> Builder:
    """Build a ball, egg or stack of balls with drivers, on a ring, three legs or a post."""
    b = Builder()
    finish = draw_finish(rng, _BRIGHT)
    radius, long = rng.uniform(0.24, 0.36), rng.uniform(0.85, 1.35)
    kind = draw(rng, ["ring", "legs", "post"])
    rise = {"ring": 0.03, "legs": rng.uniform(0.1, 0.25), "post": rng.uniform(0.2, 0.8)}[kind]
    deep = rng.uniform(0.8, 1.1)
    center = np.array([0, rise + long * radius, 0])
    _bowl(b, finish, center, radius, long, deep, rng.uniform(0.35, 0.7))
    if rng.random() < 0.4:
        small = rng.uniform(0.4, 0.65) * radius
        above = center + (0, long * radius + 0.85 * small, -0.1 * radius)
        _bowl(b, finish, above, small, 1.0, 1.0, 0.5)
    if kind == "ring":
        rows = [(0.5, 0), (0.55, 0.02), (0.5, 0.12), (0.4, 0.12)]
        b.lathe("stand", finish.metal, [(r * radius, y) for r, y in rows], segments=28)
    elif kind == "legs":
        tops = circle(3, 0.4 * radius, rise + 0.25 * radius, 90)
        for top, foot in zip(tops, circle(3, 0.85 * radius, 0, 90), strict=True):
            b.cylinder("stand", finish.metal, foot, top, 0.012, 0.025, 10)
    else:
        b.cylinder("stand", finish.metal, (0, 0.01, 0), (0, rise + 0.1 * radius, 0), 0.035)
        rows = [(0.8 * radius, 0), (0.78 * radius, 0.02), (0.2 * radius, 0.05)]
        b.lathe("stand", finish.metal, rows, segments=32)
    return b


def _bowl(
    b: Builder, finish: Finish, center: Array, radius: float, long: float, deep: float, cut: float
) -> None:
    """Add an ellipsoid cut off in front, closed by a baffle of `cut` its radius with a driver."""
    end = np.arcsin(np.clip(cut, 0.0, 0.95))
    angles = np.linspace(np.pi * 0.98, end, 14)
    rows = [(radius * np.sin(a), deep * radius * np.cos(a)) for a in angles]
    b.lathe("cabinet", finish.cabinet, rows, center, 28, lean(-90), squash=long)
    plane = Front(center - (0, 0, deep * radius * np.cos(end)))
    driver(b, finish, plane, (0, 0), 0.92 * cut * radius * min(long, 1.0))


def horn(rng: np.random.Generator) -> Builder:
    """Build a horn: on a bracket, as a hand-held megaphone, on a post, or a gramophone's."""
    b = Builder()
    finish = draw_finish(rng, ("plastic", "metal", "paint", "wood"))
    kind = draw(rng, ["bracket", "megaphone", "post", "gramophone"])
    mouth, length = rng.uniform(0.25, 0.42), rng.uniform(0.5, 0.9)
    if kind == "gramophone":
        _gramophone(b, rng, finish, mouth)
        return b
    level = {"bracket": 0.5, "megaphone": 0.5, "post": rng.uniform(1.0, 1.6)}[kind]
    tips = [0.0] if kind != "post" else [120.0 * i for i in range(int(rng.integers(1, 4)))]
    for degrees in tips:
        turn = rotation((0, 1, 0), degrees) @ lean(-90)
        _flare(b, rng, finish, np.array([0, level, 0]), turn, (mouth, length))
    if kind == "post":
        b.cylinder("stand", finish.metal, (0, 0, 0), (0, level + 0.15, 0), 0.035)
        b.lathe("stand", finish.metal, [(0.2, 0), (0.2, 0.03), (0.05, 0.06)])
    elif kind == "bracket":
        z, half = 0.12 * length - 0.4 * length, 0.8 * mouth
        path = [(-half, level, z), (-half, 0.03, z), (half, 0.03, z), (half, level, z)]
        for start, end in zip(path, path[1:], strict=False):
            beam(b, "stand", finish.metal, start, end, 0.05, 0.02)
        b.cylinder("stand", finish.metal, path[0], path[3], 0.015, segments=8)
        b.rounded_box("stand", finish.metal, (0, 0.015, z), (1.3 * half, 0.03, 0.16), 0.02)
    else:
        grip = rng.uniform(0.22, 0.32)
        start, end = np.array([0, level, 0.02]), np.array([0, level - grip - 0.1, 0.06])
        beam(b, "handle", finish.ring, start, end, 0.055, 0.08)
        b.rounded_box("control", pick_material(rng, "paint"), (0, level - 0.16, -0.02),
                      (0.03, 0.06, 0.06), 0.008)  # fmt: skip
    return b


def _flare(
    b: Builder,
    rng: np.random.Generator,
    finish: Finish,
    center: Array,
    turn: Array,
    size: tuple[float, float],
) -> None:
    """Add a flaring horn along `turn`'s y from a can at `center`; `size` is (mouth, length)."""
    mouth, length = size
    neck, power = 0.06, rng.uniform(1.5, 3.5)
    t = np.linspace(0, 1, 9)
    outside = np.stack([neck + (mouth - neck) * t**power, 0.1 + t * length], 1)
    inside = outside[::-1] * (0.94, 1) - (0, 0.004)
    b.lathe("cabinet", finish.cabinet, np.concatenate([outside, inside[:-2]]), center, 28, turn)
    lip = [(mouth * 0.97, -0.012), (mouth * 1.03, -0.012), (mouth * 1.03, 0.012),
           (mouth * 0.95, 0.012)]  # fmt: skip
    tip = center + turn @ np.array([0, 0.1 + length, 0])
    rings = [*lip, lip[0]]
    angles = 2 * np.pi * np.arange(28) / 28
    b.loft("cabinet", finish.ring,
           [np.stack([r * np.cos(angles), np.full(28, y), -r * np.sin(angles)], 1) @ turn.T + tip
            for r, y in rings], caps=False)  # fmt: skip
    can = rng.uniform(0.08, 0.14)
    rows = [(0.8 * can, -0.2), (can, -0.18), (can, 0.06), (0.8 * can, 0.12)]
    b.lathe("driver", finish.metal, rows, center, 24, turn)
    bullet = [(0.16 * mouth, 0.45 * length), (0.2 * mouth, 0.7 * length), (0.1 * mouth,
              0.95 * length), (0.01, length)]  # fmt: skip
    b.lathe("driver", finish.ring, bullet, center, 20, turn)


def _gramophone(b: Builder, rng: np.random.Generator, finish: Finish, mouth: float) -> None:
    """Add a gramophone: a box with a turntable and a crank, and a horn that rises and bends."""
    wood = pick_material(rng, "wood")
    side, tall = rng.uniform(0.45, 0.6), rng.uniform(0.18, 0.3)
    b.rounded_box("stand", wood, (0, 0.02, 0), (1.12 * side, 0.04, 1.12 * side), 0.01)
    b.rounded_box("stand", wood, (0, 0.02 + tall / 2, 0), (side, tall, side), 0.01)
    top = 0.02 + tall
    b.cylinder("driver", Material((0.05, 0.05, 0.05)), (0, top, 0), (0, top + 0.025, 0), 0.4 * side)
    post = np.array([0, top, 0.42 * side])
    height = rng.uniform(0.55, 0.8)
    path = [post - (0, 0.05, 0), post + (0, 0.6 * height, 0.08), post + (0, height, -0.1)]
    path += [post + (0, height + 0.1, -0.35), post + (0, height + 0.16, -0.6)]
    points = bend(path, 0.25, 6)
    t = np.linspace(0, 1, len(points))
    radii = 0.02 + 0.06 * t + (mouth - 0.08) * t ** rng.uniform(3, 5)
    _funnel(b, finish.cabinet, points, radii)
    crank = [(side / 2, 0.6 * tall, 0), (side / 2 + 0.1, 0.6 * tall, 0),
             (side / 2 + 0.1, 0.6 * tall - 0.12, 0), (side / 2 + 0.2, 0.6 * tall - 0.12, 0)]  # fmt: skip
    b.tube("handle", finish.metal, bend(crank, 0.02), 0.012, 8)


def _funnel(b: Builder, material: Material, points: Array, radii: Array) -> None:
    """Add a hollow tube along `points` that opens at its end: out along it and back inside."""
    tangents = np.gradient(points, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    across = np.array([1.0, 0, 0])
    angles = 2 * np.pi * np.arange(28) / 28
    rings = []
    for shrink in (1.0, 0.93):
        for point, tangent, r in zip(points, tangents, radii * shrink, strict=True):
            up = np.cross(tangent, across)
            circle_ = np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * up
            rings.append(point + r * circle_)
    n = len(points)
    b.loft("cabinet", material, rings[:n] + rings[n:][::-1])
