"""Small speakers: pods on the desk, portable ones, horns, and sets of several."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.parts.furniture import UP, bend, circle, draw, lean
from ffd_lightning.shapes.parts.speaker_drivers import (
    FORWARD,
    Finish,
    add_driver,
    add_skin,
    draw_cloth,
    draw_finish,
)
from ffd_lightning.shapes.parts.speaker_parts import (
    Cabinet,
    Units,
    add_cabinet,
    add_feet,
    add_handle,
    add_knobs,
    draw_cabinet,
    row_of_bays,
    two_way,
)
from ffd_lightning.shapes.shapes import (
    Array,
    Builder,
    Material,
    pick_material,
    rotation,
)

SIDEWAYS = rotation((0, 0, 1), -90)
"""Turns what is upright so that it points to +x."""


def pod(rng: np.random.Generator) -> Builder:
    """Build an egg, a ball or a drum around one driver, on a neck, on legs or on the ground."""
    b, finish = Builder(), draw_finish(rng)
    _add_pod(b, rng, finish, rng.uniform(0.09, 0.16), np.zeros(3))
    return b


def _add_pod(
    b: Builder,
    rng: np.random.Generator,
    finish: Finish,
    radius: float,
    at: Array,
    yaw: float = 0.0,
) -> None:
    """Add a pod that stands at `at`."""
    stretch, tilt = rng.uniform(0.8, 1.6), rng.uniform(0, 25)
    kind = draw(rng, ["ground", "neck", "legs"], [0.25, 0.45, 0.3])
    low = {"ground": -0.03 * radius, "neck": rng.uniform(0.1, 1.6) * radius, "legs": 0.35 * radius}[
        kind
    ]
    turn = rotation(UP, yaw) @ lean(tilt)
    center = at + (low + stretch * radius) * UP
    if kind == "neck":
        wide = radius * rng.uniform(0.6, 1.0)
        rows = [
            (wide, 0),
            (wide, 0.08 * radius),
            (0.85 * wide, 0.14 * radius),
            (0.1 * wide, 0.17 * radius),
        ]
        b.lathe("stand", finish.rim, rows, at, 28)
        b.cylinder("stand", finish.rim, at + 0.02 * UP, center, 0.14 * radius)
    elif kind == "legs":
        for x, y, z in circle(3, 0.65 * radius, 0, yaw + 90):
            foot = at + (x, y, z)
            head = center + (0.6 * x, -0.6 * stretch * radius, 0.6 * z)
            b.cylinder("stand", finish.rim, foot, head, 0.05 * radius, 0.1 * radius, 12)
    else:
        b.lathe("stand", finish.rim, radius * np.array([(0.6, 0), (0.5, 0.15), (0.3, 0.2)]), at)
    _add_body(b, rng, finish, center, turn, (radius, stretch))


def _add_body(
    b: Builder,
    rng: np.random.Generator,
    finish: Finish,
    center: Array,
    turn: Array,
    extent: tuple[float, float],
) -> None:
    """Add a body turned about the forward axis, cut off at the front, where its driver sits.

    `extent` is its radius and how much taller than wide it is.
    """
    radius, stretch = extent
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
    front = center - turn @ np.array([0, 0, out])
    spare = mouth * stretch - r
    shift = -0.85 * spare if stretch > 1.15 else 0.0
    a = 2 * np.pi * np.arange(24) / 24
    disc = np.stack([np.cos(a), np.sin(a), 0 * a], 1)
    rings = [mouth * disc * (1, stretch, 1), 0.93 * r * disc + shift * UP]
    b.loft("body", finish.rim, [ring @ turn.T + front for ring in rings], caps=False)
    add_driver(b, finish, "woofer", front + turn @ (shift * UP), r, turn)
    treble = 0.75 * spare
    if shift and treble > 0.12 * r:
        place = turn @ np.array([0, shift + r + treble, -0.01 * r])
        add_driver(b, finish, "tweeter", front + place, treble, turn)


def portable(rng: np.random.Generator) -> Builder:
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
    b.lathe("grille", cloth, rows, center, 36, turn)
    for sign in (-1, 1):
        flip = turn @ rotation((1, 0, 0), 0 if sign > 0 else 180)
        cap = [(1.03, 0.88), (1.05, 0.94), (1.0, 1.0), (0.85, 1.03), (0.8, 0.99)]
        b.lathe("body", finish.body, np.array(cap) * (radius, half), center, 36, flip)
    if kind == "tube":
        for sign in (-1, 1):
            out = rotation(UP, 90.0 * -sign)
            add_driver(b, finish, "woofer", center + (sign * 1.1 * half, 0, 0), 0.75 * radius, out)
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


def _boombox(b: Builder, rng: np.random.Generator, finish: Finish) -> None:
    """Add a wide box with two or four drivers around a panel, knobs above, and a handle."""
    wide, tall, deep = rng.uniform(0.4, 0.65), rng.uniform(0.18, 0.32), rng.uniform(0.1, 0.16)
    cabinet = Cabinet(wide, tall, deep, (0, 0.012, 0), bevel=rng.uniform(0.008, 0.025))
    side: Units = [("woofer", tall * rng.uniform(0.3, 0.44))]
    if rng.random() < 0.4:
        side.insert(0, ("tweeter", 0.12 * tall))
    space = ("blank", 0.45 * tall)
    add_cabinet(
        b, cabinet, finish, row_of_bays(cabinet.face, [*side, space, *side[::-1]], across=True)
    )
    add_feet(b, finish.rim, wide, deep, 0.012, False)
    metal, y = pick_material(rng, "metal"), 0.012 + tall / 2
    size = (0.75 * tall, 0.02, rng.uniform(0.3, 0.6) * tall)
    b.rounded_box("panel", metal, (0, y - 0.08 * tall, 0), size, 0.01, 0.004, FORWARD)
    window = (0.8 * size[0], 0.012, 0.5 * size[2])
    b.rounded_box("panel", finish.rim, (0, y - 0.08 * tall, -0.008), window, 0.006, 0.003, FORWARD)
    ends = [(x * tall, y + 0.38 * tall, -0.002) for x in (-0.3, 0.3)]
    add_knobs(b, metal, ends, 0.05 * tall, int(rng.integers(2, 6)))
    reach = rng.uniform(0.3, 0.46) * wide
    top = np.array([(x, 0.008 + tall, deep / 2) for x in (-reach, reach)])
    add_handle(b, finish.rim, top, rng.uniform(0.04, 0.09), 0.009)


def horn(rng: np.random.Generator) -> Builder:
    """Build a round or oblong public-address horn in a bracket, on a wall plate, post or foot."""
    b = Builder()
    skin, metal = (
        pick_material(rng, draw(rng, ["plastic", "paint", "metal"])),
        pick_material(rng, "metal"),
    )
    long, mouth = rng.uniform(0.25, 0.5), rng.uniform(0.13, 0.24)
    throat, flare = rng.uniform(0.03, 0.05), rng.uniform(1.3, 3.0)
    squash = rng.uniform(0.5, 0.8) if rng.random() < 0.35 else 1.0
    low = mouth * squash + rng.uniform(0.06, 0.12)
    at, turn = low * UP, np.diag([1.0, squash, 1.0])
    t = np.linspace(0, 1, 12)
    outer = np.stack([throat + (mouth - throat) * t**flare, long * t], 1)
    lip = [(1.05 * mouth, long), (1.05 * mouth, long + 0.015), (0.97 * mouth, long + 0.012)]
    inner = outer[::-1] - (0.008, -0.002)
    add_skin(b, "body", skin, np.concatenate([outer, lip, inner]), at, turn)
    plug = [(0.6, 0.15), (0.75, 0.3), (0.5, 0.42), (0.1, 0.48)]
    b.lathe("driver", metal, np.array(plug) * (1.3 * throat, long), at, 20, turn @ FORWARD)
    b.cylinder("driver", metal, at - (0, 0, 0.25 * long), at + (0, 0, 0.05), 0.35 * throat)
    deep, wide = rng.uniform(0.08, 0.16), rng.uniform(1.3, 2.2) * throat
    rows = [
        (throat, -0.02),
        (wide, 0.0),
        (wide, 0.8 * deep),
        (0.8 * wide, deep),
        (0.1 * wide, deep),
    ]
    b.lathe("driver", pick_material(rng, "metal"), rows, at, 28, rotation((1, 0, 0), 90))
    arm = wide + 0.02
    hook = [
        (-arm, low, 0.5 * deep),
        (-arm, 0.02, 0.5 * deep),
        (arm, 0.02, 0.5 * deep),
        (arm, low, 0.5 * deep),
    ]
    b.tube("stand", metal, bend(hook, 0.03), 0.01, 8)
    b.cylinder(
        "stand", metal, at + (-arm - 0.02, 0, 0.5 * deep), at + (arm + 0.02, 0, 0.5 * deep), 0.014
    )
    _horn_mount(b, rng, metal, 0.5 * deep, wide)
    return b


def _horn_mount(
    b: Builder, rng: np.random.Generator, metal: Material, z: float, wide: float
) -> None:
    """Add a foot below the bracket of a horn, or a tall post."""
    if rng.random() < 0.4:
        drop = rng.uniform(0.3, 0.9)
        b.cylinder("stand", metal, (0, -drop, z), (0, 0.02, z), 0.02)
        rows = [(0.13, 0), (0.13, 0.015), (0.03, 0.03)]
        b.lathe("stand", metal, rows, (0, -drop - 0.01, z), 28)
        return
    b.rounded_box("stand", metal, (0, 0.006, z), (2.2 * wide, 0.016, 0.16), 0.01, 0.004)


def speaker_set(rng: np.random.Generator) -> Builder:
    """Build a pair of equal boxes, or a subwoofer with two or four satellites around it."""
    b, finish = Builder(), draw_finish(rng)
    if rng.random() < 0.35:
        cabinet = draw_cabinet(rng, (0.15, 0.26), (0.25, 0.75), (0.16, 0.3))
        bays = row_of_bays(cabinet.face, two_way(rng, cabinet.width), rng.uniform(0, 0.5))
        apart, yaw = cabinet.width * rng.uniform(0.65, 1.4), rng.uniform(0, 15)
        for side in (-1, 1):
            one = replace(cabinet, foot=(side * apart, 0.0, 0.0), yaw=side * yaw)
            add_cabinet(b, one, finish, bays)
        return b
    cabinet = draw_cabinet(rng, (0.18, 0.3), (0.22, 0.36), (0.2, 0.32), (0, 0.02, 0))
    big: Units = [("woofer", cabinet.width * rng.uniform(0.32, 0.45))]
    if rng.random() < 0.4:
        big.append(("port", 0.12 * cabinet.width))
    add_cabinet(b, cabinet, finish, row_of_bays(cabinet.face, big, 0.1))
    add_feet(b, finish.rim, cabinet.back * cabinet.width, cabinet.depth, 0.02, False)
    size, pairs = rng.uniform(0.07, 0.12), 1 if rng.random() < 0.7 else 2
    pods, state = pairs == 1 and rng.random() < 0.5, int(rng.integers(1 << 30))
    tall = size * rng.uniform(1.2, 2.6)
    for pair in range(pairs):
        x = cabinet.width / 2 + size * (1.1 + 1.6 * pair)
        for side in (-1, 1):
            same = np.random.default_rng(state)  # so that all satellites match
            foot = (side * x, 0.0, -0.6 * size * pair)
            if pods:
                _add_pod(b, same, finish, 0.5 * size, np.array(foot), side * 10.0)
                continue
            one = Cabinet(size, tall, 0.9 * size, foot, 8.0, side * 10.0, 0.06 * size)
            units: Units = [("woofer", 0.4 * size), ("tweeter", 0.2 * size)]
            bays = row_of_bays(one.face, units[: 1 if pairs == 2 or tall < 1.6 * size else 2])
            add_cabinet(b, one, finish, bays)
    return b
