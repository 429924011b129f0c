"""Colours and patterns, what common surfaces are of, and choices by name."""

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.shapes.kit.vectors import Triple

Rng = np.random.Generator


def draw(rng: Rng, choices: Sequence[str], p: Sequence[float] | None = None) -> str:
    """Draw one of `choices`, evenly or with probabilities `p`."""
    return str(rng.choice(choices, p=p))


@dataclass(frozen=True)
class Material:
    """A colour, optionally patterned."""

    color: Triple  # RGB in [0, 1]
    pattern: str = ""  # or "wood", "stripes", "checker", "speckle", "fabric"
    scale: float = 2.0  # how often the pattern repeats per unit length
    alpha: float = 1.0  # below 1 is see-through
    seed: int = 0  # of the pattern's noise

    def rgba(self) -> NDArray[np.uint8]:
        """Return the plain colour as (4,) uint8."""
        return np.round(255 * np.clip([*self.color, self.alpha], 0, 1)).astype(np.uint8)

    def texture(self) -> NDArray[np.uint8]:
        """Return the tileable pattern as a (64, 64, 4) uint8 image."""
        rng = np.random.default_rng(self.seed)
        u, v = np.meshgrid(*2 * [np.arange(64) / 64])
        tau = 2 * np.pi
        noise = rng.random((64, 64))
        if self.pattern == "wood":
            phase = rng.random(2) * tau
            bend = 0.02 * np.sin(tau * u + phase[0]) + 0.01 * np.sin(2 * tau * u + phase[1])
            grain = 0.6 * np.sin(tau * 5 * (v + bend)) + 0.4 * np.sin(tau * 11 * (v + bend))
            shade = 0.9 + 0.08 * grain + 0.05 * (noise - 0.5)
        elif self.pattern == "stripes":
            shade = np.where(np.sin(tau * 4 * u) > 0, 1.0, 0.62)
        elif self.pattern == "checker":
            shade = np.where(np.sin(tau * 2 * u) * np.sin(tau * 2 * v) > 0, 1.0, 0.6)
        elif self.pattern == "speckle":
            shade = np.where(noise > 0.82, 0.7, 1.0)
        elif self.pattern == "fabric":
            weave = np.sin(tau * 16 * u) * np.sin(tau * 16 * v)
            shade = 0.9 + 0.1 * weave + 0.06 * (noise - 0.5)
        else:
            raise ValueError(f"unknown pattern {self.pattern!r}")
        image = np.full((64, 64, 4), self.rgba())
        image[..., :3] = np.round(255 * np.clip(shade[..., None] * np.asarray(self.color), 0, 1))
        return image


_SURFACES = {  # scale of the pattern, then ranges of hue, saturation, value
    "wood": (1.5, (0.05, 0.11), (0.35, 0.7), (0.35, 0.85)),
    "metal": (2.0, (0.55, 0.65), (0.0, 0.08), (0.25, 0.8)),
    "paint": (2.0, (0, 1), (0.3, 0.9), (0.4, 0.95)),
    "fabric": (3.0, (0, 1), (0.1, 0.7), (0.35, 0.9)),
    "leather": (2.0, (0.02, 0.1), (0.2, 0.7), (0.15, 0.6)),
    "plastic": (3.0, (0, 1), (0.0, 0.8), (0.15, 0.95)),
    "glass": (2.0, (0.5, 0.6), (0.1, 0.3), (0.7, 0.9)),
    "rubber": (2.0, (0, 1), (0, 0.05), (0.08, 0.2)),
}
_PATTERNS = {
    "wood": (["wood", ""], [0.7, 0.3]),
    "fabric": (["", "fabric", "stripes", "checker"], [0.4, 0.35, 0.15, 0.1]),
    "plastic": (["speckle", ""], [0.2, 0.8]),
}


def pick_material(rng: Rng, kind: str) -> Material:
    """Draw a material of a kind: wood, metal, paint, fabric, leather, plastic, glass, rubber."""
    seed, (scale, *ranges) = int(rng.integers(1 << 30)), _SURFACES[kind]
    pattern = draw(rng, *_PATTERNS[kind]) if kind in _PATTERNS else ""
    hue, saturation, value = (rng.uniform(*ends) for ends in ranges)
    color = colorsys.hsv_to_rgb(hue % 1, saturation, value)
    return Material(color, pattern, scale, 0.45 if kind == "glass" else 1.0, seed)


def draw_housing(rng: Rng) -> Material:
    """Draw the plastic or metal of a housing."""
    kind = draw(rng, ["dark", "light", "metal", "plastic"], [0.45, 0.2, 0.2, 0.15])
    if kind == "dark":
        return pick_material(rng, "rubber")
    if kind == "light":
        shade = rng.uniform(0.75, 0.95)
        return Material((shade, shade, shade * rng.uniform(0.85, 1.0)))
    return pick_material(rng, kind)
