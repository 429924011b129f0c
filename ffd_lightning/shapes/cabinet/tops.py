"""What a cabinet ends with: a board, a cornice, a second case, a mirror, a worktop."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.cabinet.fronts import doors, shelves
from ffd_lightning.shapes.cabinet.joinery import Bay, carcass, dividers, plank
from ffd_lightning.shapes.cabinet.layouts import fill
from ffd_lightning.shapes.cabinet.plan import Plan
from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, draw, nothing, pick_material
from ffd_lightning.shapes.kit.paths import bend, corners
from ffd_lightning.shapes.kit.vectors import vec


def flat(b: Builder, rng: Rng, p: Plan, material: Material | None = None) -> None:
    """Add a board with an overhang."""
    over, thick = rng.uniform(0.0, 0.06), rng.uniform(0.02, 0.06)
    board = material or (p.style.body if rng.random() < 0.6 else p.style.front)
    size = (p.width + 2 * over + 0.004, thick, p.depth + over + 0.004)
    middle = (0, p.top + thick / 2 - 0.002, -over / 2)
    b.rounded_box("top", board, middle, size, radius=0.012, edge=rng.uniform(0.2, 0.45) * thick)


def cornice(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a moulding that flares."""
    _moulding(b, rng, p, (p.width, p.top, p.depth), 0.0)


def _moulding(b: Builder, rng: Rng, p: Plan, size: tuple[float, float, float], z: float) -> None:
    """Add a moulding on a case of `size` (width, height of its top, depth) about `z`."""
    reach, rings = rng.uniform(0.03, 0.09), []
    profile = [(0.0, -0.01), (0.3, 0.15), (0.33, 0.4), (0.5, 0.65), (0.8, 0.78), (1.0, 0.85)]
    for out, rise in [*profile, (1.0, 1.2)]:
        wide, deep = size[0] + 2 * out * reach, size[2] + out * reach
        rings.append(corners(wide, deep, size[1] + rise * reach) + vec(0, 0, z - out * reach / 2))
    b.loft("top", p.style.body, rings)


