"""What all lamps have in common: shades, bulbs, bases, turned bodies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from ffd_lightning.shapes.parts.furniture import UP, draw
from ffd_lightning.shapes.shapes import (
    Array,
    Builder,
    Material,
    pick_material,
    rotation,
)

FLIP = rotation((1, 0, 0), 180)
"""Turns a shade that hangs into one that opens upward."""

_GLOW = Material((1.0, 0.95, 0.75))
_BRASS = ((0.75, 0.58, 0.28), (0.6, 0.42, 0.2), (0.82, 0.68, 0.42))


def draw_metal(rng: np.random.Generator) -> Material:
    """Draw the metal of poles and fittings: steel, brass or lacquered."""
    kind = draw(rng, ["metal", "brass", "paint"], [0.5, 0.35, 0.15])
    if kind == "brass":
        return Material(_BRASS[int(rng.integers(len(_BRASS)))])
    return pick_material(rng, kind)


def draw_shade_material(rng: np.random.Generator, glass: float = 0.15) -> Material:
    """Draw a pale cloth, any other fabric, paint, metal or (with probability `glass`) glass."""
    if rng.random() < glass:
        return pick_material(rng, "glass")
    kind = draw(rng, ["pale", "fabric", "paint", "metal"], [0.35, 0.35, 0.2, 0.1])
    if kind != "pale":
        return pick_material(rng, kind)
    value, warmth = rng.uniform(0.78, 0.97), rng.uniform(0.03, 0.25)
    color = (value, value * (1 - 0.4 * warmth), value * (1 - warmth))
    pattern = draw(rng, ["", "fabric", "stripes"], [0.5, 0.35, 0.15])
    return Material(color, pattern, 4.0, seed=int(rng.integers(1 << 30)))


def draw_body_material(rng: np.random.Generator) -> Material:
    """Draw the material of a base's body: ceramic, wood, metal or coloured plastic."""
    return pick_material(
        rng, draw(rng, ["paint", "wood", "metal", "plastic"], [0.4, 0.3, 0.2, 0.1])
    )


def outline(kind: str, count: int = 32) -> Array:
    """Return a unit cross-section (k, 2): "round", "square", "hexagon", "fluted" or "oval"."""
    if kind in ("square", "hexagon"):
        sides = 4 if kind == "square" else 6
        a = np.pi / sides + 2 * np.pi * np.arange(sides + 1) / sides
        ends = np.stack([np.cos(a), np.sin(a)], 1)
        t = np.arange(3)[None, :, None] / 3
        return (ends[:-1, None] * (1 - t) + ends[1:, None] * t).reshape(-1, 2)
    count = 2 * count if kind == "fluted" else count
    a = 2 * np.pi * np.arange(count) / count
    r = 1 + 0.05 * np.cos(count / 4 * a) if kind == "fluted" else np.ones(count)
    return np.stack([r * np.cos(a), r * np.sin(a) * (0.6 if kind == "oval" else 1)], 1)


def _rings(
    rows: ArrayLike, section: Array, at: ArrayLike, turn: Array | None, twist: float
) -> list:
    """Return a copy of `section` for each (radius, height) row, moved and turned to its place."""
    matrix, rings = np.eye(3) if turn is None else turn, []
    profile = np.asarray(rows, float)
    for (r, h), degrees in zip(profile, np.linspace(0, twist, len(profile)), strict=True):
        flat = np.column_stack([r * section[:, 0], np.full(len(section), h), r * section[:, 1]])
        rings.append(flat @ rotation(UP, degrees).T @ matrix.T + np.asarray(at, float))
    return rings


def turned(
    b: Builder,
    part: str,
    material: Material,
    rows: ArrayLike,
    section: Array,
    at: ArrayLike = (0, 0, 0),
    twist: float = 0.0,
) -> None:
    """Add a solid of `section` (k, 2) scaled along (radius, height) rows, twisted by degrees."""
    b.loft(part, material, _rings(rows, section, at, None, twist))


