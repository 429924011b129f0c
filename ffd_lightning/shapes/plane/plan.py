"""What the components of an aeroplane share: sizes, colours, its fuselage and its wing.

The unit of length is about the fuselage's; the nose is at z = -0.5.
"""

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, pick_material
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import Array, vec

BLACK = Material((0.05, 0.05, 0.055))
STEEL = Material((0.45, 0.46, 0.48))
GLASS = Material((0.1, 0.14, 0.2))


@dataclass(frozen=True, eq=False)
class Plan:
    """An aeroplane's sizes and colours."""

    wide: float  # of the fuselage
    tall: float  # of the fuselage
    span: float  # from the middle to a wing's tip
    root: float  # chord of the wing in the middle
    lead: float  # z of the wing's leading edge in the middle
    seat: float  # z at which the canopy begins, where there is one
    clear: float  # how far the ground is below the belly
    station: float  # share of the span at which inner engines, or a tail's booms, are
    paint: Material  # the main colour
    accent: Material  # of tails and stripes
    rows: Sequence[Section] = ()  # the fuselage's sections, from nose to tail
    level: float = 0.0  # height of the wing in the middle
    # The right wing: points (k, 3) of its leading edge, from the middle on, and chords (k,) there.
    edge: Array = field(default_factory=lambda: np.zeros((2, 3)))
    chords: Array = field(default_factory=lambda: np.zeros(2))

    def at(self, z: float) -> Section:
        """Return the fuselage's section at z."""
        rows = np.array(self.rows)
        return Section(z, *(float(np.interp(z, rows[:, 0], rows[:, i])) for i in (1, 2, 3)))

    def half(self, z: float) -> float:
        """Return half the fuselage's width at z."""
        return self.at(z).width / 2

    def height(self, z: float, up: float) -> float:
        """Return the height of the middle (`up` 0), top (1) or belly (-1) of the fuselage at z."""
        return self.at(z).lift + up / 2 * self.at(z).height

    @property
    def end(self) -> float:
        """The z of the fuselage's end."""
        return self.rows[-1].z

    @property
    def ground(self) -> float:
        """Height of the ground."""
        return self.height(self.lead, -1) - self.clear

    def wing(self, t: float, along: float = 0.0, side: int = 1) -> Array:
        """Return the point of a wing at `t` of its span and `along` its chord."""
        x = t * self.edge[-1, 0]
        columns = (self.edge[:, 1], self.edge[:, 2], self.chords)
        y, z, chord = (float(np.interp(x, self.edge[:, 0], column)) for column in columns)
        return vec(side * x, y, z + along * chord)


def skin(
    b: Builder, part: str, paint: Material, rows: Sequence[Section], box: float = 0.0, x: float = 0
) -> None:
    """Add a body along z through sections, `box` from 0 (round) to 1 (square), at `x`."""
    b.loft(part, paint, [row.ring(box, side=x) for row in rows])


_RANGES = {  # weight; ranges of wide, tall / wide, span, root, lead, seat, clear
    "airliner": (34, (7, 15), (100, 112), (34, 60), (15, 28), (-22, -6), (0, 0), (6, 10)),
    "business": (8, (8, 13), (100, 120), (34, 58), (12, 22), (-12, 0), (0, 0), (4, 8)),
    "supersonic": (2, (4, 6), (100, 110), (20, 30), (33, 40), (-20, -5), (0, 0), (5, 8)),
    "fighter": (23, (7, 11), (90, 135), (22, 46), (20, 36), (-16, 0), (-38, -27), (5, 7)),
    "light": (15, (10, 17), (100, 135), (45, 85), (13, 25), (-27, -14), (-26, -18), (7, 12)),
    "propliner": (10, (8, 16), (100, 125), (40, 70), (11, 21), (-18, -4), (0, 0), (5, 10)),
    "warbird": (7, (9, 13), (110, 150), (42, 68), (18, 30), (-27, -14), (-13, 0), (6, 10)),
    "glider": (3, (7, 11), (110, 140), (75, 140), (9, 15), (-20, -10), (-45, -42), (2, 4)),
    "flying": (3, (15, 28), (40, 60), (65, 110), (50, 65), (-40, -40), (-34, -31), (6, 9)),
}
_DRAB = {"fighter": 0.85, "propliner": 0.4, "warbird": 0.8, "flying": 0.7}
"""How probable a military colour is."""


def draw_plan(rng: Rng, role: str) -> Plan:
    """Draw the sizes and colours of an aeroplane for a role."""
    wide, tallness, span, root, lead, seat, clear = (
        rng.uniform(*ends) / 100 for ends in _RANGES[role][1:]
    )
    accent = pick_material(rng, "paint")
    if rng.random() < _DRAB.get(role, 0.0):
        hue, saturation = rng.uniform(0.1, 0.62), rng.uniform(0.03, 0.35)
        paint = Material(colorsys.hsv_to_rgb(hue, saturation, rng.uniform(0.25, 0.65)))
    else:
        white = Material((rng.uniform(0.75, 0.97),) * 3)
        paint = white if rng.random() < 0.65 else pick_material(rng, "paint")
    sizes = wide, tallness * wide, span, root, lead, seat, clear, rng.uniform(0.26, 0.4)
    return Plan(*sizes, paint, accent)


ROLES = tuple(Component.of(k, row[0], draw_plan, role=k) for k, row in _RANGES.items())
