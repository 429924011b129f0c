"""How the front of a cabinet is laid out."""

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.cabinet.joinery import BOARD, Bay, carcass, plank
from ffd_lightning.shapes.cabinet.plan import Plan
from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import SIDES, vec


def fill(rng: Rng, bay: Bay, kind: str) -> None:
    """Close or furnish a bay: "drawers", "door", "glass", "open" or "mixed" (one above another)."""
    if kind == "mixed":
        share = rng.uniform(0.2, 0.45)
        low, high = bay.split((1 - share, share), across=False)
        first = draw(rng, ["door", "drawers", "open"])
        fill(rng, low, first)
        fill(rng, high, "drawers" if first != "drawers" else "open")
    elif kind == "drawers":
        bay.drawers(min(max(1, round(bay.height / rng.uniform(0.14, 0.28))), 6))
    elif kind in ("door", "glass"):
        bay.shelves(min(4, int(bay.height / 0.35)))
        handle, count = 0.5 if bay.height > 1.1 else 0.85, 2 if bay.width > 0.55 else 1
        bay.doors(count, kind == "glass", handle)
    elif bay.height > 0.3:
        bay.shelves(int(rng.integers(1, max(2, min(5, int(bay.height / 0.28))))))


def drawers(b: Builder, rng: Rng, p: Plan) -> None:
    """Fill the case with rows of drawers, lower ones taller, sometimes a level open."""
    rows = int(np.clip(round(p.height / rng.uniform(0.15, 0.34)), 1, 5 if p.height < 1.2 else 7))
    columns = max(1, round(p.width / rng.uniform(0.45, 1.0)))
    levels = p.case(b).split(np.linspace(rng.uniform(1.0, 1.7), 1.0, rows), across=False)
    empty = int(rng.choice([0, rows - 1])) if rows > 1 and rng.random() < 0.15 else -1
    split = rng.random() < 0.3 and p.width > 0.7
    for i, level in enumerate(levels):
        if i != empty:
            for cell in level.split(columns + (split and i == rows - 1), across=True):
                cell.drawers(1)


def closed(b: Builder, rng: Rng, p: Plan) -> None:
    """Close the case with doors."""
    bay = p.case(b)
    bay.shelves(int(p.height / 0.4))
    count = max(1, round(p.width / rng.uniform(0.36, 0.6)))
    bay.doors(count, rng.random() < 0.15, 0.5 if p.height > 1.1 else 0.85)


