"""Public-address horns."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import UP, lean, vec
from ffd_lightning.shapes.speaker.drivers import FORWARD, add_skin


def horn(rng: Rng) -> Builder:
    """Build a round or oblong public-address horn in a bracket, on a wall plate, post or foot."""
    b = Builder()
    skin = pick_material(rng, draw(rng, ["plastic", "paint", "metal"]))
    metal = pick_material(rng, "metal")
    long, mouth = rng.uniform(0.25, 0.5), rng.uniform(0.13, 0.24)
    throat, flare = rng.uniform(0.03, 0.05), rng.uniform(1.3, 3.0)
    squash = rng.uniform(0.5, 0.8) if rng.random() < 0.35 else 1.0
    low = mouth * squash + rng.uniform(0.06, 0.12)
    at, turn = low * UP, np.diag([1.0, squash, 1.0])
    t = np.linspace(0, 1, 12)
    outer = np.stack([throat + (mouth - throat) * t**flare, long * t], 1)
    lip = [(1.05 * mouth, long), (1.05 * mouth, long + 0.015), (0.97 * mouth, long + 0.012)]
    inner = outer[::-1] - (0.008, -0.002)
    add_skin(b, "body", skin, np.concatenate([outer, lip, inner]), at, turn)
    plug = [(0.6, 0.15), (0.75, 0.3), (0.5, 0.42), (0.1, 0.48)]
    profile = np.array(plug) * (1.3 * throat, long)
    b.lathe("driver", metal, profile, at, segments=20, turn=turn @ FORWARD)
    b.cylinder("driver", metal, at - vec(0, 0, 0.25 * long), at + vec(0, 0, 0.05), 0.35 * throat)
    deep, wide = rng.uniform(0.08, 0.16), rng.uniform(1.3, 2.2) * throat
    rows = [(throat, -0.02), (wide, 0.0), (wide, 0.8 * deep), (0.8 * wide, deep)]
    rows += [(0.1 * wide, deep)]
    b.lathe("driver", pick_material(rng, "metal"), rows, at, segments=28, turn=lean(90))
    arm = wide + 0.02
    hook = [(-arm, low), (-arm, 0.02), (arm, 0.02), (arm, low)]
    path = bend([(x, y, 0.5 * deep) for x, y in hook], 0.03)
    b.tube("stand", metal, path, 0.01, segments=8)
    start = at + vec(-arm - 0.02, 0, 0.5 * deep)
    b.cylinder("stand", metal, start, at + vec(arm + 0.02, 0, 0.5 * deep), 0.014)
    _horn_mount(b, rng, metal, 0.5 * deep, wide)
    return b


def _horn_mount(b: Builder, rng: Rng, metal: Material, z: float, wide: float) -> None:
    """Add a foot below the bracket of a horn, or a tall post."""
    if rng.random() < 0.4:
        drop = rng.uniform(0.3, 0.9)
        b.cylinder("stand", metal, (0, -drop, z), (0, 0.02, z), 0.02)
        rows = [(0.13, 0), (0.13, 0.015), (0.03, 0.03)]
        b.lathe("stand", metal, rows, (0, -drop - 0.01, z), segments=28)
        return
    b.rounded_box("stand", metal, (0, 0.006, z), (2.2 * wide, 0.016, 0.16), radius=0.01, edge=0.004)
