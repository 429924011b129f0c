"""What the components of a car share: its size, its outline, its materials. Metres."""

from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.kit import Component, Material, Rng, pick_material
from ffd_lightning.shapes.kit.vectors import Pair

BLACK = Material((0.06, 0.06, 0.065))
CHROME = Material((0.75, 0.76, 0.78))
LAMP = Material((0.95, 0.93, 0.82))
RED = Material((0.75, 0.06, 0.05))


@dataclass(frozen=True)
class Plan:
    """How a car stands and what it is of; its nose is at z = -length / 2."""

    length: float  # of the body
    width: float  # of the body at its widest
    track: float  # from the outer side of the left wheels to that of the right ones
    height: float  # of the roof
    belt: float  # height of the body below the windows
    radius: float  # of the tyres
    clearance: float  # height of the sills
    axles: tuple[float, ...]  # z of each axle, front first
    arch: float  # radius of the openings for the wheels; 0 where the wheels stand free of the body
    ends: Pair  # widths of nose and tail over the body's
    taper: float  # where the body begins to narrow, from 0 at its middle to 1 at its ends
    soft: float  # how round the flanks are, from 0 to 1
    line: tuple[Pair, ...]  # (z, height) rows from nose to tail: the top without the cabin
    paint: Material  # of the body
    second: Material  # of wings, stripes and some roofs
    roof: Material  # of the roof
    sill: Material  # of the lowest part of the flanks
    glass: Material  # of the windows, dark and opaque

    @property
    def least(self) -> float:
        """The least height of the body over the wheels."""
        return self.radius + self.arch + 0.06

    def top(self, z: float) -> float:
        """Return the height of the body at z."""
        rows = np.asarray(self.line)
        return float(np.interp(z, rows[:, 0], rows[:, 1]))

    def half(self, z: float) -> float:
        """Return half the width of the body at z."""
        t = np.clip((abs(2 * z / self.length) - self.taper) / (1 - self.taper), 0, 1)
        narrowing = (1 - self.ends[int(z > 0)]) * t ** (1 + 2.7 * self.taper)
        return float(0.5 * self.width * (1 - narrowing))

    def lower(self, z: float) -> float:
        """Return the height of the body's lower edge at z: the sill or a wheel arch."""
        reach = min(abs(z - axle) for axle in self.axles)
        if reach < self.arch:
            return self.radius + float(np.sqrt(self.arch**2 - reach**2))
        end = max(0.0, abs(2 * z / self.length) - 0.8) / 0.2
        return self.clearance + 0.2 * end**2 * (self.radius - 0.5 * self.clearance)


def draw_paint(rng: Rng) -> Material:
    """Draw a car's colour: lively, or white, silver, grey or black."""
    if rng.random() < 0.6:
        return pick_material(rng, "paint")
    return Material((float(rng.choice([0.08, 0.25, 0.5, 0.7, 0.92])),) * 3)


_USES = {  # weight; ranges of length, width, height, tyre radius, clearance, belt over height
    "city": (1.1, (2.4, 3.7), (1.42, 1.75), (1.28, 1.68), (0.24, 0.33), (0.12, 0.26), (0.52, 0.68)),
    "compact": (2, (3.5, 4.5), (1.5, 1.9), (1.25, 1.62), (0.26, 0.36), (0.1, 0.26), (0.54, 0.7)),
    "family": (2.6, (4.2, 5.2), (1.6, 1.95), (1.22, 1.6), (0.27, 0.38), (0.1, 0.26), (0.56, 0.72)),
    "large": (0.9, (4.9, 6.4), (1.75, 2.1), (1.3, 1.65), (0.3, 0.4), (0.12, 0.28), (0.56, 0.7)),
    "sports": (1, (3.5, 4.9), (1.55, 2.05), (1.0, 1.35), (0.27, 0.37), (0.07, 0.2), (0.6, 0.75)),
    "suv": (2.4, (3.3, 5.3), (1.6, 2.1), (1.5, 2.1), (0.32, 0.5), (0.18, 0.5), (0.56, 0.7)),
    "van": (0.9, (3.6, 6.6), (1.6, 2.1), (1.7, 2.8), (0.27, 0.38), (0.14, 0.32), (0.46, 0.62)),
    "pickup": (0.6, (4.2, 6.2), (1.6, 2.1), (1.45, 2.1), (0.32, 0.5), (0.2, 0.5), (0.58, 0.7)),
    "lorry": (0.35, (5.0, 8.5), (1.9, 2.5), (2.1, 3.0), (0.38, 0.52), (0.3, 0.45), (0.5, 0.6)),
    "bus": (0.4, (6.2, 13.0), (2.2, 2.6), (2.5, 3.4), (0.42, 0.52), (0.25, 0.4), (0.38, 0.5)),
    "vintage": (0.5, (2.8, 4.3), (1.1, 1.4), (1.5, 1.95), (0.33, 0.45), (0.3, 0.4), (0.58, 0.68)),
    "racer": (0.35, (3.6, 5.0), (1.5, 2.0), (0.9, 1.1), (0.28, 0.38), (0.1, 0.14), (0.33, 0.38)),
}


def draw_plan(rng: Rng, use: str) -> Plan:
    """Draw the sizes and materials of a car for a use; its line is still to be set."""
    length, width, height, radius, low, belt = (rng.uniform(*span) for span in _USES[use][1:])
    free, half = use == "vintage", length / 2
    front, rear = (max(rng.uniform(0.12, 0.25) * length, 1.35 * radius) for _ in range(2))
    axles: tuple[float, ...] = (front - half, half - rear)
    if free:
        axles = 0.35 * radius - half, half - rng.uniform(0.4, 1.4) * radius
    if use in ("bus", "lorry") and length > 7 and rng.random() < 0.35:
        axles = (*axles[:1], axles[1] - 1.2 * radius, axles[1] + 1.1 * radius)
    arch = 0.0 if free else rng.uniform(1.08, 1.22) * radius
    paint, second, tint = draw_paint(rng), draw_paint(rng), rng.uniform(0.16, 0.34)
    boxy = free or use in ("bus", "lorry", "van")
    return Plan(
        length=length,
        width=width,
        track=width * rng.uniform(1.28, 1.4) if free else width,
        height=height,
        belt=max(belt * height, radius + arch + 0.1),
        radius=radius,
        clearance=min(low, 0.9 * radius),
        axles=axles,
        arch=arch,
        ends=(rng.uniform(0.45, 0.62), rng.uniform(0.85, 1)),
        taper=0.12 if free else 0.55,
        soft=rng.uniform(0, 0.2 if boxy else 1),
        line=(),
        paint=paint,
        second=second,
        roof=paint if rng.random() < 0.8 else second,
        sill=BLACK if rng.random() < (0.5 if use == "suv" else 0.12) else paint,
        glass=Material((0.8 * tint, 0.95 * tint, 1.1 * tint)),
    )


USES = tuple(Component.of(name, row[0], draw_plan, use=name) for name, row in _USES.items())
