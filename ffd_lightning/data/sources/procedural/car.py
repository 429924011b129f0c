"""Cars: saloon, estate, off-roader, van, bus, pickup, roadster, vintage, formula."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.data.sources.procedural.car_parts import (
    BLACK,
    CHROME,
    Cabin,
    Stance,
    cabin,
    doors,
    draw_glass,
    draw_paint,
    face,
    hood,
    mirrors,
    shell,
    walls,
    wheel,
    wheels,
)
from ffd_lightning.data.sources.procedural.formula_car import formula
from ffd_lightning.data.sources.procedural.furniture import beam, draw
from ffd_lightning.data.sources.procedural.shapes import (
    Builder,
    Family,
    Material,
    pick_material,
    rotation,
)
from ffd_lightning.data.sources.procedural.vintage_car import vintage

PARTS = ("body", "roof", "hood", "window", "wheel", "light", "trim", "seat")


def _axles(
    rng: np.random.Generator, length: float, radius: float, front: float
) -> tuple[float, float]:
    """Draw the axles' z; `front` is the front overhang in tyre radii."""
    first = -length / 2 + radius * front
    rear = length / 2 - radius * rng.uniform(1.9, 2.8)
    return first, rear


def _stance(
    rng: np.random.Generator,
    length: tuple[float, float],
    width: tuple[float, float],
    radius: tuple[float, float],
    clearance: tuple[float, float],
) -> Stance:
    """Draw a car's size within these ranges; its profile is still to be set."""
    long, r = rng.uniform(*length), rng.uniform(*radius)
    axles = _axles(rng, long, r, rng.uniform(2.0, 2.8))
    low = min(rng.uniform(*clearance), 0.9 * r)
    return Stance(long, rng.uniform(*width), axles, r, low, (), rng.uniform(0.78, 0.9))


def _with_profile(
    stance: Stance, nose: float, cowl: tuple[float, float], deck: tuple[float, float], tail: float
) -> Stance:
    """Set a profile: heights of nose and tail, (z, height) of the cowl and of the deck's front."""
    half = stance.length / 2
    least = 2.13 * stance.radius + 0.06  # the wheel arches must fit below the bonnet
    rows = [(-half, nose - 0.08), (-half + 0.08, nose), (-half + 0.35, max(nose + 0.05, least))]
    rows += [(cowl[0], max(cowl[1], least + 0.03)), (deck[0], max(deck[1], least + 0.03))]
    rows += [(half - 0.2, max(tail + 0.02, least)), (half - 0.04, tail), (half, tail - 0.07)]
    return replace(stance, profile=tuple(rows))


def _finish(
    b: Builder, rng: np.random.Generator, stance: Stance, paint: Material, shape: Cabin
) -> None:
    """Add what all closed cars share: lights, wheels, doors, mirrors."""
    face(b, rng, stance, paint)
    wheels(b, rng, stance)
    front, rear = shape.belt
    seams = [front + t * (rear - front) for t in (0.12, *shape.pillars)]
    doors(b, stance, seams, shape.heights[0])
    mirrors(b, paint, shape.point(0.07, -0.02, 1))


def _closed_car(
    b: Builder,
    rng: np.random.Generator,
    stance: Stance,
    shape: Cabin,
    glass: Material,
) -> Material:
    """Add body, cabin and fittings; return the paint."""
    paint = draw_paint(rng)
    roof = paint if rng.random() < 0.8 else draw_paint(rng)
    shell(b, paint, stance)
    cabin(b, paint, glass, shape, roof)
    hood(b, paint, stance, (-stance.length / 2 + 0.2, shape.belt[0] - 0.06))
    _finish(b, rng, stance, paint, shape)
    return paint


