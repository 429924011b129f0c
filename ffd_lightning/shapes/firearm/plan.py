"""What the components of a firearm share: sizes, materials, swept bodies. Metres, muzzle at -z."""

import colorsys
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, pick_material
from ffd_lightning.shapes.kit.sections import Section, superellipse
from ffd_lightning.shapes.kit.vectors import Array, Pair, vec

BLACK = Material((0.03, 0.03, 0.03))
IRON = Material((0.14, 0.14, 0.15))


@dataclass(frozen=True)
class Plan:
    """A firearm's sizes and materials; the barrel's axis is at height 0, the body's rear at 0."""

    kind: str  # one of `KINDS`
    length: float  # of the body; the barrel leaves it there
    high: float  # height of the body's top
    low: float  # height of the underside, where grip and trigger hang
    wide: float  # width of the body
    end: float  # how far forward the barrel reaches
    guard: float  # how far forward what the front hand holds reaches
    bore: float  # radius of the barrel
    hold: float  # where the grip's middle meets the underside, along the barrel
    palm: float  # depth of the grip
    well: float  # where the magazine enters
    steel: Material  # of barrel and receiver
    body: Material  # of the frame
    hand: Material  # of grips and stocks


_KINDS = {  # weight, odds of wood; length, rise, drop, width, reach, bore; hold and well in lengths
    "pistol": (2.4, 0.3, 0.19, 0.016, 0.033, 0.028, 0.012, 0.008, 0.0, 0.0),
    "revolver": (1.9, 0.75, 0.115, 0.014, 0.056, 0.023, 0.085, 0.011, 0.0, 0.0),
    "compact": (1.6, 0.3, 0.31, 0.032, 0.034, 0.048, 0.1, 0.012, 0.16, 0.8),
    "machine_pistol": (0.9, 0.1, 0.25, 0.028, 0.034, 0.043, 0.06, 0.011, 0.42, 0.55),
    "service": (2.2, 0.35, 0.31, 0.03, 0.052, 0.044, 0.28, 0.011, 0.16, 0.72),
    "bullpup": (0.7, 0.0, 0.42, 0.038, 0.048, 0.05, 0.13, 0.011, 0.65, 0.2),
    "bolt": (1.3, 0.75, 0.23, 0.018, 0.056, 0.05, 0.36, 0.012, -0.1, 0.65),
    "hunting": (1.3, 0.75, 0.17, 0.02, 0.044, 0.04, 0.38, 0.012, 0.0, 0.65),
    "support": (1.6, 0.4, 0.36, 0.043, 0.054, 0.06, 0.42, 0.015, 0.16, 0.66),
}


def draw_furniture(rng: Rng, wood: float = 0.0) -> Material:
    """Draw what is held in the hands: wood (with probability `wood`) or a dull polymer."""
    if rng.random() < wood:
        return pick_material(rng, "wood")
    hue, saturation, value = rng.uniform((0.08, 0, 0.1), (0.28, 0.45, 0.55))
    return Material(colorsys.hsv_to_rgb(hue, saturation, value), str(rng.choice(["", "speckle"])))


def draw_plan(rng: Rng, kind: str) -> Plan:
    """Draw the sizes and materials of a firearm of a kind."""
    _, wood, length, *means, hold, well = _KINDS[kind]
    length *= rng.uniform(0.75, 1.25) if kind != "revolver" else rng.uniform(0.9, 1.1)
    high, drop, wide, reach, bore = means * rng.uniform(0.75, 1.3, 5)
    end = length + reach * float(np.exp(rng.uniform(-0.75, 0.65)))
    palm = rng.uniform(0.03, 0.036) if kind == "revolver" else rng.uniform(0.042, 0.064)
    value = rng.uniform(0.5, 0.8) if rng.random() < 0.25 else rng.uniform(0.12, 0.32)
    steel = Material(colorsys.hsv_to_rgb(rng.uniform(0.55, 0.65), rng.uniform(0, 0.15), value))
    polymer = rng.random() < {"pistol": 0.4, "bullpup": 1.0, "service": 0.2}.get(kind, 0)
    guard = length + (end - length) * rng.uniform(0.35, 0.9)
    hold, well = hold * length + 0.55 * palm * (hold >= 0), well * rng.uniform(0.9, 1.1) * length
    body, hand = draw_furniture(rng) if polymer else steel, draw_furniture(rng, wood)
    sizes = length, high, -drop, wide, end, guard, bore, hold, palm, well
    return Plan(kind, *sizes, steel, body, hand)


KINDS = tuple(Component.of(k, row[0], draw_plan, kind=k) for k, row in _KINDS.items())


def at(forward: float, up: float, side: float = 0.0) -> Array:
    """Return the (3,) point that lies `forward` of the origin, towards -z."""
    return vec(side, up, -forward)


def bar(b: Builder, part: str, material: Material, rows: ArrayLike, boxiness: float = 0.7) -> None:
    """Add a body along the barrel through (forward, low, high, width) rows; boxiness 0 is round."""
    sections = []
    for f, low, high, wide in np.asarray(rows, float):
        sections.append(Section(-f, (low + high) / 2, wide, high - low).ring(boxiness, 16))
    b.loft(part, material, sections)


def block(
    b: Builder, part: str, skin: Material, ends: Pair, heights: Pair, wide: float, boxy: float = 0.8
) -> None:
    """Add a body of one section between the two places in `ends` and the two in `heights`."""
    bar(b, part, skin, [(f, *heights, wide) for f in ends], boxy)


def sweep(
    b: Builder, part: str, skin: Material, path: ArrayLike, depth: ArrayLike, width: ArrayLike
) -> None:
    """Sweep a section along a path (p, 2) of (forward, up) in the plane of symmetry.

    `depth` is measured in that plane, `width` across it; both may vary along the path.
    """
    points = np.asarray(path, float)
    tangents = np.gradient(points, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    depths, widths = (np.broadcast_to(np.asarray(x, float), len(points)) for x in (depth, width))
    ring, sections = superellipse(0.65), []
    for point, (df, du), d, w in zip(points, tangents, depths, widths, strict=True):
        flat = point + ring[:, 1:] * d / 2 * np.array([-du, df])
        sections.append(np.column_stack([ring[:, 0] * w / 2, flat[:, 1], -flat[:, 0]]))
    b.loft(part, skin, sections)
