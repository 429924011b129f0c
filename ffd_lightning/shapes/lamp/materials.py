"""Materials of lamps."""

from __future__ import annotations

from ffd_lightning.shapes.kit import Material, Rng, draw, pick_material

_BRASS = ((0.75, 0.58, 0.28), (0.6, 0.42, 0.2), (0.82, 0.68, 0.42))


def draw_metal(rng: Rng) -> Material:
    """Draw the metal of poles and fittings: steel, brass or lacquered."""
    kind = draw(rng, ["metal", "brass", "paint"], [0.5, 0.35, 0.15])
    if kind == "brass":
        return Material(_BRASS[int(rng.integers(len(_BRASS)))])
    return pick_material(rng, kind)


def draw_body_material(rng: Rng) -> Material:
    """Draw the material of a base's body: ceramic, wood, metal or coloured plastic."""
    kinds = ["paint", "wood", "metal", "plastic"]
    return pick_material(rng, draw(rng, kinds, [0.4, 0.3, 0.2, 0.1]))


def draw_shade_material(rng: Rng, glass: float = 0.15) -> Material:
    """Draw a pale cloth, any other fabric, paint, metal or (with probability `glass`) glass."""
    if rng.random() < glass:
        return pick_material(rng, "glass")
    kind = draw(rng, ["pale", "fabric", "paint", "metal"], [0.35, 0.35, 0.2, 0.1])
    if kind != "pale":
        return pick_material(rng, kind)
    value, warmth = rng.uniform(0.78, 0.97), rng.uniform(0.03, 0.25)
    color = (value, value * (1 - 0.4 * warmth), value * (1 - warmth))
    pattern = draw(rng, ["", "fabric", "stripes"], [0.5, 0.35, 0.15])
    return Material(color, pattern, 4.0, seed=int(rng.integers(1 << 30)))
