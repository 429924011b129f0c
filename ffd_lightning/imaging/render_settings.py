"""How shapes are rendered."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class RenderSettings:
    """Size and cameras of the images that are rendered of every shape.

    Convention:
        Angles are in degrees. An object faces -z with y up: azimuth 0 shows its front, 90 is seen
        from +x, the object's own right.

    Attributes:
        height, width: in pixels.
        elevation: of the camera above the horizon.
        azimuths: one image of every shape for each.
        samples: rays along each side of a pixel.
    """

    height: int = 192
    width: int = 256
    elevation: float = 30.0
    azimuths: list[float] = field(default_factory=lambda: [45.0])
    samples: int = 3
