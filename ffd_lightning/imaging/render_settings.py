"""How shapes are rendered."""

import hashlib
import math
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np

from ffd_lightning.components import Range, check_ranges, typed
from ffd_lightning.imaging.camera import RADIUS, Camera, blender_field_of_view

_ELEVATIONS, _LENSES = (-5, 60), (25, 60)  # of random cameras, in degrees
# The authors' Blender script: the camera at (0, 1, 0.6), Blender's default lens.
_AUTHORS_POSITION = (1.0, 0.6)  # horizontal and vertical


@dataclass
class RenderSettings:
    """Size and cameras of the images that are rendered of every shape.

    Convention:
        Angles are in degrees. An object faces -z with y up: azimuth 0 shows its front, 90 is seen
        from +x, the object's own right.

    Attributes:
        height: in pixels.
        width: in pixels.
        camera: `framed` stands where every shape is whole in the image; `authors`, the paper's, is
            nearer and cuts tall shapes off.
        elevation: of the camera above the horizon; by default 30, and the authors' own 30.96.
        azimuths: one image of every shape for each.
        random_views: so many images more of every shape, from cameras drawn for it: from all sides,
            5 degrees below to 60 above the horizon, lenses of 25 to 60 degrees. For networks that
            are to see photographs.
        samples: rays along each side of a pixel.
    """

    height: Annotated[int, Range("[32, inf)")] = 192
    width: Annotated[int, Range("[32, inf)")] = 256
    camera: Literal["framed", "authors"] = "framed"
    elevation: Annotated[float, Range("[-90, 90]")] | None = None
    azimuths: list[float] = field(default_factory=lambda: [45.0])
    random_views: Annotated[int, Range("[0, inf)")] = 0
    samples: Annotated[int, Range("(0, inf)")] = 3

    def __post_init__(self) -> None:
        typed(Literal["framed", "authors"], self.camera, "camera")
        # On the command line a side has 32 pixels or more; scripts may want smaller pictures.
        check_ranges(vars(self), height="(0, inf)", width="(0, inf)", samples="(0, inf)")
        check_ranges(vars(self), random_views="[0, inf)", elevation="[-90, 90]")
        if not self.azimuths and not self.random_views:
            raise ValueError("azimuths=[] needs an angle at least, or random_views a view")

    def cameras(self, shape: str = "") -> tuple[Camera, ...]:
        """Return the camera of each image; random ones follow from the name of the shape alone.

        Source: `authors` is of the rendering script in the authors' repository `shapenet`: distance
        1.166, elevation atan(0.6), 35 mm on a 32 mm sensor.

        >>> camera, = RenderSettings(camera="authors").cameras()
        >>> round(192 / 2 / camera.half_height / camera.distance)  # pixels a unit
        240
        """
        rng = np.random.default_rng(list(hashlib.sha256(shape.encode()).digest()))
        return (*self._fixed(), *(_random_camera(rng) for _ in range(self.random_views)))

    @property
    def only_camera(self) -> Camera | None:
        """The camera of all images; None where there are several."""
        fixed = self._fixed()
        return fixed[0] if len(fixed) == 1 and not self.random_views else None

    @property
    def views(self) -> str:
        """From where images are rendered, in words.

        >>> RenderSettings().views
        'azimuth 45 (0 is the front), elevation 30, lens 40 degrees'
        >>> RenderSettings(azimuths=[], random_views=8).views
        'all sides, elevation -5 to 60, lens 25 to 60 degrees'
        """
        words, fixed = [], self._fixed()
        if fixed:
            azimuths = ", ".join(f"{camera.azimuth:g}" for camera in fixed)
            words.append(
                f"azimuth {azimuths} (0 is the front), elevation {fixed[0].elevation:.0f}, "
                f"lens {fixed[0].field_of_view:.0f} degrees"
            )
        if self.random_views:
            ranges = [f"{low} to {high}" for low, high in (_ELEVATIONS, _LENSES)]
            words.append(f"all sides, elevation {ranges[0]}, lens {ranges[1]} degrees")
        return "; ".join(words)

    @property
    def picture_camera(self) -> Camera:
        """From where shapes are drawn for people: as the images are, if all have one camera.

        Otherwise from three quarters, where most of a shape is seen.
        """
        return self.only_camera or Camera()

    def _fixed(self) -> tuple[Camera, ...]:
        if self.camera == "framed":
            elevation = 30.0 if self.elevation is None else self.elevation
            return tuple(Camera(azimuth, elevation) for azimuth in self.azimuths)
        own = math.degrees(math.atan2(*reversed(_AUTHORS_POSITION)))
        elevation = own if self.elevation is None else self.elevation
        side = max(self.height, self.width)  # Blender's sensor is as wide as the longer one
        lens = blender_field_of_view(self.height, side)
        distance = math.hypot(*_AUTHORS_POSITION)
        return tuple(Camera(azimuth, elevation, distance, lens) for azimuth in self.azimuths)


def _random_camera(rng: np.random.Generator) -> Camera:
    """Draw a camera that a shape of box diagonal 1 fills, or nearly."""
    lens = float(rng.uniform(*_LENSES))
    distance = RADIUS / math.sin(math.radians(lens / 2)) * float(rng.uniform(1, 1.25))
    return Camera(float(rng.uniform(0, 360)), float(rng.uniform(*_ELEVATIONS)), distance, lens)
