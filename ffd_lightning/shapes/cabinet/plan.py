"""What the components of a cabinet share, and the outlines of its plan. Metres."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ffd_lightning.shapes.cabinet.joinery import Bay, Joinery, carcass, draw_joinery
from ffd_lightning.shapes.kit import Builder, Chosen, Component, Rng, draw, nothing
from ffd_lightning.shapes.kit.sheets import Bent
from ffd_lightning.shapes.kit.vectors import Array


@dataclass(frozen=True)
class Plan:
    """A cabinet's sizes and look."""

    width: float  # of the case
    height: float  # of the case, without what it stands on
    depth: float  # of the case
    foot: float  # height of what it stands on
    style: Joinery  # of its fronts

    @property
    def top(self) -> float:
        """Height of the case's upper side."""
        return self.foot + self.height

    def case(self, b: Builder, back: bool = True) -> Bay:
        """Add the case; return its opening."""
        size = (self.width, self.height, self.depth)
        return carcass(b, self.style, size, (0, self.foot, 0), back)


_SIZES = {  # how frequent, then ranges of width, height, depth
    "night": (1.2, (0.34, 0.7), (0.2, 0.65), (0.26, 0.52)),
    "chest": (2, (0.55, 1.3), (0.5, 1.2), (0.32, 0.62)),
    "tall": (1, (0.3, 0.8), (0.9, 1.8), (0.25, 0.55)),
    "low": (2, (1.0, 2.4), (0.22, 0.5), (0.28, 0.56)),
    "sideboard": (2, (0.9, 2.1), (0.45, 1.0), (0.28, 0.6)),
    "wardrobe": (1.6, (0.5, 2.8), (1.5, 2.4), (0.35, 0.72)),
    "shelving": (2, (0.35, 2.0), (0.6, 2.3), (0.18, 0.42)),
    "office": (0.7, (0.36, 1.3), (0.45, 1.6), (0.35, 0.75)),
    "lockers": (0.5, (0.3, 2.2), (1.0, 2.0), (0.3, 0.6)),
    "kitchen": (1.2, (0.45, 2.6), (0.62, 0.8), (0.5, 0.66)),
}
_FOOT = {
    "plinth": (0.03, 0.1), "legs": (0.07, 0.45), "splayed": (0.1, 0.38), "bracket": (0.05, 0.14),
    "sled": (0.08, 0.4), "casters": (0.05, 0.08), "none": (0.0, 0.0),
}  # fmt: skip
_KINDS = {"kitchen": ("wood", "paint", "plastic"), "shelving": ("wood", "wood", "paint", "plastic")}


def draw_plan(rng: Rng, chosen: Chosen) -> Plan:
    """Draw the sizes and the look of a cabinet of these components."""
    use = chosen["use"].name
    width, height, depth = (rng.uniform(*span) for span in _SIZES[use][1:])
    steel = use in ("office", "lockers")
    style = draw_joinery(rng, ("metal", "paint") if steel else _KINDS.get(use, ("wood", "paint")))
    if chosen["outline"].name != "straight":  # so that few faces are to be bent
        style = replace(style, panel="flat", grip="knob")
    if steel:
        style = replace(style, panel="flat", grip=draw(rng, ["bar", "bow", "slot"]))
    share = 0.6 if use in ("wardrobe", "kitchen") else 1.0  # what is tall or heavy stands low
    return Plan(width, height, depth, share * rng.uniform(*_FOOT[chosen["stand"].name]), style)


USES = tuple(Component(use, of[0], nothing) for use, of in _SIZES.items())

Outline = Callable[[Array], Array]
"""From x, -1 to 1 across the front, to the share of the depth there."""


def _warped(b: Builder, p: Plan, outline: Outline, fixed: float) -> Builder:
    """Return what draws with the depth changed along x, away from the plane z = `fixed`."""

    def bend(v: Array) -> Array:
        share = outline((2 * v[:, 0] / p.width).clip(-1, 1))
        return np.stack([v[:, 0], v[:, 1], fixed + (v[:, 2] - fixed) * share], 1)

    return Bent(b, bend, p.width / 6.5)


def bow(b: Builder, rng: Rng, p: Plan) -> Builder:
    """Bow the front out, or in and out."""
    waves = int(rng.choice([1, 1, 3]))
    swell = min(rng.uniform(0.15, 0.5), 0.2 * p.width / p.depth) / waves**1.5
    return _warped(b, p, lambda u: 1 + swell * np.cos(waves * np.pi * u / 2), p.depth / 2)


def half_round(b: Builder, rng: Rng, p: Plan) -> Builder:
    """Make the plan a half round."""
    grow, power = 0.9 * p.width / p.depth / 2 + 0.4, rng.uniform(0.4, 0.6)
    return _warped(b, p, lambda u: grow * (1 - 0.9 * u * u) ** power, p.depth / 2)


def drum(b: Builder, rng: Rng, p: Plan) -> Builder:
    """Make the plan round."""
    return _warped(b, p, lambda u: p.width / p.depth * np.sqrt(1 - 0.9 * u * u), 0.0)


def wedge(b: Builder, rng: Rng, p: Plan) -> Builder:
    """Make the plan one that fits a corner of a room."""
    ends = rng.uniform(0.25, 0.5)
    grow = p.width / p.depth / 2 + ends
    return _warped(b, p, lambda u: ends + (grow - ends) * (1 - np.abs(u)), -p.depth / 2)


_CURVED = {"layout": ("drawers", "doors", "both"), "top": ("flat", "bare", "cornice")}
_SMALL = {"use": ("night", "chest", "sideboard")}
_CORNERED = {"use": ("tall", "chest"), "layout": ("doors", "both")}
OUTLINES = (
    Component("straight", 6.5, lambda b, rng, p: b),
    Component("bow", 1.8, bow, _CURVED | {"use": (*_SMALL["use"], "wardrobe")}),
    Component("half", 1, half_round, _CURVED | _SMALL),
    Component("drum", 4, drum, _CURVED | {"use": ("night",), "stand": ("none", "plinth")}),
    Component("wedge", 1.5, wedge, {**_CURVED, **_CORNERED}),
)
