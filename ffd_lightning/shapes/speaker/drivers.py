"""The finish of speakers, and what turns about an axis in their fronts: drivers, ports."""

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


def skin(b: Builder, part: str, paint: Material, rows: ArrayLike, at: Array, turn: Array) -> None:
    """Add a surface turned about the forward axis through `at`; rows are (radius, out) in units."""
    count = 24 if np.max(rows) > 0.05 else 16  # few faces where they are small
    a = 2 * np.pi * np.arange(count) / count
    circle = np.stack([np.cos(a), np.sin(a), 0 * a], 1)
    rings = [(r * circle - vec(0, 0, out)) @ turn.T + at for r, out in np.asarray(rows)]
    b.loft(part, paint, rings, caps=False)


def port(b: Builder, finish: Finish, at: Array, r: float, depth: float, turn: Array) -> None:
    """Add a flared bass port of radius `r` that goes `depth` into the body."""
    rows = [(1.0, 0.0), (1.0, 0.06), (0.9, 0.07), (0.75, -0.15), (0.7, -depth / r)]
    skin(b, "port", finish.rim, r * np.array(rows), at, turn)
    skin(b, "port", BLACK, [(0.71 * r, -0.98 * depth), (0.05 * r, -depth)], at, turn)


def driver(b: Builder, finish: Finish, kind: str, at: Array, r: float, turn: Array) -> None:
    """Add a "woofer" (rim, surround, sunk cone, cap) or a "tweeter" (plate, dome) of radius `r`."""
    rim = (finish.rim, [(1.0, -0.01), (1.0, 0.05), (0.97, 0.08), (0.86, 0.08), (0.84, 0.03)])
    if kind == "tweeter":
        layers = [rim, (finish.rim, [(0.85, 0.04), (0.5, -0.05), (0.42, -0.06), (0.36, -0.02)])]
        steps, wide, tall, sink = 6, 0.38, 0.3, 0.04
    else:
        roll = (BLACK, [(0.85, 0.03), (0.82, 0.09), (0.77, 0.11), (0.72, 0.08), (0.7, 0.0)])
        layers = [rim, roll, (finish.cone, [(0.71, 0.01), (0.45, -0.17), (0.24, -0.34)])]
        steps, wide, tall, sink = 5, 0.27, 0.16, 0.33
    for material, rows in layers:
        skin(b, "driver", material, r * np.array(rows), at, turn)
    a = np.linspace(0, 1.5, steps)
    cap = r * np.stack([wide * np.cos(a), tall * np.sin(a) - sink], 1)
    b.lathe("driver", finish.cap, cap, at, segments=20, turn=turn @ FORWARD)
