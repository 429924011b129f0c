"""Lamps that hang from the ceiling or a wall, and lanterns."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.parts.furniture import UP, bend, draw
from ffd_lightning.shapes.parts.lamp_parts import (
    FLIP,
    Shade,
    add_bulb,
    add_foot,
    add_shade,
    draw_body_material,
    draw_metal,
    draw_shade,
    draw_shade_material,
    outline,
    turned,
    turned_rows,
)
from ffd_lightning.shapes.shapes import (
    Array,
    Builder,
    Material,
    pick_material,
    rotation,
)

HANGING = {"dome": 0.3, "cone": 0.15, "empire": 0.15, "bell": 0.15, "bowl": 0.15, "drum": 0.1}
CUPS = {"bell": 0.35, "empire": 0.35, "bowl": 0.3}


def pendant(rng: np.random.Generator) -> Builder:
    """Build one shade on a cord, several from a bar or a plate, a globe, or stacked rings."""
    b = Builder()
    metal = draw_metal(rng)
    kind = draw(rng, ["single", "row", "cluster", "globe", "rings"], [0.35, 0.2, 0.15, 0.15, 0.15])
    drop = rng.uniform(0.15, 0.8)
    if kind in ("row", "cluster"):
        _several(b, rng, metal, kind, drop)
        return b
    _rose(b, metal, rng.uniform(0.05, 0.09), np.zeros(3))
    _cord(b, metal, np.zeros(3), drop)
    if kind == "single":
        wide = rng.uniform(0.14, 0.34)
        shade = draw_shade(rng, wide, wide * rng.uniform(0.6, 1.7), HANGING, glass=0.1)
        _hang(b, shade, metal, np.array([0, -drop, 0]), 0.12)
    elif kind == "globe":
        wide = rng.uniform(0.14, 0.28)
        tall = wide * rng.uniform(0.7, 1.4)
        a = np.linspace(-1.5, 1.5, 21)
        ribs = 1 + 0.02 * np.cos(np.pi * np.arange(21)) * (rng.random() < 0.5)
        rows = np.stack([wide * ribs * np.cos(a), tall * np.sin(a)], 1)
        turned(b, "shade", draw_shade_material(rng), rows, outline("round"), (0, -drop - tall, 0))
        b.cylinder("shade", metal, (0, -drop - 0.03, 0), (0, 0.02 - drop, 0), 0.03)
    else:
        _tiers(b, rng, metal, drop)
    return b


def _rose(b: Builder, metal: Material, radius: float, at: Array) -> None:
    """Add the round plate at the ceiling, its top at `at`."""
    rows = [(0.015, -0.03), (0.7 * radius, -0.025), (radius, -0.008), (radius, 0)]
    b.lathe("base", metal, rows, at, 24)


def _cord(b: Builder, metal: Material, top: Array, length: float) -> None:
    """Add a cord that hangs down from `top`."""
    b.cylinder("pole", metal, top - 0.005 * UP, top - (length + 0.005) * UP, 0.007, segments=8)


def _hang(b: Builder, shade: Shade, metal: Material, top: Array, bulb: float) -> None:
    """Add a shade below the end of a cord, and the bulb inside it."""
    add_shade(b, shade, metal, top)
    add_bulb(b, metal, top + 0.005 * UP, min(bulb, 0.85 * shade.height), FLIP)


def _several(b: Builder, rng: np.random.Generator, metal: Material, kind: str, drop: float) -> None:
    """Add two to six equal shades, in a row below a bar or around below a plate."""
    count = int(rng.integers(2, 6)) if kind == "row" else int(rng.integers(3, 7))
    wide = rng.uniform(0.07, 0.15)
    shade = draw_shade(rng, wide, wide * rng.uniform(0.8, 2.0), HANGING, fine=count < 4)
    uneven = rng.uniform(0.1, 0.5) if rng.random() < 0.5 else 0.0
    if kind == "row":
        gap = wide * rng.uniform(2.3, 3.2)
        bar = (gap * (count - 1) + 0.1, 0.03, 0.06)
        b.rounded_box("base", metal, (0, -0.015, 0), bar, 0.02, 0.005)
        places = np.array([(x, 0.0, 0.0) for x in gap * (np.arange(count) - (count - 1) / 2)])
    else:
        ring = 1.15 * wide / np.sin(np.pi / count)
        _rose(b, metal, ring + 0.04, np.zeros(3))
        a = 2 * np.pi * np.arange(count) / count
        places = np.stack([ring * np.cos(a), 0 * a, ring * np.sin(a)], 1)
    for place in places:
        length = max(0.08, drop + uneven * rng.uniform(-0.5, 0.5))
        _cord(b, metal, place, length)
        _hang(b, shade, metal, place - length * UP, 0.1)


def _tiers(b: Builder, rng: np.random.Generator, metal: Material, drop: float) -> None:
    """Add two to six conical leaves, one above the other on a rod, as an artichoke of discs."""
    count, wide = int(rng.integers(2, 7)), rng.uniform(0.16, 0.34)
    gap = rng.uniform(0.05, 0.1)
    skin, bulge = draw_shade_material(rng, glass=0.0), rng.uniform(0.3, 0.9)
    b.cylinder("pole", metal, (0, -drop, 0), (0, -drop - gap * count, 0), 0.02)
    for i, t in enumerate(np.linspace(-1, 0.7, count)):
        r = wide * (1 - bulge * t * t)
        rows = np.array([(r, -1.1 * gap), (0.62 * r, -0.35 * gap), (0.03, 0.0)])
        add_shade(b, Shade(rows, outline("round"), skin), metal, (0, -drop - i * gap, 0))
    add_bulb(b, metal, (0, -drop - gap * (count - 1), 0), 0.1, FLIP)


def chandelier(rng: np.random.Generator) -> Builder:
    """Build a turned column with curved arms around it, a candle or a cup on each."""
    b = Builder()
    metal = draw_metal(rng)
    tall, drop = rng.uniform(0.25, 0.5), rng.uniform(0.1, 0.5)
    _rose(b, metal, 0.07, np.array([0, tall + drop, 0]))
    _cord(b, metal, np.array([0, tall + drop, 0]), drop)
    column = metal if rng.random() < 0.6 else draw_body_material(rng)
    turned(
        b,
        "pole",
        column,
        turned_rows(rng, rng.uniform(0.04, 0.08), tall, 0.012),
        outline("round", 16),
    )
    rows = [(0.004, -0.06), (0.018, -0.045), (0.02, -0.03), (0.008, -0.01), (0.02, 0.005)]
    b.lathe("pole", metal, rows, segments=12)
    head = draw(rng, ["candle", "up", "down"], [0.4, 0.3, 0.3])
    size = rng.uniform(0.05, 0.085)
    shade = draw_shade(rng, size, size * rng.uniform(1.1, 1.8), CUPS, fine=False, glass=0.3)
    tiers = 2 if rng.random() < 0.25 and head == "candle" else 1
    most = 8 if head == "candle" and tiers == 1 else 6
    reach, count = rng.uniform(0.28, 0.5), int(rng.integers(3, most + 1))
    for tier in range(tiers):
        out = reach * (1 - 0.45 * tier)
        number = max(3, count - 2 * tier)
        path = (
            _arm_path(rng, head, out, rng.uniform(0.05, 0.25) * tall, tall) + 0.4 * tier * tall * UP
        )
        for i in range(number):
            turn = rotation(UP, 360.0 * i / number + 30 * tier)
            _arm(b, metal, shade, head, path @ turn.T)
    if tiers == 1 and rng.random() < 0.3:
        a = np.linspace(0, 2 * np.pi, 37)
        level = np.interp(0.6 * reach, path[:, 0], path[:, 1])
        ring = np.stack([0.6 * reach * np.cos(a), np.full(37, level), 0.6 * reach * np.sin(a)], 1)
        b.tube("arm", metal, ring, 0.008, 8)
    return b


def _arm_path(
    rng: np.random.Generator, head: str, reach: float, start: float, tall: float
) -> Array:
    """Draw an arm's path (p, 3) from the column out along x: a scroll, a bow or straight."""
    kind = draw(rng, ["scroll", "bow", "straight"], [0.5, 0.3, 0.2])
    rise = rng.uniform(0.0, 0.5) * tall
    if kind == "straight":
        return np.array(
            [(0, start, 0), (reach / 2, start + rise / 4, 0), (reach, start + rise / 2, 0)]
        )
    sag = rng.uniform(0.2, 0.5) * tall * (-1 if head != "down" else 1)
    points = [(0.0, start, 0.0), (0.45 * reach, start + sag, 0.0)]
    if kind == "scroll":
        points = [(0, start, 0), (0.3 * reach, start - 0.8 * sag, 0), (0.6 * reach, start + sag, 0)]
    return bend([*points, (reach, start + sag / 2, 0), (reach, start + rise, 0)], reach, 3)


