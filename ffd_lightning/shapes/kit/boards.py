"""What is sawn: beams, rails, slats, panels and the filling between posts."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material
from ffd_lightning.shapes.kit.vectors import UP, Array, Triple, lean, vec


def beam(
    b: Builder,
    part: str,
    material: Material,
    start: ArrayLike,
    end: ArrayLike,
    width: float,
    height: float,
) -> None:
    """Add a straight bar with chamfered edges; `height` is its side nearest to upright."""
    first, last = np.asarray(start, float), np.asarray(end, float)
    length = float(np.linalg.norm(last - first))
    along = (last - first) / length
    helper = vec(0.0, 1, 0) if abs(along[1]) < 0.95 else vec(0.0, 0, 1)
    side = np.cross(helper, along)
    side /= np.linalg.norm(side)
    turn = np.column_stack([side, np.cross(along, side), along])
    size, radius = (width, height, length), 0.15 * min(width, height)
    b.rounded_box(part, material, (first + last) / 2, size, radius, turn=turn, segments=1)


def rails(
    b: Builder, part: str, material: Material, points: Array, width: float, height: float
) -> None:
    """Join consecutive points (p, 3), and the last to the first, with beams."""
    for start, end in zip(points, np.roll(points, -1, axis=0), strict=True):
        beam(b, part, material, start, end, width=width, height=height)


def slats(
    b: Builder,
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
        b.rounded_box(part, material, center, board, edge, turn=turn, segments=segments)


def pad(
    b: Builder,
    part: str,
    material: Material,
    center: ArrayLike,
    size: Triple,
    radius: float,
    degrees: float = 0.0,
) -> None:
    """Add an upright panel or cushion, `size` (width, height, thickness), tipped back by `degrees`.

    `radius` rounds its outline as seen from the front.
    """
    width, height, thickness = size
    turn = lean(90 + degrees)
    box = (width, thickness, height)
    edge = 0.45 * thickness
    b.rounded_box(part, material, center, box, radius=radius, edge=edge, turn=turn)


def enclose(
    b: Builder, material: Material, tops: Array, *, deck: float, fill: str, gap: float
) -> None:
    """Fill the back and both ends of a seat between posts that end at `tops`, (4, 3).

    They are in the order of `corners` and reach down to the height `deck`; the ends are as high as
    the lower of their posts. `fill` is "bars", "slats" or "panel"; `gap` is the distance between
    bars or slats.
    """
    _fill_side(b, material, tops[2:], deck, "back", fill, gap)
    for pair in (tops[[0, 3]], tops[[1, 2]]):
        pair[:, 1] = pair[:, 1].min()
        _fill_side(b, material, pair, deck, "arm", fill, gap)


def _fill_side(
    b: Builder, material: Material, tops: Array, deck: float, part: str, fill: str, gap: float
) -> None:
    """Fill the space between two posts that end at `tops`, (2, 3), down to the deck."""
    first, last = tops - 0.03 * UP
    beam(b, part, material, first, last, width=0.03, height=0.05)
    rise, middle = first[1] - deck, (first + last) / 2
    length = float(np.linalg.norm(last - first))
    along_z = abs(last[2] - first[2]) > abs(last[0] - first[0])
    if fill == "bars":
        for t in np.linspace(0, 1, round(length / gap) + 1)[1:-1]:
            point = first + t * (last - first)
            b.cylinder(part, material, point, point - rise * UP, 0.011, segments=8)
        return
    tall = 0.5 * gap if fill == "slats" else rise
    count = max(1, round(rise / gap)) if fill == "slats" else 1
    size = (0.018, tall, length) if along_z else (length, tall, 0.018)
    low, high = middle - (rise - tall / 2) * UP, middle - tall / 2 * UP
    slats(b, part, material, low, high, size, count)