def saloon(rng: np.random.Generator) -> Builder:
    """Draw a saloon or coupé: bonnet, cabin, boot; sporty ones are low with a spoiler."""
    b, sporty = Builder(), rng.random() < 0.4
    stance = _stance(rng, (3.9, 5.2), (1.65, 1.95), (0.29, 0.35), (0.14, 0.24))
    belt = rng.uniform(0.78, 0.86) if sporty else rng.uniform(0.86, 0.98)
    half = stance.length / 2
    cowl = -half + stance.length * rng.uniform(0.26, 0.34)
    rear = half - stance.length * rng.uniform(0.08, 0.19)
    stance = _with_profile(
        stance,
        belt - rng.uniform(0.12, 0.25),
        (cowl, belt),
        (rear, belt + 0.02),
        belt - rng.uniform(-0.02, 0.1),
    )
    belt = stance.top(cowl)
    high = belt + (rng.uniform(0.34, 0.42) if sporty else rng.uniform(0.42, 0.58))
    roof = (cowl + rng.uniform(0.5, 0.85), rear - rng.uniform(0.4, 1.0))
    widths = (0.86 * stance.width, rng.uniform(0.62, 0.72) * stance.width)
    pillars = (0.55,) if sporty or rng.random() < 0.3 else (0.42, 0.74)
    shape = Cabin((cowl, rear), roof, (belt, high), widths, pillars, rng.uniform(0.05, 0.08))
    paint = _closed_car(b, rng, stance, shape, draw_glass(rng))
    if sporty and rng.random() < 0.7:
        _spoiler(b, rng, stance, paint)
    return b


def _spoiler(b: Builder, rng: np.random.Generator, stance: Stance, paint: Material) -> None:
    """Add a wing on two struts over the tail."""
    z, rise = stance.length / 2 - 0.2, rng.uniform(0.08, 0.28)
    y, half = stance.top(z), 0.9 * stance.half_width(z)
    b.rounded_box("trim", paint, (0, y + rise, z + 0.04), (2 * half, 0.045, 0.26), 0.06, 0.02)
    for side in (-0.7, 0.7):
        beam(
            b,
            "trim",
            paint,
            (side * half, y - 0.03, z),
            (side * half, y + rise, z + 0.03),
            0.04,
            0.12,
        )


def estate(rng: np.random.Generator) -> Builder:
    """Draw a hatchback, estate or minivan: the roof reaches the tail."""
    b = Builder()
    stance = _stance(rng, (3.2, 5.0), (1.55, 1.9), (0.27, 0.34), (0.15, 0.25))
    half, belt = stance.length / 2, rng.uniform(0.86, 1.02)
    cowl = -half + rng.uniform(0.75, 1.35)
    rear = half - rng.uniform(0.06, 0.16)
    stance = _with_profile(
        stance, belt - rng.uniform(0.1, 0.22), (cowl, belt), (rear - 0.3, belt + 0.03), belt
    )
    belt = stance.top(cowl)
    high = belt + rng.uniform(0.45, 0.72)
    roof = (cowl + rng.uniform(0.4, 0.9), rear - rng.uniform(0.08, 0.5))
    widths = (0.87 * stance.width, rng.uniform(0.66, 0.76) * stance.width)
    pillars = (0.36, 0.66) if stance.length > 3.9 else (0.5,)
    shape = Cabin((cowl, rear), roof, (belt, high), widths, pillars, rng.uniform(0.06, 0.1))
    _closed_car(b, rng, stance, shape, draw_glass(rng))
    if rng.random() < 0.35:
        _roof_rails(b, rng, shape)
    return b


def _roof_rails(b: Builder, rng: np.random.Generator, shape: Cabin) -> None:
    """Add two rails along the roof, with or without cross-bars or a box on them."""
    y, half = shape.heights[1] + 0.1, 0.36 * shape.widths[1]
    front, rear = shape.roof[0] + 0.2, shape.roof[1] - 0.15
    for side in (-half, half):
        beam(b, "trim", BLACK, (side, y, front), (side, y, rear), 0.035, 0.035)
        for z in (front + 0.03, rear - 0.03):
            b.box("trim", BLACK, (side, y - 0.05, z), (0.035, 0.12, 0.06))
    for t in np.linspace(0.2, 0.8, int(rng.integers(0, 4))):
        z = front + t * (rear - front)
        beam(b, "trim", BLACK, (-half, y + 0.02, z), (half, y + 0.02, z), 0.05, 0.025)


