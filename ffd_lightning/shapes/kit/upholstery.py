"""Padded seats as sofas and armchairs have them: sizes and looks, cushions, feet. Metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import UP, vec

ARMS = ("box", "padded", "rolled", "slope", "flare", "open")


@dataclass(frozen=True)
class Seating:
    """The dimensions and looks of a padded seat; its front is at z = -depth / 2.

    Attributes:
        seats: how many sit on it.
        width: between the arms.
        depth: over all.
        seat: height of the cushions' upper side.
        cushion: thickness of the seat cushions.
        back: height of the back above the seat.
        thick: thickness of the back.
        rake: degrees by which the back is tipped.
        arm: width of an arm.
        arm_rise: height of an arm above the seat.
        foot: height of the legs.
        arms: one of `ARMS`.
        cover: what covers it.
        pillows: what covers the cushions.
        frame: what its legs and open arms are of.
    """

    seats: int
    width: float
    depth: float
    seat: float
    cushion: float
    back: float
    thick: float
    rake: float
    arm: float
    arm_rise: float
    foot: float
    arms: str
    cover: Material
    pillows: Material
    frame: Material

    @property
    def span(self) -> float:
        """Width over the arms."""
        return self.width + 2 * self.arm


def draw_cover(rng: Rng) -> Material:
    """Draw what covers a seat."""
    return pick_material(rng, draw(rng, ["fabric", "leather", "plastic"], [0.55, 0.3, 0.15]))


def draw_seating(rng: Rng, seats: int, arms: tuple[str, ...] = ARMS) -> Seating:
    """Draw a padded seat for `seats` persons with one of the given arms."""
    style = draw(rng, arms)
    cover = pick_material(rng, draw(rng, ["fabric", "leather"], [0.65, 0.35]))
    return Seating(
        seats=seats,
        width=seats * rng.uniform(0.5, 0.72) + (0.06 if seats == 1 else 0.0),
        depth=rng.uniform(0.75, 1.02),
        seat=rng.uniform(0.36, 0.47),
        cushion=rng.uniform(0.1, 0.19),
        back=rng.uniform(0.3, 0.55),
        thick=rng.uniform(0.14, 0.24),
        rake=rng.uniform(4, 14),
        arm=rng.uniform(0.05, 0.07) if style == "open" else rng.uniform(0.11, 0.26),
        arm_rise=rng.uniform(0.12, 0.26),
        foot=rng.uniform(0.03, 0.2),
        arms=style,
        cover=cover,
        pillows=cover if rng.random() < 0.75 else pick_material(rng, "fabric"),
        frame=pick_material(rng, draw(rng, ["wood", "metal"], [0.7, 0.3])),
    )


def add_base(b: Builder, s: Seating) -> None:
    """Add the box below the cushions."""
    wide = s.width + (0 if s.arms == "open" else s.arm)
    top = s.seat - 0.8 * s.cushion
    size = (wide, top - s.foot, 0.96 * s.depth)
    b.rounded_box("seat", s.cover, (0, (top + s.foot) / 2, 0), size, 0.03)


def add_seat_cushions(b: Builder, s: Seating, front: float = 0.0) -> None:
    """Add one cushion per seat between the arms; `front` lets them stand out at the front."""
    wide, rear = s.width / s.seats, s.depth / 2 - 0.7 * s.thick
    start = -s.depth / 2 - front
    for i in range(s.seats):
        x = (i + 0.5) * wide - s.width / 2
        size = (0.99 * wide, s.cushion, rear - start)
        center = (x, s.seat - s.cushion / 2, (rear + start) / 2)
        b.rounded_box("seat", s.pillows, center, size, radius=0.05, edge=0.4 * s.cushion)


def add_feet(b: Builder, rng: Rng, s: Seating, width: float | None = None) -> None:
    """Add short legs below the corners, and a middle pair below long sofas."""
    if s.arms == "open" and width is None:
        return
    wide = s.span if width is None else width
    kind = draw(rng, ["square", "round"])
    profile = ((0.0, rng.uniform(0.45, 1.0)), (0.5, 0.85), (1.0, 1.0))
    style = LegStyle(kind, rng.uniform(0.04, 0.075), profile)
    feet = corners(wide - 0.16, s.depth - 0.14, 0.0)
    if wide > 1.5:
        feet = np.concatenate([feet, feet[[0, 2]] * vec(0, 1, 1)])
    out = 1 + 0.02 * (style.profile[0][1] < 0.7)
    add_legs(b, "leg", s.frame, style, feet + (s.foot + 0.02) * UP, feet * vec(out, 1, out))
