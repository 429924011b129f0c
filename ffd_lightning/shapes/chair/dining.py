"""Chairs on four legs with a framed back."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, pad, rails, slats
from ffd_lightning.shapes.kit.legs import add_legs, draw_leg_style, stretchers
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.upholstery import draw_cover
from ffd_lightning.shapes.kit.vectors import Array, Pair, lean, vec


def _back(
    b: Builder,
    rng: Rng,
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
        foot, head = (turn @ vec(x, up, 0.0) + origin for up in (-0.03, rise))
        beam(b, "back", frame, foot, head, width=post, height=post)
    kinds = ["ladder", "cushion", "panel", "cross", "spindles"]
    kind = draw(rng, kinds, [0.3, 0.15, 0.2, 0.1, 0.25])
    if kind == "ladder":
        count = int(rng.integers(2, 7))
        bar = min(rng.uniform(0.03, 0.09), 0.8 * (rise - low) / count)
        first = turn @ vec(0, low + bar / 2, 0) + origin
        last = turn @ vec(0, rise - bar / 2, 0) + origin
        slats(b, "back", frame, first, last, (2 * half, bar, 0.018), count, turn)
    elif kind == "cushion":
        size = (width + 0.03, rise - low + 0.04, rng.uniform(0.05, 0.09))
        center = turn @ vec(0, (rise + low) / 2, 0) + origin
        pad(b, "back", cover, center, size, rng.uniform(0.03, 0.12), degrees)
    else:
        rail = rng.uniform(0.04, 0.1)
        crest = (width + rng.uniform(0, 0.05), rail, 1.1 * post)
        top = turn @ vec(0, rise, 0) + origin
        pad(b, "back", frame, top, crest, rng.uniform(0.1, 0.5) * rail, degrees)
        _back_filling(b, rng, frame, kind, origin, half=half, low=low, rise=rise, degrees=degrees)


def _back_filling(
    b: Builder,
    rng: Rng,
    frame: Material,
    kind: str,
    origin: Array,
    *,
    half: float,
    low: float,
    rise: float,
    degrees: float,
) -> None:
    """Fill a back between its posts, at +-`half`, from `low` up to its crest at `rise`."""
    turn = lean(degrees)

    def at(x: float, up: float) -> Array:
        return turn @ vec(x, up, 0.0) + origin

    if kind == "panel":
        size = (2 * half, rise - low, 0.018)
        pad(b, "back", frame, at(0, (rise + low) / 2), size, 0.02, degrees)
        return
    low = 0.0 if kind == "spindles" and rng.random() < 0.5 else low
    if low:
        beam(b, "back", frame, at(-half, low), at(half, low), width=0.02, height=0.03)
    if kind == "cross":
        beam(b, "back", frame, at(-half, low), at(half, rise), width=0.02, height=0.03)
        beam(b, "back", frame, at(half, low), at(-half, rise), width=0.016, height=0.03)
        return
    for x in np.linspace(-half, half, int(rng.integers(5, 11)))[1:-1]:
        start = at(x, low - 0.01)
        b.cylinder("back", frame, start, at(x, rise), radius=0.008, radius_end=0.007, segments=8)


def _side_arms(
    b: Builder, rng: Rng, material: Material, x: float, seat: float, rise: float, reach: Pair
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
        beam(b, "arm", material, foot, (side, level, front + setback), width=0.03, height=0.03)


def dining(rng: Rng) -> Builder:
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
    b.rounded_box("seat", frame, middle, flat, radius=rng.uniform(0.01, 0.1), edge=0.4 * thickness)
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
        rails(b, "leg", frame, feet + 0.93 * (tops - feet), width=0.018, height=0.05)
    kind = draw(rng, ["none", "box", "h"], [0.5, 0.25, 0.25])
    if kind != "none":
        points = feet + rng.uniform(0.2, 0.45) * (tops - feet)
        stretchers(b, "leg", frame, points, 0.018, kind)
    degrees = rng.uniform(2, 14)
    rear = vec(0, height - 0.01, depth / 2 - inset)
    _back(b, rng, frame, cover, rear, width - inset, rise, degrees)
    if rng.random() < 0.25:
        top = rng.uniform(0.18, 0.25)
        reach = (-0.4 * depth, depth / 2 - inset + 0.02 + np.tan(np.radians(degrees)) * top)
        _side_arms(b, rng, frame, width / 2 - 0.01, height, top, reach)
    return b
