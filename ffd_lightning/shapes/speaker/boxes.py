"""Boxes whose fronts are tiled by bays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair, Triple, about_y, lean, vec
from ffd_lightning.shapes.speaker.drivers import BLACK, Finish, driver, port

Units = list[tuple[str, float]]
"""What is mounted in a front: (kind, radius) each."""


@dataclass(frozen=True)
class Bay:
    """One rectangle of a cabinet's front and what is mounted in its middle."""

    kind: str  # "woofer", "tweeter", "port", "slot", "horn" or "blank"
    radius: float  # of what is mounted (half the width of a horn or a slot)
    center: Pair  # (x, y) from the middle of the front
    size: Pair  # (width, height)


@dataclass(frozen=True)
class Cabinet:
    """A box that stands on a level floor, bevelled and drilled at the front. Metres, degrees."""

    width: float  # of the front
    height: float  # of the front, along its slope
    depth: float  # from front to back
    foot: Triple = (0.0, 0.0, 0.0)  # the middle of the front's lower edge
    tilt: float = 0.0  # by which the front leans back
    yaw: float = 0.0  # by which it is turned about the vertical
    bevel: float = 0.008  # of the front's edges
    back: float = 1.0  # width of the back over that of the front
    curve: float = 1.0  # 1 for straight sides, more for bowed ones

    @property
    def turn(self) -> Array:
        """Rotation (3, 3) from the cabinet's frame to the world's."""
        return about_y(self.yaw) @ lean(self.tilt)

    @property
    def face(self) -> Pair:
        """Width and height of the flat part of the front."""
        return self.width - 2 * self.bevel, self.height - 2 * self.bevel

    def world(self, points: ArrayLike) -> Array:
        """Move points (..., 3), given from the middle of the front, to the world."""
        local = np.asarray(points, float) + self.height / 2 * UP
        return local @ self.turn.T + np.asarray(self.foot)

    def bays(self, units: Units, blank: float = 0.0, across: bool = False) -> list[Bay]:
        """Tile the front with one bay for each unit, from below on.

        `across` puts them side by side, from the left on. Radii are shrunk where they do not fit;
        `blank` is the share of the spare length that is left empty at the start.
        """
        wide, long = self.face[::-1] if across else self.face
        radii = np.minimum([r for _, r in units], 0.46 * wide)
        flat = np.array([0.55 if kind in ("slot", "horn") else 1.0 for kind, _ in units])
        needs = 2.2 * radii * (1.0 if across else flat)
        shrink = min(1.0, 0.97 * long / needs.sum())
        spare = long - shrink * needs.sum()
        lengths = [blank * spare, *(shrink * needs + (1 - blank) * spare / len(units))]
        kinds = [("blank", 0.0), *zip([k for k, _ in units], shrink * radii, strict=True)]
        bays, start = [], -long / 2
        for (kind, r), length in zip(kinds, lengths, strict=True):
            middle = start + length / 2
            start += length
            if length > 1e-3 * long:
                place, size = (middle, 0.0), (length, wide)
                if not across:
                    place, size = place[::-1], size[::-1]
                bays.append(Bay(kind, float(r), place, size))
        return bays

    def share_below(self, bay: Bay) -> float:
        """Return the share of the front's height that ends with `bay`."""
        return 0.5 + (bay.center[1] + bay.size[1] / 2) / self.face[1]


def draw_cabinet(rng: Rng, width: Pair, height: Pair, depth: Pair, low: float = 0.0) -> Cabinet:
    """Draw sizes within ranges, the bevel, and the sides of a cabinet `low` above the ground."""
    w, h, d = rng.uniform(*width), rng.uniform(*height), rng.uniform(*depth)
    side = draw(rng, ["straight", "tapered", "bowed"], [0.6, 0.15, 0.25])
    back = 1.0 if side == "straight" else rng.uniform(0.4, 0.8)
    curve = rng.uniform(1.8, 3.0) if side == "bowed" else 1.0
    return Cabinet(w, h, d, (0, low, 0), bevel=w * rng.uniform(0.02, 0.1), back=back, curve=curve)


