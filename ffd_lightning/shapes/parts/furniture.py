"""What tables, chairs, benches and sofas have in common: legs, rails, slats, bent tubes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.shapes import Array, Builder, Material, rotation

UP = np.array([0.0, 1.0, 0.0])

Profile = tuple[tuple[float, float], ...]


def corners(width: float, depth: float, height: float, z: float = 0.0) -> Array:
    """Return the (4, 3) corners of a level rectangle about (0, height, z), in order around it.

    The first two are the front ones (-z).
    """
    signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    flat = signs * np.array([width, depth]) / 2 + np.array([0, z])
    return np.insert(flat, 1, height, axis=1)


def circle(count: int, radius: float, height: float, degrees: float = 0.0) -> Array:
    """Return `count` points (count, 3) evenly around the y axis, the first turned by `degrees`."""
    a = np.radians(degrees) + 2 * np.pi * np.arange(count) / count
    return np.stack([radius * np.cos(a), np.full(count, height), radius * np.sin(a)], 1)


def bend(points: ArrayLike, radius: float, steps: int = 5) -> Array:
    """Return the polyline (p, 3) with its inner corners rounded by about `radius`."""
    corners_ = np.asarray(points, float)
    path = [corners_[0]]
    for before, corner, after in zip(corners_, corners_[1:], corners_[2:], strict=False):
        to, away = before - corner, after - corner
        lengths = np.linalg.norm(to), np.linalg.norm(away)
        reach = min(radius, 0.45 * lengths[0], 0.45 * lengths[1])
        a, b = corner + to * reach / lengths[0], corner + away * reach / lengths[1]
        for t in np.linspace(0, 1, steps + 1):
            path.append((1 - t) ** 2 * a + 2 * t * (1 - t) * corner + t**2 * b)
    return np.array([*path, corners_[-1]])


def beam(
    builder: Builder,
    part: str,
    material: Material,
    start: ArrayLike,
    end: ArrayLike,
    width: float,
    height: float,
) -> None:
    """Add a straight bar with chamfered edges; `height` is its side nearest to upright."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    length = float(np.linalg.norm(b - a))
    along = (b - a) / length
    helper = np.array([0.0, 1, 0]) if abs(along[1]) < 0.95 else np.array([0.0, 0, 1])
    side = np.cross(helper, along)
    side /= np.linalg.norm(side)
    turn = np.column_stack([side, np.cross(along, side), along])
    builder.rounded_box(
        part,
        material,
        (a + b) / 2,
        (width, height, length),
        0.15 * min(width, height),
        turn=turn,
        segments=1,
    )


def rails(
    builder: Builder, part: str, material: Material, points: Array, width: float, height: float
) -> None:
    """Join consecutive points (p, 3), and the last to the first, with beams."""
    for start, end in zip(points, np.roll(points, -1, axis=0), strict=True):
        beam(builder, part, material, start, end, width, height)


def slats(
    builder: Builder,
    part: str,
    material: Material,
    first: ArrayLike,
    last: ArrayLike,
    size: ArrayLike,
    count: int,
    turn: Array | None = None,
) -> None:
    """Add `count` equal boards of `size`, evenly from the centre `first` to the centre `last`."""
    board = np.asarray(size, float)
    edge = 0.2 * float(board.min())
    segments = 1 if count > 3 else 3  # a few broad boards are in full view
    for t in np.linspace(0, 1, count) if count > 1 else [0.5]:
        center = (1 - t) * np.asarray(first, float) + t * np.asarray(last, float)
        builder.rounded_box(part, material, center, board, edge, turn=turn, segments=segments)


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


def draw_leg_style(
    rng: np.random.Generator, thickness: tuple[float, float], hairpin: float = 0.1
) -> LegStyle:
    """Draw a square, round, turned or (with probability `hairpin`) hairpin leg."""
    across = rng.uniform(*thickness)
    if rng.random() < hairpin:
        return LegStyle("hairpin", across, ())
    kind = str(rng.choice(["square", "round", "turned"], p=[0.45, 0.35, 0.2]))
    if kind == "turned":
        return LegStyle("round", 1.25 * across, _turned_profile(rng))
    foot = rng.uniform(0.45, 1.0) if rng.random() < 0.6 else 1.0
    knee = rng.uniform(0.5, 0.9)
    return LegStyle(
        kind, across, ((0.0, foot), (knee / 2, (1 + foot) / 2), (knee, 1.0), (1.0, 1.0))
    )


def _turned_profile(rng: np.random.Generator) -> Profile:
    """Draw the beads and necks of a turned leg, slender below and full above."""
    rows = [(0.0, 0.5), (0.04, 0.7), (0.09, 0.7), (0.12, 0.42)]
    levels = np.linspace(0.2, 0.68, int(rng.integers(3, 6)))
    rows += [(float(y), float(rng.uniform(0.5, 0.95))) for y in levels]
    return (*rows, (0.74, 0.55), (0.77, 1.0), (0.8, 0.6), (0.83, 1.0), (1.0, 1.0))


def add_leg(
    builder: Builder,
    part: str,
    material: Material,
    style: LegStyle,
    top: ArrayLike,
    foot: ArrayLike,
    stretch: tuple[float, float] = (1.0, 1.0),
) -> None:
    """Add a leg from `top` to `foot`, both its ends level; `stretch` scales its x and z sides."""
    a, b = np.asarray(foot, float), np.asarray(top, float)
    if not style.plain:
        rod, spread = max(0.008, 0.16 * style.thickness), 0.9 * style.thickness
        ends = b + spread * np.array([[-1, 0, 1], [1, 0, -1]])
        path = bend([ends[0], a + rod * UP, ends[1]], 0.4 * style.thickness)
        builder.tube(part, material, path, rod, 8)
        return
    if style.section == "square":
        flat = np.array([(1, 0.8), (0.8, 1), (-0.8, 1), (-1, 0.8)])
        ring = np.concatenate([flat, -flat])
    else:
        ring = circle(16, 1.0, 0.0)[:, [0, 2]]
    ring = ring * np.asarray(stretch) * style.thickness / 2
    builder.loft(
        part,
        material,
        [np.insert(scale * ring, 1, 0, axis=1) + a + t * (b - a) for t, scale in style.profile],
    )


