"""What closed cars have in common: the cabin on the body, doors, mirrors. Metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.car.body import BLACK, CHROME, draw_paint, face, hood, shell
from ffd_lightning.shapes.car.stance import Stance
from ffd_lightning.shapes.car.wheels import wheels
from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.sections import corner_arcs
from ffd_lightning.shapes.kit.vectors import Array, Pair, vec


def draw_glass(rng: Rng) -> Material:
    """Draw the tint of windows, dark and opaque."""
    value = rng.uniform(0.16, 0.34)
    return Material((0.8 * value, 0.95 * value, 1.1 * value))


@dataclass(frozen=True)
class Cabin:
    """A closed cabin: where its glass starts at the belt and ends at the roof.

    Attributes:
        belt: z of the windscreen's and the rear window's feet.
        roof: z of the roof's front and rear edge.
        heights: of the belt and of the roof.
        widths: across at the belt and at the roof.
        pillars: fractions along the sides where pillars stand, besides the four corners.
        pillar: how wide they are.
    """

    belt: Pair
    roof: Pair
    heights: Pair
    widths: Pair
    pillars: tuple[float, ...] = (0.48,)
    pillar: float = 0.06

    def point(self, along: float, up: float, side: float) -> Array:
        """Return a point of the flank: fractions along it and up it, and `side` -1 or 1."""
        t = max(0.0, min(1.0, up))
        front, rear = ((1 - t) * self.belt[i] + t * self.roof[i] for i in (0, 1))
        half = 0.5 * ((1 - up) * self.widths[0] + up * self.widths[1])
        y = (1 - up) * self.heights[0] + up * self.heights[1]
        return vec(side * half, y, front + along * (rear - front))

    def ring(self, up: float, grow: float = 0.0) -> Array:
        """Return the horizontal outline (16, 3) at a fraction of the height."""
        low, high = self.point(0, up, 1), self.point(1, up, 1)
        x, z = np.array([high[0], (high[2] - low[2]) / 2]) + grow
        corners, arcs = corner_arcs(3)
        flat = corners * np.array([x - 0.08, z - 0.08]) + 0.08 * arcs
        middle = (low[2] + high[2]) / 2
        return np.column_stack([flat[:, 0], np.full(16, low[1]), flat[:, 1] + middle])

    def pillar_ring(self, along: float, up: float, side: float) -> Array:
        """Return a pillar's horizontal outline (8, 3), its outer faces just proud of the glass.

        It is level, so that however far the pillar leans its ends stay below the roof.
        """
        half, proud = self.pillar / 2, 0.01
        middle = self.point(along, up, side) - vec(side * (half - proud), 0, 0)
        middle[2] += {0.0: half - proud, 1.0: proud - half}.get(along, 0.0)
        # Corner pillars must be as round as the glass and the roof are there.
        chamfer = min(0.03, 0.8 * half) if along in (0.0, 1.0) else 0.2 * half
        a, c = half, half - chamfer
        flat = np.array([(a, c), (c, a), (-c, a), (-a, c), (-a, -c), (-c, -a), (c, -a), (a, -c)])
        return np.insert(flat, 1, 0, axis=1) + middle


def cabin(b: Builder, paint: Material, glass: Material, shape: Cabin, roof: Material) -> None:
    """Add windows, pillars and a roof."""
    b.loft("window", glass, [shape.ring(up) for up in (-0.15, 0.0, 0.5, 1.0)])
    for side in (-1, 1):
        for along in (0.0, *shape.pillars, 1.0):
            levels = (-0.1, 0.0, 1.0) if along in (0.0, 1.0) else (-0.1, 1.0)
            rings = [shape.pillar_ring(along, up, side) for up in levels]
            b.loft("roof", paint, rings)
    thick = 0.05 * (shape.heights[1] - shape.heights[0]) + 0.02
    rise = vec(0, thick, 0)
    rings = [shape.ring(0.97, 0.02), shape.ring(1.0, 0.012) + 0.3 * rise]
    rings += [shape.ring(1.0, -0.06) + 0.8 * rise, shape.ring(1.0, -0.25) + rise]
    b.loft("roof", roof, rings)


def doors(b: Builder, stance: Stance, seams: Sequence[float], belt: float) -> None:
    """Add the doors' vertical seams at each z of `seams`, a handle behind each but the last."""
    low, rows = stance.clearance + 0.1, sorted(seams)
    for side in (-1, 1):
        for i, z in enumerate(rows):
            bottom = max(low, stance.lower(z) + 0.02)
            top = stance.clearance + 0.72 * (belt - stance.clearance)
            if top - bottom < 0.1:
                continue
            x = side * (stance.half_width(z) - 0.009)
            b.box("body", BLACK, (x, (bottom + top) / 2, z), (0.026, top - bottom, 0.012))
            if i:
                handle = (side * (stance.half_width(z) + 0.002), top - 0.04, z - 0.14)
                b.box("trim", CHROME, handle, (0.03, 0.025, 0.14))


def mirrors(b: Builder, paint: Material, foot: Array) -> None:
    """Add two mirrors beside `foot`, the lower end of the right front pillar."""
    for side in (-1, 1):
        root = foot * vec(side, 1, 1)
        head = root + vec(0.12 * side, 0.08, -0.02)
        b.cylinder("trim", BLACK, root, head, 0.018, segments=8)
        b.rounded_box("trim", paint, head, (0.16, 0.11, 0.08), 0.035, segments=2)


def fittings(b: Builder, rng: Rng, stance: Stance, paint: Material, shape: Cabin) -> None:
    """Add what all closed cars share: lights, wheels, doors, mirrors."""
    face(b, rng, stance, paint)
    wheels(b, rng, stance)
    front, rear = shape.belt
    seams = [front + t * (rear - front) for t in (0.12, *shape.pillars)]
    doors(b, stance, seams, shape.heights[0])
    mirrors(b, paint, shape.point(0.07, -0.02, 1))


def closed_car(b: Builder, rng: Rng, stance: Stance, shape: Cabin) -> Material:
    """Add body, cabin and fittings; return the paint."""
    paint, glass = draw_paint(rng), draw_glass(rng)
    roof = paint if rng.random() < 0.8 else draw_paint(rng)
    shell(b, paint, stance)
    cabin(b, paint, glass, shape, roof)
    hood(b, paint, stance, (-stance.length / 2 + 0.2, shape.belt[0] - 0.06))
    fittings(b, rng, stance, paint, shape)
    return paint


def upper_sides(
    b: Builder, paint: Material, shape: Cabin, blind: float | None, lintel: float
) -> None:
    """Close a tall cabin above `lintel`, and wholly behind the fraction `blind`."""
    bands = [(0.0, lintel)] if blind is None else [(0.0, lintel), (blind, -0.1)]
    for front, low in bands:
        rings = []
        for up in (low, 1.0):
            x, y, z = shape.point(front, up, 1)
            ahead, behind = z - 0.012 * (front == 0), shape.point(1, up, 1)[2] + 0.015
            out = x + 0.012
            rings.append([(out, y, ahead), (out, y, behind), (-out, y, behind), (-out, y, ahead)])
        b.loft("body", paint, rings)
