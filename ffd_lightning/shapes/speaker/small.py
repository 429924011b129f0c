"""Small speakers: pods, portable ones, pairs, subwoofers with their satellites."""

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.vectors import UP, Array, about_y, about_z, lean, vec
from ffd_lightning.shapes.speaker.boxes import Cabinet, Units, add_cabinet, draw_cabinet, two_way
from ffd_lightning.shapes.speaker.drivers import Finish, draw_cloth, draw_finish, driver, skin
from ffd_lightning.shapes.speaker.fittings import feet, handle, knobs


def pod(b: Builder, rng: Rng) -> None:
    """Build an egg, a ball or a drum around one driver, on a neck, on legs or on the ground."""
    add_pod(b, rng, draw_finish(rng), rng.uniform(0.09, 0.16), np.zeros(3), 0.0)


def add_pod(b: Builder, rng: Rng, finish: Finish, radius: float, at: Array, yaw: float) -> None:
    """Add a pod that stands at `at`, (3,), turned by `yaw` degrees.

    Its body is turned about the forward axis and cut off at the front, where its driver sits.
    """
    stretch, tilt = rng.uniform(0.8, 1.6), rng.uniform(0, 25)  # `stretch` times as tall as wide
    kind = draw(rng, ["ground", "neck", "legs"], [0.25, 0.45, 0.3])
    neck = rng.uniform(0.1, 1.6) * radius
    low = {"ground": -0.03 * radius, "neck": neck, "legs": 0.35 * radius}[kind]
    turn, center = about_y(yaw) @ lean(tilt), at + (low + stretch * radius) * UP
    if kind == "neck":
        wide = radius * rng.uniform(0.6, 1.0)
        rows = np.array([(1, 0), (1, 0.08), (0.85, 0.14), (0.1, 0.17)]) * (wide, radius)
        b.lathe("stand", finish.rim, rows, at, segments=28)
        b.cylinder("stand", finish.rim, at + 0.02 * UP, center, 0.14 * radius)
    elif kind == "legs":
        for x, y, z in circle(count=3, radius=0.65 * radius, height=0, degrees=yaw + 90):
            path = [at + vec(x, y, z), center + vec(0.6 * x, -0.6 * stretch * radius, 0.6 * z)]
            b.tube("stand", finish.rim, path, (0.05 * radius, 0.1 * radius))
    else:
        b.lathe("stand", finish.rim, radius * np.array([(0.6, 0), (0.5, 0.15), (0.3, 0.2)]), at)
    blunt, length = rng.uniform(0.4, 1.0), radius * rng.uniform(0.8, 1.5)
    a = np.linspace(rng.uniform(0.75, 1.15), np.pi - 0.08, 16)
    outs = length * np.sign(np.cos(a)) * np.abs(np.cos(a)) ** blunt
    rows, oval = np.stack([radius * np.sin(a) ** blunt, outs], 1), turn @ np.diag([1, stretch, 1])
    skin(b, "body", finish.body, rows, center, oval)
    skin(b, "body", finish.body, [rows[-1], (0.02 * radius, rows[-1, 1])], center, oval)
    mouth, out = rows[0]
    r = mouth * rng.uniform(0.8, 0.95) * min(1.0, stretch)
    front, spare = center - turn @ vec(0, 0, out), mouth * stretch - r
    shift = -0.85 * spare if stretch > 1.15 else 0.0
    disc = circle(24, 1.0, 0.0)[:, [0, 2, 1]]
    rings = [mouth * disc * vec(1, stretch, 1), 0.93 * r * disc + shift * UP]
    b.loft("body", finish.rim, [ring @ turn.T + front for ring in rings], caps=False)
    driver(b, finish, "woofer", front + turn @ (shift * UP), r, turn)
    treble = 0.75 * spare
    if shift and treble > 0.12 * r:
        place = front + turn @ vec(0, shift + r + treble, -0.01 * r)
        driver(b, finish, "tweeter", place, treble, turn)


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
            driver(b, finish, "woofer", middle, 0.75 * radius, about_y(90.0 * -sign))
            foot = (0.25 * half, 0.3 * radius, radius)
            b.rounded_box("stand", finish.rim, (sign * 0.5 * half, 0.1 * radius, 0), foot, 0.01)
    else:
        b.lathe("stand", finish.rim, [(0.8 * radius, 0), (0.9 * radius, 0.02)], segments=32)
        rows = [(0.5 * radius, 0), (0.5 * radius, 0.008), (0.42 * radius, 0.012)]
        b.lathe("panel", finish.rim, rows, (0, 2.02 * half + 0.012, 0))
    if rng.random() < 0.5:
        ends = np.array([(-0.6, 0, 0), (0.6, 0, 0)]) * (half if kind == "tube" else radius)
        rise = 0.94 * radius if kind == "tube" else half
        handle(b, finish.rim, ends + center + rise * UP, rng.uniform(0.03, 0.07), 0.005)


