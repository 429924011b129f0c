"""What cabinets are made of: boards, carcasses and their bays, and what closes these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import UP, Array, Triple, lean, vec

BOARD = 0.02
"""Thickness of fronts and inner boards in metres."""


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
    b.rounded_box(part, material, (a + c) / 2, c - a, 0.15 * float((c - a).min()), segments=1)


_KNOB = ((0.005, -0.004), (0.005, 0.01), (0.015, 0.017), (0.013, 0.027), (0.004, 0.031))


@dataclass(frozen=True)
class Bay:
    """A rectangular opening of a carcass, seen from the front; (x, y) is its centre.

    It draws what divides and closes it. Its front can be a door's or a drawer's, too.
    """

    b: Builder
    style: Joinery
    x: float
    y: float
    width: float
    height: float
    front: float  # z of the carcass's front edge
    depth: float  # from there to the back panel

    @property
    def middle(self) -> Array:
        """The middle of a board with this front, (3,)."""
        return vec(self.x, self.y, self.front + BOARD / 2)

    @property
    def face(self) -> Bay:
        """Where its front lies: within the opening, or over half its edges, less a gap."""
        lap, out = (-0.006, 0.0) if self.style.inset else (0.4 * BOARD - 0.006, BOARD)
        width, height = self.width + lap, self.height + lap
        return replace(self, width=width, height=height, front=self.front - out)

    def cells(self, shares: ArrayLike, across: bool, gap: float = 0.0) -> list[Bay]:
        """Cut the width (`across`) or height into bays `gap` apart, lowest first.

        `shares` are theirs, or how many they are if they are equal.
        """
        parts = np.ones(int(shares)) if isinstance(shares, int) else np.asarray(shares, float)
        middle, side = ("x", "width") if across else ("y", "height")
        length = getattr(self, side)
        sizes = parts / np.sum(parts) * (length - gap * (len(parts) - 1))
        starts = getattr(self, middle) - length / 2 + (np.cumsum(sizes + gap) - sizes - gap)
        places = zip(starts + sizes / 2, sizes, strict=True)
        return [replace(self, **{middle: place, side: size}) for place, size in places]

    def split(self, shares: ArrayLike, across: bool, gap: float = BOARD) -> list[Bay]:
        """Cut as `cells` does, with boards in the gaps."""
        cells, (x, y) = self.cells(shares, across, gap), (self.width / 2, self.height / 2)
        for one, two in pairwise(cells):
            if across:
                low = (one.x + one.width / 2, one.y - y - 0.004, one.front + 0.002)
                high = (two.x - two.width / 2, one.y + y + 0.004, one.front + one.depth)
            else:
                low = (one.x - x - 0.004, one.y + one.height / 2, one.front + 0.002)
                high = (one.x + x + 0.004, two.y - two.height / 2, one.front + one.depth)
            plank(self.b, "body" if across else "shelf", self.style.body, low, high)
        return cells

    def shelves(self, count: int) -> None:
        """Add `count` boards, evenly, behind where inset doors are."""
        left, right = self.x - self.width / 2 - 0.003, self.x + self.width / 2 + 0.003
        start, end = self.front + 1.3 * BOARD, self.front + self.depth
        for y in np.linspace(-0.5, 0.5, count + 2)[1:-1] * self.height + self.y:
            low, high = (left, y - BOARD / 2, start), (right, y + BOARD / 2, end)
            plank(self.b, "shelf", self.style.body, low, high)

    def drawers(self, rows: int, columns: int = 1) -> None:
        """Close it with a grid of drawers."""
        for row in self.cells(rows, across=False):
            for cell in row.cells(columns, across=True):
                face, rise = cell.face, 0.32 * cell.height if self.style.grip == "slot" else 0
                face.panel("drawer")
                wide = cell.width > 0.75 and self.style.grip in ("knob", "bow")
                for offset in (-0.27 * cell.width, 0.27 * cell.width) if wide else (0.0,):
                    at = (cell.x + offset, cell.y + rise, face.front)
                    _grip(self.b, self.style, at, min(0.4 * cell.width, 0.22), vec(1, 0, 0))

    def doors(self, count: int, glazed: bool = False, handle: float = 0.5) -> None:
        """Close it with hinged doors, in pairs; `handle` is the handles' height, from 0 to 1."""
        for i, cell in enumerate(self.cells(count, across=True)):
            face = cell.face
            if glazed:
                face.glazing()
            else:
                face.panel("door")
            x = face.x + (-1) ** i * (face.width / 2 - min(0.035, 0.12 * face.width))
            y = face.y + (handle - 0.5) * 0.7 * face.height
            _grip(self.b, self.style, (x, y, face.front), min(0.3 * face.height, 0.28), UP)

    def panel(self, part: str) -> None:
        """Add the board of a door or drawer, BOARD thick, at the front."""
        half, deep = vec(self.width, self.height, 0) / 2, vec(0, 0, BOARD / 2)
        front = self.style.front
        border = min(0.06, 0.2 * min(self.width, self.height))
        inner = np.maximum(half - vec(border, border, 0), 0.004)
        if self.style.panel in ("flat", "raised") or border < 0.02:
            plank(self.b, part, front, self.middle - half - deep, self.middle + half + deep)
            if self.style.panel == "raised" and border >= 0.02:
                at, size = self.middle - 0.8 * deep, (2 * inner[0], 0.8 * BOARD, 2 * inner[1])
                taper = 1 - 0.012 / inner[:2].max()
                self.b.box(part, front, at, size, turn=lean(-90), taper=taper)
            return
        self.frame(part, border)
        if self.style.panel == "louvre" and part == "door":
            count = max(4, min(round(2 * inner[1] / 0.035), 16))
            tall = 2 * inner[1] / count
            size = (2 * inner[0] + 0.01, 1.15 * tall, 0.006)
            for y in (np.arange(count) + 0.5 - count / 2) * tall:
                self.b.box(part, front, self.middle + y * UP, size, turn=lean(25))
        else:
            low, high = self.middle - 1.05 * inner, self.middle + 1.05 * inner
            plank(self.b, part, front, low - 0.2 * deep, high + 0.8 * deep)

    def frame(self, part: str, border: float) -> None:
        """Add four boards, `border` broad, around the front."""
        level = (self.width - 1.8 * border, border, 0.98 * BOARD)
        for side in (-1, 1):
            x, y = side * (self.width - border) / 2, side * (self.height - border) / 2
            upright = (border, self.height, BOARD)
            self.b.box(part, self.style.front, self.middle + vec(x, 0, 0), upright)
            self.b.box(part, self.style.front, self.middle + y * UP, level)

    def glazing(self) -> None:
        """Add a glass door with bars at the front."""
        border, front = min(0.05, 0.15 * self.width), self.style.front
        self.frame("door", border)
        width, height = self.width - 1.9 * border, self.height - 1.9 * border
        self.b.box("door", self.style.glass, self.middle, (width, height, 0.005))
        if self.style.panel in ("frame", "raised"):
            for y in np.linspace(-0.5, 0.5, 2 + round(height / 0.3))[1:-1] * height:
                self.b.box("door", front, self.middle + y * UP, (width, 0.014, 0.012))
        if self.style.panel == "raised":
            self.b.box("door", front, self.middle, (0.014, height, 0.012))