def gallery(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board with a rim at the back and the ends."""
    rise, x, z = rng.uniform(0.04, 0.25), p.width / 2, p.depth / 2
    flat(b, rng, p)
    high, low = p.top + rise, p.top
    plank(b, "top", p.style.body, (-x, low, z - 0.02), (x, high, z))
    for side in (-x, x - 0.02):
        plank(b, "top", p.style.body, (side, low, -0.5 * z), (side + 0.02, low + 0.7 * rise, z))


def mirror(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board and a framed mirror on two posts."""
    flat(b, rng, p)
    wide, tall = rng.uniform(0.5, 0.85) * p.width, rng.uniform(0.45, 0.8)
    center = vec(0, p.top + 0.08 + tall / 2, p.depth / 2 - 0.03)
    b.rounded_box("top", p.style.body, center, (wide, tall, 0.03), 0.01)
    size = (wide - 0.1, tall - 0.1, 0.018)
    b.box("top", Material((0.75, 0.83, 0.88)), center - vec(0, 0, 0.01), size)
    for x in (-0.3, 0.3):
        post = (0.04, 0.5 * tall + 0.16, 0.02)
        b.box("top", p.style.body, center + vec(x * wide, -0.25 * tall, 0.01), post)


def hutch(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board and a shallower case with glass doors or shelves, sometimes raised."""
    flat(b, rng, p)
    rise, deep = rng.uniform(0.5, 1.2), rng.uniform(0.5, 0.85) * p.depth
    z, bottom, t = (p.depth - deep) / 2, p.top + 0.015, p.style.board
    wide = p.width - rng.uniform(0, 0.1)
    gap = rng.uniform(0.15, 0.35) if rng.random() < 0.4 else 0.0
    if gap:
        end = (bottom + gap + 0.01, z + deep / 2)
        for x in (-wide / 2, wide / 2 - t):
            plank(b, "body", p.style.body, (x, bottom, z), (x + t, *end))
        plank(b, "body", p.style.body, (-wide / 2, bottom, end[1] - 0.015), (wide / 2, *end))
    bottom += gap
    bay, count = carcass(b, p.style, (wide, rise, deep), (0.0, z), bottom), round(wide / 0.5)
    if rng.random() < 0.35:
        _row(b, rng, p, bay.split(np.ones(max(1, count - 1)), across=True), ["open"])
    else:
        shelves(b, p.style, bay, int(rng.integers(1, 4)))
        doors(b, p.style, bay, max(1, count), glazed=True, handle=0.3)
    _moulding(b, rng, p, (wide, bottom + rise, deep), z)


def _row(b: Builder, rng: Rng, p: Plan, bays: list[Bay], kinds: list[str]) -> None:
    """Fill a row of bays."""
    dividers(b, p.style, bays, across=True)
    for bay in bays:
        fill(b, rng, p.style, bay, draw(rng, kinds))


def worktop(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a worktop with a sink, a hob or both."""
    flat(b, rng, p, pick_material(rng, draw(rng, ["wood", "metal", "plastic"])))
    steel, level = pick_material(rng, "metal"), p.top + 0.035
    count = max(1, round(p.width / 0.6))
    spots = list(rng.permutation((np.arange(count) + 0.5) / count - 0.5) * p.width)
    x, size = spots.pop(), vec(rng.uniform(0.34, 0.4), 0.036, rng.uniform(0.3, 0.38))
    b.rounded_box("top", steel, (x, level, -0.04), size, 0.04, segments=2)
    bowl, middle = Material((0.35, 0.36, 0.38)), (x, level + 0.004, -0.04)
    b.rounded_box("top", bowl, middle, size * vec(0.85, 1, 0.8), 0.06, segments=2)
    rise, reach = rng.uniform(0.14, 0.3), rng.uniform(0.12, 0.18)
    path = [(x, level - 0.02, 0.2), (x, level + rise, 0.2)]
    path += [(x, level + y, 0.2 - reach) for y in (rise, 0.7 * rise)]
    b.tube("top", steel, bend(path, 0.06, 3), 0.013, segments=8)
    if spots and rng.random() < 0.6:
        x = spots.pop()
        plate = (0.44, 0.04, 0.42)
        b.rounded_box("top", Material((0.08, 0.08, 0.09)), (x, level, 0), plate, 0.02, segments=2)
        for i, j in ((-1, -1), (1, -1), (-1, 1), (1, 1)):
            ring = [(0.05, 0.015), (0.075, 0.022), (0.05, 0.024), (0.03, 0.018)]
            b.lathe("top", steel, ring, (x + 0.11 * i, level, 0.1 * j), segments=12)


def wall(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a worktop, tiles and a row of cases on the wall."""
    worktop(b, rng, p)
    gap, rise, deep = rng.uniform(0.4, 0.6), rng.uniform(0.4, 0.8), rng.uniform(0.28, 0.36)
    tiles, z = Material(pick_material(rng, "plastic").color, "checker", 5.0), p.depth / 2
    low, high = (-p.width / 2, p.top, z - 0.02), (p.width / 2, p.top + gap + 0.05, z)
    plank(b, "body", tiles, low, high)
    bay = carcass(b, p.style, (p.width, rise, deep), (0.0, z - deep / 2), p.top + gap + 0.03)
    bays = bay.split(np.ones(max(1, round(p.width / 0.6))), across=True)
    _row(b, rng, p, bays, ["door", "door", "glass", "open"])


_LOW = ("night", "chest", "low", "sideboard", "office")
_TALL = ("tall", "wardrobe", "shelving")
_CASES = ("drawers", "doors", "both", "sliding", "columns", "shelves", "kneehole")
TOPS = (
    Component("bare", 1, nothing, {"use": (*_LOW, *_TALL, "lockers")}),
    Component("flat", 2.2, flat, {"use": (*_LOW, *_TALL), "layout": _CASES}),
    Component("cornice", 1.2, cornice, {"use": _TALL, "layout": _CASES}),
    Component("gallery", 1, gallery, {"use": ("night", "chest", "sideboard")}),
    Component(
        "mirror",
        1,
        mirror,
        {"use": ("chest", "sideboard"), "layout": ("drawers", "both", "kneehole")},
    ),
    Component("hutch", 1.8, hutch, {"use": ("chest", "sideboard"), "layout": _CASES}),
    Component("worktop", 1, worktop, {"use": ("kitchen",)}),
    Component("wall", 1.2, wall, {"use": ("kitchen",)}),
)
