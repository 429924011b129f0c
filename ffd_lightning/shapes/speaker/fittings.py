"""What is put on and under speakers: grilles, handles, feet, knobs."""

from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.vectors import UP, Array, vec
from ffd_lightning.shapes.speaker.boxes import Cabinet
from ffd_lightning.shapes.speaker.drivers import FORWARD


def grille(b: Builder, cloth: Material, cabinet: Cabinet, low: float = 0, high: float = 1) -> None:
    """Cover the front with a framed cloth, from the share `low` of its height to `high`."""
    wide, tall = cabinet.face
    center = cabinet.world((0, ((low + high) / 2 - 0.5) * tall, -0.012))
    size = (0.96 * wide, 0.034, 0.97 * tall * (high - low))
    turn = cabinet.turn @ FORWARD
    b.rounded_box("grille", cloth, center, size, radius=0.03 * wide + 0.005, edge=0.01, turn=turn)


def handle(b: Builder, material: Material, ends: ArrayLike, rise: float, size: float) -> None:
    """Add a strap between two points (2, 3), `rise` above them."""
    start, end = np.asarray(ends, float)
    t = np.linspace(0, 1, 9)[:, None]
    path = start + t * (end - start) + rise * (1 - np.abs(2 * t - 1) ** 4) * UP
    b.tube("handle", material, path, size, segments=8)


def feet(b: Builder, material: Material, cabinet: Cabinet, cone: bool = False) -> None:
    """Add four feet, cylinders or spikes, between the ground and a cabinet that looks ahead."""
    width, depth = cabinet.back * cabinet.width, cabinet.depth
    r = 0.07 * min(width, depth)
    for x, z in product((-0.4, 0.4), (0.12, 0.88)):
        top = vec(x * width, cabinet.foot[1] + 0.004, z * depth)
        end, radius_end = top * vec(1, 0, 1), 0.3 * r if cone else r
        b.cylinder("stand", material, top, end, radius=r, radius_end=radius_end, segments=14)


def corners(b: Builder, material: Material, cabinet: Cabinet) -> None:
    """Cap the edges of an upright cabinet's front and back corners with metal."""
    size = 0.1 * min(cabinet.width, cabinet.height)
    ends, turn = ((0.3 * size, 1.0), (cabinet.depth - 0.3 * size, cabinet.back)), cabinet.turn
    for (z, share), x, y in product(ends, (-1, 1), (-1, 1)):
        near = np.array([x * share * cabinet.width / 2, y * cabinet.height / 2])
        center = cabinet.world((*(near - np.array([x, y]) * 0.42 * size), z))
        b.rounded_box("body", material, center, [size] * 3, 0.25 * size, turn=turn, segments=1)


def knobs(b: Builder, material: Material, ends: ArrayLike, radius: float, count: int) -> None:
    """Add `count` round knobs that point to the front, evenly between two points, (2, 3)."""
    first, last = np.asarray(ends, float)
    rows = radius * np.array([(1.0, -0.1), (1.0, 0.3), (0.8, 0.4), (0.7, 1.0), (0.6, 1.1)])
    for t in np.linspace(0, 1, count):
        b.lathe("panel", material, rows, (1 - t) * first + t * last, segments=12, turn=FORWARD)


def tripod(b: Builder, metal: Material, height: float, spread: float, middle: Array) -> None:
    """Add a pole on three splayed legs with braces."""
    b.cylinder("stand", metal, middle + 0.1 * UP, middle + (height - 0.005) * UP, 0.016)
    joint = middle + 0.55 * height * UP
    b.cylinder("stand", metal, joint - 0.03 * UP, joint + 0.03 * UP, 0.028)
    for foot in circle(count=3, radius=spread, height=0.012, degrees=90) + middle:
        b.cylinder("stand", metal, joint, foot, 0.011, segments=10)
        brace = middle + 0.12 * UP, 0.35 * joint + 0.65 * foot
        b.cylinder("stand", metal, *brace, 0.008, segments=8)
