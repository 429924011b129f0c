"""Backs of benches, drawn in the frame of `Plan.back`, and arms."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ffd_lightning.shapes.bench.plan import Plan
from ffd_lightning.shapes.kit import Builder, Rng, boards
from ffd_lightning.shapes.kit.boards import beam, pad
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import lean, vec


def slats(b: Builder, rng: Rng, p: Plan) -> None:
    """Add posts and one to six long boards before them."""
    for x in p.xs:
        beam(b, "back", p.frame, p.back(x, -0.06), p.back(x, p.rise), 0.8 * p.side, 0.04)
    count, low = int(rng.integers(1, 7)), p.rise * rng.uniform(0.05, 0.6)
    pitch = (p.rise - low) / count
    first, last = p.back(0, low + pitch / 2, -0.03), p.back(0, p.rise - pitch / 2, -0.03)
    size = (p.length, rng.uniform(0.6, 0.9) * pitch, 0.022)
    boards.slats(b, "back", p.wood, first, last, size, count, lean(p.rake))


def _framed(b: Builder, rng: Rng, p: Plan) -> float:
    """Add posts, a crest and a lower rail; return the height of the rail."""
    xs, low = p.xs, p.rise * rng.choice([0.02, rng.uniform(0.15, 0.35)])
    for x in xs:
        beam(b, "back", p.frame, p.back(x, -0.05), p.back(x, p.rise), p.side, p.side)
    crest = (xs[-1] - xs[0] + p.side + rng.uniform(0.0, 0.1), rng.uniform(0.04, 0.12), 0.035)
    pad(b, "back", p.frame, p.back(0, p.rise), crest, rng.uniform(0.1, 0.5) * crest[1], p.rake)
    beam(b, "back", p.frame, p.back(xs[0], low), p.back(xs[-1], low), 0.03, 0.04)
    return low


def bars(b: Builder, rng: Rng, p: Plan) -> None:
    """Fill a frame with thin rods or upright laths."""
    low, flat = _framed(b, rng, p), rng.random() < 0.4
    for x in np.linspace(p.xs[0], p.xs[-1], round(p.length / rng.uniform(0.07, 0.16)))[1:-1]:
        rod = p.back(x, low), p.back(x, p.rise)
        if flat:
            beam(b, "back", p.wood, *rod, 0.045, 0.015)
        else:
            b.cylinder("back", p.wood, *rod, 0.01, segments=8)


def cross(b: Builder, rng: Rng, p: Plan) -> None:
    """Fill a frame with crossed bars."""
    low, first, last = _framed(b, rng, p), p.xs[0], p.xs[-1]
    count = max(1, round((last - first) / rng.uniform(0.5, 0.9)))
    for start, end in pairwise(np.linspace(first, last, count + 1)):
        for one, two, thick in ((start, end, 0.02), (end, start, 0.016)):
            beam(b, "back", p.wood, p.back(one, low), p.back(two, p.rise), thick, 0.03)


def panel(b: Builder, rng: Rng, p: Plan) -> None:
    """Fill a frame with a board."""
    low = _framed(b, rng, p)
    size = (p.xs[-1] - p.xs[0], p.rise - low, 0.02)
    pad(b, "back", p.wood, p.back(0, (p.rise + low) / 2), size, 0.02, p.rake)


def padded(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a pad or slab, or one for each seat."""
    count, rise = int(rng.choice([1, 2, 3], p=[0.7, 0.15, 0.15])), min(p.rise, 0.45 * p.length)
    wide, tall = p.length / count, rise + p.thick
    size, radius = (0.995 * wide, tall, rng.uniform(0.05, 0.12)), rng.uniform(0.1, 0.3) * tall
    for x in (np.arange(count) + 0.5 - count / 2) * wide:
        pad(b, "back", p.cover, p.back(x, (rise - p.thick) / 2), size, radius, p.rake)


def rests(b: Builder, rng: Rng, p: Plan, backed: bool = True) -> None:
    """Add an arm at each end: a rest on a post, and on a second one if there is no back."""
    front, top = -p.depth / 2 + p.side / 2, p.seat + p.arm
    rear = p.back(0, p.arm)[2] if backed else p.depth / 2 - p.side / 2
    for x in p.xs[[0, -1]]:
        for z in (front,) if backed else (front, rear):
            post = (x, p.under - 0.05, z), (x, top, z)
            beam(b, "arm", p.frame, *post, 0.8 * p.side, 0.8 * p.side)
        rest = (1.2 * p.side, 0.03, rear - front + 0.08)
        b.rounded_box("arm", p.frame, (x, top, (front + rear) / 2 - 0.03), rest, 0.02)


def hoops(b: Builder, rng: Rng, p: Plan) -> None:
    """Add bent tubes as arms."""
    for x in p.xs[[0, -1]]:
        front, rear = -0.42 * p.depth, p.back(x, p.arm)
        path = [vec(x, p.under, front + 0.05), vec(x, p.seat + p.arm, front - 0.04), rear]
        b.tube("arm", p.frame, bend(path, 0.12), 0.018, segments=8)


def ends(b: Builder, rng: Rng, p: Plan) -> None:
    """Close both ends by boards between the seat and a rest."""
    front, rear, top = -p.depth / 2, p.back(0, p.arm)[2], p.seat + p.arm
    low, z, deep = rng.choice([0.0, p.under - 0.02]), (front + rear) / 2, rear - front
    for x in (-p.length / 2, p.length / 2):
        b.rounded_box("arm", p.wood, (x, (top + low) / 2, z), (0.025, top - low, deep), 0.008)
        b.rounded_box("arm", p.frame, (x, top, z - 0.01), (0.06, 0.03, deep + 0.03), 0.012)


def scrolls(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a padded end at each side, rolled outward or plain."""
    thick, rolled = rng.uniform(0.05, 0.1), rng.random() < 0.6
    tall, half = p.arm + p.thick, vec(0, 0, p.depth / 2)
    for side in (-1, 1):
        x = side * (p.length / 2 + 0.4 * thick)
        middle = (x, p.seat + (p.arm - p.thick) / 2, 0)
        b.rounded_box("arm", p.cover, middle, (thick, tall, p.depth), 0.02)
        if rolled:
            roll = vec(x + side * 0.3 * thick, p.seat + p.arm, 0)
            b.cylinder("arm", p.cover, roll - half, roll + half, 0.75 * thick)