def ball(b: Builder, part: str, material: Material, center: ArrayLike, radii: Array) -> None:
    """Add an ellipsoid whose poles are small flats, so that no face is without area."""
    a = np.linspace(-1.5, 1.5, 15)
    rows = np.stack([radii[0] * np.cos(a), radii[1] * np.sin(a)], 1)
    b.lathe(part, material, rows, center, 26)


@dataclass(frozen=True)
class Shade:
    """A thin open shell.

    Attributes:
        rows: (radius, height) from the lower opening to the upper one, which is at height 0.
        section: (k, 2) unit cross-section.
        material: of the skin.
        trim: of the rims, or None for no rims.
    """

    rows: Array
    section: Array
    material: Material
    trim: Material | None = None

    @property
    def height(self) -> float:
        """Distance between the openings."""
        return float(-self.rows[0, 1])


def _shade_rows(rng: np.random.Generator, kind: str, steps: int) -> Array:
    """Draw (radius, height) rows within 0 to 1, from the lower opening up."""
    t = np.linspace(0, 1, 3 if kind in ("drum", "empire", "cone") else steps + 1)
    if kind in ("drum", "empire", "cone"):
        low, high = {"drum": (0.85, 1.0), "empire": (0.4, 0.75), "cone": (0.1, 0.3)}[kind]
        return np.stack([1 - (1 - rng.uniform(low, high)) * t, t], 1)
    if kind == "bell":
        top = rng.uniform(0.25, 0.55)
        return np.stack([top + (1 - top) * (1 - t) ** rng.uniform(1.6, 3), t], 1)
    first = 0.0 if kind == "dome" else rng.uniform(-0.9, -0.5)
    power, a = rng.uniform(0.7, 1.25), first + t * (1.45 - first)
    rise = np.sign(a) * np.abs(np.sin(a)) ** power
    r = np.abs(np.cos(a)) ** power
    return np.stack([r / r.max(), (rise - rise[0]) / (rise[-1] - rise[0])], 1)


def draw_shade(
    rng: np.random.Generator,
    radius: float,
    height: float,
    kinds: dict[str, float],
    fine: bool = True,
    glass: float = 0.15,
) -> Shade:
    """Draw a shade of one of `kinds` (with their weights) that is `radius` wide at its widest.

    Kinds: "drum", "empire", "cone" (straight), "bell", "dome", "bowl" (curved). `fine` spends
    more faces on it and allows cross-sections other than round ones.
    """
    weights = np.array(list(kinds.values()))
    kind = draw(rng, list(kinds), weights / weights.sum())
    rows = _shade_rows(rng, kind, 8 if fine else 4) * np.array([radius, height])
    sections = ["round", "square", "hexagon", "fluted", "oval"]
    other = 0.12 if kind in ("drum", "empire", "bell") else 0.0
    section = draw(rng, sections, [1 - 3 * other, other, 0.5 * other, other, 0.5 * other])
    shape = outline(section if fine else "round", 28 if fine else 14)
    if section == "square" and fine:
        shape = 1.25 * shape
    trim = draw_metal(rng) if fine and rng.random() < 0.35 else None
    return Shade(rows - (0, height), shape, draw_shade_material(rng, glass), trim)