def _grip(b: Builder, style: Joinery, at: Triple, length: float, way: Array) -> None:
    """Add a handle at the point `at` of a front: a knob, or what is `length` long along `way`."""
    center, along = np.asarray(at, float), length * way
    if style.grip == "knob":
        b.lathe("handle", style.handle, _KNOB, center, segments=10, turn=lean(-90))
    elif style.grip == "slot":
        b.box("handle", style.handle, center, np.maximum(along, (0.016, 0.016, 0.006)))
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


def carcass(
    b: Builder, style: Joinery, size: Triple, foot: Triple = (0, 0, 0), back: bool = True
) -> Bay:
    """Add sides, top, bottom and back of `size` above the point `foot`; return the opening."""
    (width, height, depth), (x, bottom, z), t = size, foot, style.board
    left, right, top = x - width / 2, x + width / 2, bottom + height
    front, rear = z - depth / 2, z + depth / 2
    plank(b, "body", style.body, (left, bottom, front), (left + t, top, rear))
    plank(b, "body", style.body, (right - t, bottom, front), (right, top, rear))
    for low in (bottom, top - t):
        plank(b, "body", style.body, (left + 0.5 * t, low, front), (right - 0.5 * t, low + t, rear))
    if back:
        start, end = (left + 0.5 * t, bottom + 0.5 * t), (right - 0.5 * t, top - 0.5 * t)
        plank(b, "body", style.body, (*start, rear - 0.012), (*end, rear))
    inner = width - 2 * t, height - 2 * t
    return Bay(b, style, x, bottom + height / 2, *inner, front, depth - 0.012)
