"""What is sawn: beams, rails, slats, panels."""

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material
from ffd_lightning.shapes.kit.vectors import UNTURNED, Array, Point, Triple, lean


def beam(
    b: Builder, part: str, material: Material, start: Point, end: Point, width: float, height: float
) -> None:
    """Add a straight bar with chamfered edges; `height` is its side nearest to upright."""
    first, last = np.asarray(start, float), np.asarray(end, float)
    length = float(np.linalg.norm(last - first))
    along = (last - first) / length
    side = np.cross((0.0, 1, 0) if abs(along[1]) < 0.95 else (0.0, 0, 1), along)
    side /= np.linalg.norm(side)
    turn = np.column_stack([side, np.cross(along, side), along])
    size, radius = (width, height, length), 0.15 * min(width, height)
    b.rounded_box(part, material, (first + last) / 2, size, radius, turn=turn, segments=1)


def rails(
    b: Builder, part: str, material: Material, points: Array, width: float, height: float
) -> None:
    """Join consecutive points (p, 3), and the last to the first, with beams."""
    for start, end in zip(points, np.roll(points, -1, axis=0), strict=True):
        beam(b, part, material, start, end, width, height)


def slats(
    b: Builder,
    part: str,
    material: Material,
    first: Point,
    last: Point,
    size: Triple,
    count: int,
    turn: Array = UNTURNED,
) -> None:
    """Add `count` equal boards of `size`, evenly from the centre `first` to the centre `last`."""
    edge = 0.2 * float(np.min(size))
    segments = 1 if count > 3 else 3  # a few broad boards are in full view
    for t in np.linspace(0, 1, count) if count > 1 else [0.5]:
        center = (1 - t) * np.asarray(first, float) + t * np.asarray(last, float)
        b.rounded_box(part, material, center, size, edge, turn=turn, segments=segments)


def pad(
    b: Builder,
    part: str,
    material: Material,
    center: Point,
    size: Triple,
    radius: float,
    degrees: float = 0.0,
) -> None:
    """Add an upright panel or cushion, `size` (width, height, thickness), tipped back by `degrees`.

    `radius` rounds its outline as seen from the front.
    """
    width, height, thickness = size
    box, edge = (width, thickness, height), 0.45 * thickness
    b.rounded_box(part, material, center, box, radius, edge=edge, turn=lean(90 + degrees))
