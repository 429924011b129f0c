"""Things laid out on a front: a local frame, plates and turned parts that stand out of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.data.sources.procedural.furniture import lean
from ffd_lightning.data.sources.procedural.shapes import Array, Builder, Material, rotation


@dataclass(frozen=True)
class Front:
    """A plane with a frame: x across, y up, -z out of it.

    Attributes:
        center: of the plane, (3,).
        turn: (3, 3) rotation of the frame.
    """

    center: Array
    turn: Array = field(default_factory=lambda: np.eye(3))

    def at(self, x: float, y: float, z: float = 0.0) -> Array:
        """Return the position in space of a point of the frame, (3,)."""
        return np.asarray(self.center + self.turn @ np.array([x, y, z]))

    def moved(self, x: float, y: float, z: float = 0.0, degrees: float = 0.0) -> Front:
        """Return the front about another of its points, tipped back further by `degrees`."""
        return Front(self.at(x, y, z), self.turn @ lean(degrees))


def plate(
    b: Builder,
    part: str,
    material: Material,
    front: Front,
    spot: tuple[float, float],
    size: tuple[float, float, float],
    radius: float,
    segments: int = 2,
) -> None:
    """Add a plate of `size` (width, height, thickness) half sunk into a front at `spot` (x, y).

    `radius` rounds its outline.
    """
    width, height, thickness = size
    turn = front.turn @ rotation((1, 0, 0), 90)
    box, edge = (width, thickness, height), 0.25 * min(thickness, radius)
    b.rounded_box(part, material, front.at(*spot), box, radius, edge, turn, segments)


def knob(
    b: Builder,
    part: str,
    material: Material,
    front: Front,
    spot: tuple[float, float],
    profile: ArrayLike,
    segments: int = 24,
) -> None:
    """Add a profile of (radius, height) rows turned about the normal of a front at `spot`."""
    b.lathe(part, material, profile, front.at(*spot), segments, front.turn @ lean(-90))
