"""Submarines."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.vectors import UP, Array, about_y, about_z, lean, vec
from ffd_lightning.shapes.watercraft.hull import tint


def submarine(rng: Rng) -> Builder:
    """Build a submarine: a spindle with a sail, planes, fins, a screw and sometimes a deck."""
    b = Builder()
    paint = tint(rng, "dark", "black", "grey", "navy", "orange", "green")
    dark = tint(rng, "dark", "black")
    length, radius = rng.uniform(1.3, 2.0), rng.uniform(0.085, 0.15)
    nose, tail = rng.uniform(0.08, 0.25), rng.uniform(0.25, 0.45)
    ahead = nose * (1 - np.cos(np.linspace(0, np.pi / 2, 9)))
    t = np.concatenate([ahead, np.linspace(1 - tail, 1, 11)])
    front = np.sqrt(np.maximum(1 - (1 - t / nose) ** 2, 0))
    rear = 1 - 0.88 * np.clip((t - 1 + tail) / tail, 0, 1) ** 1.8
    share = np.where(t < nose, front, rear)
    profile = np.column_stack([radius * np.maximum(share, 0.02), (0.5 - t) * length])
    forward = lean(-90)
    b.lathe("hull", paint, profile, turn=forward, segments=28)
    if rng.random() < 0.5:
        size = (1.1 * radius, 0.25 * radius, rng.uniform(0.5, 0.65) * length)
        center = (0, 0.95 * radius, -0.05 * length)
        b.rounded_box("deck", dark, center, size, radius=0.4 * radius, edge=0.02)
    z, tall = rng.uniform(-0.2, 0.02) * length, rng.uniform(0.1, 0.19)
    long = rng.uniform(0.16, 0.3)
    root = vec(0, 0.8 * radius, z)
    _fin(b, "cabin", paint, root, (0, tall + 0.2 * radius, 0), chord=long, thickness=0.06, tip=0.88)
    roof = vec(0, radius + tall - 0.01, z)
    for i in range(int(rng.integers(1, 5))):
        foot = roof + vec(0, 0, (-0.25 + 0.15 * i) * long)
        b.cylinder("mast", dark, foot, foot + rng.uniform(0.03, 0.14) * UP, 0.007, segments=8)
    level = rng.uniform(0.3, 0.7) * tall + radius if rng.random() < 0.6 else 0.0
    at = z if level else -0.3 * length
    for side in (-1, 1):
        reach = (side * (0.13 if level else 0.1 + radius), 0, 0.02)
        _fin(b, "keel", paint, vec(0, level, at), reach, chord=0.09, thickness=0.016, tip=0.7)
    turn = 45.0 if rng.random() < 0.25 else 0.0
    for k in range(4):
        way = about_z(turn + 90 * k) @ vec(rng.uniform(1.1, 1.6) * radius, 0, 0)
        root = vec(0, 0, 0.44 * length)
        _fin(b, "keel", paint, root, way + vec(0, 0, 0.02), chord=0.13, thickness=0.018, tip=0.65)
    metal = tint(rng, "orange", "grey")
    _screw(b, metal, z=0.5 * length, radius=0.75 * radius, blades=int(rng.integers(3, 8)))
    return b


def _fin(
    b: Builder,
    part: str,
    paint: Material,
    root: Array,
    reach: ArrayLike,
    chord: float,
    thickness: float,
    tip: float,
) -> None:
    """Add a streamlined fin from `root` along `reach`, its tip scaled by `tip`."""
    out = np.asarray(reach, float)
    side = np.cross((0, 0, 1.0), out)
    side /= np.linalg.norm(side)
    s = np.array([(-0.5, 0), (-0.42, 0.6), (-0.2, 1), (0.1, 0.8), (0.5, 0.08)])
    foil = np.concatenate([s, s[-1:0:-1] * (1, -1)])
    section = foil[:, :1] * vec(0, 0, chord) + foil[:, 1:] * side * thickness / 2
    scales = ((0.0, 1.0), (0.5, (1 + tip) / 2), (0.97, tip), (1.0, 0.85 * tip))
    b.loft(part, paint, [root + t * out + scale * section for t, scale in scales])


def _screw(b: Builder, metal: Material, z: float, radius: float, blades: int) -> None:
    """Add a hub and twisted blades about the z axis."""
    start, end = (0, 0, z - 0.02), (0, 0, z + 0.03)
    b.tube("engine", metal, [start, end], (0.25 * radius, 0.08 * radius), segments=10)
    for k in range(blades):
        spin = about_z(360 * k / blades)
        turn = spin @ about_y(145)
        center = spin @ vec(0, 0.55 * radius, 0) + vec(0, 0, z)
        radii = (0.22 * radius, 0.45 * radius, 0.04 * radius)
        b.ellipsoid("engine", metal, center, radii, segments=10, turn=turn)
