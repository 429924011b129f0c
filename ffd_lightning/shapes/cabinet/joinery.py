"""What cabinets are made of: boards, carcasses and their bays, and what closes these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import UP, Pair, Triple, lean, vec

BOARD = 0.02
"""Thickness of fronts and inner boards in metres."""


@dataclass(frozen=True)
class Bay:
    """A rectangular opening of a carcass, seen from the front; (x, y) is its centre."""

    x: float
    y: float
    width: float
    height: float
    front: float  # z of the carcass's front edge
    depth: float  # from there to the back panel

    def split(self, shares: ArrayLike, across: bool, gap: float = BOARD) -> list[Bay]:
        """Cut by `shares` of the width (`across`) or height into bays `gap` apart, lowest first."""
        middle, side = ("x", "width") if across else ("y", "height")
        length, parts = getattr(self, side), np.asarray(shares, float) / np.sum(shares)
        sizes = parts * (length - gap * (len(parts) - 1))
        starts = getattr(self, middle) - length / 2 + (np.cumsum(sizes + gap) - sizes - gap)
        cells = zip(starts + sizes / 2, sizes, strict=True)
        return [replace(self, **{middle: place, side: size}) for place, size in cells]

    def divide(self, count: int, across: bool, gap: float = BOARD) -> list[Bay]:
        """Cut the width (`across`) or height into `count` equal bays `gap` apart, lowest first."""
        return self.split(np.ones(count), across, gap)

    @property
    def back(self) -> float:
        """The z of the back."""
        return self.front + self.depth


@dataclass(frozen=True)
class Joinery:
    """The look that all fronts of one cabinet share."""

    body: Material
    front: Material
    handle: Material
    glass: Material
    panel: str  # "flat", "frame", "raised" or "louvre"
    grip: str  # "bar", "knob", "bow", "slot" or "none"
    inset: bool  # whether fronts lie within the carcass's edges, not on them
    board: float  # thickness of the carcass's boards


def draw_joinery(rng: Rng, kinds: Sequence[str]) -> Joinery:
    """Draw the materials (the body's is one of `kinds`) and the style of fronts and handles."""
    body = pick_material(rng, draw(rng, kinds))
    front = body if rng.random() < 0.45 else pick_material(rng, draw(rng, kinds))
    return Joinery(
        body=body,
        front=front,
        handle=pick_material(rng, draw(rng, ["metal", "wood", "rubber"], [0.7, 0.15, 0.15])),
        glass=pick_material(rng, "glass"),
        panel=draw(rng, ["flat", "frame", "raised", "louvre"], [0.4, 0.25, 0.25, 0.1]),
        grip=draw(rng, ["bar", "knob", "bow", "slot", "none"], [0.28, 0.32, 0.22, 0.1, 0.08]),
        inset=bool(rng.random() < 0.4),
        board=rng.uniform(0.016, 0.035),
    )


def plank(b: Builder, part: str, material: Material, low: ArrayLike, high: ArrayLike) -> None:
    """Add a board with eased edges between two opposite corners, (3,) each."""
    a, c = np.asarray(low, float), np.asarray(high, float)
    edge = 0.15 * float((c - a).min())
    b.rounded_box(part, material, (a + c) / 2, c - a, edge, segments=1)


def carcass(
    b: Builder,
    style: Joinery,
    size: Triple,
    center: Pair = (0.0, 0.0),
    bottom: float = 0.0,
    back: bool = True,
) -> Bay:
    """Add sides, top, bottom and back of `size` (width, height, depth); return the opening.

    `center` is (x, z) of the middle; the carcass stands at height `bottom`.
    """
    width, height, depth = size
    (x, z), t = center, style.board
    left, right, top = x - width / 2, x + width / 2, bottom + height
    front, rear = z - depth / 2, z + depth / 2
    plank(b, "body", style.body, (left, bottom, front), (left + t, top, rear))
    plank(b, "body", style.body, (right - t, bottom, front), (right, top, rear))
    for low in (bottom, top - t):
        plank(b, "body", style.body, (left + 0.5 * t, low, front), (right - 0.5 * t, low + t, rear))
    if back:
        start, end = (left + 0.5 * t, bottom + 0.5 * t), (right - 0.5 * t, top - 0.5 * t)
        plank(b, "body", style.body, (*start, rear - 0.012), (*end, rear))
    return Bay(x, bottom + height / 2, width - 2 * t, height - 2 * t, front, depth - 0.012)


def dividers(b: Builder, style: Joinery, bays: Sequence[Bay], across: bool) -> None:
    """Add the boards between consecutive bays, as `Bay.split` made them."""
    for one, two in pairwise(bays):
        back = one.back
        if across:
            low = (one.x + one.width / 2, one.y - one.height / 2 - 0.004, one.front + 0.002)
            high = (two.x - two.width / 2, one.y + one.height / 2 + 0.004, back)
        else:
            low = (one.x - one.width / 2 - 0.004, one.y + one.height / 2, one.front + 0.002)
            high = (one.x + one.width / 2 + 0.004, two.y - two.height / 2, back)
        plank(b, "body" if across else "shelf", style.body, low, high)


_KNOB = ((0.005, -0.004), (0.005, 0.01), (0.015, 0.017), (0.013, 0.027), (0.004, 0.031))


def fronts(b: Builder, style: Joinery, bay: Bay, rows: int, columns: int = 1) -> None:
    """Close a bay with a grid of drawers."""
    for row in bay.divide(rows, across=False, gap=0.0):
        for cell in row.divide(columns, across=True, gap=0.0):
            face, rise = _face(style, cell), 0.32 * cell.height if style.grip == "slot" else 0
            _panel(b, style, "drawer", face)
            wide = cell.width > 0.75 and style.grip in ("knob", "bow")
            for offset in (-0.27 * cell.width, 0.27 * cell.width) if wide else (0.0,):
                at = (cell.x + offset, cell.y + rise, face.front)
                grip(b, style, at, min(0.4 * cell.width, 0.22), upright=False)


def doors(
    b: Builder, style: Joinery, bay: Bay, count: int, glazed: bool = False, handle: float = 0.5
) -> None:
    """Close a bay with hinged doors, in pairs; `handle` is the handles' height, from 0 to 1."""
    for i, cell in enumerate(bay.divide(count, across=True, gap=0.0)):
        face = _face(style, cell)
        if glazed:
            _glazing(b, style, face)
        else:
            _panel(b, style, "door", face)
        x = face.x + (-1) ** i * (face.width / 2 - min(0.035, 0.12 * face.width))
        y = face.y + (handle - 0.5) * 0.7 * face.height
        grip(b, style, (x, y, face.front), min(0.3 * face.height, 0.28), upright=True)


def sliding_doors(b: Builder, style: Joinery, bay: Bay, count: int) -> None:
    """Close a bay with overlapping doors on two tracks, a shelf or more behind them."""
    inner = replace(bay, front=bay.front + 2 * BOARD, depth=bay.depth - 2 * BOARD)
    shelves(b, style, inner, max(1, round(bay.height / 0.4) - 1))
    for i, cell in enumerate(bay.divide(count, across=True, gap=0.0)):
        z = cell.front + 0.004 + (0.024 if i % 2 else 0.0)
        _panel(b, style, "door", replace(cell, width=cell.width + 0.03, front=z))
        if style.grip != "none":
            x = cell.x + (0.5 * cell.width - 0.05) * (1 if i else -1)
            size = (0.022, min(0.2, 0.3 * cell.height), 0.008)
            b.rounded_box("handle", style.handle, (x, cell.y, z), size, radius=0.008, edge=0.003)


def shelves(b: Builder, style: Joinery, bay: Bay, count: int) -> None:
    """Add `count` boards to a bay, evenly, behind where inset doors are."""
    for y in np.linspace(-0.5, 0.5, count + 2)[1:-1] * bay.height + bay.y:
        low = (bay.x - bay.width / 2 - 0.003, y - BOARD / 2, bay.front + 1.3 * BOARD)
        high = (bay.x + bay.width / 2 + 0.003, y + BOARD / 2, bay.back)
        plank(b, "shelf", style.body, low, high)


def _face(style: Joinery, cell: Bay) -> Bay:
    """Return where the front of a cell lies: within the opening, or over half its edges."""
    # On a carcass it reaches towards the middle of the boards around, less a gap.
    lap, out = (-0.006, 0.0) if style.inset else (0.4 * BOARD - 0.006, BOARD)
    return replace(cell, width=cell.width + lap, height=cell.height + lap, front=cell.front - out)


def _panel(b: Builder, style: Joinery, part: str, face: Bay) -> None:
    """Add the board of a door or drawer, BOARD thick behind `face.front`."""
    half, deep = vec(face.width, face.height, 0) / 2, vec(0, 0, BOARD / 2)
    middle = vec(face.x, face.y, face.front + BOARD / 2)
    border = min(0.06, 0.2 * min(face.width, face.height))
    inner = np.maximum(half - vec(border, border, 0), 0.004)
    if style.panel in ("flat", "raised") or border < 0.02:
        plank(b, part, style.front, middle - half - deep, middle + half + deep)
        if style.panel == "raised" and border >= 0.02:
            size, taper = (2 * inner[0], 0.8 * BOARD, 2 * inner[1]), 1 - 0.012 / inner[:2].max()
            b.box(part, style.front, middle - 0.8 * deep, size, turn=lean(-90), taper=taper)
        return
    _frame(b, part, style, face, border)
    if style.panel == "louvre" and part == "door":
        count = max(4, min(round(2 * inner[1] / 0.035), 16))
        tall = 2 * inner[1] / count
        size = (2 * inner[0] + 0.01, 1.15 * tall, 0.006)
        for y in (np.arange(count) + 0.5 - count / 2) * tall:
            b.box(part, style.front, middle + y * UP, size, turn=lean(25))
    else:
        low, high = middle - 1.05 * inner - 0.2 * deep, middle + 1.05 * inner + 0.8 * deep
        plank(b, part, style.front, low, high)


def _frame(b: Builder, part: str, style: Joinery, face: Bay, border: float) -> None:
    """Add four boards, `border` broad, around a face."""
    middle = vec(face.x, face.y, face.front + BOARD / 2)
    for side in (-1, 1):
        x, y = side * (face.width - border) / 2, side * (face.height - border) / 2
        level = (face.width - 1.8 * border, border, 0.98 * BOARD)
        b.box(part, style.front, middle + vec(x, 0, 0), (border, face.height, BOARD))
        b.box(part, style.front, middle + y * UP, level)


def _glazing(b: Builder, style: Joinery, face: Bay) -> None:
    """Add a glass door with bars."""
    middle = vec(face.x, face.y, face.front + BOARD / 2)
    border = min(0.05, 0.15 * face.width)
    _frame(b, "door", style, face, border)
    width, height = face.width - 1.9 * border, face.height - 1.9 * border
    b.box("door", style.glass, middle, (width, height, 0.005))
    if style.panel in ("frame", "raised"):
        for y in np.linspace(-0.5, 0.5, 2 + round(height / 0.3))[1:-1] * height:
            b.box("door", style.front, middle + y * UP, (width, 0.014, 0.012))
    if style.panel == "raised":
        b.box("door", style.front, middle, (0.014, height, 0.012))


def grip(b: Builder, style: Joinery, at: Triple, length: float, upright: bool) -> None:
    """Add a handle at the point `at` of a front: a bar or bow of `length`, a knob or a slot."""
    center, along = np.asarray(at, float), length * (UP if upright else vec(1, 0, 0))
    if style.grip == "knob":
        b.lathe("handle", style.handle, _KNOB, center, segments=10, turn=lean(-90))
    elif style.grip == "slot":
        size = (0.016, length, 0.006) if upright else (length, 0.016, 0.006)
        b.box("handle", style.handle, center, size)
    elif style.grip == "bow":
        (start, end), out = (center - 0.35 * along, center + 0.35 * along), vec(0, 0, -0.035)
        path = bend([start, start + out, end + out, end], 0.03, 2)
        b.tube("handle", style.handle, path, 0.006, segments=6)
    elif style.grip == "bar":
        out = vec(0, 0, -0.03)
        for foot in (center - 0.36 * along, center + 0.36 * along):
            b.cylinder("handle", style.handle, foot, foot + out, 0.005, segments=6)
        start, end = center + out - 0.5 * along, center + out + 0.5 * along
        b.cylinder("handle", style.handle, start, end, 0.008, segments=8)
