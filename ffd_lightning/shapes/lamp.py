"""Lamps: table, floor, arc, desk, pendant, chandelier, sconce, lantern."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.parts.furniture import (
    UP,
    LegStyle,
    add_legs,
    bend,
    circle,
    draw,
)
from ffd_lightning.shapes.parts.lamp_parts import (
    FLIP,
    Shade,
    add_bulb,
    add_foot,
    add_harp,
    add_shade,
    ball,
    draw_body_material,
    draw_metal,
    draw_shade,
    draw_shade_material,
    outline,
    turned,
    turned_rows,
)
from ffd_lightning.shapes.parts.mounted_lamp import (
    chandelier,
    lantern,
    pendant,
    sconce,
)
from ffd_lightning.shapes.shapes import (
    Array,
    Builder,
    Family,
    Material,
    rotation,
)

PARTS = ("base", "pole", "arm", "shade", "bulb")

CLOTH = {"drum": 0.3, "empire": 0.35, "cone": 0.1, "bell": 0.2, "dome": 0.05}
HEADS = {"empire": 0.25, "cone": 0.25, "bell": 0.15, "dome": 0.35}


def _table(rng: np.random.Generator) -> Builder:
    """Build a body on a foot, and a shade on top of it."""
    b = Builder()
    metal, material = draw_metal(rng), draw_body_material(rng)
    radius, height = rng.uniform(0.05, 0.14), rng.uniform(0.16, 0.46)
    foot = 0.0
    if rng.random() < 0.6:
        foot = rng.uniform(0.012, 0.035)
        add_foot(b, rng, metal if rng.random() < 0.5 else material, rng.uniform(0.08, 0.13), foot)
    _body(b, rng, material, metal, (radius, foot - 0.002, foot + height))
    size = rng.uniform(0.11, 0.24), rng.uniform(0.12, 0.3)
    shade = draw_shade(rng, max(size[0], 1.15 * radius), size[1], CLOTH)
    low = foot + height + rng.uniform(0.01, 0.08)
    b.cylinder("pole", metal, (0, foot + height - 0.01, 0), (0, low + 0.16 * size[1], 0), 0.01)
    holder, top = low + 0.15 * size[1], low + size[1]
    bulb = min(0.1, 0.6 * size[1])
    add_bulb(b, metal, (0, holder, 0), bulb)
    add_harp(b, metal, holder, top, 0.45 * bulb)
    add_shade(b, shade, metal, (0, top, 0))
    return b


def _body(
    b: Builder,
    rng: np.random.Generator,
    material: Material,
    metal: Material,
    extent: tuple[float, float, float],
) -> None:
    """Add the body of a table lamp; `extent` is its radius, lower and upper end."""
    radius, low, high = extent
    rise, at = high - low, np.array([0, low, 0])
    kind = draw(rng, ["vase", "stack", "block", "loop", "legs", "column"],
                [0.4, 0.16, 0.14, 0.08, 0.1, 0.12])  # fmt: skip
    if kind == "vase":
        section = draw(rng, ["round", "fluted", "hexagon", "square"], [0.7, 0.14, 0.08, 0.08])
        twist = rng.uniform(-150, 150) if section in ("fluted", "square") else 0.0
        rows = turned_rows(rng, radius, rise, 0.016)
        turned(b, "base", material, rows, outline(section), at, twist)
    elif kind == "stack":
        _stack(b, rng, material, metal, extent)
    elif kind == "block":
        top = rng.uniform(0.5, 1.2) * radius
        rows = np.array([(radius, 0), (top, 0.97 * rise), (0.92 * top, rise)])
        section = draw(rng, ["square", "hexagon", "round", "oval"])
        turned(b, "base", material, rows, outline(section), at)
    elif kind == "loop":
        a = np.linspace(-0.5 * np.pi, 1.5 * np.pi, 33)
        half, thick = rise / 2, rng.uniform(0.012, 0.028)
        wide = rng.uniform(0.4, 1.0) * half
        flat = np.stack([wide * np.cos(a), half + (half - 0.8 * thick) * np.sin(a), 0 * a], 1)
        b.tube("base", material, flat + at, thick)
        b.lathe("base", metal, [(0.06, -0.005), (0.06, 0.012), (0.02, 0.02)], at)
    elif kind == "legs":
        count = int(rng.integers(3, 5))
        style = LegStyle(draw(rng, ["round", "square"]), 0.024, ((0, 0.6), (0.5, 0.9), (1, 1)))
        tops, feet = circle(count, 0.015, high - 0.01), circle(count, 0.9 * radius + 0.03, low)
        add_legs(b, "base", material, style, tops, feet)
        b.cylinder("base", metal, (0, high - 0.04, 0), (0, high, 0), 0.032)
    else:
        slim = rng.uniform(0.012, 0.03)
        b.cylinder("base", material, at, (0, high, 0), slim, segments=24)
        b.lathe("base", metal, [(0.09, 0), (0.09, 0.012), (slim, 0.025)], at)


def _stack(
    b: Builder,
    rng: np.random.Generator,
    material: Material,
    metal: Material,
    extent: tuple[float, float, float],
) -> None:
    """Thread two to five balls, discs or blocks on a rod, smaller toward the top."""
    radius, low, high = extent
    b.cylinder("pole", metal, (0, low, 0), (0, high, 0), 0.01)
    count, kind = int(rng.integers(2, 6)), draw(rng, ["ball", "disc", "block"])
    shares = np.linspace(1, rng.uniform(0.5, 1.1), count)
    sizes = shares / shares.sum() * (high - low)
    second = draw_body_material(rng)
    foot = low
    for i, size in enumerate(sizes):
        skin = second if i % 2 else material
        wide = radius * shares[i]
        middle = np.array([0, foot + size / 2, 0])
        if kind == "ball":
            ball(b, "base", skin, middle, np.array([0.9 * wide, 0.52 * size]))
        elif kind == "disc":
            half, edge = 0.5 * size, 0.12 * size
            rows = [
                (wide - edge, -half),
                (wide, edge - half),
                (wide, half - edge),
                (wide - edge, half),
            ]
            b.lathe("base", skin, rows, middle)
        else:
            turn = rotation(UP, i * 45.0 if i % 2 else 0.0)
            b.rounded_box("base", skin, middle, (1.5 * wide, size, 1.5 * wide), 0.01, turn=turn)
        foot += size


def _floor(rng: np.random.Generator) -> Builder:
    """Build a tall pole or tripod with a shade, a torchiere's bowl, a globe or several heads."""
    b = Builder()
    metal, material = draw_metal(rng), draw_body_material(rng)
    height, radius = rng.uniform(1.1, 1.55), rng.uniform(0.014, 0.026)
    head = draw(rng, ["shade", "bowl", "globe", "tree"], [0.5, 0.2, 0.12, 0.18])
    if rng.random() < 0.3 and head != "tree":
        _tripod(b, rng, material, metal, height)
    else:
        add_foot(b, rng, metal, rng.uniform(0.13, 0.2), rng.uniform(0.02, 0.06))
        b.cylinder("pole", metal, (0, 0.01, 0), (0, height, 0), radius, 0.8 * radius)
        for y in rng.uniform(0.1, 0.85, int(rng.integers(0, 4))) * height:
            rows = [(radius, -0.04), (2.2 * radius, -0.01), (2.2 * radius, 0.01), (radius, 0.04)]
            b.lathe("pole", material, rows, (0, y, 0), 16)
        if rng.random() < 0.15:
            y = rng.uniform(0.3, 0.45) * height
            tray = rng.uniform(0.17, 0.25)
            b.lathe("base", material, [(tray, 0), (tray, 0.02)], (0, y, 0), 32)
    if head == "shade":
        wide, tall = rng.uniform(0.16, 0.32), rng.uniform(0.2, 0.42)
        add_bulb(b, metal, (0, height - 0.02, 0), 0.12)
        add_harp(b, metal, height, height + 0.75 * tall, 0.06)
        shade = draw_shade(rng, wide, tall, CLOTH)
        add_shade(b, shade, metal, (0, height + 0.75 * tall, 0))
    elif head == "bowl":
        shade = draw_shade(rng, rng.uniform(0.13, 0.24), rng.uniform(0.08, 0.22), HEADS)
        add_shade(b, shade, metal, (0, height, 0), FLIP)
        add_bulb(b, metal, (0, height, 0), 0.09)
    elif head == "globe":
        size = rng.uniform(0.1, 0.2)
        radii = size * np.array([1, rng.uniform(0.8, 1.5)])
        center = (0, height + 0.9 * radii[1], 0)
        ball(b, "shade", draw_shade_material(rng), center, radii)
    else:
        _branches(b, rng, metal, height)
    return b


