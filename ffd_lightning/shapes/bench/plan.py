"""What the components of a bench share: sizes, materials, the frame of its back. Metres."""

from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.upholstery import draw_cover
from ffd_lightning.shapes.kit.vectors import Array, lean, vec


@dataclass(frozen=True)
class Plan:
    """A bench's sizes and materials; the middle of its seat is above the origin."""

    length: float  # of the seat
    depth: float  # of the seat
    seat: float  # height of the seat's upper side
    rise: float  # of the back above the seat
    rake: float  # degrees by which the back is tipped
    thick: float  # of the seat
    side: float  # thickness of posts and legs
    inset: float  # how far from the ends the outer legs and posts stand
    arm: float  # height of arms above the seat
    wood: Material  # what boards are of
    frame: Material  # what carries them is of
    cover: Material  # what pads are of

    @property
    def under(self) -> float:
        """Height of the seat's lower side, a little above it so that legs reach in."""
        return self.seat - self.thick + 0.003

    @property
    def xs(self) -> Array:
        """Where along its length legs and posts stand: near the ends, and between if it is long."""
        reach = self.length / 2 - self.inset
        return np.linspace(-reach, reach, 2 if self.length < 1.55 else 3)

    def back(self, x: float, up: float, out: float = 0.0) -> Array:
        """Return the point at `x`, `up` along the back, `out` behind its middle."""
        return vec(0, self.seat, self.depth / 2 - 0.02) + lean(self.rake) @ vec(x, up, out)

    def across(
        self, b: Builder, part: str, x: float, y: float, reach: float, tall: float, z: float = 0.0
    ) -> None:
        """Add a bar from the front to the back that reaches +-`reach` about `z`."""
        beam(b, part, self.frame, (x, y, z - reach), (x, y, z + reach), 0.025, tall)


_SIZES = {  # how frequent, then length, depth, seat, rise, rake: the lowest and the highest
    "garden": (4, (0.9, 0.38, 0.36, 0.28, 5), (2.2, 0.62, 0.48, 0.65, 24)),
    "hall": (3.5, (0.95, 0.32, 0.38, 0.25, 1), (1.8, 0.54, 0.54, 0.9, 12)),
    "bed": (2, (0.9, 0.36, 0.36, 0.15, 2), (1.7, 0.66, 0.52, 0.6, 14)),
    "row": (0.8, (1.5, 0.24, 0.36, 0.3, 2), (2.8, 0.42, 0.5, 0.4, 9)),
    "stool": (1.3, (0.45, 0.28, 0.38, 0.3, 2), (0.85, 0.45, 0.56, 0.4, 9)),
    "stone": (1, (0.7, 0.34, 0.34, 0.28, 0), (2.2, 0.6, 0.52, 0.6, 6)),
    "round": (1, (0.9, 0.3, 0.36, 0.25, 0), (1.8, 0.5, 0.5, 0.5, 0.1)),
    "picnic": (1, (0.9, 0.2, 0.4, 0.3, 2), (2.5, 0.36, 0.48, 0.4, 9)),
}


def draw_plan(rng: Rng, seat: str, use: str) -> Plan:
    """Draw the sizes and materials of a bench for a use with a kind of seat."""
    wood = frame = pick_material(rng, draw(rng, ["wood", "paint"], [0.75, 0.25]))
    if rng.random() < 0.45:
        frame = pick_material(rng, draw(rng, ["metal", "wood", "paint"], [0.6, 0.25, 0.15]))
    thick = rng.uniform(0.05, 0.16) if seat in ("pad", "slab") else rng.uniform(0.02, 0.05)
    side, inset = rng.uniform(0.035, 0.075), rng.choice([0.0, rng.uniform(0.0, 0.2)])
    length, depth, height, rise, rake = rng.uniform(*_SIZES[use][1:])
    sizes = (thick, side, side / 2 + inset * length / 2, min(rng.uniform(0.14, 0.28), rise))
    return Plan(length, depth, height, rise, rake, *sizes, wood, frame, draw_cover(rng))


USES = tuple(Component.of(use, of[0], draw_plan, use=use) for use, of in _SIZES.items())