def two_way(rng: Rng, width: float) -> Units:
    """Draw one or two cones, a tweeter and perhaps a port, from below up."""
    big = width * rng.uniform(0.32, 0.46)
    units: Units = [("woofer", big)]
    if rng.random() < 0.25:
        units.append(("woofer", big * rng.uniform(0.6, 1.0)))
    treble = "horn" if rng.random() < 0.12 else "tweeter"
    units.append((treble, width * (0.38 if treble == "horn" else rng.uniform(0.15, 0.26))))
    if rng.random() < 0.2:
        units.reverse()
    if rng.random() < 0.35:
        kind = draw(rng, ["port", "slot"])
        units.insert(0, (kind, width * (rng.uniform(0.12, 0.2) if kind == "port" else 0.35)))
    return units


def _rectangle(width: float, height: float) -> Array:
    """Return points (k, 2) evenly around a rectangle, counterclockwise from its lower left."""
    t, one = 2 * np.arange(7) / 7 - 1, np.ones(7)  # seven points on each side
    sides = [(t, -one), (one, t), (-t, one), (-one, -t)]
    return np.concatenate([np.stack(s, 1) for s in sides]) * np.array([width, height]) / 2


def _lift(flat: Array, z: float, center: ArrayLike = (0, 0)) -> Array:
    """Return (k, 2) points as (k, 3) at depth `z`, moved by `center`."""
    return np.column_stack([flat + np.asarray(center), np.full(len(flat), z)])


def add_cabinet(b: Builder, cabinet: Cabinet, finish: Finish, bays: Sequence[Bay]) -> None:
    """Add a cabinet whose front is tiled by `bays`, with everything mounted in them."""
    slope = np.tan(np.radians(cabinet.tilt))
    rows = [(0.0, cabinet.bevel), (0.4 * cabinet.bevel, 0.3 * cabinet.bevel)]
    deep = cabinet.depth - cabinet.bevel
    rows += [(cabinet.bevel + t * deep, 0.0) for t in np.linspace(0, 1, 6)]
    rings = []
    for z, inset in rows:
        share = 1 - (1 - cabinet.back) * (z / cabinet.depth) ** cabinet.curve
        flat = _rectangle(cabinet.width * share - 2 * inset, cabinet.height - 2 * inset)
        # The underside stays level however far the front leans back.
        flat[:, 1] += (0.5 - flat[:, 1] / cabinet.height) * slope * z
        rings.append(_lift(flat, z))
    b.loft("body", finish.body, [cabinet.world(r) for r in rings], caps=False)
    ends = [rings[-1], rings[-1] * vec(0.03, 0.03, 1) + rings[-1][:, 1].mean() * UP]
    b.loft("body", finish.body, [cabinet.world(r) for r in ends], caps=False)
    for bay in bays:
        _add_bay(b, cabinet, finish, bay)


def _add_bay(b: Builder, cabinet: Cabinet, finish: Finish, bay: Bay) -> None:
    """Add a bay's board, with a hole where one is needed, and what is mounted in it."""
    outer = _rectangle(*bay.size)
    if bay.kind in ("horn", "slot"):
        hole = _rectangle(2 * bay.radius, bay.radius * (0.9 if bay.kind == "horn" else 0.3))
    else:
        angles = np.arctan2(outer[:, 1], outer[:, 0])
        reach = 0.93 * bay.radius if bay.radius else 0.03 * min(bay.size)
        hole = reach * np.stack([np.cos(angles), np.sin(angles)], 1)
    board = [cabinet.world(_lift(flat, 0, bay.center)) for flat in (outer, hole)]
    b.loft("body", finish.body, board, caps=False)
    if bay.kind == "blank":
        return
    center = cabinet.world((*bay.center, 0))
    deep = min(0.6 * cabinet.depth, 1.2 * bay.radius)
    if bay.kind in ("horn", "slot"):
        scales = [(1.08, 0), (1.08, -0.012), (0.95, -0.012), (0.6, 0.4 * deep), (0.3, 0.8 * deep)]
        rings = [cabinet.world(_lift(s * hole, z, bay.center)) for s, z in scales]
        b.loft("port" if bay.kind == "slot" else "driver", finish.rim, rings, caps=False)
        throat = [cabinet.world(_lift(s * hole, 0.79 * deep, bay.center)) for s in (0.32, 0.02)]
        b.loft("port", BLACK, throat, caps=False)
    elif bay.kind == "port":
        port(b, finish, center, bay.radius, deep, cabinet.turn)
    else:
        driver(b, finish, bay.kind, center, bay.radius, cabinet.turn)