def _arm(b: Builder, metal: Material, shade: Shade, head: str, path: Array) -> None:
    """Add one arm along `path` and, at its end, a candle, or a cup that opens up or down."""
    b.tube("arm", metal, path, 0.008, 6)
    end = path[-1]
    if head == "down":
        _hang(b, shade, metal, end + 0.005 * UP, 0.07)
        return
    b.lathe("arm", metal, [(0.01, -0.012), (0.03, 0), (0.032, 0.012), (0.015, 0.014)], end, 10)
    if head == "up":
        add_shade(b, shade, metal, end, FLIP)
        add_bulb(b, metal, end, 0.06)
        return
    wax = Material((0.93, 0.9, 0.82))
    b.cylinder("bulb", wax, end, end + 0.08 * UP, 0.012, segments=8)
    flame = [(0.006, 0), (0.012, 0.015), (0.009, 0.03), (0.001, 0.045)]
    b.lathe("bulb", Material((1.0, 0.9, 0.6)), flame, end + 0.08 * UP, 8)


def sconce(rng: np.random.Generator) -> Builder:
    """Build a plate for the wall with one to three arms that hold shades in front of it."""
    b = Builder()
    metal = draw_metal(rng)
    wide, tall = rng.uniform(0.05, 0.12), rng.uniform(0.1, 0.32)
    upright = rotation((1, 0, 0), -90)
    if rng.random() < 0.5:
        b.rounded_box("base", metal, (0, 0, 0.012), (wide, 0.024, tall), 0.4 * wide, 0.008, upright)
    else:
        rows = [(0.5 * tall, -0.012), (0.5 * tall, 0.004), (0.4 * tall, 0.014), (0.02, 0.02)]
        b.lathe("base", metal, rows, (0, 0, 0.012), 28, upright, squash=rng.uniform(0.6, 1.5))
    size = rng.uniform(0.06, 0.12)
    count = int(rng.choice([1, 2, 3], p=[0.55, 0.3, 0.15]))
    up = rng.random() < 0.6
    kinds = {"empire": 0.3, "bell": 0.25, "bowl": 0.15, "dome": 0.15, "drum": 0.15}
    shade = draw_shade(rng, size, size * rng.uniform(1, 2), kinds, fine=count == 1, glass=0.25)
    reach, sag = size + rng.uniform(0.03, 0.12), rng.uniform(-0.08, 0.08)
    spread = 1.25 * size * (count - 1)
    for x in np.linspace(-spread, spread, count) if count > 1 else [0.0]:
        middle = 0.04 if x == 0 else 0.0
        foot = np.array([0.1 * x, 0, 0.01])
        end = np.array([x, 0.06 if up else 0.02, -reach - middle])
        points = np.array([foot, foot - (0, sag, 0.4 * reach), (x, -0.06 - abs(sag), end[2]), end])
        if not up:
            points[1:3] = (0.1 * x, 0.1, -0.3 * reach), (x, 0.12, end[2])
        b.tube("arm", metal, bend(points, 0.1, 6), 0.009, 8)
        add_shade(b, shade, metal, end, FLIP if up else None)
        add_bulb(b, metal, end, min(0.1, 0.8 * shade.height), None if up else FLIP)
    return b


