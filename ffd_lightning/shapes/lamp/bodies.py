"""Turned bodies of lamps, and their cross-sections."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.curves import monotone
from ffd_lightning.shapes.kit.vectors import Array, about_y


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


def rings_along(
    rows: ArrayLike, section: Array, at: ArrayLike, turn: Array | None, twist: float
) -> list:
    """Return a copy of `section` for each (radius, height) row, moved and turned to its place."""
    matrix, rings = np.eye(3) if turn is None else turn, []
    profile = np.asarray(rows, float)
    for (r, h), degrees in zip(profile, np.linspace(0, twist, len(profile)), strict=True):
        flat = np.column_stack([r * section[:, 0], np.full(len(section), h), r * section[:, 1]])
        rings.append(flat @ about_y(degrees).T @ matrix.T + np.asarray(at, float))
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
    b.loft(part, material, rings_along(rows, section, at, None, twist))


def ball(b: Builder, part: str, material: Material, center: ArrayLike, radii: Array) -> None:
    """Add an ellipsoid whose poles are small flats, so that no face is without area."""
    a = np.linspace(-1.5, 1.5, 15)
    rows = np.stack([radii[0] * np.cos(a), radii[1] * np.sin(a)], 1)
    b.lathe(part, material, rows, center, segments=26)


def add_foot(b: Builder, rng: Rng, material: Material, radius: float, height: float) -> None:
    """Add a flat, stepped, domed, square or hexagonal foot on the floor."""
    kind = draw(rng, ["flat", "stepped", "domed", "square", "hexagon"], [0.3, 0.2, 0.25, 0.15, 0.1])
    edge = 0.12 * height
    rows = [(radius, 0), (radius, height - edge), (radius - edge, height), (0.1 * radius, height)]
    if kind == "stepped":
        step = [(1, 0), (1, 0.5), (0.78, 0.5), (0.75, 1), (0.1, 1)]
        rows = [(r * radius, t * height) for r, t in step]
    elif kind == "domed":
        a = np.linspace(0, 1.5, 7)
        rows = [(radius, 0), *np.stack([radius * np.cos(a), height * (0.3 + 0.7 * np.sin(a))], 1)]
    turned(b, "base", material, rows, outline(kind if kind in ("square", "hexagon") else "round"))


def turned_rows(rng: Rng, radius: float, height: float, neck: float) -> Array:
    """Draw the smooth profile (p, 2) of a vase: `radius` at its widest, `neck` at the top."""
    count = int(rng.integers(1, 4))
    levels = np.array([0, *np.sort(rng.uniform(0.1, 0.88, count)), 0.95, 1])
    levels[1:-2] = np.maximum.accumulate(levels[1:-2] + 0.02 * np.arange(count))
    widths = rng.uniform(0.35, 0.95, count) * radius
    widths[int(rng.integers(count))] = radius
    knots = np.array([rng.uniform(0.45, 0.9) * radius, *widths, 1.2 * neck, neck])
    t = np.linspace(0, 1, 18)
    return np.stack([monotone(levels, knots, t), height * t], 1)
