"""What the components of a chair share: sizes, materials, the frame of its back. Metres."""

from dataclasses import dataclass

from ffd_lightning.shapes.kit import Component, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.upholstery import Seating, draw_cover
from ffd_lightning.shapes.kit.vectors import Array, lean, vec


@dataclass(frozen=True)
class Plan:
    """A chair's sizes and materials; the middle of its seat is above the origin."""

    width: float  # of the seat
    depth: float  # of the seat
    seat: float  # height of the seat's upper side
    thick: float  # of the seat's board
    rise: float  # of the back above the seat
    rake: float  # degrees by which the back is tipped
    frame: Material  # what legs and posts are of
    cover: Material  # what pads and shells are of

    @property
    def under(self) -> float:
        """Height of the board's lower side, a little above it so that legs reach in."""
        return self.seat - self.thick + 0.003

    def back(self, x: float, up: float, out: float = 0.0) -> Array:
        """Return the point at `x`, `up` along the back, `out` behind its middle."""
        foot = vec(0, self.seat - 0.01, self.depth / 2 - 0.025)
        return foot + lean(self.rake) @ vec(x, up, out)

    def seating(self, rng: Rng, arms: str) -> Seating:
        """Return a padded seat of these sizes with one of the kit's arms."""
        return Seating(
            seats=1,
            width=self.width,
            depth=self.depth + 0.2,
            seat=self.seat,
            cushion=rng.uniform(0.1, 0.17),
            back=self.rise,
            thick=rng.uniform(0.12, 0.22),
            rake=0.5 * self.rake,
            arm=rng.uniform(0.05, 0.07) if arms == "open" else rng.uniform(0.09, 0.22),
            arm_rise=rng.uniform(0.14, 0.26),
            foot=rng.uniform(0.03, 0.18),
            arms=arms,
            cover=self.cover,
            pillows=self.cover if rng.random() < 0.75 else pick_material(rng, "fabric"),
            frame=self.frame,
        )


_SIZES = {  # how frequent, then ranges of width, depth, seat, rise, rake
    "dining": (4, (0.36, 0.6), (0.36, 0.54), (0.38, 0.52), (0.25, 0.75), (1, 16)),
    "lounge": (3, (0.46, 0.8), (0.46, 0.72), (0.28, 0.44), (0.3, 0.8), (8, 32)),
    "office": (1.5, (0.42, 0.6), (0.4, 0.56), (0.4, 0.58), (0.25, 0.85), (3, 16)),
    "bar": (1.5, (0.28, 0.46), (0.28, 0.42), (0.5, 0.85), (0.12, 0.5), (0, 14)),
}


def draw_plan(rng: Rng, use: str) -> Plan:
    """Draw the sizes and materials of a chair for a use."""
    width, depth, seat, rise, rake = (rng.uniform(*span) for span in _SIZES[use][1:])
    wooden = (0.1, 0.1, 0.8) if use == "office" else (0.6, 0.15, 0.25)
    frame = pick_material(rng, draw(rng, ["wood", "paint", "metal"], wooden))
    thick = rng.uniform(0.018, 0.04)
    return Plan(width, depth, seat, thick, rise, rake, frame, draw_cover(rng))


USES = tuple(Component.of(use, of[0], draw_plan, use=use) for use, of in _SIZES.items())
