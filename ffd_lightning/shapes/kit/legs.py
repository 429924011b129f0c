"""Legs of furniture and the stretchers that join them."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.boards import beam, rails
from ffd_lightning.shapes.kit.paths import bend, circle
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair, Triple


@dataclass(frozen=True)
class LegStyle:
    """The look of a leg; it is equally thick all along where nothing else is said."""

    section: str  # "square", "round" or "hairpin" (two thin rods that meet at the foot)
    thickness: float  # across the leg at its widest
    profile: tuple[Pair, ...] = ((0.0, 1.0), (0.5, 1.0), (1.0, 1.0))
    """(height from foot 0 to top 1, fraction of the thickness) rows."""
    stretch: Pair = (1.0, 1.0)  # scales its x and z sides

    @property
    def plain(self) -> bool:
        """Whether rails can be joined to the leg."""
        return self.section != "hairpin"


def draw_leg_style(rng: Rng, thickness: Pair, hairpin: float = 0.1) -> LegStyle:
    """Draw a square, round, turned or (with probability `hairpin`) hairpin leg."""
    across = rng.uniform(*thickness)
    if rng.random() < hairpin:
        return LegStyle("hairpin", across)
    kind = draw(rng, ["square", "round", "turned"], [0.45, 0.35, 0.2])
    if kind == "turned":  # with beads and necks, slender below and full above
        levels = np.linspace(0.2, 0.68, int(rng.integers(3, 6)))
        waves = [(float(y), float(rng.uniform(0.5, 0.95))) for y in levels]
        low = (0.0, 0.5), (0.04, 0.7), (0.09, 0.7), (0.12, 0.42)
        high = (0.74, 0.55), (0.77, 1.0), (0.8, 0.6), (0.83, 1.0), (1.0, 1.0)
        return LegStyle("round", 1.25 * across, (*low, *waves, *high))
    foot = rng.uniform(0.45, 1.0) if rng.random() < 0.6 else 1.0
    knee = rng.uniform(0.5, 0.9)
    profile = ((0.0, foot), (knee / 2, (1 + foot) / 2), (knee, 1.0), (1.0, 1.0))
    return LegStyle(kind, across, profile)


def add_legs(
    b: Builder, part: str, material: Material, style: LegStyle, tops: ArrayLike, feet: ArrayLike
) -> None:
    """Add a leg from each of `tops` to the same row of `feet`, both (n, 3), its ends level."""
    if style.section == "square":
        flat = np.array([(1, 0.8), (0.8, 1), (-0.8, 1), (-1, 0.8)])
        ring = np.concatenate([flat, -flat])
    else:
        ring = circle(16, 1.0, 0.0)[:, [0, 2]]
    level = np.insert(ring * np.asarray(style.stretch) * style.thickness / 2, 1, 0, axis=1)
    rod, spread = max(0.008, 0.16 * style.thickness), 0.9 * style.thickness
    for high, low in zip(np.asarray(tops, float), np.asarray(feet, float), strict=True):
        if style.plain:
            b.loft(part, material, [s * level + low + t * (high - low) for t, s in style.profile])
        else:
            ends = high + spread * np.array([[-1, 0, 1], [1, 0, -1]])
            path = bend([ends[0], low + rod * UP, ends[1]], 0.4 * style.thickness)
            b.tube(part, material, path, rod, segments=8)


def stretchers(
    b: Builder, part: str, material: Material, points: Array, size: float, kind: str
) -> None:
    """Join four legs at `points`, (4, 3) in `corners` order, as "box", "h" or "x"."""
    front_left, front_right, back_right, back_left = points
    bar = partial(beam, b, part, material, width=size)
    if kind == "box":
        rails(b, part, material, points, size, size)
    elif kind == "h":
        bar(front_left, back_left, height=size)
        bar(front_right, back_right, height=size)
        bar((front_left + back_left) / 2, (front_right + back_right) / 2, height=size)
    else:
        bar(front_left, back_right, height=size)
        bar(front_right, back_left, height=0.8 * size)


def add_trestles(
    b: Builder, rng: Rng, material: Material, joint: str, ends: Pair, sizes: Triple
) -> float:
    """Add a trestle at each x of `ends` and a beam, the part `joint`, from one to the other.

    Return the beam's height. `sizes` are the trestles' reach along z either way, their height and
    the thickness of their posts. They are an x, an a, an h or a t seen from the end.
    """
    kind, (reach, top, side) = draw(rng, ["x", "a", "h", "t"]), sizes
    level = {"x": 0.5, "a": 0.35, "h": 0.3, "t": 0.4}[kind] * top
    high, low = {"x": (-0.9, 0.9), "a": (0.3, 0.9), "h": (0.6, 0.6), "t": (0.0, 0.0)}[kind]
    post = LegStyle("square", side, stretch=(0.8, 2.0 if kind == "t" else 1.0))
    for x in ends:
        for sign in (-1, 1) if kind != "t" else (1,):
            head, foot = (x, top - 0.5 * side, sign * high * reach), (x, 0.0, sign * low * reach)
            add_legs(b, "leg", material, post, [head], [foot])
        if kind in ("a", "h"):
            z = (0.35 * high + 0.65 * low) * reach
            beam(b, "leg", material, (x, level, -z), (x, level, z), 0.5 * side, 0.7 * side)
        for y in (top - side / 2, side / 2) if kind in ("h", "t") else (top - side / 2,):
            b.rounded_box("leg", material, (x, y, 0), (0.9 * side, side, 2 * reach), 0.2 * side)
    beam(b, joint, material, (ends[0], level, 0), (ends[1], level, 0), 0.5 * side, side)
    return level
