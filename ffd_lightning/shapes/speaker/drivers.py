"""The finish of speakers, and what turns about an axis in their fronts: drivers, ports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import Array, lean, vec

FORWARD = lean(-90)
"""Turns what is upright so that it points to the front."""
BLACK = Material((0.06, 0.06, 0.07))
_CONES = (
    (0.13, 0.13, 0.14), (0.85, 0.84, 0.8), (0.8, 0.66, 0.2), (0.5, 0.52, 0.55), (0.3, 0.2, 0.15),
)  # fmt: skip


@dataclass(frozen=True)
class Finish:
    """The materials of a speaker: of its body, its rims, its cones and its dust caps."""

    body: Material
    rim: Material
    cone: Material
    cap: Material


def draw_finish(rng: Rng) -> Finish:
    """Draw a wooden, black, lacquered or plastic body and drivers to go with it."""
    kind = draw(rng, ["wood", "black", "paint", "plastic"], [0.4, 0.18, 0.2, 0.22])
    body = pick_material(rng, "rubber" if kind == "black" else kind)
    dark = 0.2 if kind == "black" else 0.45
    rim = BLACK if rng.random() < dark else pick_material(rng, "metal")
    cone = Material(_CONES[int(rng.choice(5, p=[0.45, 0.15, 0.12, 0.18, 0.1]))])
    return Finish(body, rim, cone, cone if rng.random() < 0.4 else pick_material(rng, "metal"))


def draw_cloth(rng: Rng) -> Material:
    """Draw the cloth or perforated metal of a grille."""
    value = rng.uniform(0.12, 0.6)
    color = (value, value * rng.uniform(0.85, 1), value * rng.uniform(0.7, 1))
    pattern = draw(rng, ["fabric", "speckle", ""], [0.5, 0.3, 0.2])
    return Material(color, pattern, 5.0, seed=int(rng.integers(1 << 30)))


def add_skin(
    b: Builder, part: str, material: Material, rows: ArrayLike, at: ArrayLike, turn: Array
) -> None:
    """Add a surface turned about the forward axis through `at`; rows are (radius, out) in units."""
    count = 24 if np.max(rows) > 0.05 else 16  # few faces where they are small
    a = 2 * np.pi * np.arange(count) / count
    circle = np.stack([np.cos(a), np.sin(a), 0 * a], 1)
    rings = [(r * circle - vec(0, 0, out)) @ turn.T + np.asarray(at) for r, out in np.asarray(rows)]
    b.loft(part, material, rings, caps=False)


def add_port(
    b: Builder, finish: Finish, center: ArrayLike, radius: float, depth: float, turn: Array
) -> None:
    """Add a flared bass port that goes `depth` into the body."""
    rows = [(1.0, 0.0), (1.0, 0.06), (0.9, 0.07), (0.75, -0.15), (0.7, -depth / radius)]
    add_skin(b, "port", finish.rim, radius * np.array(rows), center, turn)
    rear = [(0.71 * radius, -0.98 * depth), (0.05 * radius, -depth)]
    add_skin(b, "port", BLACK, rear, center, turn)


def add_driver(
    b: Builder, finish: Finish, kind: str, center: ArrayLike, radius: float, turn: Array
) -> None:
    """Add a "woofer" (rim, surround, sunk cone, cap) or a "tweeter" (plate, dome) facing -z."""
    r = radius
    rim = [(1.0, -0.01), (1.0, 0.05), (0.97, 0.08), (0.86, 0.08), (0.84, 0.03)]
    add_skin(b, "driver", finish.rim, r * np.array(rim), center, turn)
    matrix = turn @ FORWARD
    if kind == "tweeter":
        flare = [(0.85, 0.04), (0.5, -0.05), (0.42, -0.06), (0.36, -0.02)]
        add_skin(b, "driver", finish.rim, r * np.array(flare), center, turn)
        a = np.linspace(0, 1.5, 6)
        dome = np.stack([0.38 * np.cos(a), 0.3 * np.sin(a) - 0.04], 1)
        b.lathe("driver", finish.cap, r * dome, center, segments=20, turn=matrix)
        return
    roll = [(0.85, 0.03), (0.82, 0.09), (0.77, 0.11), (0.72, 0.08), (0.7, 0.0)]
    add_skin(b, "driver", BLACK, r * np.array(roll), center, turn)
    rows = r * np.array([(0.71, 0.01), (0.45, -0.17), (0.24, -0.34)])
    add_skin(b, "driver", finish.cone, rows, center, turn)
    a = np.linspace(0, 1.5, 5)
    cap = np.stack([0.27 * np.cos(a), 0.16 * np.sin(a) - 0.33], 1)
    b.lathe("driver", finish.cap, r * cap, center, segments=20, turn=matrix)
