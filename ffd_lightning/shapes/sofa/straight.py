"""Straight sofas, and chesterfields."""

from __future__ import annotations

from dataclasses import replace

from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.seat_backs import add_arm, add_loose_back, add_tight_back, add_tufts
from ffd_lightning.shapes.kit.upholstery import add_base, add_feet, add_seat_cushions, draw_seating
from ffd_lightning.shapes.kit.vectors import vec
from ffd_lightning.shapes.sofa.pillows import throw_pillows


def straight(rng: Rng) -> Builder:
    """Build a sofa for one to four with any arms and a tight or cushioned back."""
    b = Builder()
    s = draw_seating(rng, int(rng.choice([1, 2, 3, 4], p=[0.1, 0.35, 0.4, 0.15])))
    add_base(b, s)
    one = replace(s, seats=1) if rng.random() < 0.2 else s
    add_seat_cushions(b, one)
    kind = draw(rng, ["loose", "tight", "tufted"], [0.55, 0.3, 0.15])
    if kind == "loose":
        add_loose_back(b, s, rng.uniform(0.0, 0.14))
    else:
        add_tight_back(b, s, s.width + s.arm)
        if kind == "tufted":
            add_tufts(b, s, width=s.width, rows=int(rng.integers(2, 4)), columns=4 * s.seats)
    for side in (-1, 1):
        add_arm(b, s, side)
    add_feet(b, rng, s)
    throw_pillows(b, rng, s)
    return b


def chesterfield(rng: Rng) -> Builder:
    """Build a sofa whose rolled arms run on into a rolled, buttoned back of the same height."""
    b = Builder()
    s = draw_seating(rng, int(rng.integers(1, 5)), arms=("rolled",))
    rise = rng.uniform(0.24, 0.34)
    s = replace(s, arm_rise=rise, back=rise, rake=4.0, arm=rng.uniform(0.17, 0.25), pillows=s.cover)
    add_base(b, s)
    add_seat_cushions(b, s, front=0.03)
    add_tight_back(b, s, s.width + s.arm)
    r = 0.58 * s.arm
    crest = vec(0, s.seat + rise - 0.3 * r, s.depth / 2 - 0.3 * s.thick)
    half = vec(s.span / 2, 0, 0)
    b.cylinder("back", s.cover, crest - half, crest + half, r)
    add_tufts(b, s, width=s.width, rows=int(rng.integers(2, 4)), columns=5 * s.seats)
    for side in (-1, 1):
        add_arm(b, s, side)
    add_feet(b, rng, s)
    return b
