"""Slatted benches as in parks."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.bench.boards import add_boards, draw_bench_size
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, slats
from ffd_lightning.shapes.kit.legs import add_leg, square_post
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import Array, Pair, lean, vec


def _wooden_side(
    b: Builder, material: Material, x: float, seat: Pair, back: Array, arm: float
) -> None:
    """Add a side frame of square posts: seat (depth, height), back's top, arm's height or 0."""
    depth, height = seat
    front, rear = -0.45 * depth, 0.45 * depth
    post = square_post(0.055)
    add_leg(b, "leg", material, post, (x, arm or height, front), (x, 0, front))
    add_leg(b, "leg", material, post, (x, height, rear), (x, 0, rear + 0.03))
    low = height - 0.04
    beam(b, "leg", material, (x, low, front), (x, low, rear), width=0.035, height=0.06)
    beam(b, "back", material, (x, height - 0.03, rear), (x, *back[1:]), width=0.045, height=0.05)
    if arm:
        t = (arm - height) / (back[1] - height)
        z = rear + t * (back[2] - rear)
        rest = (0.07, 0.03, z - front + 0.08)
        b.rounded_box("arm", material, (x, arm, (front + z) / 2 - 0.02), rest, 0.02)


def _iron_side(
    b: Builder, material: Material, x: float, seat: Pair, back: Array, arm: float
) -> None:
    """Add a side frame of bent iron with the same arguments as `_wooden_side`."""
    depth, height = seat
    front, rear, low = -0.42 * depth, 0.45 * depth, height - 0.035
    r = 0.017
    seat_path = [(x, 0, front - 0.05), (x, low, front), (x, low, rear)]
    b.tube("leg", material, bend(seat_path, 0.12), r, segments=8)
    back_path = [(x, 0, rear + 0.1), (x, 0.5 * height, rear - 0.05), (x, height, rear + 0.005)]
    b.tube("leg", material, bend([*back_path, (x, *back[1:])], 0.2), r, segments=8)
    start = (x, 0.3 * height, front - 0.01)
    beam(b, "leg", material, start, (x, 0.3 * height, rear), width=0.016, height=0.03)
    if arm:
        t = (arm - height) / (back[1] - height)
        z = rear + t * (back[2] - rear)
        path = [(x, low, front + 0.05), (x, arm, front - 0.06), (x, arm + 0.02, z)]
        b.tube("arm", material, bend(path, 0.12), r, segments=8)


def park(rng: Rng) -> Builder:
    """Build a slatted seat and back on two or three wooden or iron side frames."""
    b = Builder()
    length, depth, height = draw_bench_size(rng)
    wood = pick_material(rng, draw(rng, ["wood", "paint"], [0.75, 0.25]))
    iron = rng.random() < 0.5
    frame = pick_material(rng, "metal") if iron else wood
    add_boards(b, rng, wood, (length, depth, height), int(rng.integers(2, 8)))
    rise, degrees, count = rng.uniform(0.28, 0.5), rng.uniform(6, 20), int(rng.integers(1, 6))
    turn, foot = lean(degrees), vec(0, height, 0.45 * depth)
    low = rise * rng.uniform(0.15, 0.45)
    pitch = (rise - low) / count
    if not iron and rng.random() < 0.3:  # upright laths between two rails
        for up in (low, rise):
            middle, half = foot + turn @ vec(0, up, -0.03), vec(length / 2, 0, 0)
            beam(b, "back", wood, middle - half, middle + half, width=0.03, height=0.06)
        for x in np.linspace(-0.47, 0.47, round(length / rng.uniform(0.08, 0.14))) * length:
            at = foot + turn @ vec(x, (low + rise) / 2, -0.03)
            b.rounded_box("back", wood, at, (0.04, rise - low, 0.015), 0.004, turn=turn, segments=1)
    else:
        first = foot + turn @ vec(0, low + pitch / 2, -0.03)
        last = foot + turn @ vec(0, rise - pitch / 2, -0.03)
        slats(b, "back", wood, first, last, (length, 0.8 * pitch, 0.022), count, turn)
    arm = height + rng.uniform(0.17, 0.24) if rng.random() < 0.7 and rise > 0.27 else 0.0
    side, top = (_iron_side if iron else _wooden_side), foot + turn @ vec(0, rise, 0)
    inset = length / 2 - rng.uniform(0.03, 0.2)
    for x in (-inset, inset):
        side(b, frame, x, (depth, height), top, arm)
    if length > 1.6:
        side(b, frame, 0.0, (depth, height), top, 0.0)
    return b
