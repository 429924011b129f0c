"""Cabinets: dressers, wardrobes, sideboards, bookcases, hutches, filing, bowed, kitchen units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.parts.bowed_cabinet import bowed
from ffd_lightning.shapes.parts.casework import add_cornice, add_top, fill, stand
from ffd_lightning.shapes.parts.furniture import corners, draw
from ffd_lightning.shapes.parts.joinery import (
    BOARD,
    Joinery,
    carcass,
    dividers,
    doors,
    draw_joinery,
    fronts,
    plank,
    shelves,
    sliding_doors,
)
from ffd_lightning.shapes.parts.kitchen_unit import kitchen
from ffd_lightning.shapes.shapes import Builder, Family, Material, pick_material

PARTS = ("body", "top", "door", "drawer", "shelf", "handle", "leg")

_STANDS = ("plinth", "legs", "splayed", "bracket", "sled", "none")


def _dresser(rng: np.random.Generator) -> Builder:
    """Build a chest of drawers: nightstand, tallboy, wide dresser."""
    b = Builder()
    style = draw_joinery(rng)
    kind = draw(rng, ["night", "tall", "chest", "wide"], [0.25, 0.2, 0.25, 0.3])
    limits = {
        "night": ((0.38, 0.6), (0.3, 0.6), (0.3, 0.45), (1, 3), (1, 1)),
        "tall": ((0.4, 0.7), (1.0, 1.5), (0.38, 0.5), (5, 7), (1, 1)),
        "chest": ((0.75, 1.1), (0.65, 1.1), (0.4, 0.55), (3, 5), (1, 2)),
        "wide": ((1.2, 1.8), (0.55, 0.9), (0.4, 0.55), (2, 4), (2, 3)),
    }[kind]
    width, height, depth = (rng.uniform(*limit) for limit in limits[:3])
    low, high = limits[3]
    rows, columns = int(rng.integers(low, high + 1)), int(rng.integers(limits[4][0], high)) % 4
    columns = int(np.clip(columns, *limits[4]))
    base = stand(b, rng, style.body, (width, depth), _STANDS, 0.22)
    bay = carcass(b, style, (width, height, depth), bottom=base)
    add_top(
        b, rng, style.body if rng.random() < 0.6 else style.front, (width, base + height, depth)
    )
    graded = np.linspace(rng.uniform(1.0, 1.7), 1.0, rows)
    levels = bay.split(graded, across=False)
    dividers(b, style, levels, across=False)
    split_top = rng.random() < 0.4 and kind in ("chest", "wide")
    open_level = 0 if kind == "night" and rows > 1 and rng.random() < 0.5 else -1
    for i, level in enumerate(levels):
        if i == open_level:
            continue
        count = columns + 1 if split_top and i == rows - 1 else columns
        cells = level.split(np.ones(count), across=True)
        dividers(b, style, cells, across=True)
        for cell in cells:
            fronts(b, style, cell, 1)
    if kind == "wide" and rng.random() < 0.3:
        _mirror(b, rng, style, (width, base + height, depth))
    return b


def _mirror(
    b: Builder, rng: np.random.Generator, style: Joinery, size: tuple[float, float, float]
) -> None:
    """Stand a framed mirror on the back of a dresser of `size`."""
    width, height, depth = size
    wide, tall = rng.uniform(0.5, 0.85) * width, rng.uniform(0.45, 0.8)
    center = np.array([0, height + 0.08 + tall / 2, depth / 2 - 0.03])
    glass = Material((0.75, 0.83, 0.88))
    b.rounded_box("top", style.body, center, (wide, tall, 0.03), 0.01)
    b.box("top", glass, center - (0, 0, 0.01), (wide - 0.1, tall - 0.1, 0.018))
    for x in (-0.3, 0.3):
        b.box("top", style.body, center + (x * wide, -0.25 * tall, 0.01), (0.04, 0.5 * tall + 0.16,
              0.02))  # fmt: skip


def _wardrobe(rng: np.random.Generator) -> Builder:
    """Build a wardrobe or tall cupboard: two to five doors, drawers or a shelf below."""
    b = Builder()
    style = draw_joinery(rng)
    count = int(rng.integers(1, 6))
    width = count * rng.uniform(0.36, 0.56)
    height, depth = rng.uniform(1.6, 2.3), rng.uniform(0.35, 0.65)
    base = stand(b, rng, style.body, (width, depth), ("plinth", "bracket", "legs", "none"), 0.18)
    bay = carcass(b, style, (width, height, depth), bottom=base)
    kind = draw(
        rng, ["plain", "drawers", "attic", "sliding", "middle"], [0.3, 0.25, 0.15, 0.2, 0.1]
    )
    if kind == "drawers":
        low, bay = bay.split((rng.uniform(0.15, 0.35), 1), across=False)
        dividers(b, style, [low, bay], across=False)
        fronts(b, style, low, int(rng.integers(1, 3)), 2 if width > 0.8 else 1)
    elif kind == "attic":
        bay, high = bay.split((1, rng.uniform(0.2, 0.35)), across=False)
        dividers(b, style, [bay, high], across=False)
        doors(b, style, high, count, handle=0.1)
    if kind == "sliding" and count > 1:
        sliding_doors(b, style, bay, 2 if width < 1.5 else 3)
    elif kind == "middle" and count > 2:
        columns = bay.split((1, rng.uniform(0.8, 1.4), 1), across=True)
        dividers(b, style, columns, across=True)
        for column, filling in zip(columns, ("door", "mixed", "door"), strict=True):
            fill(b, rng, style, column, filling)
    else:
        shelves(b, style, bay, int(rng.integers(1, 5)), style.body)
        doors(b, style, bay, count)
    if rng.random() < 0.6:
        add_cornice(b, style.body, (width, base + height, depth), rng.uniform(0.03, 0.08))
    else:
        add_top(b, rng, style.body, (width, base + height, depth))
    return b


def _sideboard(rng: np.random.Generator) -> Builder:
    """Build a low, wide cabinet of two to five bays: sideboard, television bench, credenza."""
    b = Builder()
    style = draw_joinery(rng, ("wood", "wood", "paint", "plastic"))
    width, depth = rng.uniform(0.9, 2.2), rng.uniform(0.3, 0.52)
    height = rng.uniform(0.28, 0.45) if rng.random() < 0.4 else rng.uniform(0.5, 0.85)
    base = stand(b, rng, style.body if rng.random() < 0.6 else pick_material(rng, "metal"),
                 (width, depth), _STANDS, 0.28)  # fmt: skip
    bay = carcass(b, style, (width, height, depth), bottom=base)
    count = int(rng.integers(2, 6)) if width > 1.4 else int(rng.integers(2, 4))
    half = rng.uniform(0.6, 1.6, (count + 1) // 2)
    shares = np.concatenate([half, half[: count // 2][::-1]])  # symmetric, as most are
    if rng.random() < 0.2:
        sliding_doors(b, style, bay, count)
    else:
        columns = bay.split(shares, across=True)
        dividers(b, style, columns, across=True)
        kinds = ["door", "drawers", "open", "glass", "mixed"]
        fillings = [draw(rng, kinds, [0.35, 0.25, 0.2, 0.08, 0.12]) for _ in half]
        fillings += fillings[: count // 2][::-1]
        for column, filling in zip(columns, fillings, strict=True):
            fill(b, rng, style, column, filling)
    if rng.random() < 0.7:
        top = style.front if rng.random() < 0.4 else style.body
        add_top(b, rng, top, (width, base + height, depth))
    return b


def _bookcase(rng: np.random.Generator) -> Builder:
    """Build open shelving: a case, a staircase of cases, or a grid with some cells closed."""
    b = Builder()
    style = draw_joinery(rng, ("wood", "wood", "paint", "plastic"))
    kind = draw(rng, ["case", "stairs", "grid", "rack"], [0.35, 0.2, 0.25, 0.2])
    depth = rng.uniform(0.22, 0.42)
    if kind == "rack":
        _rack(b, rng, style, (rng.uniform(0.5, 1.3), rng.uniform(0.8, 2.0), depth))
    elif kind == "case":
        width, height = rng.uniform(0.4, 1.3), rng.uniform(0.8, 2.1)
        base = stand(b, rng, style.body, (width, depth), ("plinth", "none", "bracket"), 0.12)
        bay = carcass(b, style, (width, height, depth), bottom=base, back=rng.random() < 0.8)
        if rng.random() < 0.35:
            low, bay = bay.split((rng.uniform(0.3, 0.6), 1), across=False)
            dividers(b, style, [low, bay], across=False)
            fill(b, rng, style, low, draw(rng, ["door", "drawers"]))
        columns = bay.split(np.ones(int(rng.integers(1, 4)) if width > 0.8 else 1), across=True)
        dividers(b, style, columns, across=True)
        count = max(2, round(bay.height / rng.uniform(0.26, 0.42)) - 1)
        for column in columns:
            shelves(b, style, column, count, style.body)
        if rng.random() < 0.4:
            add_cornice(b, style.body, (width, base + height, depth), rng.uniform(0.02, 0.06))
        else:
            add_top(b, rng, style.body, (width, base + height, depth))
    else:
        cell, across = rng.uniform(0.28, 0.42), int(rng.integers(2, 6))
        tallest = int(rng.integers(max(2, across - 1), 6))
        direction = int(rng.choice([-1, 1]))
        for i in range(across):
            rows = max(1, tallest - i) if kind == "stairs" else tallest
            x = direction * (i - (across - 1) / 2) * (cell - style.board)
            _cells(b, rng, style, (cell, depth), x, rows, 0.3 if kind == "grid" else 0.1)
    return b


def _cells(
    b: Builder,
    rng: np.random.Generator,
    style: Joinery,
    size: tuple[float, float],
    x: float,
    rows: int,
    closed: float,
) -> None:
    """Add a column of cells of `size` (width, depth), a share `closed` of them with fronts."""
    width, depth = size
    height = rows * (width - style.board) + style.board
    bay = carcass(b, style, (width, height, depth), (x, 0.0))
    levels = bay.split(np.ones(rows), across=False, gap=style.board)
    dividers(b, style, levels, across=False)
    for level in levels:
        if rng.random() < closed:
            fill(b, rng, replace(style, inset=True), level, draw(rng, ["door", "drawers"]))


def _rack(
    b: Builder, rng: np.random.Generator, style: Joinery, size: tuple[float, float, float]
) -> None:
    """Add shelves on four posts, sometimes with rails and a cross at the back."""
    width, height, depth = size
    post = rng.uniform(0.018, 0.035)
    metal = pick_material(rng, "metal") if rng.random() < 0.6 else style.body
    feet = corners(width - post, depth - post, 0)
    for x, _, z in feet:
        b.rounded_box(
            "leg", metal, (x, height / 2, z), (post, height, post), 0.3 * post, segments=4
        )
    levels = np.linspace(rng.uniform(0.06, 0.2), 0.985, int(rng.integers(3, 7))) * height
    for y in levels:
        board = (width - 0.4 * post, 0.022, depth - 0.4 * post)
        b.rounded_box("shelf", style.front, (0, y, 0), board, 0.01)
        if y < levels[-1] and rng.random() < 0.4:
            rail = (width, 0.03, 0.01)
            b.box("shelf", metal, (0, y + 0.06, depth / 2 - post / 2), rail)
    if rng.random() < 0.5:
        z = depth / 2 - post / 2
        for side in (-1, 1):
            ends = (-side * width / 2.1, 0.1 * height, z), (side * width / 2.1, 0.9 * height, z)
            b.cylinder("leg", metal, *ends, 0.006, segments=8)


def _hutch(rng: np.random.Generator) -> Builder:
    """Build a display cabinet: a glazed or open case on a deeper closed one."""
    b = Builder()
    style = replace(draw_joinery(rng), board=rng.uniform(0.02, 0.03))
    width, depth = rng.uniform(0.7, 1.7), rng.uniform(0.38, 0.55)
    low_height, high_height = rng.uniform(0.55, 0.9), rng.uniform(0.6, 1.2)
    base = stand(b, rng, style.body, (width, depth), ("plinth", "bracket", "legs"), 0.14)
    low = carcass(b, style, (width, low_height, depth), bottom=base)
    add_top(b, rng, style.body, (width, base + low_height, depth))
    count = max(1, round(width / rng.uniform(0.4, 0.6)))
    if rng.random() < 0.6:
        low, row = low.split((1, rng.uniform(0.25, 0.4)), across=False)
        dividers(b, style, [low, row], across=False)
        fronts(b, style, row, 1, count)
    doors(b, style, low, count, handle=0.85)
    deep = rng.uniform(0.6, 0.85) * depth
    z, bottom = (depth - deep) / 2, base + low_height + 0.018
    wide = width - rng.uniform(0, 0.08)
    gap = rng.uniform(0.15, 0.35) if rng.random() < 0.4 else 0.0
    if gap:
        end = (bottom + gap + 0.01, z + deep / 2)
        for x in (-wide / 2, wide / 2 - style.board):
            plank(b, "body", style.body, (x, bottom, z), (x + style.board, *end))
        plank(b, "body", style.body, (-wide / 2, bottom, end[1] - 0.015), (wide / 2, *end))
    bottom += gap
    bay = carcass(b, style, (wide, high_height, deep), (0.0, z), bottom)
    if rng.random() < 0.3:
        columns = bay.split(np.ones(max(1, count - 1)), across=True)
        dividers(b, style, columns, across=True)
        for column in columns:
            fill(b, rng, style, column, "open")
    else:
        shelves(b, style, bay, int(rng.integers(1, 4)), style.body)
        doors(b, style, bay, count, glazed=True, handle=0.3)
    size = (wide, bottom + high_height, deep)
    add_cornice(b, style.body, size, rng.uniform(0.03, 0.08), z)
    return b


def _filing(rng: np.random.Generator) -> Builder:
    """Build office steel: a filing cabinet with label holders, or a bank of lockers."""
    b = Builder()
    style = replace(draw_joinery(rng, ("metal", "paint", "plastic")), panel="flat", board=0.022)
    style = replace(style, grip=draw(rng, ["bar", "bow", "slot"]))
    if rng.random() < 0.45:
        _lockers(b, rng, style)
        return b
    rows = int(rng.integers(2, 6))
    width = rng.uniform(0.36, 0.5) if rng.random() < 0.6 else rng.uniform(0.7, 1.1)
    height, depth = rows * rng.uniform(0.2, 0.34), rng.uniform(0.4, 0.7)
    kinds = ("casters", "none") if rows < 4 else ("plinth", "none")
    base = stand(b, rng, style.body, (width, depth), kinds)
    bay = carcass(b, style, (width, height, depth), bottom=base)
    fronts(b, style, bay, rows)
    paper, z = Material((0.92, 0.92, 0.86)), bay.front - BOARD - 0.002
    for cell in bay.split(np.ones(rows), across=False, gap=0.0):
        place = (cell.x, cell.y + 0.2 * cell.height, z)
        b.rounded_box("drawer", style.handle, place, (0.1, 0.05, 0.006), 0.002, segments=1)
        b.box("drawer", paper, (*place[:2], z - 0.003), (0.085, 0.035, 0.004))
    lock = np.array([0.4 * width, base + height - 0.035, z + 0.004])
    b.cylinder("handle", style.handle, lock, lock - (0, 0, 0.012), 0.012)
    return b


def _lockers(b: Builder, rng: np.random.Generator, style: Joinery) -> None:
    """Add a bank of lockers with air slits."""
    columns, rows = int(rng.integers(1, 6)), int(rng.integers(1, 4))
    width, height = columns * rng.uniform(0.28, 0.4), rng.uniform(1.4, 1.95)
    depth = rng.uniform(0.38, 0.55)
    base = stand(b, rng, style.body, (width, depth), ("plinth", "legs", "none"), 0.14)
    bay = carcass(b, style, (width, height, depth), bottom=base)
    dark, z = Material((0.12, 0.12, 0.13)), bay.front - (0 if style.inset else BOARD)
    slits = int(rng.integers(2, 6))
    for column in bay.split(np.ones(columns), across=True):
        for cell in column.split(np.ones(rows), across=False):
            doors(b, style, cell, 1)
            for end in (1, -1) if cell.height > 0.8 else (1,):
                for i in range(slits):
                    y = cell.y + end * (0.44 * cell.height - 0.025 * i)
                    b.box("door", dark, (cell.x, y, z), (0.5 * cell.width, 0.008, 0.004))


FAMILIES: dict[str, Family] = {
    "dresser": _dresser,
    "wardrobe": _wardrobe,
    "sideboard": _sideboard,
    "bookcase": _bookcase,
    "hutch": _hutch,
    "filing": _filing,
    "kitchen": kitchen,
    "bowed": bowed,
}
