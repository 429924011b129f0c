"""What cabinets are made of: boards, carcasses and their bays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import Pair, Triple

BOARD = 0.02
"""Thickness of fronts and inner boards in metres."""


@dataclass(frozen=True)
class Bay:
    """A rectangular opening of a carcass, seen from the front.

    Attributes:
        x, y: its centre.
        width, height: of the clear opening.
        front: z of the carcass's front edge.
        depth: from there to the back panel.
    """

    x: float
    y: float
    width: float
    height: float
    front: float
    depth: float

    def split(self, shares: ArrayLike, across: bool, gap: float = BOARD) -> list[Bay]:
        """Cut by `shares` of the width (`across`) or height into bays `gap` apart, lowest first."""
        parts = np.asarray(shares, float) / np.sum(shares)
        length = (self.width if across else self.height) - gap * (len(parts) - 1)
        sizes = parts * length
        starts = np.cumsum(sizes + gap) - sizes - gap
        low = (self.x - self.width / 2) if across else (self.y - self.height / 2)
        middles = low + starts + sizes / 2
        if across:
            return [replace(self, x=m, width=s) for m, s in zip(middles, sizes, strict=True)]
        return [replace(self, y=m, height=s) for m, s in zip(middles, sizes, strict=True)]

    def back(self) -> float:
        """Return z of the back."""
        return self.front + self.depth


@dataclass(frozen=True)
class Joinery:
    """The look that all fronts of one cabinet share.

    Attributes:
        body, front, handle, glass: materials.
        panel: "flat", "frame", "raised" or "louvre".
        grip: "bar", "knob", "bow", "slot" or "none".
        inset: whether fronts lie within the carcass's edges, not on them.
        board: thickness of the carcass's boards.
    """

    body: Material
    front: Material
    handle: Material
    glass: Material
    panel: str
    grip: str
    inset: bool
    board: float


def draw_joinery(rng: Rng, kinds: Sequence[str] = ("wood", "paint")) -> Joinery:
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
    return Bay(
        x=x,
        y=bottom + height / 2,
        width=width - 2 * t,
        height=height - 2 * t,
        front=front,
        depth=depth - 0.012,
    )


def dividers(b: Builder, style: Joinery, bays: Sequence[Bay], across: bool) -> None:
    """Add the boards between consecutive bays, as `Bay.split` made them."""
    for one, two in pairwise(bays):
        back = one.back()
        if across:
            low = (one.x + one.width / 2, one.y - one.height / 2 - 0.004, one.front + 0.002)
            high = (two.x - two.width / 2, one.y + one.height / 2 + 0.004, back)
        else:
            low = (one.x - one.width / 2 - 0.004, one.y + one.height / 2, one.front + 0.002)
            high = (one.x + one.width / 2 + 0.004, two.y - two.height / 2, back)
        plank(b, "body" if across else "shelf", style.body, low, high)
