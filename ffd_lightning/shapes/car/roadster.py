"""Open cars."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.car.body import BLACK, draw_paint, face, hood, shell, walls
from ffd_lightning.shapes.car.cabin import mirrors
from ffd_lightning.shapes.car.stance import Stance, draw_stance, with_profile
from ffd_lightning.shapes.car.wheels import wheels
from ffd_lightning.shapes.kit import Builder, Rng, pick_material
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.vectors import Pair, lean, vec


def roadster(rng: Rng) -> Builder:
    """Draw an open car: a cockpit with seats, windscreen, steering wheel."""
    b, paint = Builder(), draw_paint(rng)
    stance = draw_stance(
        rng, length=(3.5, 4.7), width=(1.6, 1.9), radius=(0.28, 0.34), clearance=(0.13, 0.22)
    )
    half, belt = stance.length / 2, max(rng.uniform(0.76, 0.88), 2.13 * stance.radius + 0.1)
    front = -half + stance.length * rng.uniform(0.33, 0.42)
    room = rng.uniform(1.1, 1.9)
    rear, floor = min(front + room, stance.axles[1] - 1.13 * stance.radius - 0.05), 0.42
    stance = with_profile(
        stance,
        nose=belt - rng.uniform(0.14, 0.22),
        cowl=(front, belt),
        deck=(rear, belt),
        tail=belt - rng.uniform(0.02, 0.12),
    )
    rows = [row for row in stance.profile if not front < row[0] < rear]
    index = [z for z, _ in rows].index(front) + 1
    sunk = ((front + 0.01, floor), (rear - 0.01, floor))
    stance = replace(stance, profile=(*rows[:index], *sunk, *rows[index:]))
    belt = stance.top(front)
    shell(b, paint, stance)
    span = (floor - 0.15, belt)
    walls(b, paint, stance, ends=(front, rear), span=span, thickness=0.09, closed=(False, False))
    hood(b, paint, stance, (-half + 0.2, front - 0.08))
    face(b, rng, stance, paint)
    wheels(b, rng, stance)
    _cockpit(b, rng, stance, (front, rear), floor, belt)
    mirrors(b, paint, vec(0.43 * stance.width, belt, front + 0.12))
    return b


def _cockpit(b: Builder, rng: Rng, stance: Stance, ends: Pair, floor: float, belt: float) -> None:
    """Add the windscreen, one or two rows of seats and the steering wheel."""
    front, rear = ends
    rise, rake, half = rng.uniform(0.25, 0.42), rng.uniform(0.2, 0.4), 0.4 * stance.width
    glass = pick_material(rng, "glass")
    left = [vec(-half, belt - 0.02, front - 0.05), vec(-0.85 * half, belt + rise, front + rake)]
    frame = [*left, *(point * vec(-1, 1, 1) for point in left[::-1])]
    for start, end in itertools.pairwise(frame):
        beam(b, "window", BLACK, start, end, width=0.035, height=0.035)
    b.loft("window", glass, [np.array(frame) + shift for shift in ([0, 0, 0], [0, 0.004, 0.012])])
    cover, spread = pick_material(rng, "leather"), 0.21 * stance.width
    count = 2 if rear - front > 1.5 else 1
    for row in range(count):
        z = rear - 0.25 - 0.8 * row
        for side in (-spread, spread):
            center = (side, floor + 0.12, z - 0.22)
            b.rounded_box("seat", cover, center, (0.46, 0.2, 0.5), 0.08, segments=2)
            back = (side, floor + 0.38, z + 0.06)
            turn = lean(14)
            b.rounded_box("seat", cover, back, (0.46, 0.62, 0.16), 0.07, turn=turn, segments=2)
    hub = vec(spread * rng.choice([-1, 1]), belt, front + 0.3)
    b.cylinder("trim", BLACK, hub + vec(0, -0.1, -0.3), hub, 0.025, segments=8)
    ring = [(0.17, -0.015), (0.19, 0), (0.17, 0.015), (0.15, 0)]
    b.lathe("trim", BLACK, [*ring, ring[0]], hub, segments=14, turn=lean(65))