def off_roader(rng: np.random.Generator) -> Builder:
    """Draw an off-roader: tall, boxy, high off the ground; often with a spare wheel behind."""
    b = Builder()
    stance = _stance(rng, (3.6, 5.0), (1.7, 2.05), (0.36, 0.46), (0.28, 0.42))
    stance = replace(stance, nose=rng.uniform(0.88, 0.97))
    half, belt = stance.length / 2, rng.uniform(1.05, 1.2)
    cowl, rear = -half + stance.length * rng.uniform(0.27, 0.36), half - 0.06
    stance = _with_profile(
        stance, belt - rng.uniform(0.03, 0.15), (cowl, belt), (rear - 0.3, belt), belt
    )
    belt = stance.top(cowl)
    high = belt + rng.uniform(0.5, 0.72)
    roof = (cowl + rng.uniform(0.12, 0.5), rear - rng.uniform(0.03, 0.25))
    widths = (0.88 * stance.width, rng.uniform(0.74, 0.84) * stance.width)
    pillars = (0.36, 0.68) if rng.random() < 0.65 else (0.45,)
    shape = Cabin((cowl, rear), roof, (belt, high), widths, pillars, rng.uniform(0.07, 0.11))
    paint = _closed_car(b, rng, stance, shape, draw_glass(rng))
    if rng.random() < 0.55:
        _roof_rails(b, rng, shape)
    if rng.random() < 0.5:
        turn, y = rotation((1, 0, 0), 90), stance.clearance + 0.6 * (belt - stance.clearance)
        r = 0.85 * stance.radius
        profile = [
            (0.3 * r, -0.1),
            (0.9 * r, -0.1),
            (r, -0.05),
            (r, 0.06),
            (0.9 * r, 0.1),
            (0.55 * r, 0.11),
            (0.05, 0.12),
        ]
        b.lathe("wheel", BLACK, profile, (0, y + 0.05, half + 0.08), 24, turn)
    for side in (-1, 1):
        z = np.array(stance.axles) + np.array([1, -1]) * 1.2 * stance.radius
        x = side * (stance.width / 2 + 0.02)
        beam(
            b,
            "trim",
            paint if rng.random() < 0.3 else BLACK,
            (x, stance.clearance, z[0]),
            (x, stance.clearance, z[1]),
            0.14,
            0.06,
        )
    return b


def van(rng: np.random.Generator) -> Builder:
    """Draw a van: panel van or people carrier, its bonnet short or none."""
    b, panel = Builder(), rng.random() < 0.45
    stance = _stance(rng, (3.6, 6.0), (1.7, 2.1), (0.3, 0.36), (0.18, 0.3))
    stance = replace(stance, nose=rng.uniform(0.86, 0.95))
    half, belt = stance.length / 2, rng.uniform(1.0, 1.2)
    cowl, rear = -half + rng.uniform(0.12, 0.75), half - 0.05
    stance = _with_profile(
        stance, belt - rng.uniform(0.08, 0.25), (cowl, belt), (rear - 0.3, belt), belt
    )
    belt = stance.top(cowl)
    high = belt + rng.uniform(0.7, 1.3)
    roof = (cowl + rng.uniform(0.3, 0.8), rear - rng.uniform(0.02, 0.12))
    widths = (0.9 * stance.width, rng.uniform(0.76, 0.88) * stance.width)
    count = 1 if panel else int(rng.integers(2, 5))
    pillars = tuple(np.linspace(0, 1, count + 2)[1:-1]) if not panel else (0.3,)
    shape = Cabin((cowl, rear), roof, (belt, high), widths, pillars, rng.uniform(0.08, 0.14))
    paint = _closed_car(b, rng, stance, shape, draw_glass(rng))
    _upper_sides(b, paint, shape, 0.3 if panel else None, rng.uniform(0.7, 0.85))
    return b


def _upper_sides(
    b: Builder, paint: Material, shape: Cabin, blind: float | None, lintel: float
) -> None:
    """Close a tall cabin above `lintel`, and wholly behind the fraction `blind`."""
    bands = [(0.0, 1.0, lintel, 1.0)]
    if blind is not None:
        bands.append((blind, 1.0, -0.1, 1.0))
    for front, rear, low, high in bands:
        rings = []
        for up in (low, high):
            ends = [shape.point(t, up, 1) for t in (front, rear)]
            x = ends[0][0] + 0.012
            z0, z1 = ends[0][2] - 0.012 * (front == 0), ends[1][2] + 0.015
            rings.append(
                [
                    (x, ends[0][1], z0),
                    (x, ends[0][1], z1),
                    (-x, ends[0][1], z1),
                    (-x, ends[0][1], z0),
                ]
            )
        b.loft("body", paint, rings)


