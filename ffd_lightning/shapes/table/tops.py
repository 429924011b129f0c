"""Sizes, materials, tops and drawer fronts of tables."""

from __future__ import annotations

from typing import NamedTuple

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import rails, slats
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.sections import eased_disc
from ffd_lightning.shapes.kit.vectors import Pair, Triple, lean, vec

_KNOB = ((0.006, -0.02), (0.006, 0.0), (0.016, 0.006), (0.013, 0.014), (0.004, 0.017))


class Limits(NamedTuple):
    """From what to what the sides of a table go, in metres."""

    width: Pair
    depth: Pair
    height: Pair


SIZES = {
    "dining": Limits(width=(1.2, 2.2), depth=(0.75, 1.05), height=(0.7, 0.78)),
    "square": Limits(width=(0.75, 1.1), depth=(0.75, 1.1), height=(0.68, 0.78)),
    "coffee": Limits(width=(0.8, 1.4), depth=(0.45, 0.8), height=(0.3, 0.48)),
    "side": Limits(width=(0.38, 0.6), depth=(0.38, 0.6), height=(0.45, 0.68)),
    "bar": Limits(width=(0.6, 1.5), depth=(0.5, 0.7), height=(0.92, 1.12)),
    "console": Limits(width=(0.9, 1.6), depth=(0.28, 0.42), height=(0.7, 0.9)),
}
"""What a table is for decides its proportions."""


def draw_size(rng: Rng, *uses: str) -> Triple:
    """Draw (width, depth, height) of a table for one of `uses`."""
    width, depth, height = (rng.uniform(*limits) for limits in SIZES[draw(rng, uses)])
    return width, depth, height


def draw_materials(rng: Rng) -> tuple[Material, Material]:
    """Draw the materials of the top and of what carries it; a third of tables have only one."""
    kinds = ["wood", "paint", "plastic", "metal", "glass"]
    kind = draw(rng, kinds, [0.55, 0.17, 0.1, 0.06, 0.12])
    top = pick_material(rng, kind)
    if kind != "glass" and rng.random() < 0.35:
        return top, top
    return top, pick_material(rng, draw(rng, ["wood", "metal", "paint"], [0.45, 0.35, 0.2]))


def rectangular_top(
    b: Builder, rng: Rng, material: Material, size: Triple, thickness: float, rounding: float = 0.15
) -> None:
    """Add a solid, planked or framed top whose upper side is at the height of `size`.

    `rounding` limits the radius of its corners, as a fraction of its depth.
    """
    width, depth, height = size
    center = vec(0, height - thickness / 2, 0)
    style = draw(rng, ["solid", "planks", "frame"], [0.7, 0.18, 0.12])
    if style == "planks" and material.alpha == 1:
        count = int(rng.integers(4, 8))
        gap = rng.uniform(0.004, 0.012)
        board = (width, thickness, depth / count - gap)
        offset = vec(0, 0, (depth - depth / count) / 2)
        slats(b, "top", material, center - offset, center + offset, board, count)
    elif style == "frame":
        border = 0.12 * depth
        rim = pick_material(rng, "wood")
        points = corners(width - border, depth - border, center[1])
        rails(b, "top", rim, points, width=border, height=thickness)
        for point in points:
            b.rounded_box("top", rim, point, (border, thickness, border), 0.1 * border)
        inner = (width - 1.9 * border, 0.6 * thickness, depth - 1.9 * border)
        b.rounded_box("top", material, center, inner, 0.1 * border)
    else:
        radius = rounding * rng.choice([0.05, 0.3, 1.0]) * depth
        edge = rng.uniform(0.1, 0.5) * thickness
        block = (width, thickness, depth)
        b.rounded_box("top", material, center, block, radius=radius, edge=edge, segments=4)


def round_top(
    b: Builder,
    material: Material,
    radius: float,
    height: float,
    thickness: float,
    squash: float = 1.0,
    part: str = "top",
    segments: int = 40,
) -> None:
    """Add a disc with an eased rim whose upper side is at `height`; `squash` scales its z."""
    ease = 0.35 * thickness
    low = height - thickness
    rows = eased_disc(radius, low, height, ease)
    b.lathe(part, material, rows, segments=segments, squash=squash)


def drawer_fronts(
    b: Builder,
    front: Material,
    handle: Material,
    center: Triple,
    size: Pair,
    rows: int,
    columns: int = 1,
    knobs: bool = False,
) -> None:
    """Add a grid of drawer fronts with handles on the -z side of `center`; size (width, height)."""
    width, height = size[0] / columns, size[1] / rows
    gap = 0.06 * min(width, height)
    for column in range(columns):
        for row in range(rows):
            x = center[0] + (column + 0.5 - columns / 2) * width
            y = center[1] + (row + 0.5 - rows / 2) * height
            face = (width - gap, height - gap, 0.024)
            b.rounded_box("drawer", front, (x, y, center[2] - 0.008), face, 0.008, segments=1)
            z = center[2] - 0.035
            if knobs:
                b.lathe("drawer", handle, _KNOB, (x, y, z), segments=10, turn=lean(-90))
            else:
                bar = (0.35 * width, 0.016, 0.034)
                b.rounded_box("drawer", handle, (x, y, z), bar, 0.006, segments=1)
