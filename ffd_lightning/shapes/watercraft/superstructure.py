"""What stands on deck: houses, funnels, masts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair, Triple, vec


def _ring(width: float, z: Pair, y: float, chamfer: float) -> Array:
    """Return a level rectangle (8, 3) with cut corners: front first."""
    w, c = width / 2, min(chamfer, 0.4 * width, 0.4 * (z[1] - z[0]))
    flat = [(w - c, z[0]), (w, z[0] + c), (w, z[1] - c / 2), (w - c / 2, z[1])]
    flat += [(-x, at) for x, at in reversed(flat)]
    return np.array([(x, y, at) for x, at in flat])


@dataclass(frozen=True)
class House:
    """A deckhouse: `z` and `y` are where it begins and ends, front and bottom first.

    Attributes:
        width: at its foot.
        z: its foot's front and back.
        y: its bottom and top.
        slope: how far its front and its back lean in, per unit height.
        taper: how far each side leans in, per unit height.
        chamfer: of its upright edges.
    """

    width: float
    z: Pair
    y: Pair
    slope: Pair = (0.2, 0.0)
    taper: float = 0.06
    chamfer: float = 0.02

    def ring(self, level: float, grow: float = 0.0) -> Array:
        """Return the outline (8, 3) at `level` (0 bottom, 1 top), `grow` outside the wall."""
        up = level * (self.y[1] - self.y[0])
        z = (self.z[0] + self.slope[0] * up - grow, self.z[1] - self.slope[1] * up + grow)
        width = self.width - 2 * self.taper * up + 2 * grow
        return _ring(width, z, self.y[0] + up, self.chamfer)


def add_house(
    b: Builder,
    house: House,
    wall: Material,
    glass: Material,
    windows: str = "band",
    roof: float = 0.012,
    band: Pair = (0.45, 0.82),
) -> None:
    """Add a deckhouse; `windows` is "band" (all around), "panes" (along the sides) or "none".

    `roof` is how far the roof juts out, 0 for none.
    """
    b.loft("cabin", wall, [house.ring(0), house.ring(0.5), house.ring(1)])
    if windows == "band":
        b.loft("cabin", glass, [house.ring(level, 0.003) for level in band])
    elif windows == "panes":
        low, high = house.ring(band[0], 0.003), house.ring(band[1], 0.003)
        start, end = low[0, 2] + 0.02, low[3, 2] - 0.01
        tall = high[0, 1] - low[0, 1]
        count = min(max(1, int((end - start) / (1.3 * tall))), 20)
        pitch = (end - start) / count
        size = (high[1, 0] - high[6, 0], 0.9 * tall, 0.62 * pitch)
        for i in range(count):
            center = (0, (low[0, 1] + high[0, 1]) / 2, start + (i + 0.5) * pitch)
            b.box("cabin", glass, center, size)
        front = (0.8 * size[0], 0.9 * tall, 0.02)
        at = (low[0, 2] + high[0, 2]) / 2 + 0.008
        b.box("cabin", glass, (0, (low[0, 1] + high[0, 1]) / 2, at), front)
    elif windows != "none":
        raise ValueError(f"unknown windows {windows!r}")
    if roof > 0:
        top = house.ring(1, roof)
        b.loft("cabin", wall, [top, top + 0.012 * UP])


def funnel(b: Builder, base: Material, band: Material, foot: Triple, size: Array) -> None:
    """Add a raked oval funnel with a coloured band; `size` is its width, height and length."""
    width, height, length = size
    a = 2 * np.pi * np.arange(20) / 20
    oval = np.stack([width / 2 * np.cos(a), 0 * a, length / 2 * np.sin(a)], 1)

    def ring(level: float, scale: float = 1.0) -> Array:
        shift = vec(0, level * height, 0.18 * level * height)
        return oval * scale * (1 - 0.12 * level) + shift + np.array(foot)

    dark = Material((0.1, 0.1, 0.1))
    b.loft("funnel", base, [ring(0), ring(1)])
    b.loft("funnel", band, [ring(0.55, 1.03), ring(0.8, 1.03)])
    b.loft("funnel", dark, [ring(0.98, 0.8), ring(1.06, 0.8)])


def mast(b: Builder, material: Material, foot: Array, height: float, arms: int) -> None:
    """Add a signal mast: a pole with `arms` cross-bars and a radar bar."""
    radius = 0.012
    top = foot + height * UP
    b.cylinder("mast", material, foot, top, radius=radius, radius_end=0.5 * radius, segments=8)
    for i in range(arms):
        at = foot + height * (0.55 + 0.35 * i / max(arms, 1)) * UP
        reach = (0.16 - 0.03 * i) * height / 0.3
        ends = (at - vec(0.5 * reach, 0, 0), at + vec(0.5 * reach, 0, 0))
        b.cylinder("mast", material, *ends, 0.5 * radius, segments=6)
    radar = foot + vec(0, 0.45 * height, -0.025)
    b.box("mast", material, radar, (0.07, 0.016, 0.014))
    b.box("mast", material, radar + vec(0, -0.012, 0.012), (0.015, 0.012, 0.03))
