"""Colours of aeroplanes."""

from __future__ import annotations

import colorsys

from ffd_lightning.shapes.kit import Material, Rng, pick_material

BLACK = Material((0.05, 0.05, 0.055))
STEEL = Material((0.45, 0.46, 0.48))
GLASS = Material((0.1, 0.14, 0.2))


def draw_livery(rng: Rng, drab: float = 0.0) -> tuple[Material, Material]:
    """Draw a main and an accent colour; `drab` is the probability of a military main colour."""
    accent = pick_material(rng, "paint")
    if rng.random() < drab:
        hue, saturation = rng.uniform(0.1, 0.62), rng.uniform(0.03, 0.35)
        return Material(colorsys.hsv_to_rgb(hue, saturation, rng.uniform(0.25, 0.65))), accent
    if rng.random() < 0.6:
        return Material((rng.uniform(0.75, 0.97),) * 3), accent
    return pick_material(rng, "paint"), accent
