"""Cars for work: van, bus, pickup and lorry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.car.body import CHROME, draw_paint, face, hood, shell, walls
from ffd_lightning.shapes.car.cabin import (
    Cabin,
    cabin,
    closed_car,
    draw_glass,
    fittings,
    upper_sides,
)
from ffd_lightning.shapes.car.stance import Stance, draw_stance, with_profile
from ffd_lightning.shapes.car.wheels import wheels
from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.paths import bend


def van(rng: Rng) -> Builder:
    """Draw a van: panel van or people carrier, its bonnet short or none."""
    b, panel = Builder(), rng.random() < 0.45
    stance = draw_stance(
        rng, length=(3.6, 6.0), width=(1.7, 2.1), radius=(0.3, 0.36), clearance=(0.18, 0.3)
    )
    stance = replace(stance, nose=rng.uniform(0.92, 0.98))
    half, belt = stance.length / 2, rng.uniform(1.0, 1.2)
    cowl, rear = -half + rng.uniform(0.12, 0.75), half - 0.05
    stance = with_profile(
        stance,
        nose=belt - rng.uniform(0.08, 0.25),
        cowl=(cowl, belt),
        deck=(rear - 0.3, belt),
        tail=belt,
    )
    belt = stance.top(cowl)
    high = belt + rng.uniform(0.7, 1.3)
    roof = (cowl + rng.uniform(0.3, 0.8), rear - rng.uniform(0.02, 0.12))
    widths = (0.9 * stance.width, rng.uniform(0.76, 0.88) * stance.width)
    count = 1 if panel else int(rng.integers(2, 5))
    shape = Cabin(
        belt=(cowl, rear),
        roof=roof,
        heights=(belt, high),
        widths=widths,
        pillars=tuple(np.linspace(0, 1, count + 2)[1:-1]) if not panel else (0.3,),
        pillar=rng.uniform(0.08, 0.14),
    )
    paint = closed_car(b, rng, stance, shape)
    upper_sides(b, paint, shape, blind=0.3 if panel else None, lintel=rng.uniform(0.7, 0.85))
    return b


def bus(rng: Rng) -> Builder:
    """Draw a bus: long, upright, many windows; some have two decks or three axles."""
    b, paint, glass = Builder(), draw_paint(rng), draw_glass(rng)
    length, width, r = rng.uniform(6.5, 13), rng.uniform(2.3, 2.6), rng.uniform(0.42, 0.52)
    half, belt, tall = length / 2, rng.uniform(1.25, 1.6), rng.uniform(1.1, 1.4)
    front, rear = rng.uniform(1.5, 2.6) - half, half - rng.uniform(2, 3.2)
    twin = length > 10.5 and rng.random() < 0.4
    axles = (front, rear, rear + 2.5 * r) if twin else (front, rear)
    profile = ((-half, belt - 0.04), (0.0, belt), (half, belt))
    stance = Stance(
        length=length, width=width, axles=axles, radius=r, clearance=0.3, profile=profile, nose=0.95
    )
    shell(b, paint, stance)
    rake, gap, lintel = rng.uniform(0.02, 0.3), rng.uniform(1.2, 2.2), rng.uniform(0.75, 0.9)
    decks = 1 + int(rng.random() < 0.25)
    bays = min(round(length / gap), 9 if decks == 1 else 4)
    pillars = tuple(np.linspace(0, 1, bays + 1)[1:-1])
    for deck in range(decks):
        low = belt + deck * (tall + 0.45)
        if deck:
            size = (0.98 * width, 0.5, length - 0.04)  # a little proud of the glass
            b.rounded_box("body", paint, (0, low - 0.2, 0), size, 0.1, segments=2)
        ends, widths = (0.04 - half, half - 0.04), (0.97 * width, 0.93 * width)
        shape = Cabin(
            belt=ends,
            roof=(ends[0] + rake, half - 0.1),
            heights=(low, low + tall),
            widths=widths,
            pillars=pillars,
            pillar=0.08,
        )
        cabin(b, paint, glass, shape, paint)
        upper_sides(b, paint, shape, blind=None, lintel=lintel)
    face(b, rng, stance, paint)
    wheels(b, rng, stance)
    _livery(b, draw_paint(rng), glass, stance, belt, belt + tall)
    return b


def _livery(
    b: Builder, stripe: Material, glass: Material, stance: Stance, belt: float, roof: float
) -> None:
    """Add a bus's coloured stripes and, on its kerb side, the front door."""
    for side in (-0.495, 0.495):
        center = (side * stance.width, belt - 0.2, 0.1)
        b.box("body", stripe, center, (0.05, 0.14, 0.55 * stance.length))
    door = (0.5 * stance.width, 0.17 + 0.45 * roof, 0.75 - stance.length / 2)
    b.box("window", glass, door, (0.05, 0.8 * (roof - 0.5), 0.7))


def pickup(rng: Rng) -> Builder:
    """Draw a pickup or a lorry: a cab, and behind it an open bed or a box."""
    b, paint, glass = Builder(), draw_paint(rng), draw_glass(rng)
    stance = draw_stance(
        rng, length=(4.4, 6.0), width=(1.7, 2.1), radius=(0.34, 0.44), clearance=(0.26, 0.4)
    )
    half, floor = stance.length / 2, 2.13 * stance.radius + 0.07
    belt = max(rng.uniform(1.05, 1.2), floor + 0.12)
    cowl = -half + rng.uniform(0.7, 1.5)
    back = cowl + rng.uniform(1.3, 2.2)
    rows = [(-half, belt - 0.25), (-half + 0.06, belt - 0.12), (cowl, belt), (back + 0.04, belt)]
    rows += [(back + 0.05, floor), (half, floor)]
    stance = replace(stance, nose=rng.uniform(0.88, 0.96), profile=tuple(rows))
    high = belt + rng.uniform(0.45, 0.7)
    shape = Cabin(
        belt=(cowl, back),
        roof=(cowl + rng.uniform(0.3, 0.6), back - rng.uniform(0.02, 0.2)),
        heights=(belt, high),
        widths=(0.88 * stance.width, rng.uniform(0.7, 0.82) * stance.width),
        pillars=(0.5,) if back - cowl > 1.7 else (),
        pillar=0.08,
    )
    shell(b, paint, stance)
    cabin(b, paint, glass, shape, paint)
    hood(b, paint, stance, (-half + 0.15, cowl - 0.06))
    fittings(b, rng, stance, paint, shape)
    if rng.random() < 0.3:
        tall = rng.uniform(1.1, 1.7)
        center = (0, floor + tall / 2, (back + half) / 2 + 0.06)
        size = (stance.width, tall, half - back - 0.12)
        b.rounded_box("body", draw_paint(rng), center, size, 0.04)
        return b
    ends = (back + 0.05, half - 0.01)
    walls(b, paint, stance, ends=ends, span=(floor - 0.2, belt), thickness=0.07)
    if rng.random() < 0.3:
        x, z = 0.46 * stance.width - 0.06, back + 0.2
        hoop = [(-x, belt - 0.05, z), (-0.85 * x, high, z), (0.85 * x, high, z)]
        hoop += [(x, belt - 0.05, z)]
        b.tube("trim", CHROME, bend(hoop, 0.12, 3), 0.03, segments=8)
    return b