def bus(rng: np.random.Generator) -> Builder:
    """Draw a bus: long, upright, many windows; city or coach, some with two decks."""
    b, paint = Builder(), draw_paint(rng)
    length, width, r = rng.uniform(6.5, 13), rng.uniform(2.3, 2.6), rng.uniform(0.42, 0.52)
    axles = (-length / 2 + rng.uniform(1.5, 2.6), length / 2 - rng.uniform(2, 3.2))
    axles = (*axles, axles[1] + 2.5 * r) if length > 10.5 and rng.random() < 0.4 else axles
    belt, tall = rng.uniform(1.25, 1.6), rng.uniform(1.1, 1.4)
    stance = Stance(length, width, axles, r, 0.3, (), 0.95)
    half = length / 2
    stance = replace(stance, profile=((-half, belt - 0.04), (0, belt), (half, belt)))
    decks, glass = 1 + int(rng.random() < 0.25), draw_glass(rng)
    shell(b, paint, stance)
    for deck in range(decks):
        low = belt + deck * (tall + 0.45)
        rake = rng.uniform(0.02, 0.3)
        pillars = tuple(np.linspace(0, 1, round(length / rng.uniform(1.1, 1.9)) + 1)[1:-1])
        heights = (low, low + tall)
        shape = Cabin(
            (-half + 0.04, half - 0.04),
            (-half + 0.04 + rake, half - 0.1),
            heights,
            (0.97 * width, 0.93 * width),
            pillars,
            0.08,
        )
        if deck:
            b.rounded_box("body", paint, (0, low - 0.2, 0), (0.97 * width, 0.5, length - 0.08), 0.1)
        cabin(b, paint, glass, shape, paint)
        _upper_sides(b, paint, shape, None, rng.uniform(0.75, 0.9))
    face(b, rng, stance, paint)
    wheels(b, rng, stance)
    stripe = draw_paint(rng)
    for side in (-1, 1):
        b.box("body", stripe, (side * 0.495 * width, belt - 0.2, 0.1), (0.05, 0.14, 0.55 * length))
        door = (side * 0.5 * width, 0.35 + 0.45 * (belt + tall - 0.4), -half + 0.75)
        b.box("window", glass, door, (0.05, 0.8 * (belt + tall - 0.5), 0.7)) if side > 0 else None
    return b


def pickup(rng: np.random.Generator) -> Builder:
    """Draw a pickup or a lorry: a cab, and behind it an open bed or a box."""
    b, paint, glass = Builder(), draw_paint(rng), draw_glass(rng)
    stance = _stance(rng, (4.4, 6.0), (1.7, 2.1), (0.34, 0.44), (0.26, 0.4))
    stance = replace(stance, nose=rng.uniform(0.88, 0.96))
    half, belt = stance.length / 2, rng.uniform(1.05, 1.2)
    floor = 2.13 * stance.radius + 0.07
    belt = max(belt, floor + 0.12)
    cowl = -half + rng.uniform(0.7, 1.5)
    back = cowl + rng.uniform(1.3, 2.2)
    rows = [(-half, belt - 0.25), (-half + 0.06, belt - 0.12), (cowl, belt), (back + 0.04, belt)]
    rows += [(back + 0.05, floor), (half, floor)]
    stance = replace(stance, profile=tuple(rows))
    high = belt + rng.uniform(0.45, 0.7)
    widths = (0.88 * stance.width, rng.uniform(0.7, 0.82) * stance.width)
    pillars = (0.5,) if back - cowl > 1.7 else ()
    shape = Cabin(
        (cowl, back),
        (cowl + rng.uniform(0.3, 0.6), back - rng.uniform(0.02, 0.2)),
        (belt, high),
        widths,
        pillars,
        0.08,
    )
    shell(b, paint, stance)
    cabin(b, paint, glass, shape, paint)
    hood(b, paint, stance, (-half + 0.15, cowl - 0.06))
    _finish(b, rng, stance, paint, shape)
    if rng.random() < 0.3:
        tall, color = rng.uniform(1.1, 1.7), draw_paint(rng)
        center = (0, floor + tall / 2, (back + half) / 2 + 0.06)
        b.rounded_box("body", color, center, (stance.width, tall, half - back - 0.12), 0.04)
        return b
    walls(b, paint, stance, (back + 0.05, half - 0.01), (floor - 0.02, belt), 0.07)
    if rng.random() < 0.3:
        for side in (-1, 1):
            x = side * (0.46 * stance.width - 0.06)
            hoop = [(x, belt - 0.05, back + 0.2), (0.85 * x, high, back + 0.2)]
            beam(b, "trim", CHROME, *hoop, 0.05, 0.05)
        beam(
            b,
            "trim",
            CHROME,
            (0.85 * x, high, back + 0.2),
            (-0.85 * x, high, back + 0.2),
            0.05,
            0.05,
        )
    return b