def lantern(rng: np.random.Generator) -> Builder:
    """Build a glazed, roofed lantern: on a post, on a ceiling chain, or standing with a handle."""
    b = Builder()
    metal = draw_metal(rng)
    sides = "square" if rng.random() < 0.55 else "hexagon"
    mount = draw(rng, ["post", "chain", "stand"], [0.5, 0.25, 0.25])
    wide, tall = rng.uniform(0.1, 0.17), rng.uniform(0.22, 0.42)
    low = 0.0
    if mount == "post":
        low = rng.uniform(0.7, 1.5)
        add_foot(b, rng, metal, rng.uniform(0.12, 0.17), rng.uniform(0.06, 0.16))
        stem = rng.uniform(0.02, 0.035)
        rows = [
            (2 * stem, 0.02),
            (2 * stem, 0.2 * low),
            (1.2 * stem, 0.22 * low),
            (stem, 0.9 * low),
        ]
        rows += [(1.8 * stem, 0.92 * low), (stem, 0.94 * low), (2 * stem, low)]
        turned(b, "pole", metal, rows, outline(draw(rng, ["round", "hexagon"]), 20))
    top = low + tall + _case(b, rng, metal, sides, (wide, low, tall))
    if mount == "chain":
        length = rng.uniform(0.1, 0.6)
        _rose(b, metal, 0.07, np.array([0, top + length, 0]))
        _cord(b, metal, np.array([0, top + length, 0]), length + 0.01)
    elif mount == "stand":
        a = np.linspace(0, np.pi, 21)
        rise = top - low - tall + rng.uniform(0.03, 0.12)
        loop = np.stack([0.7 * wide * np.cos(a), low + tall + rise * np.sin(a), 0 * a], 1)
        b.tube("arm", metal, loop, 0.008, 8)
    return b


