"""How far training images are varied, so that a network trained on renderings takes photographs."""

from __future__ import annotations

from dataclasses import dataclass, fields

_LIMITS = {"contrast": 1.0, "gamma": 1.0, "light": 1.0, "hue": 0.5, "shift": 0.5, "roll": 45.0}
_FACTORS = ("brightness", "saturation", "tint", "scale")
_MOST_FACTOR = 3.0


@dataclass
class PhotoVariation:
    """Varies training images as photographs vary: colours, framing, imperfect cut-outs.

    0 turns any of it off. Factors are drawn between 1 / (1 + x) and 1 + x.

    Attributes:
        brightness: factor of the object's brightness.
        contrast: factor of the object's contrast.
        gamma: how far its middle tones are lifted or lowered; at 1 to their squares.
        light: how far light falls off from one side of the image to the other.
        saturation: factor of its colours' distance from grey.
        hue: its hues turn by so much of a circle at most.
        tint: factor of each colour channel.
        grey: share of images without colour.
        scale: factor of its size: the distance of the camera.
        shift: of the object, in heights of the image, at most.
        roll: of the camera, in degrees, at most.
        background: share of images whose background is left in: a colour with a gradient.
        patch: share of images where a patch of the background is left.
        border: share of images that are cut out too wide, or too narrow.
        blur: share of images that are blurred, as small ones are.
        noise: largest deviation of the pixels' noise, white being 1.
        erasing: share of images where a rectangle hides something of the object.
    """

    brightness: float = 0.4
    contrast: float = 0.3
    gamma: float = 0.5
    light: float = 0.4
    saturation: float = 0.5
    hue: float = 0.05
    tint: float = 0.15
    grey: float = 0.1
    scale: float = 0.2
    shift: float = 0.06
    roll: float = 4.0
    background: float = 0.1
    patch: float = 0.1
    border: float = 0.3
    blur: float = 0.4
    noise: float = 0.04
    erasing: float = 0.15

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        for f in fields(self):
            most = _MOST_FACTOR if f.name in _FACTORS else _LIMITS.get(f.name, 1.0)
            value = getattr(self, f.name)
            if not 0 <= value <= most:
                raise ValueError(f"{f.name}={value} must lie in [0, {most:g}]")
