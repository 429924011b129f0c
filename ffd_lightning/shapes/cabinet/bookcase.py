"""Open shelving."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.cabinet.casework import add_cornice, add_top, fill, stand
from ffd_lightning.shapes.cabinet.fronts import shelves
from ffd_lightning.shapes.cabinet.joinery import Joinery, carcass, dividers, draw_joinery
from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import Pair, Triple


def bookcase(rng: Rng) -> Builder:
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
            shelves(b, style, column, count)
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
    b: Builder, rng: Rng, style: Joinery, size: Pair, x: float, rows: int, closed: float
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


def _rack(b: Builder, rng: Rng, style: Joinery, size: Triple) -> None:
    """Add shelves on four posts, sometimes with rails and a cross at the back."""
    width, height, depth = size
    post = rng.uniform(0.018, 0.035)
    metal = pick_material(rng, "metal") if rng.random() < 0.6 else style.body
    feet = corners(width - post, depth - post, 0)
    for x, _, z in feet:
        block = (post, height, post)
        b.rounded_box("leg", metal, (x, height / 2, z), block, 0.3 * post, segments=4)
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
