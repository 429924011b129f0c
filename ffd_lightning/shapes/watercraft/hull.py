"""Hulls, decks, bulwarks and railings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, pick_material
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair, vec

_COLORS = {
    "white": (0.93, 0.93, 0.91),
    "cream": (0.9, 0.84, 0.7),
    "grey": (0.55, 0.58, 0.62),
    "dark": (0.22, 0.24, 0.27),
    "navy": (0.12, 0.18, 0.38),
    "black": (0.12, 0.12, 0.13),
    "red": (0.62, 0.16, 0.12),
    "green": (0.15, 0.38, 0.28),
    "orange": (0.85, 0.45, 0.12),
    "blue": (0.2, 0.42, 0.68),
    "teak": (0.66, 0.47, 0.28),
    "window": (0.1, 0.14, 0.2),
}


def tint(rng: Rng, *names: str) -> Material:
    """Draw one of the named colours, a little off its usual tone."""
    color = np.array(_COLORS[names[int(rng.integers(len(names)))]])
    r, g, b = np.clip(color * rng.uniform(0.85, 1.1) + rng.uniform(-0.03, 0.03, 3), 0.03, 1.0)
    return Material((float(r), float(g), float(b)))


def plank(rng: Rng) -> Material:
    """Draw a deck's wood, finely grained."""
    wood = pick_material(rng, "wood")
    return Material(wood.color, "wood", 4.0, seed=wood.seed)


@dataclass(frozen=True)
class Hull:
    """The shape of a hull, its bow at -z; stations run from 0 at the bow to 1 at the stern.

    Attributes:
        length: between the ends of the keel line.
        beam: greatest breadth.
        depth: from the keel (y = 0) to the deck's edge at its lowest.
        widest: station of the greatest breadth.
        transom: breadth at the stern, as a fraction of the beam.
        fineness: below 1 for a blunt bow, above for a sharp one.
        fullness: of the midship section: 1.3 is a V, 2 an ellipse, 5 nearly a box.
        sheer: how much the deck's edge rises to the bow and to the stern.
        rake: how far the deck overhangs the keel at the bow and at the stern.
        lift: how much the keel rises at the bow and at the stern.
        x: shifts the hull sideways, as in a catamaran.
    """

    length: float
    beam: float
    depth: float
    widest: float = 0.5
    transom: float = 0.5
    fineness: float = 0.8
    fullness: float = 2.5
    sheer: Pair = (0.0, 0.0)
    rake: Pair = (0.0, 0.0)
    lift: Pair = (0.0, 0.0)
    x: float = 0.0

    def half(self, t: float) -> float:
        """Return half the breadth of the deck at a station."""
        if t < self.widest:
            share = np.sin(np.pi / 2 * t / self.widest) ** self.fineness
        else:
            aft = (t - self.widest) / (1 - self.widest)
            share = self.transom + (1 - self.transom) * np.cos(np.pi / 2 * aft) ** 0.8
        return max(float(share) * self.beam / 2, 0.004)

    def top(self, t: float) -> float:
        """Return the height of the deck's edge at a station."""
        bow, stern = max(0.0, 1 - t / 0.7) ** 2, max(0.0, (t - 0.4) / 0.6) ** 2
        return self.depth + self.sheer[0] * bow + self.sheer[1] * stern

    def keel(self, t: float) -> float:
        """Return the height of the hull's lowest point at a station."""
        bow, stern = max(0.0, 1 - t / 0.3) ** 2, max(0.0, (t - 0.65) / 0.35) ** 2
        return self.lift[0] * bow + self.lift[1] * stern

    def z(self, t: float, y: float | None = None) -> float:
        """Return where a station lies at height `y`, by default at the deck's edge."""
        rise = (self.top(t) if y is None else y) / self.depth
        overhang = self.rake[1] * t**6 - self.rake[0] * (1 - t) ** 4
        return (t - 0.5) * self.length + overhang * rise

    def edge(self, t: float, side: float, inset: float = 0.0, up: float = 0.0) -> Array:
        """Return the point (3,) of the deck's edge on `side`, -1 or 1, `inset` from it."""
        x = self.x + side * max(self.half(t) - inset, 0.002)
        return vec(x, self.top(t) + up, self.z(t))

    def profile(self, t: float, span: Pair = (0.0, 9.0), inset: float = 0.0) -> Array:
        """Return the section (18, 3) at a station, from gunwale to keel to gunwale.

        Only what lies between the heights `span` is kept; `inset` moves it inward.
        """
        top, keel = self.top(t), min(self.keel(t), self.top(t) - 0.01)
        high, low = min(top, max(span[1], keel + 0.004)), max(keel, min(span[0], top - 0.004))
        y = low + (high - low) * (1 - np.sin(np.linspace(0, np.pi / 2, 9)))
        power = 1.25 + (self.fullness - 1.25) * min(1.0, t / (0.7 * self.widest))
        drop = np.clip((top - y) / (top - keel), 0, 1)
        x = max(self.half(t) - inset, 0.002) * (1 - drop**power) ** (1 / power)
        x, y = np.maximum(x, 0.0015), y + inset * drop  # a keel has some breadth
        z = np.array([self.z(t, level) for level in y])
        sides = [np.stack([self.x + s * x, y, z], 1) for s in (-1, 1)]
        return np.concatenate([sides[0], sides[1][::-1]])