def roadster(rng: np.random.Generator) -> Builder:
    """Draw an open car: a cockpit with seats, windscreen, steering wheel."""
    b, paint = Builder(), draw_paint(rng)
    stance = _stance(rng, (3.5, 4.7), (1.6, 1.9), (0.28, 0.34), (0.13, 0.22))
    half, belt = stance.length / 2, max(rng.uniform(0.76, 0.88), 2.13 * stance.radius + 0.1)
    front = -half + stance.length * rng.uniform(0.33, 0.42)
    room = rng.uniform(1.1, 1.9)
    rear, floor = min(front + room, stance.axles[1] - 1.13 * stance.radius - 0.05), 0.42
    stance = _with_profile(
        stance,
        belt - rng.uniform(0.14, 0.22),
        (front, belt),
        (rear, belt),
        belt - rng.uniform(0.02, 0.12),
    )
    rows = [row for row in stance.profile if not front < row[0] < rear]
    index = [z for z, _ in rows].index(front) + 1
    stance = replace(
        stance, profile=(*rows[:index], (front + 0.01, floor), (rear - 0.01, floor), *rows[index:])
    )
    belt = stance.top(front)
    shell(b, paint, replace(stance))
    walls(b, paint, stance, (front, rear), (floor - 0.03, belt), 0.09, (False, False))
    hood(b, paint, stance, (-half + 0.2, front - 0.08))
    face(b, rng, stance, paint)
    wheels(b, rng, stance)
    _cockpit(b, rng, stance, (front, rear), floor, belt)
    mirrors(b, paint, np.array([0.43 * stance.width, belt, front + 0.12]))
    return b


def _cockpit(
    b: Builder,
    rng: np.random.Generator,
    stance: Stance,
    ends: tuple[float, float],
    floor: float,
    belt: float,
) -> None:
    """Add the windscreen, one or two rows of seats and the steering wheel."""
    front, rear = ends
    rise, rake, half = rng.uniform(0.25, 0.42), rng.uniform(0.2, 0.4), 0.4 * stance.width
    glass = pick_material(rng, "glass")
    frame = [
        np.array([x, y, z])
        for x, y, z in (
            (-half, belt - 0.02, front - 0.05),
            (-0.85 * half, belt + rise, front + rake),
            (0.85 * half, belt + rise, front + rake),
            (half, belt - 0.02, front - 0.05),
        )
    ]
    for start, end in zip(frame, frame[1:], strict=False):
        beam(b, "window", BLACK, start, end, 0.035, 0.035)
    b.loft("window", glass, [np.array(frame) + shift for shift in ([0, 0, 0], [0, 0.004, 0.012])])
    cover, spread = pick_material(rng, "leather"), 0.21 * stance.width
    count = 2 if rear - front > 1.5 else 1
    for row in range(count):
        z = rear - 0.25 - 0.8 * row
        for side in (-spread, spread):
            b.rounded_box("seat", cover, (side, floor + 0.12, z - 0.22), (0.46, 0.2, 0.5), 0.08)
            back = (side, floor + 0.38, z + 0.06)
            b.rounded_box(
                "seat", cover, back, (0.46, 0.62, 0.16), 0.07, turn=rotation((1, 0, 0), 14)
            )
    hub = np.array([spread * rng.choice([-1, 1]), belt + 0.0, front + 0.3])
    b.cylinder("trim", BLACK, hub + [0, -0.1, -0.3], hub, 0.025, segments=8)
    ring = [(0.17, -0.015), (0.19, 0), (0.17, 0.015), (0.15, 0)]
    b.lathe("trim", BLACK, [*ring, ring[0]], hub, 20, rotation((1, 0, 0), 65))


FAMILIES: dict[str, Family] = {
    "saloon": saloon,
    "estate": estate,
    "off_roader": off_roader,
    "van": van,
    "bus": bus,
    "pickup": pickup,
    "roadster": roadster,
    "vintage": vintage,
    "formula": formula,
}