def both(b: Builder, rng: Rng, p: Plan) -> None:
    """Put drawers, or small doors, above or below doors."""
    share, count = rng.uniform(0.18, 0.4), max(1, round(p.width / rng.uniform(0.36, 0.6)))
    above = p.height < 1.2 or rng.random() < 0.35
    low, high = p.case(b).split((1 - share, share) if above else (share, 1 - share), across=False)
    small, large = (high, low) if above else (low, high)
    if p.height > 1.2 and above:
        small.doors(count, handle=0.1)
    else:
        small.drawers(max(1, round(small.height / 0.25)), max(1, count // 2))
    large.shelves(int(large.height / 0.4))
    large.doors(count, rng.random() < 0.2, 0.5 if large.height > 1.1 else 0.85)


def sliding(b: Builder, rng: Rng, p: Plan) -> None:
    """Close the case with doors on two tracks that overlap, a shelf or more behind them."""
    bay = p.case(b)
    inner = replace(bay, front=bay.front + 2 * BOARD, depth=bay.depth - 2 * BOARD)
    inner.shelves(max(1, round(bay.height / 0.4) - 1))
    for i, cell in enumerate(bay.cells(2 if p.width < 1.5 else 3, across=True)):
        z = cell.front + 0.004 + (0.024 if i % 2 else 0.0)
        replace(cell, width=cell.width + 0.03, front=z).panel("door")
        if p.style.grip != "none":
            x = cell.x + (0.5 * cell.width - 0.05) * (1 if i else -1)
            size = (0.022, min(0.2, 0.3 * cell.height), 0.008)
            b.rounded_box("handle", p.style.handle, (x, cell.y, z), size, 0.008, edge=0.003)


def columns(b: Builder, rng: Rng, p: Plan) -> None:
    """Fill columns beside each other differently, mostly the same on both sides."""
    count = max(2, round(p.width / rng.uniform(0.32, 0.6)))
    half = rng.uniform(0.6, 1.6, (count + 1) // 2)
    bays = p.case(b).split([*half, *half[: count // 2][::-1]], across=True)
    kinds = ["door", "drawers", "open", "glass", "mixed"]
    chances = [0.4, 0.08, 0.2, 0.07, 0.25] if p.height > 1.2 else [0.3, 0.27, 0.2, 0.08, 0.15]
    fillings = [draw(rng, kinds, chances) for _ in half]
    for bay, filling in zip(bays, [*fillings, *fillings[: count // 2][::-1]], strict=True):
        fill(rng, bay, filling)


def shelved(b: Builder, rng: Rng, p: Plan) -> None:
    """Add open shelves, sometimes over doors or drawers."""
    bay = p.case(b, back=rng.random() < 0.8)
    if p.height > 1 and rng.random() < 0.4:
        low, bay = bay.split((rng.uniform(0.3, 0.7), 1), across=False)
        fill(rng, low, draw(rng, ["door", "drawers"]))
    bays = bay.split(max(1, round(p.width / rng.uniform(0.5, 1.0))), across=True)
    count = max(1, round(bay.height / rng.uniform(0.22, 0.45)) - 1)
    for one in bays:
        one.shelves(count)


def cells(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a grid of square cells, some closed, or one whose columns fall or rise like stairs."""
    cell, across = rng.uniform(0.28, 0.42), max(2, round(p.width / 0.35))
    tallest, stairs = max(2, round(p.height / 0.36)), rng.random() < 0.45
    direction, share = int(rng.choice([-1, 1])), rng.choice([0.0, 0.1, 0.35])
    for i in range(across):
        rows = max(1, tallest - i) if stairs else tallest
        x = direction * (i - (across - 1) / 2) * (cell - p.style.board)
        size = (cell, rows * (cell - p.style.board) + p.style.board, p.depth)
        bay = carcass(b, replace(p.style, inset=True), size, (x, 0, 0))
        for level in bay.split(rows, across=False, gap=p.style.board):
            if rng.random() < share:
                fill(rng, level, draw(rng, ["door", "drawers"]))


def rack(b: Builder, rng: Rng, p: Plan) -> None:
    """Add shelves on four posts, sometimes with a cross at the back."""
    post = rng.uniform(0.018, 0.04)
    metal = pick_material(rng, "metal") if rng.random() < 0.6 else p.style.body
    for x, _, z in corners(p.width - post, p.depth - post, 0):
        size = (post, p.height, post)
        b.rounded_box("leg", metal, (x, p.height / 2, z), size, 0.3 * post, segments=4)
    board = (p.width - 0.4 * post, 0.022, p.depth - 0.4 * post)
    for y in np.linspace(rng.uniform(0.06, 0.2), 0.985, int(rng.integers(3, 7))) * p.height:
        b.rounded_box("shelf", p.style.front, (0, y, 0), board, 0.01)
    x, z = p.width / 2.1, p.depth / 2 - post / 2
    for side in (-x, x) if rng.random() < 0.5 else ():
        ends = (-side, 0.1 * p.height, z), (side, 0.9 * p.height, z)
        b.cylinder("leg", metal, *ends, 0.006, segments=8)


def towers(b: Builder, rng: Rng, p: Plan) -> None:
    """Put a low case beside a tall one or between two, which a shelf may join."""
    columns(b, rng, p)
    sides, wide = [(-1,), (1,), (-1, 1), (-1, 1)][int(rng.integers(4))], rng.uniform(0.28, 0.65)
    rise, kind = p.height + rng.uniform(0.3, 1.6), draw(rng, ["door", "glass", "open", "mixed"])
    for side in sides:
        x = side * (p.width + wide) / 2 - side * 0.004
        fill(rng, carcass(b, p.style, (wide, rise, p.depth), (x, 0, 0)), kind)
    if len(sides) == 2 and rng.random() < 0.6:
        y, x = rise - rng.uniform(0.03, 0.4) * (rise - p.height), p.width / 2 + 0.005
        plank(b, "shelf", p.style.body, (-x, y - 0.03, 0), (x, y, p.depth / 2))


def kneehole(b: Builder, rng: Rng, p: Plan) -> None:
    """Put a case at each end and a drawer between them, with room for the knees below it."""
    wide, shallow = rng.uniform(0.2, 0.36) * p.width, rng.uniform(0.12, 0.18)
    rows = int(rng.integers(1, 5))
    for x in SIDES * (p.width - wide) / 2:
        carcass(b, p.style, (wide, p.height, p.depth), (x, p.foot, 0)).drawers(rows)
    size = (p.width - 2 * wide + 0.01, shallow, p.depth)
    carcass(b, p.style, size, (0, p.top - shallow, 0)).drawers(1)


def files(b: Builder, rng: Rng, p: Plan) -> None:
    """Fill the case with drawers that have label holders, and a lock."""
    rows, bay = max(2, round(p.height / rng.uniform(0.2, 0.36))), p.case(b)
    bay.drawers(rows)
    paper, z = Material((0.92, 0.92, 0.86)), bay.face.front - 0.002
    for cell in bay.cells(rows, across=False):
        x, y = cell.x, cell.y + 0.22 * cell.height
        b.rounded_box("drawer", p.style.handle, (x, y, z), (0.1, 0.05, 0.006), 0.002, segments=1)
        b.box("drawer", paper, (x, y, z - 0.003), (0.085, 0.035, 0.004))
    lock = vec(0.4 * p.width, p.top - 0.05, z + 0.004)
    b.cylinder("handle", p.style.handle, lock, lock - vec(0, 0, 0.012), 0.012)


def lockers(b: Builder, rng: Rng, p: Plan) -> None:
    """Fill the case with narrow doors that have air slits."""
    bay, rows = p.case(b), int(rng.integers(1, 4))
    dark, z = Material((0.12, 0.12, 0.13)), bay.face.front
    for column in bay.cells(max(1, round(p.width / 0.35)), across=True, gap=BOARD):
        for cell in column.cells(rows, across=False, gap=BOARD):
            cell.doors(1)
            for i in range(4):
                y = cell.y + 0.44 * cell.height - 0.025 * i
                b.box("door", dark, (cell.x, y, z), (0.5 * cell.width, 0.008, 0.004))


_LOW = ("night", "chest", "sideboard", "kitchen")
LAYOUTS = (
    Component("drawers", 2.4, drawers, {"use": (*_LOW, "tall")}),
    Component("doors", 1.1, closed, {"use": (*_LOW, "tall", "low", "wardrobe")}),
    Component("both", 1.5, both, {"use": ("chest", "sideboard", "kitchen", "tall", "wardrobe")}),
    Component("sliding", 0.7, sliding, {"use": ("low", "sideboard", "wardrobe")}),
    Component("columns", 2, columns, {"use": ("low", "sideboard", "kitchen", "wardrobe")}),
    Component("shelves", 1.5, shelved, {"use": ("shelving", "tall", "night", "low")}),
    Component("towers", 2, towers, {"use": ("low",)}),
    Component("kneehole", 1, kneehole, {"use": ("chest", "sideboard")}),
    Component("cells", 1, cells, {"use": ("shelving",)}),
    Component("rack", 0.8, rack, {"use": ("shelving",)}),
    Component("files", 1, files, {"use": ("office",)}),
    Component("lockers", 1, lockers, {"use": ("lockers",)}),
)
