"""From where a network's training images were taken: a few numbers, and the words for them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.render_settings import RenderSettings

Range: TypeAlias = tuple[float, float]

_FEW = 12  # azimuths that are listed
_GAP = 60.0  # degrees without a camera; with a wider one they stand not on all sides
_STEP = 5.0  # what ranges are widened to, in degrees: they are found from some of the images


@dataclass(frozen=True)
class Viewpoints:
    """The cameras of many images, summed up.

    Convention:
        Angles are in degrees, see `Camera`: azimuth 0 shows the front, 90 the object's own right.

    Attributes:
        azimuths: each of them, ascending, if they are few; else none.
        all_sides: whether they go all round, without being few.
        elevation: the lowest and the highest; None where nobody knows the cameras.
        lens: the narrowest and the widest vertical field of view; None likewise.
    """

    azimuths: tuple[float, ...] = ()
    all_sides: bool = False
    elevation: Range | None = None
    lens: Range | None = None

    @classmethod
    def of(cls, cameras: Sequence[Camera]) -> Viewpoints:
        """Sum cameras up, those that are known.

        >>> print(Viewpoints.of([Camera(45, 30)]))
        azimuth 45 (0 is the front), elevation 30, lens 40 degrees
        """
        if not cameras:
            return cls()
        azimuths = np.unique(np.round([camera.azimuth % 360 for camera in cameras], 1) % 360)
        gap = np.diff(azimuths, append=azimuths[0] + 360).max()
        few = len(azimuths) <= _FEW
        return cls(
            tuple(azimuths.tolist()) if few else (),
            not few and bool(gap < _GAP),
            _range([camera.elevation for camera in cameras]),
            _range([camera.field_of_view for camera in cameras]),
        )

    @classmethod
    def of_settings(cls, render: RenderSettings) -> Viewpoints:
        """Sum up where images of such settings are rendered from."""
        return cls.of([camera for shape in range(64) for camera in render.cameras(str(shape))])

    def __str__(self) -> str:
        if self.elevation is None or self.lens is None:
            return "unknown cameras"
        listed = ", ".join(f"{azimuth:g}" for azimuth in self.azimuths)
        many = "all sides" if self.all_sides else "many sides"
        sides = f"azimuth {listed} (0 is the front)" if self.azimuths else many
        return f"{sides}, elevation {_told(self.elevation)}, lens {_told(self.lens)} degrees"

    def to_json(self) -> dict[str, Any]:
        """Return what a JSON file can hold; `in_words` is for people."""
        return {
            "azimuths": list(self.azimuths),
            "all_sides": self.all_sides,
            "elevation": None if self.elevation is None else list(self.elevation),
            "lens": None if self.lens is None else list(self.lens),
            "in_words": str(self),
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Viewpoints:
        """Return what `to_json` was called on."""
        elevation, lens = (
            None if content[name] is None else (float(content[name][0]), float(content[name][1]))
            for name in ("elevation", "lens")
        )
        azimuths = tuple(float(azimuth) for azimuth in content["azimuths"])
        return cls(azimuths, bool(content["all_sides"]), elevation, lens)


def _range(values: Sequence[float]) -> Range:
    """Return the least and the largest, to whole degrees; a range is widened to `_STEP`."""
    low, high = min(values), max(values)
    if high - low < 1:
        return (float(round(low)),) * 2
    return _STEP * math.floor(low / _STEP + 1e-6), _STEP * math.ceil(high / _STEP - 1e-6)


def _told(ends: Range) -> str:
    low, high = ends
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"
