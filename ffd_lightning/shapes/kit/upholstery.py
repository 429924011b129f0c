"""Padded seats as sofas and armchairs have them: cushions, feet, backs, arms. Metres."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, pad
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import UP, Array, Triple, about_z, lean, vec

ARMS = ("box", "padded", "rolled", "slope", "flare", "open")


def draw_cover(rng: Rng) -> Material:
    """Draw what covers a seat."""
    return pick_material(rng, draw(rng, ["fabric", "leather", "plastic"], [0.55, 0.3, 0.15]))


@dataclass(frozen=True)
class Seating:
    """The dimensions and looks of a padded seat; its front is at z = -depth / 2."""

    seats: int  # how many sit on it
    width: float  # between the arms
    depth: float  # over all
    seat: float  # height of the cushions' upper side
    cushion: float  # thickness of the seat cushions
    back: float  # height of the back above the seat
    thick: float  # of the back
    rake: float  # degrees by which the back is tipped
    arm: float  # width of an arm
    arm_rise: float  # height of an arm above the seat
    foot: float  # height of the legs
    arms: str  # one of `ARMS`
    cover: Material
    pillows: Material  # what covers the cushions
    frame: Material  # what legs and open arms are of
    ends: Sequence[int] = (-1, 1)  # the sides that have arms

    @property
    def span(self) -> float:
        """Width over the arms."""
        return self.width + 2 * self.arm

    @property
    def deck(self) -> float:
        """Height of what the cushions lie on."""
        return self.seat - 0.8 * self.cushion

    @property
    def each(self) -> float:
        """Width of one seat."""
        return self.width / self.seats

    @property
    def places(self) -> list[float]:
        """The x of the middle of each seat."""
        return [(i + 0.5) * self.each - self.width / 2 for i in range(self.seats)]

    def point(self, x: float, rise: float, out: float = 0.0) -> Array:
        """Return the point at `x`, `rise` along the back from the seat, `out` behind its middle."""
        foot = vec(0, self.seat, self.depth / 2 - 0.55 * self.thick)
        return foot + lean(self.rake) @ vec(x, rise, out)

    def add_base(self, b: Builder) -> None:
        """Add the box below the cushions."""
        wide = self.width + (0 if self.arms == "open" else self.arm)
        size = (wide, self.deck - self.foot, 0.96 * self.depth)
        b.rounded_box("seat", self.cover, (0, (self.deck + self.foot) / 2, 0), size, 0.03)

    def add_seat_cushions(self, b: Builder, front: float = 0.0) -> None:
        """Add one cushion per seat between the arms; `front` lets them stand out at the front."""
        rear, start = self.depth / 2 - 0.7 * self.thick, -self.depth / 2 - front
        size = (0.99 * self.each, self.cushion, rear - start)
        for x in self.places:
            center = (x, self.seat - self.cushion / 2, (rear + start) / 2)
            b.rounded_box("seat", self.pillows, center, size, radius=0.05, edge=0.4 * self.cushion)

    def add_feet(self, b: Builder, rng: Rng, width: float | None = None) -> None:
        """Add short legs below the corners, and a middle pair below long sofas."""
        if self.arms == "open" and width is None:
            return
        wide = self.span if width is None else width
        kind, ankle = draw(rng, ["square", "round"]), rng.uniform(0.45, 1.0)
        style = LegStyle(kind, rng.uniform(0.04, 0.075), ((0.0, ankle), (0.5, 0.85), (1.0, 1.0)))
        feet = corners(wide - 0.16, self.depth - 0.14, 0.0)
        if wide > 1.5:
            feet = np.concatenate([feet, feet[[0, 2]] * vec(0, 1, 1)])
        out = 1.02 if ankle < 0.7 else 1.0
        tops = feet + (self.foot + 0.02) * UP
        add_legs(b, "leg", self.frame, style, tops, feet * vec(out, 1, out))

    def add_pad(
        self, b: Builder, cover: Material, at: Triple, size: Triple, radius: float, tip: float = 0
    ) -> None:
        """Add a pad to the back, its middle at `point`(*at), tipped by `tip` degrees more."""
        pad(b, "back", cover, self.point(*at), size, radius, self.rake + tip)

    def add_tight_back(self, b: Builder, width: float) -> None:
        """Add one padded panel as the back."""
        low = -0.5 * self.seat
        size = (width, self.back - low, self.thick)
        self.add_pad(b, self.cover, (0, (self.back + low) / 2, 0), size, 0.4 * self.thick)

    def add_loose_back(self, b: Builder, overhang: float) -> None:
        """Add a thin panel and a cushion per seat before it, `overhang` higher than the panel."""
        low, rise = -0.5 * self.seat, self.back - overhang
        size = (self.width + self.arm, rise - low, 0.5 * self.thick)
        self.add_pad(b, self.cover, (0, (rise + low) / 2, 0.25 * self.thick), size, 0.04)
        size = (0.98 * self.each, self.back + 0.01, 0.85 * self.thick)
        for x in self.places:
            self.add_pad(b, self.pillows, (x, self.back / 2, -0.35 * self.thick), size, 0.07, 3)

    def add_tufts(self, b: Builder, rows: int, columns: int) -> None:
        """Add staggered buttons on the front of a tight back."""
        button = [(0.011, -0.005), (0.014, 0.0), (0.008, 0.007)]
        for row in range(rows):
            rise = self.back * (0.25 + 0.6 * row / max(rows - 1, 1))
            for column in range(columns - row % 2):
                x = ((column + 0.5 * (row % 2) + 0.5) / columns - 0.5) * self.width
                at = self.point(x, rise, -0.5 * self.thick)
                b.lathe("back", self.frame, button, at, segments=8, turn=lean(self.rake - 90))

    def add_arm(self, b: Builder, side: int) -> None:
        """Add the arm on `side` (-1 or 1)."""
        deep, top, low = 0.97 * self.depth, self.seat + self.arm_rise, self.foot
        x, z = side * (self.width + self.arm) / 2, self.depth / 2 - deep / 2
        middle, tall = (x, (top + low) / 2, z), top - low
        if self.arms == "box":
            b.rounded_box("arm", self.cover, middle, (self.arm, tall, deep), 0.12 * self.arm)
        elif self.arms == "padded":
            b.rounded_box("arm", self.cover, middle, (0.9 * self.arm, tall, 0.98 * deep), 0.02)
            soft = (1.1 * self.arm, 0.5 * self.arm, deep)
            b.rounded_box("arm", self.cover, (x, top, z), soft, 0.25 * self.arm)
        elif self.arms == "rolled":
            b.rounded_box("arm", self.cover, middle, (0.8 * self.arm, tall, 0.98 * deep), 0.02)
            r, half = 0.58 * self.arm, vec(0, 0, deep / 2)
            axis = vec(x + side * 0.15 * self.arm, top - 0.3 * r, z)
            b.cylinder("arm", self.cover, axis - half, axis + half, r)
        elif self.arms == "slope":
            self._sloping_arm(b, x, z, deep)
        elif self.arms == "flare":
            size, turn = (0.8 * self.arm, tall, deep), about_z(-side * 11.0)
            b.rounded_box("arm", self.cover, middle, size, 0.03, turn=turn)
        else:
            self._open_arm(b, x, top)

    def _sloping_arm(self, b: Builder, x: float, z: float, deep: float) -> None:
        """Add an arm whose top swings down from the back to the seat at the front."""
        flat = np.array([(-0.5, 0), (0.5, 0), (0.5, 0.93), (0.36, 1), (-0.36, 1), (-0.5, 0.93)])
        rings = []
        for t in np.linspace(0, 1, 9):
            top = self.seat + 0.02 + (self.arm_rise + 0.12) * (1 - np.cos(np.pi * t)) / 2
            xy = flat * np.array([self.arm, top - self.foot]) + np.array([x, self.foot])
            rings.append(np.insert(xy, 2, z + (t - 0.5) * deep, axis=1))
        b.loft("arm", self.cover, rings)

    def _open_arm(self, b: Builder, x: float, top: float) -> None:
        """Add a wooden or metal arm: two uprights from the floor and a rest."""
        side, z, low = 0.9 * self.arm, 0.42 * self.depth, self.foot + 0.06
        for end in (-z, z):
            beam(b, "arm", self.frame, (x, 0, end), (x, top, end), 0.7 * side, 0.7 * side)
        beam(b, "arm", self.frame, (x, low, -z), (x, low, z), 0.5 * side, side)
        b.rounded_box("arm", self.frame, (x, top, 0), (1.3 * side, 0.03, 2 * z + 0.12), 0.4 * side)


def boxed(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a padded box on short legs; arms that stand on the floor do without."""
    s.add_base(b)
    s.add_feet(b, rng, None if s.ends else s.width + s.arm)


def armed(b: Builder, rng: Rng, s: Seating) -> None:
    """Add padded or open arms at the seat's ends."""
    for side in s.ends:
        s.add_arm(b, side)
