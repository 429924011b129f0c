"""What closes the bays of a carcass: doors, drawers, shelves, handles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.cabinet.joinery import BOARD, Bay, Joinery, plank
from ffd_lightning.shapes.kit import Builder, Material
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import UP, Pair, Triple, lean, vec

_KNOB = ((0.005, -0.004), (0.005, 0.01), (0.015, 0.017), (0.013, 0.027), (0.004, 0.031))


def fronts(b: Builder, style: Joinery, bay: Bay, rows: int, columns: int = 1) -> None:
    """Close a bay with a grid of drawers."""
    for row in bay.split(np.ones(rows), across=False, gap=0.0):
        for cell in row.split(np.ones(columns), across=True, gap=0.0):
            z = _panel(b, style, "drawer", _face(style, cell))
            place = (cell.x, cell.y + (0.32 * cell.height if style.grip == "slot" else 0), z)
            wide = cell.width > 0.75 and style.grip in ("knob", "bow")
            for offset in (-0.27 * cell.width, 0.27 * cell.width) if wide else (0.0,):
                at = (place[0] + offset, place[1], z)
                grip(b, style, at, min(0.4 * cell.width, 0.22), upright=False)


def doors(
    b: Builder, style: Joinery, bay: Bay, count: int, glazed: bool = False, handle: float = 0.5
) -> None:
    """Close a bay with hinged doors, in pairs; `handle` is the handles' height, from 0 to 1."""
    for i, cell in enumerate(bay.split(np.ones(count), across=True, gap=0.0)):
        face = _face(style, cell)
        z = _glazing(b, style, face) if glazed else _panel(b, style, "door", face)
        side = 1 if i % 2 == 0 else -1
        x = face.x + side * (face.width / 2 - min(0.035, 0.12 * face.width))
        y = face.y + (handle - 0.5) * 0.7 * face.height
        grip(b, style, (x, y, z), min(0.3 * face.height, 0.28), upright=True)


def sliding_doors(b: Builder, style: Joinery, bay: Bay, count: int) -> None:
    """Close a bay with overlapping doors on two tracks, a shelf or more behind them."""
    inner = replace(bay, front=bay.front + 2 * BOARD, depth=bay.depth - 2 * BOARD)
    shelves(b, style, inner, max(1, round(bay.height / 0.4) - 1))
    for i, cell in enumerate(bay.split(np.ones(count), across=True, gap=0.0)):
        shift = 0.004 + (0.024 if i % 2 else 0.0)
        face = replace(cell, width=cell.width + 0.03, front=cell.front + shift)
        z = _panel(b, replace(style, inset=True), "door", face)
        if style.grip != "none":
            x = cell.x + (0.5 * cell.width - 0.05) * (1 if i else -1)
            size = (0.022, min(0.2, 0.3 * cell.height), 0.008)
            b.rounded_box("handle", style.handle, (x, cell.y, z), size, radius=0.008, edge=0.003)


def shelves(b: Builder, style: Joinery, bay: Bay, count: int) -> None:
    """Add `count` boards to a bay, evenly, behind where inset doors are."""
    for y in np.linspace(-0.5, 0.5, count + 2)[1:-1] * bay.height + bay.y:
        low = (bay.x - bay.width / 2 - 0.003, y - BOARD / 2, bay.front + 1.3 * BOARD)
        high = (bay.x + bay.width / 2 + 0.003, y + BOARD / 2, bay.back())
        plank(b, "shelf", style.body, low, high)


def _face(style: Joinery, cell: Bay) -> Bay:
    """Return where the front of a cell lies: within the opening, or over half its edges."""
    if style.inset:
        gap = 0.006
        return replace(cell, width=cell.width - gap, height=cell.height - gap)
    lap = 0.4 * BOARD - 0.006  # towards the middle of the boards around, less a gap
    return replace(cell, width=cell.width + lap, height=cell.height + lap, front=cell.front - BOARD)


