"""What the components of a watercraft share: its hull, its houses, materials.

The unit is the length of the hull, whose middle is above the origin; the keel is at y = 0.
"""

from dataclasses import dataclass, replace

import numpy as np

from ffd_lightning.shapes.kit import Material, Rng, pick_material
from ffd_lightning.shapes.kit.vectors import Array, Pair, vec

_COLORS = {
    "white": (0.93, 0.93, 0.91), "cream": (0.9, 0.84, 0.7), "grey": (0.55, 0.58, 0.62),
    "dark": (0.22, 0.24, 0.27), "navy": (0.12, 0.18, 0.38), "black": (0.12, 0.12, 0.13),
    "red": (0.62, 0.16, 0.12), "green": (0.15, 0.38, 0.28), "orange": (0.85, 0.45, 0.12),
    "blue": (0.2, 0.42, 0.68), "teak": (0.66, 0.47, 0.28), "window": (0.1, 0.14, 0.2),
}  # fmt: skip


def tint(rng: Rng, *names: str) -> Material:
    """Draw one of the named colours, a little off its usual tone; "wood" is grained."""
    name = names[int(rng.integers(len(names)))]
    if name == "wood":
        return replace(pick_material(rng, "wood"), pattern="wood", scale=4.0)
    color = np.array(_COLORS[name])
    r, g, b = np.clip(color * rng.uniform(0.85, 1.1) + rng.uniform(-0.03, 0.03, 3), 0.03, 1.0)
    return Material((float(r), float(g), float(b)))


@dataclass(frozen=True)
class Hull:
    """The shape of a hull, its bow at -z; stations run from 0 at the bow to 1 at the stern."""

    beam: float  # greatest breadth
    depth: float  # from the keel to the deck's edge at its lowest
    transom: float = 0.9  # breadth at the stern, as a fraction of the beam
    fineness: float = 0.15  # below 1 for a blunt bow, above for a sharp one
    fullness: float = 2.5  # of the midship section: 1.3 is a V, 2 an ellipse, 5 nearly a box
    widest: float = 0.5  # station of the greatest breadth
    sheer: Pair = (0.0, 0.0)  # how much the deck's edge rises to the bow and to the stern
    rake: Pair = (0.0, 0.0)  # how far the deck overhangs the keel there
    lift: Pair = (0.0, 0.0)  # how much the keel rises there
    x: float = 0.0  # shifts the hull sideways, as in a catamaran

    def half(self, t: float) -> float:
        """Return half the breadth of the deck at a station."""
        if t < self.widest:
            share = np.sin(np.pi / 2 * max(t, 0.0) / self.widest) ** self.fineness
        else:
            aft = min((t - self.widest) / (1 - self.widest), 1.0)
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
        return t - 0.5 + (self.rake[1] * t**6 - self.rake[0] * (1 - t) ** 4) * rise

    def edge(self, t: float, side: float, inset: float = 0.0, up: float = 0.0) -> Array:
        """Return the point (3,) of the deck's edge on `side`, -1, 0 or 1, `inset` from it."""
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


@dataclass(frozen=True)
class Plan:
    """The sizes and materials of a watercraft."""

    hull: Hull  # its shape; of a catamaran, a box about both hulls
    storey: float  # height of a house's storey, by which railings, masts and seats are sized too
    paint: Material  # of the hull
    lower: Material  # of the hull below the waterline, and of keels
    deck: Material  # what the deck is of
    wall: Material  # of the houses
    glass: Material  # of the windows
    spar: Material  # of masts and railings
    house: Pair = (0.5, 0.5)  # where the lowest storey begins and ends, along z
    tiers: tuple[tuple[Pair, float], ...] = ()  # of each storey's roof: ends along z, and height

    @property
    def roof(self) -> float:
        """Height of the highest roof, or of the deck."""
        return max([self.hull.depth, *(roof for _, roof in self.tiers)])

    def level(self, z: float) -> float:
        """Return the height of the highest roof at `z`, or of the deck."""
        roofs = [roof for (front, back), roof in self.tiers if front <= z <= back]
        return max([self.hull.top(z + 0.5), *roofs])

    def rooms(self, least: float) -> list[Pair]:
        """Return where the deck before and behind the house begins and ends, if `least` long."""
        gap, (front, back) = 0.25 * self.storey, self.house
        spans = [(self.hull.z(0.15), front - gap), (back + gap, self.hull.z(0.96))]
        return [span for span in spans if span[1] - span[0] > least]
