"""Chairs: dining, swivel, cantilever, armchair, stool, shell, slatted lounge."""

from __future__ import annotations

import numpy as np

from ffd_lightning.data.sources.procedural.furniture import (
    UP,
    LegStyle,
    add_leg,
    add_legs,
    beam,
    bend,
    circle,
    corners,
    draw,
    draw_leg_style,
    lean,
    pad,
    rails,
    sheet,
    slats,
    stretchers,
)
from ffd_lightning.data.sources.procedural.shapes import (
    Array,
    Builder,
    Family,
    Material,
    pick_material,
)

PARTS = ("seat", "back", "arm", "leg")


def _upholstery(rng: np.random.Generator) -> Material:
    """Draw what covers a seat."""
    return pick_material(rng, draw(rng, ["fabric", "leather", "plastic"], [0.55, 0.3, 0.15]))


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

    That is a ladder of slats, a row of spindles, a panel, a cushion, or a cross.
    """
    turn, post = lean(degrees), rng.uniform(0.024, 0.04)

    def at(x: float, up: float) -> Array:
        return turn @ np.array([x, up, 0.0]) + origin

    half, low = (width - post) / 2, rise * rng.uniform(0.1, 0.45)
    for x in (-half, half):
        beam(b, "back", frame, at(x, -0.03), at(x, rise), post, post)
    kind = draw(
        rng, ["ladder", "spindles", "panel", "cushion", "cross"], [0.3, 0.25, 0.2, 0.15, 0.1]
    )
    rail = rng.uniform(0.04, 0.1)
    if kind == "ladder":
        count = int(rng.integers(2, 7))
        bar = min(rng.uniform(0.03, 0.09), 0.8 * (rise - low) / count)
        first, last = at(0, low + bar / 2), at(0, rise - bar / 2)
        slats(b, "back", frame, first, last, (2 * half, bar, 0.018), count, turn)
        return
    if kind == "cushion":
        size = (width + 0.03, rise - low + 0.04, rng.uniform(0.05, 0.09))
        pad(b, "back", cover, at(0, (rise + low) / 2), size, rng.uniform(0.03, 0.12), degrees)
        return
    crest = (width + rng.uniform(0, 0.05), rail, 1.1 * post)
    pad(b, "back", frame, at(0, rise), crest, rng.uniform(0.1, 0.5) * rail, degrees)
    if kind == "panel":
        size = (2 * half, rise - low, 0.018)
        pad(b, "back", frame, at(0, (rise + low) / 2), size, 0.02, degrees)
    elif kind == "cross":
        beam(b, "back", frame, at(-half, low), at(half, rise), 0.02, 0.03)
        beam(b, "back", frame, at(half, low), at(-half, rise), 0.016, 0.03)
        beam(b, "back", frame, at(-half, low), at(half, low), 0.018, 0.03)
    else:
        low = 0.0 if rng.random() < 0.5 else low
        if low:
            beam(b, "back", frame, at(-half, low), at(half, low), 0.02, 0.03)
        count = int(rng.integers(3, 9))
        for x in np.linspace(-half, half, count + 2)[1:-1]:
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
    cover = _upholstery(rng)
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


def _star_base(b: Builder, rng: np.random.Generator, material: Material, height: float) -> None:
    """Add four or five feet on casters below a gas column that ends at `height`."""
    count, reach = int(rng.integers(4, 6)), rng.uniform(0.25, 0.34)
    rubber, hub = pick_material(rng, "rubber"), rng.uniform(0.08, 0.13)
    for end in circle(count, reach, 0.055, 90.0):
        path = [(0, hub, 0), 0.5 * end + 0.6 * hub * UP, end]
        b.tube("leg", material, path, (0.028, 0.022, 0.016), 8)
        out = end * np.array([1, 0, 1]) / reach
        axle = np.array([-out[2], 0, out[0]]) * 0.02
        wheel = end * np.array([1, 0, 1]) + 0.03 * UP
        b.cylinder("leg", rubber, wheel - axle, wheel + axle, 0.03, segments=12)
        b.cylinder("leg", rubber, wheel, end, 0.012, segments=8)
    rows = [(0.035, hub - 0.03), (0.035, 0.6 * height), (0.02, 0.6 * height), (0.02, height)]
    b.lathe("leg", material, rows, segments=12)


def _swivel(rng: np.random.Generator) -> Builder:
    """Build an office chair: star base, padded seat and back, with or without arms."""
    b = Builder()
    metal = pick_material(rng, draw(rng, ["metal", "rubber"]))
    cover, height = _upholstery(rng), rng.uniform(0.42, 0.54)
    width, depth = rng.uniform(0.44, 0.56), rng.uniform(0.42, 0.52)
    soft, rise = rng.uniform(0.05, 0.11), rng.uniform(0.35, 0.8)
    _star_base(b, rng, metal, height - 0.02)
    b.box("seat", metal, (0, height - 0.02, 0), (0.22, 0.03, 0.25))
    seat = (width, soft, depth)
    b.rounded_box("seat", cover, (0, height + 0.4 * soft, 0), seat, rng.uniform(0.05, 0.16))
    turn, degrees = lean(10), 10.0
    gap = rng.uniform(0.0, 0.12)
    origin = np.array([0, height + soft * 0.5, depth / 2])
    pads = 1 if rise < 0.6 or rng.random() < 0.5 else int(rng.integers(2, 5))
    tall = (rise - gap) / pads
    for i in range(pads):
        center = turn @ np.array([0, gap + (i + 0.5) * tall, 0]) + origin
        size = (width * rng.uniform(0.85, 0.95), tall + 0.01, rng.uniform(0.05, 0.08))
        pad(b, "back", cover, center, size, min(0.4 * tall, rng.uniform(0.04, 0.15)), degrees)
    spine = [(0, height - 0.02, 0.1), (0, height - 0.02, depth / 2 + 0.05)]
    spine += [tuple(turn @ np.array([0, gap + 0.4 * tall, 0.03]) + origin)]
    b.tube("back", metal, bend(spine, 0.1), 0.016, 8)
    kind = draw(rng, ["none", "t", "loop"], [0.3, 0.35, 0.35])
    level = height + rng.uniform(0.2, 0.26)
    for side in (-1, 1) if kind != "none" else ():
        x = side * (width / 2 + 0.035)
        rest = (0.07, 0.025, rng.uniform(0.22, 0.3))
        b.rounded_box("arm", metal, (x, level, 0.03), rest, 0.03)
        ends = [(x, level, -0.06), (x, height - 0.01, -0.06)] if kind == "loop" else []
        path = [*ends[::1], (x, height - 0.01, 0.06), (x, level, 0.06)]
        path = path if kind == "loop" else [(0, height - 0.02, 0.06), *path]
        b.tube("arm", metal, bend(path, 0.05), 0.013, 8)
        if kind == "loop":
            beam(b, "arm", metal, (0, height - 0.02, 0), (x, height - 0.01, 0), 0.05, 0.012)
    return b


def _cantilever(rng: np.random.Generator) -> Builder:
    """Build a chair hung from one bent tube without rear legs."""
    b = Builder()
    metal, cover = pick_material(rng, "metal"), _upholstery(rng)
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
        level = rng.uniform(0.17, 0.24)
        z = rear + np.tan(np.radians(degrees)) * (level + slope)
        for x in (-half - r, half + r):
            path = [(x, seat + level, z), (x, seat + level, front + 0.06), (x, seat, front + 0.08)]
            b.tube("arm", metal, bend(path, 0.06), r, 8)
            rest = (0.035, 0.022, 0.6 * (z - front))
            wood = pick_material(rng, "wood") if x < 0 else wood
            b.rounded_box("arm", wood, (x, seat + level + r, (z + front) / 2), rest, 0.012)
    return b


def _stool(rng: np.random.Generator) -> Builder:
    """Build a low or bar stool: round or square seat, three or four legs or one column."""
    b = Builder()
    height = rng.uniform(0.6, 0.82) if rng.random() < 0.65 else rng.uniform(0.4, 0.5)
    half, soft = rng.uniform(0.15, 0.22), rng.uniform(0.03, 0.1)
    frame = pick_material(rng, draw(rng, ["wood", "metal", "paint"]))
    cover = _upholstery(rng) if rng.random() < 0.6 else frame
    low, ease = height - soft, 0.4 * soft
    if rng.random() < 0.6:
        rows = [
            (half - ease, low),
            (half, low + ease),
            (half, height - ease),
            (half - ease, height),
        ]
        b.lathe("seat", cover, [*rows, (0.4 * half, height + 0.004)])
    else:
        size = (2 * half, soft, 1.8 * half)
        b.rounded_box("seat", cover, (0, height - soft / 2, 0), size, rng.uniform(0.02, 0.12))
    under = low + 0.004
    if rng.random() < 0.35:
        foot = half * rng.uniform(0.9, 1.3)
        rows = [(foot, 0), (foot, 0.012), (0.3 * foot, 0.035), (0.03, 0.06), (0.03, under)]
        b.lathe("leg", frame, [*rows[:-1], (0.03, under - 0.03), (0.5 * half, under)])
        if height > 0.55:
            ring = circle(24, 0.8 * half, 0.3 * height)
            b.tube("leg", frame, [*ring, ring[0]], 0.009, 8)
            beam(b, "leg", frame, ring[0], ring[12], 0.012, 0.012)
    else:
        count = int(rng.integers(3, 5))
        style, turn = draw_leg_style(rng, (0.026, 0.045), 0.0), 90.0 + 180.0 / count
        tops = circle(count, 0.85 * half, under, turn)
        feet = circle(count, half * rng.uniform(0.95, 1.5), 0.0, turn)
        add_legs(b, "leg", frame, style, tops, feet)
        for level in np.sort(rng.uniform(0.2, 0.6, int(rng.integers(0, 3)))):
            rails(b, "leg", frame, feet + level * (tops - feet), 0.018, 0.022)
    if height > 0.55 and rng.random() < 0.5:
        _stool_back(b, rng, frame, cover, half, height)
    return b


def _stool_back(
    b: Builder, rng: np.random.Generator, frame: Material, cover: Material, half: float, top: float
) -> None:
    """Add a low curved backrest on two posts behind a stool's seat."""
    rise, tall = rng.uniform(0.16, 0.35), rng.uniform(0.06, 0.16)
    reach, spread = 1.02 * half, np.radians(rng.uniform(35, 75))
    for sign in (-1, 1):
        a = 0.6 * sign * spread
        foot = np.array([0.85 * reach * np.sin(a), top - 0.02, 0.85 * reach * np.cos(a)])
        head = np.array([reach * np.sin(a), top + rise, reach * np.cos(a)])
        b.cylinder("back", frame, foot, head, 0.011, segments=8)
    angles = np.linspace(-spread, spread, 11)
    heights = top + rise + np.linspace(-0.5, 0.5, 4) * tall
    grid = [[(reach * np.sin(a), y, reach * np.cos(a)) for a in angles] for y in heights]
    sheet(b, "back", cover, grid, rng.uniform(0.018, 0.035))


