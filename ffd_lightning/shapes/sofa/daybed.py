"""Daybeds."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import enclose, pad, rails
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import UP, vec


def daybed(rng: Rng) -> Builder:
    """Build a mattress on a frame of legs and rails, with bolsters or a slatted back and ends."""
    b = Builder()
    frame = pick_material(rng, draw(rng, ["wood", "metal", "paint"], [0.6, 0.25, 0.15]))
    cover = pick_material(rng, draw(rng, ["fabric", "leather"]))
    width, depth = rng.uniform(1.5, 2.1), rng.uniform(0.72, 0.95)
    deck, soft = rng.uniform(0.2, 0.34), rng.uniform(0.09, 0.2)
    post = rng.uniform(0.045, 0.07)
    back = rng.uniform(0.35, 0.55) if rng.random() < 0.7 else 0.0
    ends = rng.uniform(0.5, 1.0) * back if back else 0.0
    feet = corners(width - post, depth - post, 0.0)
    tops = feet + (deck + np.array([[ends], [ends], [back], [back]])) * UP
    style = LegStyle("square", post, ((0.0, 0.8), (0.3, 1.0), (0.6, 1.0), (1.0, 1.0)))
    add_legs(b, "leg", frame, style, tops, feet)
    rails(b, "seat", frame, feet + (deck - 0.05) * UP, width=0.03, height=0.1)
    mattress = (width - 2 * post, soft, depth - 2 * post)
    center = (0, deck + soft / 2 - 0.01, 0)
    b.rounded_box("seat", cover, center, mattress, radius=0.07, edge=0.35 * soft)
    if back:
        fill, gap = draw(rng, ["bars", "slats", "panel"]), rng.uniform(0.08, 0.16)
        enclose(b, frame, tops, deck=deck, fill=fill, gap=gap)
    level, r = deck + soft, rng.uniform(0.07, 0.11)
    if back and rng.random() < 0.7:
        count = int(rng.integers(2, 4))
        wide = mattress[0] / count
        for i in range(count):
            at = ((i + 0.5) * wide - mattress[0] / 2, level + 0.18, depth / 2 - post - 0.1)
            pad(b, "back", pick_material(rng, "fabric"), at, (0.97 * wide, 0.38, 0.14), 0.06, 14)
    else:
        for x in (-1, 1):
            mid = vec(x * (mattress[0] / 2 - r), level + 0.95 * r, 0)
            half = vec(0, 0, 0.42 * depth)
            b.cylinder("arm", cover, mid - half, mid + half, r)
    return b
