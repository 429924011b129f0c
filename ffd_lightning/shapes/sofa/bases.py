"""What a sofa stands on, and its seats."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng, pick_material
from ffd_lightning.shapes.kit.boards import rails
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.upholstery import add_base, add_feet, add_seat_cushions
from ffd_lightning.shapes.kit.vectors import UP
from ffd_lightning.shapes.sofa.plan import Plan


def feet(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box on short legs; arms that stand on the floor do without."""
    add_base(b, p)
    add_feet(b, rng, p, None if p.ends else p.width + p.arm)


def plinth(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box on a plinth."""
    add_base(b, p)
    inset, tall = rng.choice([0.03, 0.2]), p.foot + 0.02
    size = (p.width + p.arm - inset, tall, p.depth - inset)
    dark = pick_material(rng, "rubber") if rng.random() < 0.5 else p.frame
    b.rounded_box("leg", dark, (0, tall / 2, 0), size, 0.02)


def sled(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box on frames of bars."""
    add_base(b, p)
    bar, half, z = rng.uniform(0.018, 0.04), p.width / 2 - 0.06, p.depth / 2 - 0.08
    for x in np.linspace(-half, half, 3 if half > 0.9 else 2):
        ring = [(x, 0, z), (x, p.foot, z), (x, p.foot, -z), (x, 0, -z)]
        rails(b, "leg", p.frame, np.array(ring) + bar / 2 * UP, width=bar, height=bar)


def frame(b: Builder, rng: Rng, p: Plan) -> None:
    """Add rails and a board on long legs."""
    width, depth = p.width + p.arm - 0.04, p.depth - 0.04
    ring = corners(width, depth, p.deck - 0.04)
    rails(b, "seat", p.frame, ring, width=0.035, height=0.08)
    b.box("seat", p.frame, (0, p.deck - 0.02, 0), (width, 0.03, depth))
    add_feet(b, rng, replace(p, foot=p.deck - 0.03), p.width + p.arm + 0.06)


def slab(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box on a broad board on short legs."""
    over = rng.uniform(0.02, 0.2)
    size = (p.span + over, 0.045, p.depth + over)
    b.rounded_box("leg", p.frame, (0, p.foot - 0.018, 0), size, 0.03, edge=0.01)
    feet(b, rng, p)


def cushions(b: Builder, rng: Rng, p: Plan, wide: float) -> None:
    """Add cushions about as wide as told."""
    one = replace(p, seats=max(1, round(p.width / wide)))
    add_seat_cushions(b, one, front=rng.uniform(0.0, 0.04))


def each(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a cushion at each seat, sometimes two."""
    low = p.cushion * (rng.uniform(0.4, 0.6) if rng.random() < 0.3 else 0)
    if low:
        add_seat_cushions(b, replace(p, seats=1, seat=p.seat - p.cushion + low, cushion=low))
    add_seat_cushions(b, replace(p, cushion=p.cushion - low), front=rng.uniform(0.0, 0.04))


BASES = (
    Component("feet", 5, feet),
    Component("plinth", 2, plinth),
    Component("sled", 1, sled),
    Component("frame", 3, frame),
    Component("slab", 0.6, slab, {"layout": ("straight", "stool", "longue")}),
)
SEATS = (
    Component("each", 5, each),
    Component("bench", 2, partial(cushions, wide=5)),
    Component(
        "rolls",
        0.8,
        partial(cushions, wide=0.22),
        {"layout": ("straight", "stool", "longue")},
    ),
)