def _panel(b: Builder, style: Joinery, part: str, face: Bay) -> float:
    """Add the board of a door or drawer, BOARD thick behind `face.front`; return that z."""
    half = vec(face.width, face.height, 0) / 2
    middle = vec(face.x, face.y, face.front + BOARD / 2)
    deep = vec(0, 0, BOARD / 2)
    border = min(0.06, 0.2 * min(face.width, face.height))
    inner = np.maximum(half - vec(border, border, 0), 0.004)
    if style.panel == "flat" or border < 0.02:
        plank(b, part, style.front, middle - half - deep, middle + half + deep)
        return face.front
    if style.panel == "raised":
        plank(b, part, style.front, middle - half - deep, middle + half + deep)
        size = (2 * inner[0], 0.8 * BOARD, 2 * inner[1])
        taper = 1 - 0.012 / float(inner[:2].max())
        b.box(part, style.front, middle - 0.8 * deep, size, turn=lean(-90), taper=taper)
        return face.front
    frame(b, part, style.front, middle, (face.width, face.height), border)
    if style.panel == "louvre" and part == "door":
        count = max(4, min(round(2 * inner[1] / 0.035), 16))
        tall = 2 * inner[1] / count
        for y in (np.arange(count) + 0.5 - count / 2) * tall:
            size = (2 * inner[0] + 0.01, 1.15 * tall, 0.006)
            b.box(part, style.front, middle + y * UP, size, turn=lean(25))
        return face.front
    low, high = middle - 1.05 * inner - 0.2 * deep, middle + 1.05 * inner + 0.8 * deep
    plank(b, part, style.front, low, high)
    return face.front


def frame(
    b: Builder, part: str, material: Material, center: ArrayLike, size: Pair, border: float
) -> None:
    """Add four boards around the rectangle `size` (width, height) at `center`, facing -z."""
    middle, (width, height) = np.asarray(center, float), size
    for side in (-1, 1):
        upright = (border, height, BOARD)
        x = side * (width - border) / 2
        b.box(part, material, middle + vec(x, 0, 0), upright)
        level = (width - 1.8 * border, border, 0.98 * BOARD)
        y = side * (height - border) / 2
        b.box(part, material, middle + y * UP, level)


def _glazing(b: Builder, style: Joinery, face: Bay) -> float:
    """Add a glass door with bars; return z of its front."""
    middle = vec(face.x, face.y, face.front + BOARD / 2)
    border = min(0.05, 0.15 * face.width)
    frame(b, "door", style.front, middle, (face.width, face.height), border)
    width, height = face.width - 1.9 * border, face.height - 1.9 * border
    b.box("door", style.glass, middle, (width, height, 0.005))
    if style.panel in ("frame", "raised"):
        for y in np.linspace(-0.5, 0.5, 2 + round(height / 0.3))[1:-1] * height:
            b.box("door", style.front, middle + y * UP, (width, 0.014, 0.012))
    if style.panel == "raised":
        b.box("door", style.front, middle, (0.014, height, 0.012))
    return face.front


def grip(b: Builder, style: Joinery, at: Triple, length: float, upright: bool) -> None:
    """Add a handle at the point `at` of a front: a bar or bow of `length`, a knob or a slot."""
    center, along = np.asarray(at, float), UP if upright else vec(1.0, 0, 0)
    out = vec(0, 0, -1.0)
    if style.grip == "knob":
        b.lathe("handle", style.handle, _KNOB, center, segments=10, turn=lean(-90))
    elif style.grip == "slot":
        size = np.abs(along) * length + (1 - np.abs(along)) * 0.016
        b.box("handle", style.handle, center, (size[0], size[1], 0.006))
    elif style.grip == "bow":
        ends = center - 0.35 * length * along, center + 0.35 * length * along
        corner = [ends[0] + 0.035 * out, ends[1] + 0.035 * out]
        path = bend([ends[0], *corner, ends[1]], 0.03, 2)
        b.tube("handle", style.handle, path, 0.006, segments=6)
    elif style.grip == "bar":
        for t in (-0.36, 0.36):
            foot = center + t * length * along
            b.cylinder("handle", style.handle, foot, foot + 0.03 * out, 0.005, segments=6)
        start, end = (center + 0.03 * out + t * length * along for t in (-0.5, 0.5))
        b.cylinder("handle", style.handle, start, end, 0.008, segments=8)
