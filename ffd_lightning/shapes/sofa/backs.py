"""Backs and arms of sofas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng, draw, nothing, pick_material
from ffd_lightning.shapes.kit.boards import beam, enclose, pad
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.seat_backs import (
    add_arm,
    add_loose_back,
    add_tight_back,
    add_tufts,
    back_point,
)
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.upholstery import ARMS
from ffd_lightning.shapes.kit.vectors import Array, vec
from ffd_lightning.shapes.sofa.plan import Plan


def loose(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a panel and a cushion per seat before it, sometimes pillows."""
    add_loose_back(b, p, rng.uniform(0.0, 0.35) * p.back)
    _pillows(b, rng, p)


def _pillows(b: Builder, rng: Rng, p: Plan) -> None:
    """Throw up to three small pillows against the back."""
    for _ in range(int(rng.integers(0, 4)) if rng.random() < 0.4 else 0):
        size, x = rng.uniform(0.3, 0.42), rng.uniform(-0.38, 0.38) * p.width
        at = back_point(p, x, 0.46 * size, -0.95 * p.thick)
        pad(b, "back", pick_material(rng, "fabric"), at, (size, size, 0.11), 0.06, p.rake + 12)


def tight(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one padded panel, sometimes buttoned."""
    add_tight_back(b, p, p.width + p.arm)
    if rng.random() < 0.4:
        add_tufts(b, p, width=p.width, rows=int(rng.integers(2, 4)), columns=3 * p.seats)


def rolled(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a buttoned panel and a roll on it that runs on into the arms."""
    add_tight_back(b, p, p.width + p.arm)
    add_tufts(b, p, width=p.width, rows=int(rng.integers(2, 4)), columns=4 * p.seats)
    r = 0.58 * p.arm
    crest = vec(0, p.seat + p.back - 0.3 * r, p.depth / 2 - 0.3 * p.thick)
    half = vec(p.span / 2, 0, 0)
    b.cylinder("back", p.cover, crest - half, crest + half, r)


def _outlined(b: Builder, p: Plan, xs: Array, tops: Array) -> None:
    """Add a back up to `tops` above the seat at `xs`."""
    rows = np.linspace(0, 1, 7)[:, None] * (tops + 0.15) - 0.15
    grid = [[back_point(p, x, y) for x, y in zip(xs, row, strict=True)] for row in rows]
    sheet(b, "back", p.cover, grid, 0.8 * p.thick)


def camel(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a back with up to a hump per seat."""
    humps, u = int(rng.integers(1, p.seats + 1)), np.linspace(-1, 1, 33)
    arch = np.abs(np.sin(np.pi * humps * (u + 1) / 2)) ** (2 if humps == 1 else 0.7)
    tops = 0.8 * p.back + rng.uniform(0.08, 0.25) * arch
    _outlined(b, p, u * (p.width + p.arm) / 2, tops)
    _pillows(b, rng, p)


def falling(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a back that falls away from the end that has the arm."""
    u, low, wide = np.linspace(0, 1, 21), rng.uniform(0.06, 0.15), p.width + 0.6 * p.arm
    xs = p.ends[0] * (wide / 2 - u * rng.uniform(0.45, 0.97) * wide)
    fall = 0.5 + 0.5 * np.cos(np.pi * u ** rng.uniform(0.7, 2.0))
    _outlined(b, p, xs, low + (max(p.arm_rise, 0.2) - low) * fall)


def channels(b: Builder, rng: Rng, p: Plan) -> None:
    """Add upright rolls side by side, their tops level or in an arch."""
    wide = p.width + p.arm
    count = max(3, p.seats * int(rng.integers(1, 4)))
    low, arch = -0.3 * p.seat, rng.uniform(0.0, 0.4) * (rng.random() < 0.5)
    for u in (np.arange(count) + 0.5) / count * 2 - 1:
        top = p.back * (1 - arch * u * u)
        size = (1.02 * wide / count, top - low, p.thick)
        pad(b, "back", p.cover, back_point(p, u * wide / 2, (top + low) / 2), size, 0.08, p.rake)


def rests(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a low panel and a thick rest for the head on it at each seat."""
    low, wide = rng.uniform(0.5, 0.75) * p.back, p.width / p.seats
    add_tight_back(b, replace(p, back=low), p.width + p.arm)
    for i in range(p.seats):
        size = (0.96 * wide, p.back - low + 0.03, 0.8 * p.thick)
        at = back_point(p, (i + 0.5) * wide - p.width / 2, (p.back + low) / 2, -0.1 * p.thick)
        pad(b, "back", p.pillows, at, size, 0.06, p.rake + rng.choice([0, 8]))


def railing(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a railing around the back and both ends, often cushions before it."""
    tops = corners(p.width + p.arm - 0.04, p.depth - 0.04, p.deck + p.back)
    tops[:2, 1] -= rng.uniform(0.0, 0.6) * p.back
    for top in tops:
        beam(b, "back", p.frame, top * vec(1, 0, 1), top, width=0.05, height=0.05)
    fill, gap = draw(rng, ["bars", "slats", "panel"]), rng.uniform(0.08, 0.2)
    enclose(b, p.frame, tops, deck=p.deck - 0.04, fill=fill, gap=gap)
    wide, soft = p.width / p.seats, rng.uniform(0.1, 0.2)
    for i in range(p.seats if rng.random() < 0.7 else 0):
        at = ((i + 0.5) * wide - p.width / 2, p.seat + 0.17, p.depth / 2 - 0.09 - soft / 2)
        pad(b, "back", p.pillows, at, (0.97 * wide, 0.38, soft), 0.06, 10)


def upholstered(b: Builder, rng: Rng, p: Plan) -> None:
    """Add padded or open arms."""
    for side in p.ends:
        add_arm(b, p, side)


def bolsters(b: Builder, rng: Rng, p: Plan) -> None:
    """Add rolls that lie on the ends of the seat."""
    r, half = rng.uniform(0.07, 0.12), vec(0, 0, 0.46 * (p.depth - p.thick))
    for side in p.ends:
        middle = vec(side * (p.width / 2 - r), p.seat + 0.93 * r, -p.thick / 2)
        b.cylinder("arm", p.pillows, middle - half, middle + half, r)


_BROAD = {"layout": ("straight", "stool", "ell", "corner", "u", "curved")}
_BOX = _BROAD | {"base": ("feet", "plinth", "sled", "slab")}
_ALONE = ("straight", "stool")
BACKS = (
    Component("loose", 2, loose, _BROAD),
    Component("tight", 2, tight, _BOX),
    Component("rolled", 1.2, rolled, {"layout": (*_ALONE, "curved"), "base": ("feet", "plinth")}),
    Component("camel", 1.2, camel, _BOX | {"layout": (*_ALONE, "curved")}),
    Component("channels", 1.3, channels, _BOX),
    Component("rests", 1.4, rests, _BROAD),
    Component("railing", 3, railing, {"layout": _ALONE, "base": ("frame",)}),
    Component("open", 0.8, nothing, {"layout": _ALONE}),
    Component("falling", 1, falling, {"layout": ("longue",)}),
)
_PADDED = ("loose", "tight", "camel", "channels", "rests", "open", "falling")
ARM_KINDS = (
    *(Component(name, 1, upholstered, {"back": _PADDED}) for name in ARMS if name != "rolled"),
    Component("rolled", 1, upholstered, {"back": (*_PADDED, "rolled")}),
    Component("none", 1.2, nothing, _BROAD | {"back": ("railing", *_PADDED)}),
    Component("bolsters", 1, bolsters, {"back": ("tight", "channels", "open", "loose"), **_BROAD}),
)