def _tripod(
    b: Builder, rng: np.random.Generator, material: Material, metal: Material, height: float
) -> None:
    """Add three long legs that meet below the shade, and perhaps a ring or a tray between them."""
    joint = height * rng.uniform(0.55, 0.93)
    style = LegStyle(draw(rng, ["round", "square"]), 0.04, ((0, 0.6), (0.5, 0.9), (1, 1)))
    spread = rng.uniform(0.2, 0.36)
    tops, feet = circle(3, 0.025, joint, 90), circle(3, spread, 0, 90)
    add_legs(b, "base", material, style, tops, feet)
    b.cylinder("pole", metal, (0, joint - 0.06, 0), (0, joint + 0.02, 0), 0.045)
    b.cylinder("pole", metal, (0, joint, 0), (0, height, 0), 0.014)
    if rng.random() < 0.4:
        level = rng.uniform(0.25, 0.5)
        reach = float(np.linalg.norm((feet + level * (tops - feet))[0, [0, 2]]))
        b.lathe("base", material, [(reach, 0), (reach, 0.02)], (0, level * joint, 0), 28)


def _branches(b: Builder, rng: np.random.Generator, metal: Material, height: float) -> None:
    """Add two to five short arms with small shades, turned around the pole."""
    count = int(rng.integers(2, 6))
    shade = draw_shade(rng, rng.uniform(0.07, 0.11), rng.uniform(0.11, 0.17), HEADS, fine=False)
    tilt, reach = rng.uniform(20, 130), rng.uniform(0.12, 0.26)
    levels = height - np.linspace(0, rng.uniform(0.0, 0.5), count)
    start = rng.uniform(0, 360)
    for i, y in enumerate(levels):
        out = rotation(UP, start + i * 360.0 / count)
        path = bend([(0, y - 0.05, 0), (0.6 * reach, y - 0.05, 0), (reach, y + 0.03, 0)], 0.05)
        b.tube("arm", metal, path @ out.T, 0.009, 8)
        turn = out @ rotation((0, 0, 1), tilt)
        _head(b, shade, metal, out @ path[-1], turn, 0.07)


