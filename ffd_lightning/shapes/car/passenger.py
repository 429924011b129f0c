"""Closed cars for a family: saloon, estate, off-roader."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.car.body import BLACK
from ffd_lightning.shapes.car.cabin import Cabin, closed_car
from ffd_lightning.shapes.car.stance import Stance, draw_stance, with_profile
from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.vectors import lean


def saloon(rng: Rng) -> Builder:
    """Draw a saloon or coupé: bonnet, cabin, boot; sporty ones are low with a spoiler."""
    b, sporty = Builder(), rng.random() < 0.4
    stance = draw_stance(
        rng, length=(3.9, 5.2), width=(1.65, 1.95), radius=(0.29, 0.35), clearance=(0.14, 0.24)
    )
    belt = rng.uniform(0.78, 0.86) if sporty else rng.uniform(0.86, 0.98)
    half = stance.length / 2
    cowl = -half + stance.length * rng.uniform(0.26, 0.34)
    rear = half - stance.length * rng.uniform(0.08, 0.19)
    stance = with_profile(
        stance,
        nose=belt - rng.uniform(0.12, 0.25),
        cowl=(cowl, belt),
        deck=(rear, belt + 0.02),
        tail=belt - rng.uniform(-0.02, 0.1),
    )
    belt = stance.top(cowl)
    high = belt + (rng.uniform(0.34, 0.42) if sporty else rng.uniform(0.42, 0.58))
    shape = Cabin(
        belt=(cowl, rear),
        roof=(cowl + rng.uniform(0.5, 0.85), rear - rng.uniform(0.4, 1.0)),
        heights=(belt, high),
        widths=(0.86 * stance.width, rng.uniform(0.62, 0.72) * stance.width),
        pillars=(0.55,) if sporty or rng.random() < 0.3 else (0.42, 0.74),
        pillar=rng.uniform(0.05, 0.08),
    )
    paint = closed_car(b, rng, stance, shape)
    if sporty and rng.random() < 0.7:
        _spoiler(b, rng, stance, paint)
    return b


def _spoiler(b: Builder, rng: Rng, stance: Stance, paint: Material) -> None:
    """Add a wing on two struts over the tail."""
    z, rise = stance.length / 2 - 0.2, rng.uniform(0.08, 0.28)
    y, half = stance.top(z), 0.9 * stance.half_width(z)
    center = (0, y + rise, z + 0.04)
    b.rounded_box("trim", paint, center, (2 * half, 0.045, 0.26), radius=0.06, edge=0.02)
    for side in (-0.7, 0.7):
        end = (side * half, y + rise, z + 0.03)
        beam(b, "trim", paint, (side * half, y - 0.03, z), end, width=0.04, height=0.12)


def estate(rng: Rng) -> Builder:
    """Draw a hatchback, estate or minivan: the roof reaches the tail."""
    b = Builder()
    stance = draw_stance(
        rng, length=(3.2, 5.0), width=(1.55, 1.9), radius=(0.27, 0.34), clearance=(0.15, 0.25)
    )
    stance = replace(stance, nose=rng.uniform(0.86, 0.94))
    half, belt = stance.length / 2, rng.uniform(0.86, 1.02)
    cowl = -half + rng.uniform(0.75, 1.35)
    rear = half - rng.uniform(0.06, 0.16)
    stance = with_profile(
        stance,
        nose=belt - rng.uniform(0.1, 0.22),
        cowl=(cowl, belt),
        deck=(rear - 0.3, belt + 0.03),
        tail=belt,
    )
    belt = stance.top(cowl)
    high = belt + rng.uniform(0.45, 0.72)
    shape = Cabin(
        belt=(cowl, rear),
        roof=(cowl + rng.uniform(0.4, 0.9), rear - rng.uniform(0.08, 0.5)),
        heights=(belt, high),
        widths=(0.87 * stance.width, rng.uniform(0.66, 0.76) * stance.width),
        pillars=(0.36, 0.66) if stance.length > 3.9 else (0.5,),
        pillar=rng.uniform(0.06, 0.1),
    )
    closed_car(b, rng, stance, shape)
    if rng.random() < 0.35:
        _roof_rails(b, rng, shape)
    return b


def _roof_rails(b: Builder, rng: Rng, shape: Cabin) -> None:
    """Add two rails along the roof, with or without cross-bars or a box on them."""
    y, half = shape.heights[1] + 0.1, 0.36 * shape.widths[1]
    front, rear = shape.roof[0] + 0.2, shape.roof[1] - 0.15
    for side in (-half, half):
        beam(b, "trim", BLACK, (side, y, front), (side, y, rear), width=0.035, height=0.035)
        for z in (front + 0.03, rear - 0.03):
            b.box("trim", BLACK, (side, y - 0.05, z), (0.035, 0.12, 0.06))
    for t in np.linspace(0.2, 0.8, int(rng.integers(0, 4))):
        z = front + t * (rear - front)
        beam(b, "trim", BLACK, (-half, y + 0.02, z), (half, y + 0.02, z), width=0.05, height=0.025)


def off_roader(rng: Rng) -> Builder:
    """Draw an off-roader: tall, boxy, high off the ground; often with a spare wheel behind."""
    b = Builder()
    stance = draw_stance(
        rng, length=(3.6, 5.0), width=(1.7, 2.05), radius=(0.36, 0.46), clearance=(0.28, 0.42)
    )
    stance = replace(stance, nose=rng.uniform(0.88, 0.97))
    half, belt = stance.length / 2, rng.uniform(1.05, 1.2)
    cowl, rear = -half + stance.length * rng.uniform(0.27, 0.36), half - 0.06
    stance = with_profile(
        stance,
        nose=belt - rng.uniform(0.03, 0.15),
        cowl=(cowl, belt),
        deck=(rear - 0.3, belt),
        tail=belt,
    )
    belt = stance.top(cowl)
    high = belt + rng.uniform(0.5, 0.72)
    shape = Cabin(
        belt=(cowl, rear),
        roof=(cowl + rng.uniform(0.12, 0.5), rear - rng.uniform(0.03, 0.25)),
        heights=(belt, high),
        widths=(0.88 * stance.width, rng.uniform(0.74, 0.84) * stance.width),
        pillars=(0.36, 0.68) if rng.random() < 0.65 else (0.45,),
        pillar=rng.uniform(0.07, 0.11),
    )
    paint = closed_car(b, rng, stance, shape)
    if rng.random() < 0.55:
        _roof_rails(b, rng, shape)
    if rng.random() < 0.5:
        turn, y = lean(90), stance.clearance + 0.6 * (belt - stance.clearance)
        r = 0.85 * stance.radius
        profile = [(0.3 * r, -0.1), (0.9 * r, -0.1), (r, -0.05), (r, 0.06)]
        profile += [(0.9 * r, 0.1), (0.55 * r, 0.11), (0.05, 0.12)]
        b.lathe("wheel", BLACK, profile, (0, y + 0.05, half + 0.08), segments=24, turn=turn)
    for side in (-1, 1):
        z = np.array(stance.axles) + np.array([1, -1]) * 1.2 * stance.radius
        x = side * (stance.width / 2 + 0.02)
        material, start = paint if rng.random() < 0.3 else BLACK, (x, stance.clearance, z[0])
        beam(b, "trim", material, start, (x, stance.clearance, z[1]), width=0.14, height=0.06)
    return b
