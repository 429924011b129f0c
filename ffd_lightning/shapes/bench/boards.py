"""Sizes and seats of benches."""

from __future__ import annotations

from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.boards import slats
from ffd_lightning.shapes.kit.vectors import Triple, vec


def draw_bench_size(rng: Rng) -> Triple:
    """Draw (length, depth, seat height)."""
    return rng.uniform(0.9, 2.1), rng.uniform(0.34, 0.52), rng.uniform(0.38, 0.5)


def add_boards(
    b: Builder,
    rng: Rng,
    material: Material,
    size: Triple,
    count: int,
    z: float = 0.0,
    part: str = "seat",
) -> float:
    """Add a level deck of boards whose upper side is at the height of `size`; return its lower."""
    length, depth, height = size
    thickness = rng.uniform(0.022, 0.045)
    pitch = depth / count
    first = vec(0, height - thickness / 2, z - (depth - pitch) / 2)
    last = first * vec(1, 1, 0) + vec(0, 0, z + (depth - pitch) / 2)
    board = (length, thickness, pitch * (0.82 if count > 1 else 1.0))
    slats(b, part, material, first, last, board, count)
    return height - thickness
