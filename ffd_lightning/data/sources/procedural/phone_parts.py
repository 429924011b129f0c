"""What mobile phones are made of: shells, screens, keypads, cameras, aerials."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffd_lightning.data.sources.procedural.facing import Front, knob, plate
from ffd_lightning.data.sources.procedural.furniture import draw
from ffd_lightning.data.sources.procedural.shapes import (
    Array,
    Builder,
    Material,
    pick_material,
    rotation,
)


@dataclass(frozen=True)
class PhoneFinish:
    """The materials of one phone."""

    body: Material
    back: Material
    keys: Material
    screen: Material
    trim: Material


def draw_finish(rng: np.random.Generator) -> PhoneFinish:
    """Draw materials: grey and silver bodies most often, lit or dark screens."""
    kinds = ["plastic", "metal", "paint", "dark", "light"]
    shells = [_shell_material(rng, draw(rng, kinds)) for _ in range(2)]
    body, back = shells[0], shells[rng.integers(2)]
    dark = sum(body.color) < 1.2
    level = rng.uniform(0.6, 0.9) if dark or rng.random() < 0.4 else rng.uniform(0.1, 0.3)
    keys_ = Material((level, level, level))
    if rng.random() < 0.15:
        keys_ = pick_material(rng, "paint")
    lit = Material((0.06, 0.07, rng.uniform(0.08, 0.14)))
    if rng.random() < 0.55:
        hue = draw(rng, ["paint", "glass"])
        lit = replace(pick_material(rng, hue), alpha=1.0)
    return PhoneFinish(body, back, keys_, lit, pick_material(rng, "metal"))


def _shell_material(rng: np.random.Generator, kind: str) -> Material:
    """Draw the material of a shell."""
    if kind in ("dark", "light"):
        level = rng.uniform(0.1, 0.25) if kind == "dark" else rng.uniform(0.75, 0.95)
        return Material((level, level, level))
    return pick_material(rng, kind)


def outline(rng: np.random.Generator, width: float, height: float, count: int = 40) -> Array:
    """Draw a rounded outline (count, 2): nearly square to oval, some tapered or waisted."""
    power = rng.uniform(7, 14) if rng.random() < 0.6 else rng.uniform(3, 7)
    taper, waist = 0.0, 0.0
    if rng.random() < 0.4:
        taper, waist = rng.uniform(-0.12, 0.12), rng.uniform(-0.06, 0.08)
    a = 2 * np.pi * (np.arange(count) + 0.5) / count
    # angles that crowd towards the corners, where the outline bends
    a = a - 0.2 * np.sin(4 * a) * -1
    c, s = np.cos(a), np.sin(a)
    reach = (np.abs(c) ** power + np.abs(s) ** power) ** (-1 / power)
    x, y = reach * c * width / 2, reach * s * height / 2
    t = 2 * y / height
    return np.stack([x * (1 + taper * t - waist * (1 - t**2)), y], 1)


def shell(
    b: Builder, material: Material, middle: Front, plan: Array, thickness: float, edge: float
) -> Front:
    """Add a slab with rounded edges around a mid-plane; return its front surface."""
    quarter = np.linspace(0, np.pi / 2, 4)
    half, reach = thickness / 2, np.abs(plan).max(0)
    edge = min(edge, half)
    rows = [(edge * (1 - np.cos(q)), half - edge + edge * np.sin(q)) for q in quarter]
    rings = []
    for inset, z in [(i, -z) for i, z in rows[::-1]] + rows:
        flat = plan * (1 - inset / reach)
        rings.append([middle.at(x, y, z) for x, y in flat])
    b.loft("body", material, rings)
    return middle.moved(0, 0, -half)


def screen(
    b: Builder,
    rng: np.random.Generator,
    finish: PhoneFinish,
    front: Front,
    spot: tuple[float, float],
    size: tuple[float, float],
) -> None:
    """Add a display of `size` (width, height), some in a raised frame of dark glass or trim."""
    width, height = size
    radius = rng.uniform(0.01, 0.05)
    if rng.random() < 0.6:
        frame = finish.trim if rng.random() < 0.3 else Material((0.05, 0.05, 0.06))
        plate(b, "screen", frame, front, spot, (width, height, 0.012), radius)
        width, height = 0.9 * width, height - 0.1 * min(size)
    plate(b, "screen", finish.screen, front, spot, (width, height, 0.018), 0.5 * radius)


def keys(
    b: Builder,
    rng: np.random.Generator,
    finish: PhoneFinish,
    front: Front,
    spot: tuple[float, float],
    size: tuple[float, float],
    count: tuple[int, int],
) -> None:
    """Fill `size` (width, height) about `spot` with (rows, columns) keys."""
    rows, columns = count
    pitch = np.array([size[0] / columns, size[1] / rows])
    fill = rng.uniform(0.62, 0.9, 2)
    round_keys = columns <= 3 and rng.random() < 0.6
    rise = rng.uniform(0.012, 0.03)
    arch = rng.uniform(0, 0.25) * pitch[1] if rng.random() < 0.3 else 0.0
    turn = front.turn @ rotation((1, 0, 0), -90)  # a box's upper side comes to the front
    for i in range(rows):
        for j in range(columns):
            off = j - (columns - 1) / 2
            x = spot[0] + off * pitch[0]
            y = spot[1] + (i - (rows - 1) / 2) * pitch[1] - arch * abs(off)
            wide, tall = fill * pitch
            if round_keys:
                radius = 0.45 * min(wide, tall)
                plate(b, "key", finish.keys, front, (x, y), (wide, tall, 2 * rise), radius, 1)
            else:
                size3 = (wide, 2 * rise, tall)
                b.box("key", finish.keys, front.at(x, y), size3, turn, taper=0.85)


def controls(
    b: Builder,
    rng: np.random.Generator,
    finish: PhoneFinish,
    front: Front,
    y: float,
    size: tuple[float, float],
) -> None:
    """Add a round, square or ball-like control of `size` height between two or four soft keys."""
    width, height = size
    kind = draw(rng, ["ring", "square", "ball"])
    half = 0.5 * height
    if kind == "square":
        plate(b, "key", finish.trim, front, (0, y), (height, 0.95 * height, 0.03), 0.3 * half)
        plate(b, "key", finish.keys, front, (0, y), (0.45 * height, 0.45 * height, 0.045),
              0.2 * half)  # fmt: skip
    else:
        rim = [(half, -0.01), (half, 0.012), (0.85 * half, 0.016), (0.5 * half, 0.006)]
        knob(b, "key", finish.trim, front, (0, y), rim, 24)
        bulge = 0.03 if kind == "ball" else 0.014
        cap = [(0.48 * half, 0.0), (0.4 * half, 0.7 * bulge), (0.02 * half, bulge)]
        knob(b, "key", finish.keys, front, (0, y), cap, 18)
    rows = 2 if rng.random() < 0.6 and height > 0.09 else 1
    wide = 0.5 * (width - height) - 0.03
    if wide < 0.03:
        return
    for side in (-1, 1):
        for row in range(rows):
            dy = (row - (rows - 1) / 2) * 0.5 * height
            spot = (side * (width - wide) / 2, y + dy)
            tall = 0.36 * height if rows == 2 else 0.5 * height
            plate(b, "key", finish.keys, front, spot, (wide, tall, 0.026), 0.3 * tall, 1)


def earpiece(
    b: Builder,
    rng: np.random.Generator,
    finish: PhoneFinish,
    front: Front,
    spot: tuple[float, float],
    width: float,
) -> None:
    """Add a slit, or a row of holes, that sound comes out of."""
    dark = Material((0.03, 0.03, 0.03))
    if rng.random() < 0.6:
        plate(b, "speaker", dark, front, spot, (width, 0.016, 0.01), 0.007)
        return
    for x in np.linspace(-0.5, 0.5, int(rng.integers(3, 6))) * 0.8 * width:
        knob(b, "speaker", dark, front, (spot[0] + float(x), spot[1]),
             [(0.01, -0.004), (0.01, 0.005)], 8)  # fmt: skip


def camera(
    b: Builder,
    rng: np.random.Generator,
    finish: PhoneFinish,
    back: Front,
    spot: tuple[float, float],
    wide: float,
) -> None:
    """Add one to three lenses in a bump on a back."""
    radius = rng.uniform(0.05, 0.08) * wide
    count = int(rng.integers(1, 4))
    y = spot[1] - (count - 1) * 1.2 * radius
    size = (3 * radius, 2.4 * radius * (count - 1) + 3 * radius, 0.03)
    plate(b, "camera", finish.trim, back, (spot[0], y), size, 1.2 * radius)
    for i in range(count):
        place = (spot[0], spot[1] - 2.4 * i * radius)
        rim = [(radius, 0.0), (radius, 0.022), (0.7 * radius, 0.024), (0.6 * radius, 0.014)]
        knob(b, "camera", Material((0.04, 0.04, 0.06)), back, place, rim, 16)


def side_keys(
    b: Builder,
    rng: np.random.Generator,
    finish: PhoneFinish,
    middle: Front,
    size: tuple[float, float],
) -> None:
    """Add volume and power keys on the long sides of a slab of `size` (width, thickness)."""
    wide, deep = size
    for side in (-1, 1):
        y = rng.uniform(0.1, 0.3)
        for _ in range(int(rng.integers(0, 3))):
            tall = rng.uniform(0.05, 0.1)
            block = (0.03, tall, 0.35 * deep)
            b.rounded_box("key", finish.trim, middle.at(side * 0.485 * wide, y, 0), block,
                          0.006, turn=middle.turn, segments=1)  # fmt: skip
            y -= tall + 0.02


def aerial(
    b: Builder,
    rng: np.random.Generator,
    finish: PhoneFinish,
    base: Array,
    turn: Array | None = None,
    long: bool = False,
) -> None:
    """Add a stub or a pulled-out rod that stands on `base` along `turn`'s y."""
    up = np.array([0.0, 1, 0]) if turn is None else turn[:, 1]
    radius = rng.uniform(0.022, 0.035)
    stub = rng.uniform(0.12, 0.35) if long else rng.uniform(0.06, 0.14)
    path = base + np.outer([-0.05, 0, stub, stub + 0.015], up)
    radii = (radius, radius, 0.75 * radius, 0.4 * radius)
    b.tube("antenna", finish.back, path, radii, 14)
    if rng.random() < (0.5 if long else 0.3):
        tip = stub + rng.uniform(0.2, 0.5)
        rod = base + np.outer([stub, tip, tip, tip + 0.03], up)
        rod += np.outer([0, 0, 0.0005, 0.0005], up)
        b.tube("antenna", finish.trim, rod, (0.008, 0.008, 0.014, 0.014), 10)
