"""Padded seats with a back and arms, as sofas and armchairs have them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, pad
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import UP, Array, about_z, lean, vec

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


def back_point(s: Seating, x: float, rise: float, out: float = 0.0) -> Array:
    """Return the point at `x`, `rise` above the seat along the back, `out` behind its middle."""
    foot = vec(0, s.seat, s.depth / 2 - 0.55 * s.thick)
    return foot + lean(s.rake) @ vec(x, rise, out)


def add_tight_back(b: Builder, s: Seating, width: float) -> None:
    """Add one padded panel as the back."""
    low = -0.5 * s.seat
    size = (width, s.back - low, s.thick)
    pad(b, "back", s.cover, back_point(s, 0, (s.back + low) / 2), size, 0.4 * s.thick, s.rake)


def add_loose_back(b: Builder, s: Seating, overhang: float) -> None:
    """Add a thin panel and a cushion per seat before it, `overhang` higher than the panel."""
    low, rise, wide = -0.5 * s.seat, s.back - overhang, s.width / s.seats
    panel = (s.width + s.arm, rise - low, 0.5 * s.thick)
    center = back_point(s, 0, (rise + low) / 2, 0.25 * s.thick)
    pad(b, "back", s.cover, center, panel, 0.04, s.rake)
    for i in range(s.seats):
        x = (i + 0.5) * wide - s.width / 2
        size = (0.98 * wide, s.back + 0.01, 0.85 * s.thick)
        at = back_point(s, x, s.back / 2, -0.35 * s.thick)
        pad(b, "back", s.pillows, at, size, 0.07, s.rake + 3)


def add_tufts(b: Builder, s: Seating, width: float, rows: int, columns: int) -> None:
    """Add staggered buttons on the front of a tight back."""
    for row in range(rows):
        shift = 0.5 * (row % 2)
        for column in range(columns - row % 2):
            x = ((column + shift + 0.5) / columns - 0.5) * width
            at = back_point(s, x, s.back * (0.25 + 0.6 * row / max(rows - 1, 1)), -0.5 * s.thick)
            button = [(0.011, -0.005), (0.014, 0.0), (0.008, 0.007)]
            b.lathe("back", s.frame, button, at, segments=8, turn=lean(s.rake - 90))


def add_arm(b: Builder, s: Seating, side: int, depth: float | None = None) -> None:
    """Add the arm on `side` (-1 or 1), as deep as the sofa unless told otherwise."""
    deep = 0.97 * s.depth if depth is None else depth
    x, z = side * (s.width + s.arm) / 2, s.depth / 2 - deep / 2
    top, low = s.seat + s.arm_rise, s.foot
    middle, size = (x, (top + low) / 2, z), (s.arm, top - low, deep)
    if s.arms == "box":
        b.rounded_box("arm", s.cover, middle, size, 0.12 * s.arm)
    elif s.arms == "padded":
        b.rounded_box("arm", s.cover, middle, (0.9 * s.arm, top - low, 0.98 * deep), 0.02)
        soft = (1.1 * s.arm, 0.5 * s.arm, deep)
        b.rounded_box("arm", s.cover, (x, top, z), soft, 0.25 * s.arm)
    elif s.arms == "rolled":
        r = 0.58 * s.arm
        b.rounded_box("arm", s.cover, middle, (0.8 * s.arm, top - low, 0.98 * deep), 0.02)
        axis = vec(x + side * 0.15 * s.arm, top - 0.3 * r, z)
        half = vec(0, 0, deep / 2)
        b.cylinder("arm", s.cover, axis - half, axis + half, r)
    elif s.arms == "slope":
        _sloping_arm(b, s, x, z, deep)
    elif s.arms == "flare":
        turn = about_z(-side * 11.0)
        b.rounded_box("arm", s.cover, (x, *middle[1:]), (0.8 * s.arm, *size[1:]), 0.03, turn=turn)
    else:
        _open_arm(b, s, x)


def _sloping_arm(b: Builder, s: Seating, x: float, z: float, deep: float) -> None:
    """Add an arm whose top swings down from the back to the seat at the front."""
    t = np.linspace(0, 1, 9)
    tops = s.seat + 0.02 + (s.arm_rise + 0.12) * (1 - np.cos(np.pi * t)) / 2
    rings = []
    for fraction, top in zip(t, tops, strict=True):
        flat = np.array([(-0.5, 0), (0.5, 0), (0.5, 0.93), (0.36, 1), (-0.36, 1), (-0.5, 0.93)])
        xy = flat * np.array([s.arm, top - s.foot]) + np.array([x, s.foot])
        rings.append(np.column_stack([xy, np.full(6, z + (fraction - 0.5) * deep)]))
    b.loft("arm", s.cover, rings)


def _open_arm(b: Builder, s: Seating, x: float) -> None:
    """Add a wooden or metal arm: two uprights from the floor and a rest."""
    top, side = s.seat + s.arm_rise, 0.9 * s.arm
    front, rear = -0.42 * s.depth, 0.42 * s.depth
    for z in (front, rear):
        beam(b, "arm", s.frame, (x, 0, z), (x, top, z), width=0.7 * side, height=0.7 * side)
    start = (x, s.foot + 0.06, front)
    beam(b, "arm", s.frame, start, (x, s.foot + 0.06, rear), width=0.5 * side, height=side)
    rest = (1.3 * side, 0.03, rear - front + 0.12)
    b.rounded_box("arm", s.frame, (x, top, 0), rest, 0.4 * side)


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
