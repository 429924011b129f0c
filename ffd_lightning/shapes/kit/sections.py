"""Cross-sections of swept bodies."""

from typing import NamedTuple

import numpy as np

from ffd_lightning.shapes.kit.vectors import Array


class Section(NamedTuple):
    """Where a body that runs along z is cut across, in the body's own unit of length."""

    z: float  # the front is -z
    lift: float  # height of the section's middle
    width: float  # overall, along x
    height: float  # overall, along y

    def ring(
        self, boxiness: float = 0.0, count: int = 20, grow: float = 1.0, side: float = 0.0
    ) -> Array:
        """Return the outline (count, 3) of a superellipse, `grow` times as large, at x = `side`."""
        flat = superellipse(boxiness, count) * np.array([self.width, self.height]) / 2 * grow
        return np.column_stack([side + flat[:, 0], self.lift + flat[:, 1], np.full(count, self.z)])


def superellipse(boxiness: float, count: int = 16) -> Array:
    """Return a ring (count, 2) that fills the square [-1, 1]^2: boxiness 0 is round, 1 square.

    No point lies on an axis when `count` is a multiple of 4.
    """
    angles = 2 * np.pi * (np.arange(count) + 0.5) / count
    circle = np.stack([np.cos(angles), np.sin(angles)], 1)
    ring = np.sign(circle) * np.abs(circle) ** (1 - 0.8 * boxiness)
    return ring / np.abs(ring).max()


def corner_arcs(segments: int) -> tuple[Array, Array]:
    """Return what a rounded rectangle is drawn by: (1 or -1) corners and unit arcs about them.

    Both are (4 * (segments + 1), 2); a point is a corner times the half sides, less the radius,
    plus the arc's direction times the radius.
    """
    quarter = np.linspace(0, np.pi / 2, segments + 1)
    angles = np.concatenate([quarter + i * np.pi / 2 for i in range(4)])
    corners = np.repeat([(1, 1), (-1, 1), (-1, -1), (1, -1)], segments + 1, axis=0)
    return corners, np.column_stack([np.cos(angles), np.sin(angles)])
