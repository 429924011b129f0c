"""Shades of lamps and the bulbs within them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.vectors import UP, Array, lean, vec
from ffd_lightning.shapes.lamp.bodies import outline, rings_along
from ffd_lightning.shapes.lamp.materials import draw_metal, draw_shade_material

FLIP = lean(180)
"""Turns a shade that hangs into one that opens upward."""
_GLOW = Material((1.0, 0.95, 0.75))


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


def _shade_rows(rng: Rng, kind: str, steps: int) -> Array:
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
    rng: Rng,
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
    b.loft("shade", shade.material, rings_along(loop, shade.section, at, turn, 0), caps=False)
    if shade.trim is not None:
        for r, h in shade.rows[[0, -1]]:
            out, into = r + wall / 2, r - wall
            band = [(out, -wall), (out, wall), (into, wall), (into, -wall)]
            rows = np.array([*band, band[0]]) + (0, h)
            b.loft("shade", shade.trim, rings_along(rows, shade.section, at, turn, 0), caps=False)
    mouth = shade.rows[-1, 0]
    if mouth < 0.05:
        low, high = (at + matrix @ (y * UP) for y in (-0.02, 0.025))
        radius = 1.15 * mouth
        b.cylinder("shade", metal, low, high, radius=radius, radius_end=0.6 * mouth, segments=14)
        return
    count = 4 if len(shade.section) == 12 else 3
    level = vec(0, -2 * wall, 0)
    for i in range(count):
        x, z = shade.section[i * len(shade.section) // count] * (mouth - 0.5 * wall)
        spoke = np.array([[0, 0, 0], [x, 0, z]]) + level
        b.tube("shade", metal, spoke @ matrix.T + at, 0.004, segments=6)
    low, high = (matrix @ level * k + at for k in (1.6, 0.2))
    b.cylinder("shade", metal, low, high, 0.012, segments=10)


def add_bulb(
    b: Builder, metal: Material, socket: ArrayLike, size: float, turn: Array | None = None
) -> None:
    """Add a bulb, `size` long, in a holder that starts at `socket` and points up (or `turn`ed)."""
    at, matrix = np.asarray(socket, float), np.eye(3) if turn is None else turn
    b.cylinder("bulb", metal, at, at + matrix @ (0.4 * size * UP), 0.17 * size, segments=10)
    rows = [(0.14, 0.36), (0.2, 0.48), (0.31, 0.68), (0.3, 0.82), (0.18, 0.95), (0.03, 1.0)]
    profile = size * np.array(rows)
    b.lathe("bulb", _GLOW, profile, at, segments=12 if size > 0.08 else 8, turn=matrix)


def add_harp(b: Builder, metal: Material, low: float, high: float, reach: float) -> None:
    """Add the wire loop that carries a shade at `high` around the bulb whose holder is at `low`."""
    a = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 9)
    for sign in (-1, 1):
        x, y = sign * reach * np.cos(a), (low + high) / 2 + (high - low) / 2 * np.sin(a)
        b.tube("shade", metal, np.stack([x, y, 0 * a], 1), 0.004, segments=6)
    rows = [(0.005, 0), (0.006, 0.012), (0.014, 0.024), (0.012, 0.04), (0.003, 0.05)]
    b.lathe("shade", metal, rows, (0, high - 0.005, 0), segments=10)


CLOTH = {"drum": 0.3, "empire": 0.35, "cone": 0.1, "bell": 0.2, "dome": 0.05}
HEADS = {"empire": 0.25, "cone": 0.25, "bell": 0.15, "dome": 0.35}


def add_head(
    b: Builder, shade: Shade, metal: Material, at: Array, turn: Array, bulb: float
) -> None:
    """Add a shade and its bulb below `at`, turned about there."""
    add_shade(b, shade, metal, at, turn)
    add_bulb(b, metal, at, min(bulb, 0.8 * shade.height), turn @ FLIP)
