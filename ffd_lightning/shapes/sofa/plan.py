"""The rows of seats that make up a sofa: sizes, materials, places. Metres."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ffd_lightning.shapes.kit import Chosen, Component, Rng, draw, pick_material
from ffd_lightning.shapes.kit.upholstery import Seating
from ffd_lightning.shapes.kit.vectors import Array, Triple, about_y


@dataclass(frozen=True)
class Row:
    """Where a row is."""

    plan: Seating
    slots: Sequence[str] = ("base", "seat", "back", "arms")  # the components that it has
    degrees: float = 0.0  # by which it is turned about y
    shift: Triple = (0.0, 0.0, 0.0)  # of its middle, after that
    radius: float = np.inf  # of the curve that its middle follows

    def place(self, v: Array) -> Array:
        """Return vertices of the row, (v, 3), where it is."""
        if np.isfinite(self.radius):
            angle, out = v[:, 0] / self.radius, self.radius + v[:, 2]
            v = np.stack([out * np.sin(angle), v[:, 1], out * np.cos(angle) - self.radius], 1)
        return v @ about_y(self.degrees).T + self.shift


def draw_plan(rng: Rng, chosen: Chosen) -> Seating:
    """Draw the sizes and materials of a sofa of these components."""
    layout, base, back, arms = (chosen[slot].name for slot in ("layout", "base", "back", "arms"))
    long, seats = layout == "longue", int(rng.choice([1, 2, 3, 4], p=(0.08, 0.37, 0.37, 0.18)))
    if long or layout not in ("straight", "stool"):
        seats = 1 if long else int(np.clip(seats, 2, 3 if layout in ("curved", "u") else 4))
    cover = pick_material(rng, draw(rng, ["fabric", "leather"], [0.65, 0.35]))
    # The other nine numbers are not used; without them all that follow would be others.
    cushion = rng.uniform(0.1, 0.19, 10)[3]
    pillows = cover if rng.random() < 0.75 else pick_material(rng, "fabric")
    wooden = pick_material(rng, draw(rng, ["wood", "metal"], [0.7, 0.3]))
    deck = rng.uniform(0.17, 0.38)
    low, high = (0.02, 0.06) if base == "plinth" else (0.06, 0.26)
    rise = rng.uniform(0.24, 0.36) if back == "rolled" else rng.uniform(0.22, 0.85)
    thin = {"open": (0.05, 0.07), "none": (0.02, 0.03), "bolsters": (0.02, 0.03)}
    return Seating(
        seats=seats,
        width=rng.uniform(1.1, 1.9) if long else seats * rng.uniform(0.48, 0.85),
        depth=rng.uniform(0.55, 0.9) if long else rng.uniform(0.62, 1.2),
        seat=deck + 0.8 * cushion,
        cushion=cushion,
        back=rise,
        thick=0.13 if long else rng.uniform(0.12, 0.26),
        rake=4.0 if back == "rolled" or long else rng.uniform(3, 16),
        arm=rng.uniform(*thin.get(arms, (0.09, 0.2 if long else 0.34))),
        arm_rise=rise if back == "rolled" else rng.uniform(0.1, max(0.2, 0.9 * rise)),
        # What hangs on the rails of a frame must not reach lower than they do.
        foot=deck - 0.09 if base == "frame" else min(rng.uniform(low, high), deck - 0.08),
        arms=arms,
        cover=cover,
        pillows=pillows,
        frame=wooden,
    )


def curved(rng: Rng, p: Seating) -> list[Row]:
    """Bend one row."""
    return [Row(p, radius=max(p.span / 2 / np.radians(rng.uniform(20, 95)), 0.5 * p.depth + 0.5))]


def longue(rng: Rng, p: Seating) -> list[Row]:
    """Place one row with one arm."""
    return [Row(replace(p, ends=(int(rng.choice([-1, 1])),)))]


def lengthened(rng: Rng, p: Seating, apart: bool) -> list[Row]:
    """Place a row with a seat before it for the legs, joined or `apart`."""
    side, reach, wide = int(rng.choice([-1, 1])), rng.uniform(0.4, 1.2), p.width / p.seats
    gap = rng.uniform(0.1, 0.35) if apart else -0.06
    own = replace(p, seats=1, width=wide, depth=reach, thick=0.0, ends=())
    at = (side * (p.width - wide) / 2, 0.0, -(p.depth + reach) / 2 - gap)
    ends = p.ends if apart or rng.random() < 0.7 else (-side,)
    return [Row(replace(p, ends=ends)), Row(own, ("base", "seat"), 0, at)]


def corner(rng: Rng, p: Seating, wings: int) -> list[Row]:
    """Place a row and one or two wings at right angles to it."""
    sides = (-1, 1) if wings == 2 else (int(rng.choice([-1, 1])),)
    p = replace(p, width=max(p.width, wings * p.depth + 0.55))
    rows = [Row(replace(p, ends=() if wings == 2 else (-sides[0],)))]
    for side in sides:
        count = int(rng.integers(1, 4 if wings == 1 else 3))
        reach = count * rng.uniform(0.5, 0.75)
        x, degrees = side * (p.width + p.arm - p.depth) / 2, 90.0 * side
        own = replace(p, seats=count, width=reach, ends=(side,) if rng.random() < 0.6 else ())
        behind = replace(p, seats=count + 1, width=reach + p.depth - p.thick)
        rows.append(Row(own, ("base", "seat", "arms"), degrees, (x, 0, -(p.depth + reach) / 2)))
        rows.append(Row(behind, ("back",), degrees, (x, 0, -(reach + p.thick) / 2)))
    return rows


LAYOUTS = (
    Component("straight", 5.5, lambda rng, p: [Row(p)]),
    Component.of("stool", 1, lengthened, apart=True),
    Component.of("ell", 1.6, lengthened, apart=False),
    Component.of("corner", 1.5, corner, wings=1),
    Component.of("u", 1, corner, wings=2),
    Component("longue", 1, longue),
    Component("curved", 2, curved),
)
