"""How cars stand: sizes, axles and outlines. Metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ffd_lightning.shapes.kit import Rng
from ffd_lightning.shapes.kit.vectors import Pair

Profile = Sequence[Pair]


@dataclass(frozen=True)
class Stance:
    """How a car stands: its size, its axles and the outline of its top.

    Attributes:
        length: along z; the nose is at -length / 2.
        width: across the flanks.
        axles: z of each axle, front first.
        radius: of the tyres.
        clearance: height of the sills.
        profile: (z, height) rows from nose to tail: the top of the body without its cabin.
        nose: width at the ends as a fraction of `width`.
    """

    length: float
    width: float
    axles: tuple[float, ...]
    radius: float
    clearance: float
    profile: Profile
    nose: float = 0.85

    def top(self, z: float) -> float:
        """Return the height of the body at z."""
        rows = np.asarray(self.profile)
        return float(np.interp(z, rows[:, 0], rows[:, 1]))

    def half_width(self, z: float) -> float:
        """Return half the width of the body at z; it narrows towards both ends."""
        t = np.clip((abs(2 * z / self.length) - 0.55) / 0.45, 0, 1)
        return 0.5 * self.width * (1 - (1 - self.nose) * t**2.5)

    def lower(self, z: float) -> float:
        """Return the height of the body's lower edge at z: the sill or a wheel arch."""
        arch = 1.13 * self.radius
        reach = min(abs(z - axle) for axle in self.axles)
        if reach < arch:
            return self.radius + float(np.sqrt(arch**2 - reach**2))
        return self.clearance


def _draw_axles(rng: Rng, length: float, radius: float, front: float) -> Pair:
    """Draw the axles' z; `front` is the front overhang in tyre radii."""
    first = -length / 2 + radius * front
    rear = length / 2 - radius * rng.uniform(1.9, 2.8)
    return first, rear


def draw_stance(rng: Rng, length: Pair, width: Pair, radius: Pair, clearance: Pair) -> Stance:
    """Draw a car's size within these ranges; its profile is still to be set."""
    long, r = rng.uniform(*length), rng.uniform(*radius)
    axles = _draw_axles(rng, long, r, rng.uniform(2.0, 2.8))
    low = min(rng.uniform(*clearance), 0.9 * r)
    return Stance(
        length=long,
        width=rng.uniform(*width),
        axles=axles,
        radius=r,
        clearance=low,
        profile=(),
        nose=rng.uniform(0.78, 0.9),
    )


def with_profile(stance: Stance, nose: float, cowl: Pair, deck: Pair, tail: float) -> Stance:
    """Set a profile: heights of nose and tail, (z, height) of the cowl and of the deck's front."""
    half = stance.length / 2
    least = 2.13 * stance.radius + 0.06  # the wheel arches must fit below the bonnet
    rows = [(-half, nose - 0.08), (-half + 0.08, nose), (-half + 0.35, max(nose + 0.05, least))]
    rows += [(cowl[0], max(cowl[1], least + 0.03)), (deck[0], max(deck[1], least + 0.03))]
    rows += [(half - 0.2, max(tail + 0.02, least)), (half - 0.04, tail), (half, tail - 0.07)]
    return replace(stance, profile=tuple(rows))