def _moulded_seat(
    b: Builder, rng: np.random.Generator, material: Material, seat: float, half: float
) -> None:
    """Add a one-piece seat and back, curled up at the sides, its lowest point near `seat`."""
    depth, rise, tip = rng.uniform(0.4, 0.48), rng.uniform(0.3, 0.5), rng.uniform(0.05, 0.14)
    path = [(seat + 0.01, -0.5 * depth - 0.03), (seat + 0.03, -0.42 * depth)]
    path += [(seat, 0.4 * depth), (seat + rise, 0.4 * depth + tip)]
    flat = bend([(0, y, z) for y, z in path], 0.16, 7)
    steps = np.linalg.norm(np.diff(flat, axis=0), axis=1)
    s = np.insert(np.cumsum(steps), 0, 0) / steps.sum()
    normal = np.cross(np.gradient(flat, axis=0), (1, 0, 0))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal *= np.sign(normal[:, 1].mean())
    arms, curl = rng.random() < 0.45, rng.uniform(0.02, 0.07)
    side = curl + (rng.uniform(0.12, 0.18) * np.exp(-(((s - 0.55) / 0.22) ** 2)) if arms else 0.0)
    taper = (
        1 - rng.uniform(0.0, 0.35) * np.clip(s - 0.6, 0, 1) / 0.4 - 0.6 * np.clip(s - 0.93, 0, 1)
    )
    u = np.linspace(-1, 1, 13)
    across = half * np.sin(u * np.pi / 2.4) / np.sin(np.pi / 2.4)
    grid = (
        flat[:, None]
        + (side * np.ones_like(s))[:, None, None] * normal[:, None] * (u**4)[None, :, None]
    )
    grid[:, :, 0] = taper[:, None] * across[None]
    sheet(b, "seat", material, grid, rng.uniform(0.01, 0.02))


