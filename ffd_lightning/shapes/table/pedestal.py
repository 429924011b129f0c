"""Tables on columns."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.vectors import UP, vec
from ffd_lightning.shapes.table.tops import SIZES, draw_materials, rectangular_top, round_top


def _column(b: Builder, rng: Rng, material: Material, x: float, low: float, top: float) -> None:
    """Add a plain, conical or turned column at `x` from `low` up to `top`."""
    r, rise = rng.uniform(0.03, 0.07), top - low
    kind = draw(rng, ["plain", "cone", "turned"])
    if kind == "plain":
        rows = [(r, 0), (r, rise - 0.03), (2.2 * r, rise - 0.02), (2.2 * r, rise)]
    elif kind == "cone":
        waist = rng.uniform(0.3, 0.6)
        ends = rng.uniform(1.5, 3.0, 2)
        rows = [(ends[0] * r, 0), (r, waist * rise), (0.9 * r, 0.8 * rise), (ends[1] * r, rise)]
    else:
        levels = np.linspace(0.15, 0.9, 7)
        bulges = rng.uniform(0.7, 1.7, 7)
        rows = [(1.6 * r, 0), *((k * r, t * rise) for k, t in zip(bulges, levels, strict=True))]
        rows += [(1.8 * r, 0.97 * rise), (1.8 * r, rise)]
    b.lathe("leg", material, rows, (x, low, 0), segments=28)


def _foot(b: Builder, rng: Rng, material: Material, x: float, reach: float) -> float:
    """Add a disc, a plinth or three to five arched feet; return where the column starts."""
    kind = draw(rng, ["disc", "plinth", "feet"], [0.4, 0.15, 0.45])
    if kind == "disc":
        rise = rng.uniform(0.03, 0.08)
        rows = [(reach, 0), (reach, 0.015), (0.6 * reach, 0.5 * rise), (0.15 * reach, rise)]
        b.lathe("leg", material, rows, (x, 0, 0), segments=40)
        return 0.02
    if kind == "plinth":
        size = (1.4 * reach, 0.04, 1.4 * reach)
        b.rounded_box("leg", material, (x, 0.02, 0), size, 0.03)
        return 0.02
    rise, radius = rng.uniform(0.08, 0.22), rng.uniform(0.018, 0.03)
    for end in circle(count=int(rng.integers(3, 6)), radius=reach, height=radius, degrees=90.0):
        knee, ankle = 0.45 * end + 0.85 * rise * UP, 0.85 * end + 0.25 * rise * UP
        path = np.array([rise * UP, knee, ankle, end]) + vec(x, 0, 0)
        b.tube("leg", material, path, (1.5 * radius, 1.3 * radius, radius, radius), segments=10)
    return 0.7 * rise


def pedestal(rng: Rng) -> Builder:
    """Build a round, oval, square or long top on one column, or on two where it is long."""
    b = Builder()
    top, base = draw_materials(rng)
    height = rng.uniform(*SIZES[draw(rng, ["dining", "bar", "side", "coffee"])].height)
    half = rng.uniform(0.28, 0.65) if height < 0.9 else rng.uniform(0.25, 0.4)
    thickness = rng.uniform(0.02, 0.05)
    shape = draw(rng, ["round", "oval", "polygon", "square", "long"], [0.35, 0.15, 0.1, 0.2, 0.2])
    reach = half * rng.uniform(0.55, 0.75)
    columns = [0.0]
    if shape in ("square", "long"):
        width = 2 * half * (rng.uniform(1.5, 2.2) if shape == "long" else 1.0)
        rectangular_top(b, rng, top, (width, 2 * half, height), thickness, rounding=0.5)
        columns = [-0.27 * width, 0.27 * width] if shape == "long" else columns
    else:
        squash = rng.uniform(0.55, 0.75) if shape == "oval" else 1.0
        reach *= squash
        segments = int(rng.choice([6, 8])) if shape == "polygon" else 40
        round_top(b, top, half, height, thickness, squash, segments=segments)
    state = int(rng.integers(1 << 30))
    for x in columns:  # the same draws for each column, so that a pair matches
        same = np.random.default_rng(state)
        low = _foot(b, same, base, x, reach)
        _column(b, same, base, x, low, height - thickness + 0.002)
    return b