def _head(b: Builder, shade: Shade, metal: Material, at: Array, turn: Array, bulb: float) -> None:
    """Add a shade and its bulb below `at`, turned about there."""
    add_shade(b, shade, metal, at, turn)
    add_bulb(b, metal, at, min(bulb, 0.8 * shade.height), turn @ FLIP)


def _arc(rng: np.random.Generator) -> Builder:
    """Build one or several long bows over a heavy base, a shade at the end of each."""
    b = Builder()
    metal, material = draw_metal(rng), draw_body_material(rng)
    count = int(rng.choice([1, 3, 5], p=[0.7, 0.2, 0.1]))
    back, thick = rng.uniform(0.3, 0.6), rng.uniform(0.012, 0.02)
    low = rng.uniform(0.03, 0.16)
    if rng.random() < 0.5:
        b.rounded_box("base", material, (0, low / 2, back), (0.28, low, 0.24), 0.02, 0.01)
    else:
        wide = rng.uniform(0.13, 0.2)
        rows = [(wide, 0), (wide, 0.8 * low), (0.9 * wide, low), (0.02, low)]
        b.lathe("base", material, rows, (0, 0, back), 32)
    wide = rng.uniform(0.12, 0.25) if count == 1 else rng.uniform(0.09, 0.13)
    kinds = {"dome": 0.5, "drum": 0.15, "empire": 0.15, "bowl": 0.2}
    shade = draw_shade(rng, wide, wide * rng.uniform(0.7, 1.2), kinds, fine=count < 3)
    height, reach = rng.uniform(1.2, 1.7), back + rng.uniform(0.2, 0.6)
    last, lean = rng.uniform(1.9, 2.6), rng.uniform(0.4, 0.65)
    for i, side in enumerate(np.linspace(-50, 50, count) if count > 1 else [0.0]):
        tall = height * (1 - 0.12 * (i % 3))
        a = np.linspace(0, last, 24)
        along = reach * (1 - np.cos(a)) / (1 - np.cos(last))
        rise = (1 - lean) * tall * np.sin(a)
        points = np.stack([0 * a, lean * tall + rise, -along], 1)
        path = np.concatenate([[(0, low - 0.01, 0)], points]) @ rotation(UP, side).T + (0, 0, back)
        b.tube("pole", metal, path, list(np.linspace(thick, 0.6 * thick, len(path))), 10)
        end = path[-1] - 0.03 * UP
        b.cylinder("arm", metal, path[-1] + 0.005 * UP, end - 0.01 * UP, 0.012, segments=10)
        _head(b, shade, metal, end, np.eye(3), 0.1)
    return b


