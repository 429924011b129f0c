"""What aeroplanes have in common: fuselage, lifting surfaces, engines, propellers, gear."""

from __future__ import annotations

import colorsys

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.parts.sections import superellipse
from ffd_lightning.shapes.shapes import (
    Array,
    Builder,
    Material,
    pick_material,
    rotation,
)

BLACK = Material((0.05, 0.05, 0.055))
STEEL = Material((0.45, 0.46, 0.48))
GLASS = Material((0.1, 0.14, 0.2))

_AIRFOIL = np.array(
    [(0, 0), (0.04, 0.32), (0.15, 0.5), (0.35, 0.55), (0.65, 0.36), (1, 0.04)]
    + [(1, -0.04), (0.65, -0.26), (0.35, -0.4), (0.15, -0.4), (0.04, -0.26)]
)
"""Rows of (fraction of the chord, fraction of the thickness)."""


def draw_livery(rng: np.random.Generator, drab: float = 0.0) -> tuple[Material, Material]:
    """Draw a main and an accent colour; `drab` is the probability of a military main colour."""
    accent = pick_material(rng, "paint")
    if rng.random() < drab:
        hue, saturation = rng.uniform(0.1, 0.62), rng.uniform(0.03, 0.35)
        return Material(colorsys.hsv_to_rgb(hue, saturation, rng.uniform(0.25, 0.65))), accent
    if rng.random() < 0.6:
        return Material((rng.uniform(0.75, 0.97),) * 3), accent
    return pick_material(rng, "paint"), accent


def oval(row: ArrayLike, boxiness: float = 0.0, grow: float = 1.0, side: float = 0.0) -> Array:
    """Return the section (20, 3) of a row (z, middle's height, width, height) at x = `side`."""
    z, y, width, height = np.asarray(row, float)
    flat = superellipse(boxiness, 20) * np.array([width, height]) / 2 * grow
    return np.column_stack([side + flat[:, 0], y + flat[:, 1], np.full(20, z)])


def fuselage(
    b: Builder,
    part: str,
    material: Material,
    rows: ArrayLike,
    boxiness: float = 0.0,
    side: float = 0.0,
) -> None:
    """Add a body along z, at x = `side`, from rows (z, height of its middle, width, height)."""
    b.loft(part, material, [oval(row, boxiness, 1.0, side) for row in np.asarray(rows, float)])


def tapered(
    length: float, width: float, height: float, nose: float, tail: float, upsweep: float
) -> Array:
    """Return a transport's fuselage rows (k, 4), nose at z = -length / 2.

    `nose` and `tail` are the lengths of the two cones; the tail's underside rises by `upsweep`.
    """
    rows = []
    for angle in (0.01, 0.1, 0.3, 0.6, 1.0, np.pi / 2):
        s = np.sin(angle) ** 0.7
        y = -0.14 * height * (1 - s)
        rows.append((-length / 2 + nose * (1 - np.cos(angle)), y, width * s, height * s))
    for t in (0.0, 0.35, 0.7, 0.92, 1.0):
        s = 1 - 0.86 * t**1.5
        rows.append((length / 2 - tail * (1 - t), upsweep * t**1.5, width * s, height * s))
    return np.array(rows)


def width_at(rows: Array, z: float) -> float:
    """Return the width of a fuselage given by its rows at z."""
    return float(np.interp(z, rows[:, 0], rows[:, 2]))


def height_at(rows: Array, z: float, up: float) -> float:
    """Return the height of the middle (`up` 0), top (1) or belly (-1) of a fuselage at z."""
    middle, tall = (np.interp(z, rows[:, 0], rows[:, i]) for i in (1, 3))
    return float(middle + up * tall / 2)


