"""Wheels of cars. Metres."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ffd_lightning.shapes.car.body import BLACK, CHROME
from ffd_lightning.shapes.car.stance import Stance
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import Triple, about_z, lean, vec

RUBBER = Material((0.09, 0.09, 0.09))


class Rim(NamedTuple):
    """What is within a tyre: "spokes" or a "disc", how many spokes, and the metal."""

    kind: str
    spokes: int
    metal: Material


def wheel(b: Builder, radius: float, thickness: float, hub: Triple, style: Rim) -> None:
    """Add a wheel at `hub`, turned outwards."""
    kind, count, metal = style
    out = 1.0 if hub[0] > 0 else -1.0
    turn, center = about_z(-90 * out), np.array(hub)
    rim, w = 0.66 * radius, thickness / 2
    profile = [(rim, -w), (0.93 * radius, -w), (radius, -0.6 * w), (radius, 0.6 * w)]
    profile += [(0.93 * radius, w), (rim, 0.9 * w), (0.97 * rim, 0.4 * w)]
    b.lathe("wheel", RUBBER, profile, center, segments=14, turn=turn)
    face = center + vec(0.45 * w * out, 0, 0)
    plate = BLACK if kind == "spokes" else metal
    bulge = np.array([(0.97, -0.05), (0.97, 0.06), (0.45, 0.25), (0.1, 0.3)]) * (rim, w)
    b.lathe("wheel", plate, bulge, face, segments=12, turn=turn)
    if kind == "spokes":
        for i in range(count):
            spin = lean(360 * i / count)
            arm = spin @ vec(0.3 * w * out, 0.5 * rim, 0)
            b.box("wheel", metal, face + arm, (0.2 * w, 1.0 * rim, 1.1 * rim / count), turn=spin)
    cap = [(0.22 * rim, 0), (0.2 * rim, 0.5 * w), (0.05 * rim, 0.6 * w)]
    b.lathe("wheel", metal, cap, face, segments=8, turn=turn)


def wheels(b: Builder, rng: Rng, stance: Stance, inset: float = 0.02) -> None:
    """Add two wheels to every axle, all alike, their outer faces `inset` inside the flanks."""
    thickness = stance.radius * rng.uniform(0.5, 0.75)
    kind = draw(rng, ["spokes", "disc"], [0.7, 0.3])
    metal = CHROME if rng.random() < 0.6 else pick_material(rng, "metal")
    style = Rim(kind, int(rng.integers(5, 9)), metal)
    for axle in stance.axles:
        x = stance.half_width(axle) - thickness / 2 - inset
        for side in (-x, x):
            wheel(b, stance.radius, thickness, (side, stance.radius, axle), style)