def _shell(rng: np.random.Generator) -> Builder:
    """Build a moulded shell on splayed legs, a sled, rockers or one column."""
    b = Builder()
    shell = pick_material(rng, draw(rng, ["plastic", "paint", "wood"], [0.5, 0.3, 0.2]))
    base = pick_material(rng, draw(rng, ["metal", "wood"]))
    seat, half = rng.uniform(0.4, 0.47), rng.uniform(0.2, 0.27)
    _moulded_seat(b, rng, shell, seat, half)
    kind = draw(rng, ["legs", "sled", "rockers", "column"], [0.4, 0.25, 0.15, 0.2])
    if kind == "column":
        foot = rng.uniform(0.2, 0.27)
        rows = [(foot, 0), (foot, 0.01), (0.08, 0.03), (0.025, 0.12), (0.025, seat - 0.05)]
        b.lathe("leg", base, [*rows, (0.1, seat + 0.002)], segments=32)
        return b
    mount = corners(1.1 * half, 0.2, seat + 0.006)
    if kind == "sled":
        for x in (-1, 1):
            wide = x * (half - 0.01)
            path = [(x * 0.5 * half, seat + 0.01, -0.12), (wide, 0.01, -0.24)]
            path += [(wide, 0.01, 0.22), (x * 0.5 * half, seat, 0.1)]
            b.tube("leg", base, bend(path, 0.05), 0.009, 8)
        for point in (mount[:2], mount[2:]):
            b.cylinder("leg", base, point[0] - 0.01 * UP, point[1] - 0.01 * UP, 0.008, segments=8)
        return b
    style = draw_leg_style(rng, (0.028, 0.042), hairpin=0.0)
    lift = 0.05 if kind == "rockers" else 0.0
    feet = corners(2 * half * rng.uniform(0.85, 1.05), rng.uniform(0.36, 0.46), lift)
    add_legs(b, "leg", base, style, mount, feet)
    if rng.random() < 0.6 or kind == "rockers":
        stretchers(
            b, "leg", base, feet + 0.55 * (mount - feet), 0.014, draw(rng, ["box", "x", "h"])
        )
    if kind == "rockers":
        z = np.linspace(-0.36, 0.42, 13)
        for x in feet[:2, 0]:
            path = np.column_stack([np.full(13, x), 0.02 + 0.55 * z**2, z])
            b.tube("leg", base, path, 0.016, 8)
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
    slats(b, "seat", wood, start + 0.4 * gap * turn[:, 2], end - 0.4 * gap * turn[:, 2],
          (2 * half, board, 0.8 * gap), count, turn)  # fmt: skip
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
    back = end + tilt @ np.array([0, level, 0])
    wide, outer = rng.uniform(0.08, 0.14), half + 0.04
    for part, height, z in (("back", 0.75 * rise, 0.018), ("back", level, 0.018)):
        center = end + tilt @ np.array([0, height, z])
        b.rounded_box(part, wood, center, (2 * half + 0.1, 0.06, board), 0.005, turn=tilt)
    post = LegStyle("square", 0.06, ((0.0, 1.0), (0.5, 1.0), (1.0, 1.0)))
    for x in (-outer, outer):
        rest = (wide, 0.024, back[2] + 0.1 + depth / 2)
        b.rounded_box("arm", wood, (x, arm, (back[2] + 0.02 - depth / 2) / 2), rest, 0.03)
        for z in (-depth / 2 + 0.02, float(back[2])):
            add_leg(b, "leg", wood, post, (x, arm - 0.005, z), (x, 0, z), (0.5, 1.3))
        rail = (0.025, 0.09, 0)
        x_in = x - np.sign(x) * 0.03
        beam(b, "seat", wood, (x_in, front - 0.06, -depth / 2), (x_in, end[1] - 0.06, back[2] + 0.02),
             rail[0], rail[1])  # fmt: skip
    return b


FAMILIES: dict[str, Family] = {
    "dining": _dining,
    "swivel": _swivel,
    "cantilever": _cantilever,
    "stool": _stool,
    "shell": _shell,
    "slatted": _slatted,
}