def _desk(rng: np.random.Generator) -> Builder:
    """Build a lamp with a jointed arm or a gooseneck, whose head looks down and forward."""
    b = Builder()
    metal, material = draw_metal(rng), draw_body_material(rng)
    foot, back = rng.uniform(0.015, 0.04), rng.uniform(0.0, 0.06)
    add_foot(b, rng, material, rng.uniform(0.07, 0.12), foot)
    lower, upper = rng.uniform(0.27, 0.42), rng.uniform(0.2, 0.38)
    start = np.array([0, foot + 0.01, back])
    if rng.random() < 0.35:
        rise = lower + upper * rng.uniform(0.3, 0.6)
        corner = start + (0, rise, 0)
        points = [
            start - 0.02 * UP,
            corner,
            corner + (0, 0.03, -upper),
            corner + (0, -0.1, -1.1 * upper),
        ]
        path = bend(points, 0.3, 8)
        b.tube("arm", metal, path, 0.012, 10)
        end, tilt = path[-1], rng.uniform(0, 25)
    else:
        tip, fall = np.radians(rng.uniform(5, 32)), np.radians(rng.uniform(-10, 60))
        elbow = start + lower * np.array([0, np.cos(tip), np.sin(tip)])
        end = elbow + upper * np.array([0, np.sin(fall), -np.cos(fall)])
        gap = 0.014 if rng.random() < 0.5 else 0.0
        for first, second in ((start, elbow), (elbow, end)):
            _rods(b, metal, first, second, gap)
        for joint in (start, elbow, end):
            axle = np.array([0.012 + gap, 0, 0])
            b.cylinder("arm", material, joint - axle, joint + axle, 0.022, segments=16)
        tilt = rng.uniform(0, 50)
    if rng.random() < 0.25:
        _bar_head(b, rng, material, end)
        return b
    shade = draw_shade(rng, rng.uniform(0.07, 0.12), rng.uniform(0.09, 0.17), HEADS)
    _head(b, shade, metal, end, rotation((1, 0, 0), tilt), 0.08)
    return b


def _rods(b: Builder, metal: Material, start: Array, end: Array, gap: float) -> None:
    """Join two points by one rod, or by two that are `gap` to each side."""
    for side in (-1, 1) if gap else (0,):
        shift = np.array([side * gap, 0, 0])
        b.cylinder("arm", metal, start + shift, end + shift, 0.008 if gap else 0.012, segments=10)


def _bar_head(b: Builder, rng: np.random.Generator, material: Material, end: Array) -> None:
    """Add a long flat head with a glowing underside, across the front or along the arm."""
    long, wide = rng.uniform(0.25, 0.45), rng.uniform(0.05, 0.1)
    across = rng.random() < 0.5
    size = np.array([long, 0.025, wide] if across else [wide, 0.025, long])
    center = end + (0, 0, 0.0 if across else -0.4 * long)
    b.rounded_box("shade", material, center, size, 0.02, 0.008)
    glow = Material((1.0, 0.96, 0.82))
    b.box("bulb", glow, center - 0.013 * UP, size * (0.9, 0.3, 0.8))


FAMILIES: dict[str, Family] = {
    "table": _table,
    "floor": _floor,
    "arc": _arc,
    "desk": _desk,
    "pendant": pendant,
    "chandelier": chandelier,
    "sconce": sconce,
    "lantern": lantern,
}
