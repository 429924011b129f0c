"""Materials of telephones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.kit import Material, Rng, pick_material
from ffd_lightning.shapes.kit.materials import draw_housing


@dataclass(frozen=True)
class Finish:
    """The materials of one telephone."""

    body: Material
    back: Material
    trim: Material
    keys: Material
    screen: Material


def draw_finish(rng: Rng) -> Finish:
    """Draw the materials: any housing, a contrasting or equal back, dark or lit screen."""

    def shell() -> Material:
        return pick_material(rng, "plastic") if rng.random() < 0.3 else draw_housing(rng)

    body = shell()
    back = body if rng.random() < 0.5 else shell()
    level = float(np.mean(body.color))
    shade = rng.uniform(0.05, 0.2) if level > 0.5 else rng.uniform(0.65, 0.9)
    keys = Material((shade, shade, shade)) if rng.random() < 0.7 else pick_material(rng, "paint")
    hue = pick_material(rng, "paint").color
    lit = rng.random() < 0.5
    screen = Material(hue) if lit else Material((0.03, 0.03, rng.uniform(0.04, 0.1)))
    return Finish(body, back, pick_material(rng, "metal"), keys, screen)
