"""Materials of firearms."""

from __future__ import annotations

import colorsys

from ffd_lightning.shapes.kit import Material, Rng, draw, pick_material

BLACK = Material((0.03, 0.03, 0.03))
IRON = Material((0.14, 0.14, 0.15))


def draw_steel(rng: Rng) -> Material:
    """Draw blued, parkerised or (seldom) nickelled steel."""
    value = rng.uniform(0.5, 0.8) if rng.random() < 0.25 else rng.uniform(0.12, 0.32)
    return Material(colorsys.hsv_to_rgb(rng.uniform(0.55, 0.65), rng.uniform(0, 0.15), value))


def draw_furniture(rng: Rng, wood: float = 0.5) -> Material:
    """Draw what is held in the hands: wood (with probability `wood`) or a dull polymer."""
    if rng.random() < wood:
        return pick_material(rng, "wood")
    hue, saturation = rng.uniform(0.08, 0.28), rng.uniform(0.0, 0.45)
    pattern = draw(rng, ["", "speckle"], [0.7, 0.3])
    color = colorsys.hsv_to_rgb(hue, saturation, rng.uniform(0.12, 0.55))
    return Material(color, pattern, 3.0, seed=int(rng.integers(1 << 30)))
