"""What the components of a lamp share: sizes, materials, sockets for its heads. Metres."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ffd_lightning.shapes.kit import Component, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import UP, Array, lean

FLIP = lean(180)
"""Turns what stands into what hangs."""


class Socket(NamedTuple):
    """Where something is mounted."""

    at: Array  # (3,) its lower end, or its upper end where it hangs
    turn: Array = np.eye(3)  # its y axis points from there into it
    wide: float = 0.0  # radius of a shade that suits the place

    def point(self, out: float) -> Array:
        """Return the point `out` along the axis."""
        return self.at + out * (self.turn @ UP)


Sockets = list[Socket]


@dataclass(frozen=True)
class Plan:
    """A lamp's sizes and materials; ceilings are at height 0, walls at z = 0."""

    place: str  # one of `PLACES`
    height: float  # of the stem, its length below a ceiling, or of a plate on a wall
    radius: float  # of the foot, the rose or the plate
    wide: float  # radius of a single shade
    slender: float  # height of a shade relative to its radius
    foot: float  # how far the base stands out from what carries it
    metal: Material  # of poles and fittings
    body: Material  # of bases
    skin: Material  # of shades

    def heads(self, height: float, hung: bool = False) -> Sockets:
        """Return one socket on the axis."""
        return [Socket(height * UP, FLIP if hung else np.eye(3), self.wide)]


_PLACES = {  # weight, and ranges of height, radius, wide
    "table": (2.8, (0.2, 0.55), (0.05, 0.15), (0.12, 0.27)),
    "floor": (3, (0.9, 1.7), (0.12, 0.26), (0.12, 0.36)),
    "desk": (1, (0.3, 0.65), (0.07, 0.14), (0.07, 0.14)),
    "ceiling": (4, (0.05, 1.2), (0.05, 0.11), (0.1, 0.38)),
    "wall": (1.4, (0.1, 0.36), (0.035, 0.1), (0.06, 0.15)),
    "garden": (1.2, (0.5, 1.8), (0.11, 0.2), (0.1, 0.2)),
}


def draw_plan(rng: Rng, place: str) -> Plan:
    """Draw the sizes and materials of a lamp for a place."""
    height, radius, wide = (rng.uniform(*span) for span in _PLACES[place][1:])
    slender = rng.uniform(0.5, 1.3) if rng.random() < 0.6 else rng.uniform(1.2, 2.6)
    metal = pick_material(rng, draw(rng, ["metal", "paint"], [0.8, 0.2]))
    if rng.random() < 0.35:
        metal = Material((0.82, 0.62, 0.34) if rng.random() < 0.5 else (0.6, 0.42, 0.2))
    kinds = ["paint", "wood", "metal", "plastic"]
    body = pick_material(rng, draw(rng, kinds, [0.4, 0.3, 0.2, 0.1]))
    kinds = ["fabric", "paint", "metal", "glass"]
    skin = pick_material(rng, draw(rng, kinds, [0.5, 0.2, 0.1, 0.2]))
    if rng.random() < 0.4:  # pale cloth or paper
        value, warmth = rng.uniform(0.78, 0.97), rng.uniform(0.03, 0.25)
        color = (value, value * (1 - 0.4 * warmth), value * (1 - warmth))
        skin = Material(color, draw(rng, ["", "fabric"]), 4.0, seed=int(rng.integers(1 << 30)))
    return Plan(place, height, radius, wide, slender, 0.0, metal, body, skin)


PLACES = tuple(Component.of(k, row[0], draw_plan, place=k) for k, row in _PLACES.items())