def stations() -> Array:
    """Return stations (17,) from bow to stern, denser at the bow."""
    t = np.linspace(0, 1, 17)
    return 0.55 * t + 0.45 * t**2


def solid_hull(
    b: Builder, hull: Hull, upper: Material, lower: Material, waterline: float, deck: Material
) -> None:
    """Add a decked hull in two colours that meet at the height `waterline`."""
    for material, span in ((upper, (waterline, 9.0)), (lower, (0.0, waterline))):
        b.loft("hull", material, [hull.profile(t, span) for t in stations()])
    rings = []
    for t in stations():
        inset, high = 0.06 * hull.half(t), (0.0, 0.006, 0.006, 0.0)
        sides = (-1, -1, 1, 1)
        rings.append([hull.edge(t, s, inset, y) for s, y in zip(sides, high, strict=True)])
    b.loft("deck", deck, rings)


def open_hull(b: Builder, hull: Hull, outer: Material, thickness: float) -> None:
    """Add an undecked hull with sides of a thickness and a closed stern."""
    skins = [(hull.profile(t), hull.profile(t, inset=thickness)) for t in stations()]
    rings = [np.concatenate([outside, inside[::-1]]) for outside, inside in skins]
    b.loft("hull", outer, rings, caps=False)
    stern = hull.profile(1.0)
    b.loft("hull", outer, [stern - vec(0, 0, thickness), stern])


def bulwark(
    b: Builder,
    hull: Hull,
    material: Material,
    height: float,
    span: Pair = (0.0, 1.0),
    thickness: float = 0.012,
    part: str = "hull",
) -> None:
    """Add a strip that stands on the deck's edge on both sides, from one station to another.

    Where it begins behind the bow it rises from the deck gradually.
    """
    low = -0.004
    for side in (-1, 1):
        rings = []
        for t in span[0] + (span[1] - span[0]) * stations():
            inset = min(thickness, 0.6 * hull.half(t))
            outer, inner = hull.edge(t, side, -0.003), hull.edge(t, side, inset)
            high = height * min(1.0, 0.3 + 12 * (t - span[0])) if span[0] > 0 else height
            corners = ((outer, low), (outer, high), (inner, high), (inner, low))
            rings.append([point + y * UP for point, y in corners])
        b.loft(part, material, rings)


def railing(
    b: Builder, hull: Hull, material: Material, height: float, span: Pair, posts: int
) -> None:
    """Add posts and two wires along the deck's edge, joined at the bow if they start there."""
    radius = 0.0035
    ts = np.linspace(*span, posts)
    for side in (-1, 1):
        feet = np.array([hull.edge(t, side, 0.015) for t in ts])
        for foot in feet:
            b.cylinder("rail", material, foot, foot + height * UP, radius, segments=6)
        for level in (0.55 * height, height):
            b.tube("rail", material, feet + level * UP, radius, segments=6)
    if span[0] < 0.1:
        ends = [hull.edge(ts[0], side, 0.015, height) for side in (-1, 1)]
        b.cylinder("rail", material, ends[0], ends[1], radius, segments=6)