def add_shade(
    b: Builder, shade: Shade, metal: Material, top: ArrayLike, turn: Array | None = None
) -> None:
    """Hang a shade below `top`, the middle of its upper opening; `turn` tilts it about there."""
    at, matrix = np.asarray(top, float), np.eye(3) if turn is None else turn
    wall = max(0.005, 0.02 * shade.rows[:, 0].max())
    inner = np.maximum(shade.rows - (wall, 0), 0.002)[::-1] * (1, 0) + shade.rows[::-1] * (0, 1)
    loop = np.concatenate([shade.rows, inner, shade.rows[:1]])
    b.loft("shade", shade.material, _rings(loop, shade.section, at, turn, 0), caps=False)
    if shade.trim is not None:
        for r, h in shade.rows[[0, -1]]:
            band = [
                (r + wall / 2, -wall),
                (r + wall / 2, wall),
                (r - wall, wall),
                (r - wall, -wall),
            ]
            rows = np.array([*band, band[0]]) + (0, h)
            b.loft("shade", shade.trim, _rings(rows, shade.section, at, turn, 0), caps=False)
    mouth = shade.rows[-1, 0]
    if mouth < 0.05:
        low, high = (at + matrix @ (y * UP) for y in (-0.02, 0.025))
        b.cylinder("shade", metal, low, high, 1.15 * mouth, 0.6 * mouth, 14)
        return
    count = 4 if len(shade.section) == 12 else 3
    level = np.array([0, -2 * wall, 0])
    for i in range(count):
        x, z = shade.section[i * len(shade.section) // count] * (mouth - 0.5 * wall)
        spoke = np.array([[0, 0, 0], [x, 0, z]]) + level
        b.tube("shade", metal, spoke @ matrix.T + at, 0.004, 6)
    low, high = (matrix @ level * k + at for k in (1.6, 0.2))
    b.cylinder("shade", metal, low, high, 0.012, segments=10)


def add_bulb(
    b: Builder, metal: Material, socket: ArrayLike, size: float, turn: Array | None = None
) -> None:
    """Add a bulb, `size` long, in a holder that starts at `socket` and points up (or `turn`ed)."""
    at, matrix = np.asarray(socket, float), np.eye(3) if turn is None else turn
    b.cylinder("bulb", metal, at, at + matrix @ (0.4 * size * UP), 0.17 * size, segments=10)
    rows = [(0.14, 0.36), (0.2, 0.48), (0.31, 0.68), (0.3, 0.82), (0.18, 0.95), (0.03, 1.0)]
    b.lathe("bulb", _GLOW, size * np.array(rows), at, 12 if size > 0.08 else 8, matrix)


def add_harp(b: Builder, metal: Material, low: float, high: float, reach: float) -> None:
    """Add the wire loop that carries a shade at `high` around the bulb whose holder is at `low`."""
    a = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 9)
    for sign in (-1, 1):
        x, y = sign * reach * np.cos(a), (low + high) / 2 + (high - low) / 2 * np.sin(a)
        b.tube("shade", metal, np.stack([x, y, 0 * a], 1), 0.004, 6)
    rows = [(0.005, 0), (0.006, 0.012), (0.014, 0.024), (0.012, 0.04), (0.003, 0.05)]
    b.lathe("shade", metal, rows, (0, high - 0.005, 0), 10)


def add_foot(
    b: Builder, rng: np.random.Generator, material: Material, radius: float, height: float
) -> None:
    """Add a flat, stepped, domed, square or hexagonal foot on the floor."""
    kind = draw(rng, ["flat", "stepped", "domed", "square", "hexagon"], [0.3, 0.2, 0.25, 0.15, 0.1])
    edge = 0.12 * height
    rows = [(radius, 0), (radius, height - edge), (radius - edge, height), (0.1 * radius, height)]
    if kind == "stepped":
        rows = [
            (radius, 0),
            (radius, height / 2),
            (0.78 * radius, height / 2),
            (0.75 * radius, height),
        ]
        rows += [(0.1 * radius, height)]
    elif kind == "domed":
        a = np.linspace(0, 1.5, 7)
        rows = [(radius, 0), *np.stack([radius * np.cos(a), height * (0.3 + 0.7 * np.sin(a))], 1)]
    turned(b, "base", material, rows, outline(kind if kind in ("square", "hexagon") else "round"))


def turned_rows(rng: np.random.Generator, radius: float, height: float, neck: float) -> Array:
    """Draw the smooth profile (p, 2) of a vase: `radius` at its widest, `neck` at the top."""
    count = int(rng.integers(1, 4))
    levels = np.array([0, *np.sort(rng.uniform(0.1, 0.88, count)), 0.95, 1])
    levels[1:-2] = np.maximum.accumulate(levels[1:-2] + 0.02 * np.arange(count))
    widths = rng.uniform(0.35, 0.95, count) * radius
    widths[int(rng.integers(count))] = radius
    knots = np.array([rng.uniform(0.45, 0.9) * radius, *widths, 1.2 * neck, neck])
    t = np.linspace(0, 1, 18)
    return np.stack([PchipInterpolator(levels, knots)(t), height * t], 1)
