"""Chairs: dining, swivel, cantilever, armchair, stool, shell, slatted lounge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.parts.furniture import (
    UP,
    LegStyle,
    add_leg,
    add_legs,
    beam,
    bend,
    corners,
    draw,
    draw_leg_style,
    lean,
    pad,
    rails,
    slats,
    stretchers,
)
from ffd_lightning.shapes.parts.shell_chair import shell
from ffd_lightning.shapes.parts.stool import stool
from ffd_lightning.shapes.parts.swivel_chair import swivel
from ffd_lightning.shapes.parts.upholstery import (
    add_arm,
    add_base,
    add_feet,
    add_loose_back,
    add_seat_cushions,
    add_tight_back,
    add_tufts,
    back_point,
    draw_cover,
    draw_seating,
)
from ffd_lightning.shapes.shapes import (
    Array,
    Builder,
    Family,
    Material,
    pick_material,
)

PARTS = ("seat", "back", "arm", "leg")


def _back(
    b: Builder,
    rng: np.random.Generator,
    frame: Material,
    cover: Material,
    origin: Array,
    width: float,
    rise: float,
    degrees: float,
) -> None:
    """Add two posts, tipped back from `origin` (the middle of the seat's rear), and what they hold.

    That is a ladder of slats, a cushion, or a crest above a panel, a cross or spindles.
    """
    turn, post = lean(degrees), rng.uniform(0.024, 0.04)
    half, low = (width - post) / 2, rise * rng.uniform(0.1, 0.45)
    for x in (-half, half):
        foot, head = (turn @ np.array([x, up, 0.0]) + origin for up in (-0.03, rise))
        beam(b, "back", frame, foot, head, post, post)
    kinds = ["ladder", "cushion", "panel", "cross", "spindles"]
    kind = draw(rng, kinds, [0.3, 0.15, 0.2, 0.1, 0.25])
    if kind == "ladder":
        count = int(rng.integers(2, 7))
        bar = min(rng.uniform(0.03, 0.09), 0.8 * (rise - low) / count)
        first = turn @ np.array([0, low + bar / 2, 0]) + origin
        last = turn @ np.array([0, rise - bar / 2, 0]) + origin
        slats(b, "back", frame, first, last, (2 * half, bar, 0.018), count, turn)
    elif kind == "cushion":
        size = (width + 0.03, rise - low + 0.04, rng.uniform(0.05, 0.09))
        center = turn @ np.array([0, (rise + low) / 2, 0]) + origin
        pad(b, "back", cover, center, size, rng.uniform(0.03, 0.12), degrees)
    else:
        rail = rng.uniform(0.04, 0.1)
        crest = (width + rng.uniform(0, 0.05), rail, 1.1 * post)
        top = turn @ np.array([0, rise, 0]) + origin
        pad(b, "back", frame, top, crest, rng.uniform(0.1, 0.5) * rail, degrees)
        _back_filling(b, rng, frame, kind, origin, (half, low, rise), degrees)


def _back_filling(
    b: Builder,
    rng: np.random.Generator,
    frame: Material,
    kind: str,
    origin: Array,
    extent: tuple[float, float, float],
    degrees: float,
) -> None:
    """Fill a back between its posts, `extent` (half width, lower, upper end), below its crest."""
    half, low, rise = extent
    turn = lean(degrees)

    def at(x: float, up: float) -> Array:
        return turn @ np.array([x, up, 0.0]) + origin

    if kind == "panel":
        size = (2 * half, rise - low, 0.018)
        pad(b, "back", frame, at(0, (rise + low) / 2), size, 0.02, degrees)
        return
    low = 0.0 if kind == "spindles" and rng.random() < 0.5 else low
    if low:
        beam(b, "back", frame, at(-half, low), at(half, low), 0.02, 0.03)
    if kind == "cross":
        beam(b, "back", frame, at(-half, low), at(half, rise), 0.02, 0.03)
        beam(b, "back", frame, at(half, low), at(-half, rise), 0.016, 0.03)
        return
    for x in np.linspace(-half, half, int(rng.integers(5, 11)))[1:-1]:
        b.cylinder("back", frame, at(x, low - 0.01), at(x, rise), 0.008, 0.007, 8)


def _side_arms(
    b: Builder,
    rng: np.random.Generator,
    material: Material,
    x: float,
    seat: float,
    rise: float,
    reach: tuple[float, float],
) -> None:
    """Add armrests at +-`x`, `rise` above the seat, from `reach` front z to back z, on posts."""
    front, back = reach
    width = rng.uniform(0.035, 0.07)
    setback = rng.uniform(0.02, 0.08)
    for side in (-x, x):
        level = seat + rise
        rest = (width, 0.028, back - front)
        b.rounded_box("arm", material, (side, level, (front + back) / 2), rest, 0.4 * width)
        foot = (side * 0.97, seat - 0.04, front + 2 * setback)
        beam(b, "arm", material, foot, (side, level, front + setback), 0.03, 0.03)


def _dining(rng: np.random.Generator) -> Builder:
    """Build a chair on four legs with a framed back, sometimes with arms."""
    b = Builder()
    width, depth = rng.uniform(0.38, 0.54), rng.uniform(0.38, 0.5)
    height, rise = rng.uniform(0.4, 0.5), rng.uniform(0.3, 0.68)
    frame = pick_material(rng, draw(rng, ["wood", "paint", "metal"], [0.65, 0.2, 0.15]))
    cover = draw_cover(rng)
    style = draw_leg_style(rng, (0.03, 0.05), hairpin=0.0)
    thickness = rng.uniform(0.02, 0.04)
    flat = (width, thickness, depth)
    middle = (0, height - thickness / 2, 0)
    b.rounded_box("seat", frame, middle, flat, rng.uniform(0.01, 0.1), 0.4 * thickness)
    if rng.random() < 0.55:
        soft = rng.uniform(0.03, 0.07)
        cushion = (0.95 * width, soft, 0.94 * depth)
        b.rounded_box("seat", cover, (0, height + 0.3 * soft, -0.01), cushion, 0.06)
    inset = 0.6 * style.thickness + 0.005
    tops = corners(width - 2 * inset, depth - 2 * inset, height - thickness + 0.003)
    splay = rng.uniform(0.0, 0.05)
    feet = corners(width - 2 * inset + splay, depth - 2 * inset + 1.5 * splay, 0.0)
    add_legs(b, "leg", frame, style, tops, feet)
    if rng.random() < 0.6:
        rails(b, "leg", frame, feet + 0.93 * (tops - feet), 0.018, 0.05)
    kind = draw(rng, ["none", "box", "h"], [0.5, 0.25, 0.25])
    if kind != "none":
        points = feet + rng.uniform(0.2, 0.45) * (tops - feet)
        stretchers(b, "leg", frame, points, 0.018, kind)
    degrees = rng.uniform(2, 14)
    rear = np.array([0, height - 0.01, depth / 2 - inset])
    _back(b, rng, frame, cover, rear, width - inset, rise, degrees)
    if rng.random() < 0.25:
        top = rng.uniform(0.18, 0.25)
        reach = (-0.4 * depth, depth / 2 - inset + 0.02 + np.tan(np.radians(degrees)) * top)
        _side_arms(b, rng, frame, width / 2 - 0.01, height, top, reach)
    return b


def _cantilever(rng: np.random.Generator) -> Builder:
    """Build a chair hung from one bent tube without rear legs."""
    b = Builder()
    metal, cover = pick_material(rng, "metal"), draw_cover(rng)
    half, seat = rng.uniform(0.2, 0.26), rng.uniform(0.42, 0.48)
    front, rear = -rng.uniform(0.2, 0.27), rng.uniform(0.18, 0.24)
    rise, degrees = rng.uniform(0.32, 0.55), rng.uniform(6, 20)
    r, slope = rng.uniform(0.011, 0.018), rng.uniform(0.0, 0.05)
    tip = lean(degrees) @ np.array([0, rise, 0])
    left = [(-half, seat + tip[1] - slope, rear + tip[2]), (-half, seat - slope, rear)]
    left += [(-half, seat, front), (-half, r, front + rng.uniform(-0.03, 0.06))]
    left += [(-half, r, rear + rng.uniform(0.0, 0.08))]
    right = [(-x, y, z) for x, y, z in left[::-1]]
    b.tube("leg", metal, bend(left + right, rng.uniform(0.05, 0.12)), r, 10)
    thickness = rng.uniform(0.015, 0.07)
    pitch = np.degrees(np.arctan2(slope, rear - front))
    size = (2 * half - 0.5 * r, thickness, 0.97 * (rear - front))
    middle = (0, seat - slope / 2 + 0.3 * thickness, (front + rear) / 2)
    b.rounded_box("seat", cover, middle, size, 0.05, turn=lean(pitch))
    low = rng.uniform(0.2, 0.55) * rise
    center = lean(degrees) @ np.array([0, (low + rise) / 2, -0.2 * thickness])
    panel = (2 * half + 2 * r, rise - low + 0.03, max(0.03, thickness))
    pad(b, "back", cover, center + (seat - slope) * UP + [0, 0, rear], panel, 0.04, degrees)
    if rng.random() < 0.5:
        level, wood = rng.uniform(0.17, 0.24), pick_material(rng, "wood")
        z = rear + np.tan(np.radians(degrees)) * (level + slope)
        for x in (-half - r, half + r):
            path = [(x, seat + level, z), (x, seat + level, front + 0.06), (x, seat, front + 0.08)]
            b.tube("arm", metal, bend(path, 0.06), r, 8)
            rest = (0.035, 0.022, 0.6 * (z - front))
            b.rounded_box("arm", wood, (x, seat + level + r, (z + front) / 2), rest, 0.012)
    return b


def _armchair(rng: np.random.Generator) -> Builder:
    """Build a padded chair with any arms, sometimes with wings beside a high back."""
    b = Builder()
    s = draw_seating(rng, 1)
    winged = s.arms != "open" and rng.random() < 0.35
    back = rng.uniform(0.55, 0.72) if winged else s.back
    s = replace(s, width=rng.uniform(0.48, 0.64), depth=rng.uniform(0.68, 0.86), back=back)
    add_base(b, s)
    add_seat_cushions(b, s, front=0.02)
    if rng.random() < 0.6 or winged:
        add_tight_back(b, s, s.width + 0.6 * s.arm)
        if rng.random() < 0.4:
            add_tufts(b, s, s.width, int(rng.integers(3, 5)), 4)
    else:
        add_loose_back(b, s, rng.uniform(0.0, 0.12))
    for side in (-1, 1):
        add_arm(b, s, side)
        if winged:
            low, high = s.arm_rise - 0.05, 0.95 * s.back
            x, out = side * (s.width / 2 + 0.3 * s.arm), -rng.uniform(0.1, 0.14)
            turn = lean(s.rake)
            wing = (0.06, high - low, s.thick - 2 * out)
            b.rounded_box(
                "back", s.cover, back_point(s, x, (low + high) / 2, out), wing, 0.03, turn=turn
            )
    add_feet(b, rng, s)
    return b


def _slatted(rng: np.random.Generator) -> Builder:
    """Build a low garden chair of boards with broad arms and a raked, fanned back."""
    b = Builder()
    wood = pick_material(rng, draw(rng, ["wood", "paint"], [0.6, 0.4]))
    half, front = rng.uniform(0.24, 0.32), rng.uniform(0.32, 0.4)
    drop, depth = rng.uniform(0.06, 0.16), rng.uniform(0.45, 0.56)
    rise, degrees, board = rng.uniform(0.5, 0.8), rng.uniform(15, 32), 0.02
    pitch = np.degrees(np.arctan2(drop, depth))
    turn, start = lean(pitch), np.array([0, front, -depth / 2])
    end = start + turn @ np.array([0, 0, depth])
    count = int(rng.integers(5, 9))
    gap = depth / count
    first, last = start + 0.4 * gap * turn[:, 2], end - 0.4 * gap * turn[:, 2]
    slats(b, "seat", wood, first, last, (2 * half, board, 0.8 * gap), count, turn)
    tilt, planks = lean(degrees), int(rng.integers(4, 8))
    fan, arch = rng.uniform(0.0, 0.25), rng.uniform(0.0, 0.18)
    for i in range(planks):
        u = (i + 0.5) / planks * 2 - 1
        tall = rise * (1 - arch * u * u)
        low = end + tilt @ np.array([u * half * 0.95, -0.03, 0])
        high = end + tilt @ np.array([u * half * (0.95 + fan), tall, 0])
        beam(b, "back", wood, low, high, board, 1.6 * half / planks)
    arm = front + rng.uniform(0.16, 0.24)
    level = (arm - end[1]) / np.cos(np.radians(degrees))
    for up in (0.75 * rise, level):
        center = end + tilt @ np.array([0, up, 0.018])
        b.rounded_box("back", wood, center, (2 * half + 0.1, 0.06, board), 0.005, turn=tilt)
    rear = float((end + tilt @ np.array([0, level, 0]))[2])
    post = LegStyle("square", 0.06, ((0.0, 1.0), (0.5, 1.0), (1.0, 1.0)))
    rest = (rng.uniform(0.08, 0.14), 0.024, rear + 0.1 + depth / 2)
    for side in (-1, 1):
        x = side * (half + 0.04)
        b.rounded_box("arm", wood, (x, arm, (rear + 0.02 - depth / 2) / 2), rest, 0.03)
        for z in (-depth / 2 + 0.02, rear):
            add_leg(b, "leg", wood, post, (x, arm - 0.005, z), (x, 0, z), (0.5, 1.3))
        inner = side * (half + 0.01)
        rail = (inner, front - 0.06, -depth / 2), (inner, end[1] - 0.06, rear + 0.02)
        beam(b, "seat", wood, *rail, 0.025, 0.09)
    return b


FAMILIES: dict[str, Family] = {
    "dining": _dining,
    "swivel": swivel,
    "cantilever": _cantilever,
    "armchair": _armchair,
    "stool": stool,
    "shell": shell,
    "slatted": _slatted,
}