def _boombox(b: Builder, rng: Rng, finish: Finish) -> None:
    """Add a wide box with two or four drivers around a panel, knobs above, and a handle."""
    wide, tall, deep = rng.uniform(0.4, 0.65), rng.uniform(0.18, 0.32), rng.uniform(0.1, 0.16)
    cabinet = Cabinet(wide, tall, deep, (0, 0.012, 0), bevel=rng.uniform(0.008, 0.025))
    side: Units = [("woofer", tall * rng.uniform(0.3, 0.44))]
    if rng.random() < 0.4:
        side.insert(0, ("tweeter", 0.12 * tall))
    units = [*side, ("blank", 0.45 * tall), *side[::-1]]
    add_cabinet(b, cabinet, finish, cabinet.bays(units, across=True))
    feet(b, finish.rim, cabinet)
    metal, y = pick_material(rng, "metal"), 0.012 + tall / 2
    size = (0.75 * tall, 0.02, rng.uniform(0.3, 0.6) * tall)
    center, pane = (0, y - 0.08 * tall, 0), (0, y - 0.08 * tall, -0.008)
    b.rounded_box("panel", metal, center, size, radius=0.01, edge=0.004, turn=lean(-90))
    window = (0.8 * size[0], 0.012, 0.5 * size[2])
    b.rounded_box("panel", finish.rim, pane, window, radius=0.006, edge=0.003, turn=lean(-90))
    ends = [(x * tall, y + 0.38 * tall, -0.002) for x in (-0.3, 0.3)]
    knobs(b, metal, ends, 0.05 * tall, int(rng.integers(2, 6)))
    reach = rng.uniform(0.3, 0.46) * wide
    top = [(x, 0.008 + tall, deep / 2) for x in (-reach, reach)]
    handle(b, finish.rim, top, rng.uniform(0.04, 0.09), 0.009)


def speaker_set(b: Builder, rng: Rng) -> None:
    """Build a pair of equal boxes, or a subwoofer with two or four satellites around it."""
    finish = draw_finish(rng)
    if rng.random() < 0.35:
        cabinet = draw_cabinet(rng, (0.15, 0.26), (0.25, 0.75), (0.16, 0.3))
        bays = cabinet.bays(two_way(rng, cabinet.width), rng.uniform(0, 0.5))
        apart, yaw = cabinet.width * rng.uniform(0.65, 1.4), rng.uniform(0, 15)
        for side in (-1, 1):
            one = replace(cabinet, foot=(side * apart, 0.0, 0.0), yaw=side * yaw)
            add_cabinet(b, one, finish, bays)
        return
    cabinet = draw_cabinet(rng, (0.18, 0.3), (0.22, 0.36), (0.2, 0.32), 0.02)
    big: Units = [("woofer", cabinet.width * rng.uniform(0.32, 0.45))]
    if rng.random() < 0.4:
        big.append(("port", 0.12 * cabinet.width))
    add_cabinet(b, cabinet, finish, cabinet.bays(big, 0.1))
    feet(b, finish.rim, cabinet)
    size, pairs = rng.uniform(0.07, 0.12), 1 if rng.random() < 0.7 else 2
    pods, state = pairs == 1 and rng.random() < 0.5, int(rng.integers(1 << 30))
    tall = size * rng.uniform(1.2, 2.6)
    units: Units = [("woofer", 0.4 * size), ("tweeter", 0.2 * size)]
    units = units[: 1 if pairs == 2 or tall < 1.6 * size else 2]
    for pair in range(pairs):
        for side in (-1, 1):
            foot = side * (cabinet.width / 2 + size * (1.1 + 1.6 * pair)), 0.0, -0.6 * size * pair
            if pods:
                same = np.random.default_rng(state)  # so that all satellites match
                add_pod(b, same, finish, 0.5 * size, np.array(foot), side * 10.0)
            else:
                one = Cabinet(size, tall, 0.9 * size, foot, 8.0, side * 10.0, bevel=0.06 * size)
                add_cabinet(b, one, finish, one.bays(units))