def _case(
    b: Builder,
    rng: np.random.Generator,
    metal: Material,
    sides: str,
    extent: tuple[float, float, float],
) -> float:
    """Add the floor, posts, panes, candle and roof of a lantern; return the roof's height.

    `extent` is the radius, the lower end and the height of the glazed part.
    """
    wide, low, tall = extent
    section = outline(sides)
    waist = wide * rng.uniform(0.55, 1.0)
    at = np.array([0, low, 0])
    turned(
        b, "base", metal, [(0.9 * waist, 0), (1.1 * waist, 0.012), (1.1 * waist, 0.03)], section, at
    )
    pane = pick_material(rng, "glass") if rng.random() < 0.75 else draw_shade_material(rng, 0)
    rows = np.array([(0.93 * waist, 0.025), (0.93 * wide, tall)])
    turned(b, "shade", pane, rows, section, at)
    for x, z in section[::3]:
        ends = np.array([(x * waist, 0.02, z * waist), (x * wide, tall, z * wide)]) + at
        b.tube("shade", metal, ends, 0.009, 6)
    add_bulb(b, metal, at + 0.03 * UP, 0.5 * tall)
    rise, eave = wide * rng.uniform(0.4, 1.1), rng.uniform(1.12, 1.35) * wide
    t = np.linspace(0, 1, 6)
    curve = eave + (0.16 * wide - eave) * t ** rng.uniform(0.6, 1.2)
    roof = [(eave, -0.02), *np.stack([curve, rise * t], 1)]
    turned(b, "shade", metal, roof, section, at + tall * UP)
    ball = [(0.1 * wide, -0.01), (0.2 * wide, 0.15 * wide), (0.05 * wide, 0.4 * wide)]
    b.lathe("shade", metal, ball, at + (tall + rise) * UP, 14)
    return rise + 0.3 * wide
