"""Colours and patterns, and what common surfaces are of."""

from __future__ import annotations

import colorsys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.shapes.kit.choices import Rng, draw
from ffd_lightning.shapes.kit.vectors import Pair, Triple

_TEXTURE_SIZE = 64


@dataclass(frozen=True)
class Material:
    """A colour, optionally patterned.

    Attributes:
        color: RGB in [0, 1].
        pattern: "", "wood", "stripes", "checker", "speckle" or "fabric".
        scale: how often the pattern repeats per unit length.
        alpha: below 1 is see-through.
        seed: of the pattern's noise.
    """

    color: Triple
    pattern: str = ""
    scale: float = 2.0
    alpha: float = 1.0
    seed: int = 0

    def rgba(self) -> NDArray[np.uint8]:
        """Return the plain colour as (4,) uint8."""
        return np.round(255 * np.clip([*self.color, self.alpha], 0, 1)).astype(np.uint8)

    def texture(self) -> NDArray[np.uint8]:
        """Return the tileable pattern as an (h, w, 4) uint8 image."""
        rng = np.random.default_rng(self.seed)
        t = np.arange(_TEXTURE_SIZE) / _TEXTURE_SIZE
        u, v = np.meshgrid(t, t)
        tau = 2 * np.pi
        noise = rng.random((_TEXTURE_SIZE, _TEXTURE_SIZE))
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
        rgb = np.clip(shade[..., None] * np.asarray(self.color), 0, 1)
        image = np.full((_TEXTURE_SIZE, _TEXTURE_SIZE, 4), self.rgba(), dtype=np.uint8)
        image[..., :3] = np.round(255 * rgb)
        return image


def pick_material(rng: Rng, kind: str) -> Material:
    """Draw a material of a kind: wood, metal, paint, fabric, leather, plastic, glass, rubber."""
    seed = int(rng.integers(1 << 30))

    def hsv(hue: Pair, sat: Pair, val: Pair) -> tuple:
        return colorsys.hsv_to_rgb(rng.uniform(*hue) % 1, rng.uniform(*sat), rng.uniform(*val))

    if kind == "wood":
        pattern = "wood" if rng.random() < 0.7 else ""
        return Material(hsv((0.05, 0.11), (0.35, 0.7), (0.35, 0.85)), pattern, 1.5, seed=seed)
    if kind == "metal":
        return Material(hsv((0.55, 0.65), (0.0, 0.08), (0.25, 0.8)))
    if kind == "paint":
        return Material(hsv((0, 1), (0.3, 0.9), (0.4, 0.95)))
    if kind == "fabric":
        pattern = str(rng.choice(["", "fabric", "stripes", "checker"], p=[0.4, 0.35, 0.15, 0.1]))
        return Material(hsv((0, 1), (0.1, 0.7), (0.35, 0.9)), pattern, 3.0, seed=seed)
    if kind == "leather":
        return Material(hsv((0.02, 0.1), (0.2, 0.7), (0.15, 0.6)))
    if kind == "plastic":
        pattern = "speckle" if rng.random() < 0.2 else ""
        return Material(hsv((0, 1), (0.0, 0.8), (0.15, 0.95)), pattern, 3.0, seed=seed)
    if kind == "glass":
        return Material(hsv((0.5, 0.6), (0.1, 0.3), (0.7, 0.9)), alpha=0.45)
    if kind == "rubber":
        return Material(hsv((0, 1), (0, 0.05), (0.08, 0.2)))
    raise ValueError(f"unknown material kind {kind!r}")


def draw_housing(rng: Rng) -> Material:
    """Draw the plastic or metal of a housing."""
    kind = draw(rng, ["dark", "light", "metal", "plastic"], [0.45, 0.2, 0.2, 0.15])
    if kind == "dark":
        return pick_material(rng, "rubber")
    if kind == "light":
        shade = rng.uniform(0.75, 0.95)
        return Material((shade, shade, shade * rng.uniform(0.85, 1.0)))
    return pick_material(rng, kind)
