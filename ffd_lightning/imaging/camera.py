"""Cameras: where an image is taken from, and where points fall in it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

FIELD_OF_VIEW = 40.0
"""Vertical, in degrees, of the cameras that frame a shape."""
RADIUS = 0.5
"""Of the sphere that a shape of bounding-box diagonal 1 lies in; it fills the field of view."""
FRAMING_DISTANCE = RADIUS / math.sin(math.radians(FIELD_OF_VIEW / 2))
"""From where it does."""


class CameraPose(NamedTuple):
    """Position and orthonormal axes of a camera, (3,) float64 each."""

    position: NDArray[np.float64]
    right: NDArray[np.float64]
    up: NDArray[np.float64]
    forward: NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """A pinhole camera, upright, that looks at a point; by default one that frames a shape.

    Convention:
        y is up and objects face -z. Azimuth 0 looks at the front from -z, azimuth 90 at the
        object's own right from +x. Lengths are in the unit of what is seen.

    Attributes:
        azimuth: about the vertical, degrees.
        elevation: above the horizontal, degrees.
        distance: from the point looked at.
        field_of_view: vertical, degrees.
        target: the point looked at.
    """

    azimuth: float = 45.0
    elevation: float = 30.0
    distance: float = FRAMING_DISTANCE
    field_of_view: float = FIELD_OF_VIEW
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def pose(self) -> CameraPose:
        """Where it stands, and which way it is turned."""
        e, a = np.radians(self.elevation), np.radians(self.azimuth)
        toward = np.array([np.sin(a) * np.cos(e), np.sin(e), -np.cos(a) * np.cos(e)])
        right = np.array([-np.cos(a), 0.0, -np.sin(a)])
        position = toward * self.distance + np.array(self.target)
        return CameraPose(position, right, np.cross(toward, right), -toward)

    @property
    def projection(self) -> NDArray[np.float64]:
        """From points (x, y, z, 1) to how far to the right, up and away they are, (3, 4)."""
        position, *axes = self.pose
        return np.column_stack([axes, -np.stack(axes) @ position])

    @property
    def half_height(self) -> float:
        """Half the height of what is seen at distance 1."""
        return float(np.tan(np.radians(self.field_of_view / 2)))

    def slopes(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return (N, 2) offsets to the right and up at distance 1, and depths (N,), of (N, 3).

        Offsets of points that are not in front of the camera, of a depth below 0.001, mean nothing.
        """
        position, *axes = self.pose
        x, y, depth = ((np.asarray(points, np.float64) - position) @ np.stack(axes).T).T
        return np.stack([x, y], 1) / np.maximum(depth, 1e-3)[:, None], depth

    def moved(self, center: ArrayLike, scale: float) -> Camera:
        """Return the camera that sees shapes as before once they are (x - center) * scale."""
        x, y, z = ((np.array(self.target) - np.asarray(center)) * scale).tolist()
        return replace(self, distance=self.distance * scale, target=(x, y, z))

    def widened(self, share: float) -> Camera:
        """Return the camera whose image is `share` times as high and shows more, not larger."""
        half = math.atan(self.half_height * share)
        return replace(self, field_of_view=math.degrees(2 * half))


def blender_field_of_view(height: int, side: int) -> float:
    """Return the vertical field of view, in degrees, of the authors' and 3D-R2N2's lens.

    It is that of Blender's default camera: 35 mm before a sensor of 32 mm.

    Args:
        height: of the image, in pixels.
        side: of the image that falls on the sensor's, in pixels.

    >>> round(blender_field_of_view(192, 256), 3)
    37.849
    """
    return math.degrees(2 * math.atan(32 / 2 / 35 * height / side))