def add_legs(
    builder: Builder, part: str, material: Material, style: LegStyle, tops: Array, feet: Array
) -> None:
    """Add one leg from each of `tops` to the same row of `feet`, both (n, 3)."""
    for top, foot in zip(tops, feet, strict=True):
        add_leg(builder, part, material, style, top, foot)


def stretchers(
    builder: Builder,
    part: str,
    material: Material,
    points: Array,
    size: float,
    kind: str,
) -> None:
    """Join four legs at `points`, (4, 3) in `corners` order, as "box", "h" or "x"."""
    front_left, front_right, back_right, back_left = points
    if kind == "box":
        rails(builder, part, material, points, size, size)
    elif kind == "h":
        for start, end in ((front_left, back_left), (front_right, back_right)):
            beam(builder, part, material, start, end, size, size)
        middles = (front_left + back_left) / 2, (front_right + back_right) / 2
        beam(builder, part, material, *middles, size, size)
    elif kind == "x":
        beam(builder, part, material, front_left, back_right, size, size)
        beam(builder, part, material, front_right, back_left, size, 0.8 * size)
    else:
        raise ValueError(f"unknown stretchers {kind!r}")


def pad(
    builder: Builder,
    part: str,
    material: Material,
    center: ArrayLike,
    size: tuple[float, float, float],
    radius: float,
    degrees: float = 0.0,
) -> None:
    """Add an upright panel or cushion, `size` (width, height, thickness), tipped back by `degrees`.

    `radius` rounds its outline as seen from the front.
    """
    width, height, thickness = size
    turn = lean(90 + degrees)
    box = (width, thickness, height)
    builder.rounded_box(part, material, center, box, radius, 0.45 * thickness, turn)


def sheet(
    builder: Builder, part: str, material: Material, grid: ArrayLike, thickness: float
) -> None:
    """Add a curved sheet: a grid of points (n, m, 3) thickened along its normals."""
    points = np.asarray(grid, float)
    n, m = points.shape[:2]
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    offset = normals * thickness / 2
    index = np.arange(n * m).reshape(n, m)
    border = np.concatenate([index[0], index[1:, -1], index[-1, -2::-1], index[-2:0:-1, 0]])
    following = np.roll(border, -1)
    quads = [(index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])]
    quads += [tuple(q + n * m for q in quads[0])]
    quads += [(border, following, following + n * m, border + n * m)]
    faces = [np.stack([q[i].ravel() for i in t], 1) for q in quads for t in ((0, 1, 2), (0, 2, 3))]
    vertices = np.concatenate([(points + offset).reshape(-1, 3), (points - offset).reshape(-1, 3)])
    builder.add(part, material, vertices, np.concatenate(faces))


def fill_side(
    builder: Builder, material: Material, tops: Array, deck: float, part: str, fill: str, gap: float
) -> None:
    """Fill the space between two posts that end at `tops`, (2, 3), down to the deck.

    `fill` is "bars", "slats" or "panel"; `gap` is the distance between bars or slats.
    """
    first, last = tops - 0.03 * UP
    beam(builder, part, material, first, last, 0.03, 0.05)
    rise, middle = first[1] - deck, (first + last) / 2
    length = float(np.linalg.norm(last - first))
    along_z = abs(last[2] - first[2]) > abs(last[0] - first[0])
    if fill == "bars":
        for t in np.linspace(0, 1, round(length / gap) + 1)[1:-1]:
            point = first + t * (last - first)
            builder.cylinder(part, material, point, point - rise * UP, 0.011, segments=8)
        return
    tall = 0.5 * gap if fill == "slats" else rise
    count = max(1, round(rise / gap)) if fill == "slats" else 1
    size = (0.018, tall, length) if along_z else (length, tall, 0.018)
    low, high = middle - (rise - tall / 2) * UP, middle - tall / 2 * UP
    slats(builder, part, material, low, high, size, count)


def arc(
    builder: Builder,
    part: str,
    material: Material,
    radii: tuple[float, float],
    heights: tuple[ArrayLike, ArrayLike],
    angles: Array,
) -> None:
    """Sweep a chamfered rectangle around the y axis; angle 0 is +z, heights may vary with it."""
    low, high = (np.broadcast_to(np.asarray(h, float), len(angles)) for h in heights)
    flat = np.array(
        [(0, 0.06), (0.1, 0), (0.9, 0), (1, 0.06), (1, 0.9), (0.88, 1), (0.12, 1), (0, 0.9)]
    )
    rings = []
    for angle, bottom, top in zip(angles, low, high, strict=True):
        r = radii[0] + flat[:, 0] * (radii[1] - radii[0])
        y = bottom + flat[:, 1] * (top - bottom)
        rings.append(np.stack([r * np.sin(angle), y, r * np.cos(angle)], 1))
    builder.loft(part, material, rings)


def lean(degrees: float) -> Array:
    """Return the rotation that tips an upright's top backward (+z) by `degrees`."""
    return rotation((1, 0, 0), degrees)


def draw(rng: np.random.Generator, choices: Sequence[str], p: Sequence[float] | None = None) -> str:
    """Draw one of `choices`, evenly or with probabilities `p`."""
    return str(rng.choice(choices, p=p))
