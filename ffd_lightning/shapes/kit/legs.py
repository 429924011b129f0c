"""Legs of furniture and the stretchers that join them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.boards import beam, rails
from ffd_lightning.shapes.kit.paths import bend, circle
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair

Profile = tuple[Pair, ...]
STRAIGHT: Profile = ((0.0, 1.0), (0.5, 1.0), (1.0, 1.0))
"""The profile of a leg that is equally thick all along."""


@dataclass(frozen=True)
class LegStyle:
    """The look of a leg.

    Attributes:
        section: "square", "round" or "hairpin" (two thin rods that meet at the foot).
        thickness: across the leg at its widest.
        profile: (height from foot 0 to top 1, fraction of the thickness) rows.
    """

    section: str
    thickness: float
    profile: Profile

    @property
    def plain(self) -> bool:
        """Whether rails can be joined to the leg."""
        return self.section != "hairpin"


def square_post(thickness: float) -> LegStyle:
    """Return a square leg that is equally thick all along."""
    return LegStyle("square", thickness, STRAIGHT)


def draw_leg_style(rng: Rng, thickness: Pair, hairpin: float = 0.1) -> LegStyle:
    """Draw a square, round, turned or (with probability `hairpin`) hairpin leg."""
    across = rng.uniform(*thickness)
    if rng.random() < hairpin:
        return LegStyle("hairpin", across, ())
    kind = str(rng.choice(["square", "round", "turned"], p=[0.45, 0.35, 0.2]))
    if kind == "turned":
        return LegStyle("round", 1.25 * across, _turned_profile(rng))
    foot = rng.uniform(0.45, 1.0) if rng.random() < 0.6 else 1.0
    knee = rng.uniform(0.5, 0.9)
    profile = ((0.0, foot), (knee / 2, (1 + foot) / 2), (knee, 1.0), (1.0, 1.0))
    return LegStyle(kind, across, profile)


def _turned_profile(rng: Rng) -> Profile:
    """Draw the beads and necks of a turned leg, slender below and full above."""
    rows = [(0.0, 0.5), (0.04, 0.7), (0.09, 0.7), (0.12, 0.42)]
    levels = np.linspace(0.2, 0.68, int(rng.integers(3, 6)))
    rows += [(float(y), float(rng.uniform(0.5, 0.95))) for y in levels]
    return (*rows, (0.74, 0.55), (0.77, 1.0), (0.8, 0.6), (0.83, 1.0), (1.0, 1.0))


def add_leg(
    b: Builder,
    part: str,
    material: Material,
    style: LegStyle,
    top: ArrayLike,
    foot: ArrayLike,
    stretch: Pair = (1.0, 1.0),
) -> None:
    """Add a leg from `top` to `foot`, both its ends level; `stretch` scales its x and z sides."""
    low, high = np.asarray(foot, float), np.asarray(top, float)
    if not style.plain:
        rod, spread = max(0.008, 0.16 * style.thickness), 0.9 * style.thickness
        ends = high + spread * np.array([[-1, 0, 1], [1, 0, -1]])
        path = bend([ends[0], low + rod * UP, ends[1]], 0.4 * style.thickness)
        b.tube(part, material, path, rod, segments=8)
        return
    if style.section == "square":
        flat = np.array([(1, 0.8), (0.8, 1), (-0.8, 1), (-1, 0.8)])
        ring = np.concatenate([flat, -flat])
    else:
        ring = circle(count=16, radius=1.0, height=0.0)[:, [0, 2]]
    ring = ring * np.asarray(stretch) * style.thickness / 2
    level, along = np.insert(ring, 1, 0, axis=1), high - low
    rings = [scale * level + low + t * along for t, scale in style.profile]
    b.loft(part, material, rings)


def add_legs(
    b: Builder, part: str, material: Material, style: LegStyle, tops: Array, feet: Array
) -> None:
    """Add one leg from each of `tops` to the same row of `feet`, both (n, 3)."""
    for top, foot in zip(tops, feet, strict=True):
        add_leg(b, part, material, style, top, foot)


def stretchers(
    b: Builder, part: str, material: Material, points: Array, size: float, kind: str
) -> None:
    """Join four legs at `points`, (4, 3) in `corners` order, as "box", "h" or "x"."""
    front_left, front_right, back_right, back_left = points
    if kind == "box":
        rails(b, part, material, points, width=size, height=size)
    elif kind == "h":
        for start, end in ((front_left, back_left), (front_right, back_right)):
            beam(b, part, material, start, end, width=size, height=size)
        middles = (front_left + back_left) / 2, (front_right + back_right) / 2
        beam(b, part, material, *middles, width=size, height=size)
    elif kind == "x":
        beam(b, part, material, front_left, back_right, width=size, height=size)
        beam(b, part, material, front_right, back_left, width=size, height=0.8 * size)
    else:
        raise ValueError(f"unknown stretchers {kind!r}")


def add_trestle(
    b: Builder, material: Material, kind: str, x: float, spread: float, top: float, side: float
) -> float:
    """Add a trestle at `x`, "x", "a", "h" or "t" seen from the end; return where a beam meets it.

    Its feet and its head reach +-`spread` along z, its posts are `side` thick.
    """
    level = {"x": 0.5, "a": 0.35, "h": 0.3, "t": 0.4}[kind] * top
    high, low = {"x": (-0.9, 0.9), "a": (0.3, 0.9), "h": (0.6, 0.6), "t": (0.0, 0.0)}[kind]
    for sign in (-1, 1) if kind != "t" else (1,):
        ends = (x, top - 0.5 * side, sign * high * spread), (x, 0.0, sign * low * spread)
        add_leg(b, "leg", material, square_post(side), *ends, (0.8, 2.0 if kind == "t" else 1.0))
    if kind in ("a", "h"):
        reach = (0.35 * high + 0.65 * low) * spread
        start, end = (x, level, -reach), (x, level, reach)
        beam(b, "leg", material, start, end, width=0.5 * side, height=0.7 * side)
    for y in (top - side / 2, side / 2) if kind in ("h", "t") else (top - side / 2,):
        b.rounded_box("leg", material, (x, y, 0), (0.9 * side, side, 2 * spread), 0.2 * side)
    return level
