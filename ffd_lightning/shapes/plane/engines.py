"""Engines, propellers and wheels."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.vectors import UP, about_y, about_z, lean, vec
from ffd_lightning.shapes.plane.livery import BLACK, STEEL


def nacelle(
    b: Builder, material: Material, center: ArrayLike, radius: float, length: float
) -> None:
    """Add a turbofan that faces -z: cowl, dark inlet with its cone, nozzle."""
    c, turn = np.asarray(center, float), lean(90)
    profile = np.array([(0.82, 0.5), (0.9, 0.5), (1, 0.4), (1, 0.05), (0.78, -0.42), (0.68, -0.42)])
    b.lathe("engine", material, profile * [radius, -length], c, segments=18, turn=turn)
    face, back = c - vec(0, 0, 0.485 * length), c + vec(0, 0, 0.4 * length)
    inlet = [(0.84 * radius, 0), (0.84 * radius, 0.03 * length)]
    b.lathe("engine", BLACK, inlet, c - vec(0, 0, 0.505 * length), segments=18, turn=turn)
    cone = [(0.3 * radius, 0.0), (0.2 * radius, -0.05 * length), (0.02 * radius, -0.1 * length)]
    b.lathe("engine", STEEL, cone, face, segments=12, turn=turn)
    tail = np.array([(0.55, -0.02), (0.45, 0.12), (0.1, 0.22)]) * (radius, length)
    b.lathe("engine", STEEL, tail, back, segments=14, turn=turn)


def propeller(
    b: Builder, rng: Rng, hub: ArrayLike, radius: float, blades: int, spinner: Material
) -> None:
    """Add a propeller in the plane z = const at `hub`, its spinner pointing to -z."""
    c, start = np.asarray(hub, float), rng.uniform(0, 360)
    wide, r = 0.1 * radius + 0.004, 0.13 * radius
    for i in range(blades):
        spin = about_z(start + 360 * i / blades)
        rings = []
        for t, w, twist in ((0.05, 0.5, 50), (0.35, 1.0, 35), (0.8, 0.9, 20), (1.0, 0.45, 15)):
            half, thin = vec(w * wide, 0, 0), vec(0, 0, 0.012 * radius)
            flat = np.array([-half, -thin, half, thin])
            rings.append((flat @ about_y(twist).T + t * radius * UP) @ spin.T + c)
        b.loft("engine", BLACK, rings)
    cone = [(r, -0.6 * r), (r, 0.2 * r), (0.75 * r, 1.0 * r), (0.1 * r, 1.7 * r)]
    b.lathe("engine", spinner, cone, c, segments=14, turn=lean(-90))


def undercarriage(
    b: Builder, material: Material, top: ArrayLike, drop: float, radius: float, wheels: int = 1
) -> None:
    """Add a strut that ends `drop` below `top`, and one wheel or two beside each other."""
    start = np.asarray(top, float)
    axle = start - (drop - radius) * UP
    b.cylinder("gear", material, start, axle, 0.28 * radius, segments=8)
    for side in [0.0] if wheels == 1 else [-0.55, 0.55]:
        center, half = axle + vec(side * radius, 0, 0), vec(0.3 * radius, 0, 0)
        b.cylinder("gear", BLACK, center - half, center + half, radius, segments=14)
        left = center - 1.1 * half
        b.cylinder("gear", STEEL, left, center + 1.1 * half, 0.45 * radius, segments=8)