def surface(
    b: Builder,
    part: str,
    material: Material,
    edge: ArrayLike,
    chords: ArrayLike,
    thickness: float = 0.12,
) -> None:
    """Add a lifting surface with an aerofoil section.

    Args:
        b: collects it.
        part: its part.
        material: its colour.
        edge: points (k, 3) of the leading edge, from root to tip.
        chords: (k,) lengths along z.
        thickness: fraction of the chord.
    """
    points = np.asarray(edge, float)
    span = np.gradient(points, axis=0) * np.array([1, 1, 0])
    normals = np.stack([-span[:, 1], span[:, 0], np.zeros(len(points))], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rings = []
    for point, normal, chord in zip(points, normals, np.asarray(chords, float), strict=True):
        along = _AIRFOIL[:, :1] * np.array([0, 0, chord])
        rings.append(point + along + _AIRFOIL[:, 1:] * thickness * chord * normal)
    b.loft(part, material, rings)


def pair(
    b: Builder,
    part: str,
    material: Material,
    edge: ArrayLike,
    chords: ArrayLike,
    thickness: float = 0.12,
) -> None:
    """Add a lifting surface and its mirror image; see `surface`."""
    points = np.asarray(edge, float)
    surface(b, part, material, points, chords, thickness)
    # from tip to root, so that the normals point up on this side as well
    surface(b, part, material, (points * [-1, 1, 1])[::-1], np.asarray(chords)[::-1], thickness)


def on_wing(edge: ArrayLike, t: float) -> Array:
    """Return the point of a straight leading edge at the fraction t from root to tip."""
    points = np.asarray(edge, float)
    return points[0] + t * (points[-1] - points[0])


def nacelle(
    b: Builder, material: Material, center: ArrayLike, radius: float, length: float
) -> None:
    """Add a turbofan that faces -z: cowl, dark inlet with its cone, nozzle."""
    c, turn = np.asarray(center, float), rotation((1, 0, 0), 90)
    profile = np.array([(0.82, 0.5), (0.9, 0.5), (1, 0.4), (1, 0.05), (0.78, -0.42), (0.68, -0.42)])
    b.lathe("engine", material, profile * [radius, -length], c, 18, turn)
    face, back = c - [0, 0, 0.485 * length], c + [0, 0, 0.4 * length]
    b.lathe(
        "engine",
        BLACK,
        [(0.84 * radius, 0), (0.84 * radius, 0.03 * length)],
        c - [0, 0, 0.505 * length],
        18,
        turn,
    )
    cone = [(0.3 * radius, 0.0), (0.2 * radius, -0.05 * length), (0.02 * radius, -0.1 * length)]
    b.lathe("engine", STEEL, cone, face, 12, turn)
    tail = [
        (0.55 * radius, -0.02 * length),
        (0.45 * radius, 0.12 * length),
        (0.1 * radius, 0.22 * length),
    ]
    b.lathe("engine", STEEL, tail, back, 14, turn)


def propeller(
    b: Builder,
    rng: np.random.Generator,
    hub: ArrayLike,
    radius: float,
    blades: int,
    spinner: Material,
) -> None:
    """Add a propeller in the plane z = const at `hub`, its spinner pointing to -z."""
    c, start = np.asarray(hub, float), rng.uniform(0, 360)
    wide, r = 0.1 * radius + 0.004, 0.13 * radius
    for i in range(blades):
        spin = rotation((0, 0, 1), start + 360 * i / blades)
        rings = []
        for t, w, twist in ((0.05, 0.5, 50), (0.35, 1.0, 35), (0.8, 0.9, 20), (1.0, 0.45, 15)):
            flat = np.array(
                [
                    (-w * wide, 0, 0),
                    (0, 0, -0.012 * radius),
                    (w * wide, 0, 0),
                    (0, 0, 0.012 * radius),
                ]
            )
            rings.append((flat @ rotation((0, 1, 0), twist).T + [0, t * radius, 0]) @ spin.T + c)
        b.loft("engine", BLACK, rings)
    cone = [(r, -0.6 * r), (r, 0.2 * r), (0.75 * r, 1.0 * r), (0.1 * r, 1.7 * r)]
    b.lathe("engine", spinner, cone, c, 14, rotation((1, 0, 0), -90))


def undercarriage(
    b: Builder, material: Material, top: ArrayLike, drop: float, radius: float, wheels: int = 1
) -> None:
    """Add a strut that ends `drop` below `top`, and one wheel or two beside each other."""
    start = np.asarray(top, float)
    axle = start - [0, drop - radius, 0]
    b.cylinder("gear", material, start, axle, 0.28 * radius, segments=8)
    for side in [0.0] if wheels == 1 else [-0.55, 0.55]:
        center, half = axle + [side * radius, 0, 0], np.array([0.3 * radius, 0, 0])
        b.cylinder("gear", BLACK, center - half, center + half, radius, segments=14)
        b.cylinder(
            "gear", STEEL, center - 1.1 * half, center + 1.1 * half, 0.45 * radius, segments=8
        )


def canopy(
    b: Builder, rows: Array, ends: tuple[float, float], width: float, rise: float, frames: Material
) -> None:
    """Add a bubble of glass on top of a fuselage between two z, with a few frames."""
    z = np.linspace(*ends, 9)
    t = (z - ends[0]) / (ends[1] - ends[0])
    swell = np.sqrt(np.clip(1 - (2 * t**0.8 - 1) ** 2, 0.02, 1))
    base = [height_at(rows, at, 1) for at in z]
    sections = [
        (at, low - 0.3 * width, (0.25 + 0.75 * s) * width, 0.6 * width + 2 * rise * s)
        for at, low, s in zip(z, base, swell, strict=True)
    ]
    fuselage(b, "window", GLASS, sections, 0.1)
    for i in (2, 4):
        rings = [oval((z[i] + d, *sections[i][1:]), 0.1, 1.02) for d in (-0.004, 0.004)]
        b.loft("body", frames, rings)


def windows(
    b: Builder,
    rows: Array,
    ends: tuple[float, float],
    count: int,
    up: float,
    size: tuple[float, float],
) -> None:
    """Add `count` cabin windows to both flanks, `up` of the half-height above the middle."""
    for z in np.linspace(*ends, count):
        x = 0.5 * width_at(rows, z) * np.sqrt(1 - up**2)
        y = height_at(rows, z, up)
        for side in (-1, 1):
            b.box("window", GLASS, (side * (x - 0.001), y, z), (0.006, size[1], size[0]))


def windscreen(b: Builder, rows: Array, z: float, depth: float) -> None:
    """Add the cockpit's glass: a band around the upper front of a fuselage."""
    angles = np.radians(np.linspace(16, 84, 6))
    for side in (-1, 1):
        rings = []
        for at in np.linspace(z, z + depth, 4):
            middle, half = height_at(rows, at, 0), 0.5 * width_at(rows, at)
            tall = height_at(rows, at, 1) - middle
            flat = [
                (s * half * np.cos(angles), middle + s * tall * np.sin(angles)) for s in (1.03, 0.9)
            ]
            outer, inner = (np.stack(xy, 1) for xy in flat)
            ring = np.concatenate([outer, inner[::-1]]) * [side, 1]
            rings.append(np.column_stack([ring, np.full(12, at)]))
        b.loft("window", GLASS, rings)


def tail(
    b: Builder, rng: np.random.Generator, paint: Material, rows: Array, size: float, kind: str
) -> None:
    """Add fin and tailplane at a fuselage's end; `kind` is "low", "cross" or "tee"."""
    rear = float(rows[-1, 0])
    chord, rise, swept = (
        size * rng.uniform(0.75, 1.0),
        size * rng.uniform(0.9, 1.3),
        rng.uniform(0.35, 0.8),
    )
    root = np.array([0, height_at(rows, rear - 0.9 * chord, 0.6), rear - 1.05 * chord])
    tip = root + [0, rise, swept * rise]
    surface(b, "tail", paint, [root, tip], (chord, 0.5 * chord), 0.1)
    at = {"low": 0.0, "cross": 0.4, "tee": 0.97}[kind]
    hold = root + at * (tip - root) + [0, 0, 0.1 * chord]
    if kind == "low":
        hold = np.array([0, height_at(rows, rear - 0.5 * chord, 0.1), rear - 0.85 * chord])
    out = size * rng.uniform(0.9, 1.25)
    edge = [hold, hold + [out, 0.08 * out * (kind == "low"), 0.6 * swept * out]]
    pair(b, "tail", paint, edge, (0.75 * chord, 0.4 * chord), 0.09)
