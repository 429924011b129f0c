"""Cars of the 1920s and 1930s: free-standing wings, running boards, an upright radiator."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.car.body import BLACK, CHROME, LAMP, RED, draw_paint
from ffd_lightning.shapes.car.cabin import Cabin, cabin, draw_glass
from ffd_lightning.shapes.car.stance import Stance
from ffd_lightning.shapes.car.wheels import wheels
from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import lean


def vintage(rng: Rng) -> Builder:
    """Draw a vintage car."""
    b, paint = Builder(), draw_paint(rng)
    dark = BLACK if rng.random() < 0.5 else draw_paint(rng)
    length, width, radius = rng.uniform(3.4, 5.0), rng.uniform(1.5, 1.8), rng.uniform(0.34, 0.44)
    axles = (-length / 2 + 1.25 * radius, length / 2 - rng.uniform(1.3, 2.0) * radius)
    stance = Stance(
        length=length,
        width=width,
        axles=axles,
        radius=radius,
        clearance=0.3,
        profile=((-length, 1.0), (length, 1.0)),
        nose=1.0,
    )
    belt, cowl = rng.uniform(1.0, 1.2), axles[0] + rng.uniform(0.24, 0.4) * length
    tail = min(axles[1] + rng.uniform(0.1, 0.9) * radius, length / 2)
    nose = axles[0] - 0.3 * radius
    _body(b, rng, paint, nose=nose, cowl=cowl, tail=tail, belt=belt, width=width)
    high = belt + rng.uniform(0.45, 0.7)
    shape = Cabin(
        belt=(cowl + 0.02, tail - 0.02),
        roof=(cowl + rng.uniform(0.02, 0.2), tail - rng.uniform(0.02, 0.3)),
        heights=(belt, high),
        widths=(0.74 * width, rng.uniform(0.64, 0.72) * width),
        pillars=(0.36, 0.7) if tail - cowl > 1.8 else (0.55,),
        pillar=0.09,
    )
    cabin(b, paint, draw_glass(rng), shape, dark if rng.random() < 0.6 else paint)
    _wings(b, rng, dark, stance)
    wheels(b, rng, stance, inset=0.0)
    _front(b, rng, nose, belt, width)
    for side in (-1, 1):
        middle = (side * 0.4 * width, 0.75, tail + 0.05)
        b.ellipsoid("light", RED, middle, (0.05, 0.05, 0.05), segments=10)
    if rng.random() < 0.6:
        profile = [(0.05, -0.07), (0.85 * radius, -0.07), (0.9 * radius, 0)]
        profile += [(0.8 * radius, 0.08), (0.05, 0.06)]
        center = (0, 0.3 + 1.0 * radius, tail + 0.06)
        b.lathe("wheel", BLACK, profile, center, segments=22, turn=lean(90))
    return b


def _body(
    b: Builder,
    rng: Rng,
    paint: Material,
    *,
    nose: float,
    cowl: float,
    tail: float,
    belt: float,
    width: float,
) -> None:
    """Add a slender bonnet from the nose to the cowl and the wider body behind, up to `belt`."""
    low = 0.32
    slim = rng.uniform(0.36, 0.46) * width
    sizes = [(nose, slim, belt - 0.12), (cowl - 0.1, 0.66 * width, belt - 0.02)]
    rings = []
    for z, w, top in sizes:
        flank = [(w / 2, low), (w / 2, top - 0.18), (0.4 * w, top - 0.05), (0.18 * w, top)]
        rings.append([(x, y, z) for x, y in flank + [(-x, y) for x, y in reversed(flank)]])
    b.loft("hood", paint, rings)
    for side in (-1, 1):
        for t in np.linspace(0.35, 0.75, int(rng.integers(4, 9))):
            z = nose + t * (cowl - nose)
            flare = t * (0.66 * width - slim) * (cowl - nose) / (cowl - 0.1 - nose)
            x = side * 0.5 * (slim + flare)
            b.box("hood", BLACK, (x, belt - 0.45, z), (0.02, 0.22, 0.03))
    center = (0, (low + belt) / 2, (cowl - 0.12 + tail) / 2)
    size = (0.76 * width, belt - low, tail - cowl + 0.12)
    b.rounded_box("body", paint, center, size, radius=0.12, edge=0.03)


def _wings(b: Builder, rng: Rng, dark: Material, stance: Stance) -> None:
    """Add swept front wings that run out into running boards, and rear wings."""
    r, board = stance.radius, rng.uniform(0.28, 0.36)
    front, rear = stance.axles
    reach, wide = 1.18 * r, 0.21 * stance.width
    rows = [(front - reach * np.cos(a), r + reach * np.sin(a)) for a in np.linspace(-0.1, 2.1, 9)]
    rows += [(front + 1.6 * reach, board + 0.25 * r), (front + 2.2 * reach, board)]
    rows += [(rear - 1.5 * reach, board), (rear - 1.15 * reach, board + 0.05)]
    rows += [(rear - reach * np.cos(a), r + reach * np.sin(a)) for a in np.linspace(0.25, 3.0, 11)]
    for side in (-1, 1):
        offsets = np.linspace(-0.5, 0.5, 5)
        xs = [side * (stance.width / 2 - wide * (0.42 - t)) for t in offsets]
        sags = [0.09 * (2 * t) ** 2 * r for t in offsets]
        grid = [[(x, y - sag, z) for x, sag in zip(xs, sags, strict=True)] for z, y in rows]
        sheet(b, "body", dark, grid, 0.03)


def _front(b: Builder, rng: Rng, nose: float, belt: float, width: float) -> None:
    """Add the radiator, the headlamps on their bar and the bumper."""
    wide, tall = rng.uniform(0.4, 0.48) * width, belt - 0.42
    y = 0.36 + tall / 2
    b.rounded_box("trim", CHROME, (0, y, nose - 0.04), (wide, tall, 0.12), radius=0.05, edge=0.04)
    b.box("trim", BLACK, (0, y - 0.01, nose - 0.1), (0.82 * wide, 0.84 * tall, 0.02))
    for x in np.linspace(-0.4, 0.4, 7):
        b.box("trim", CHROME, (x * wide, y - 0.01, nose - 0.112), (0.02, 0.82 * tall, 0.012))
    size, lamp = rng.uniform(0.1, 0.14), belt - rng.uniform(0.2, 0.35)
    apart = 0.5 * wide + 1.2 * size
    b.cylinder("trim", CHROME, (-apart, lamp, nose), (apart, lamp, nose), 0.022, segments=8)
    for side in (-apart, apart):
        bowl = [(0.02, 0.9 * size), (0.7 * size, 0.6 * size)]
        bowl += [(size, -0.4 * size), (size, -0.6 * size)]
        b.lathe("trim", CHROME, bowl, (side, lamp, nose), segments=16, turn=lean(90))
        center = (side, lamp, nose - 0.55 * size)
        b.ellipsoid("light", LAMP, center, (0.94 * size, 0.94 * size, 0.05), segments=14)
    xs = np.linspace(-0.46, 0.46, 7) * width
    ends = [(x, 0.42, nose - 0.35 + 0.12 * abs(x) ** 2) for x in xs]
    b.tube("trim", CHROME, ends, 0.04, segments=8)
    for side in (-0.2, 0.2):
        foot = (side * width, 0.42, nose - 0.33)
        b.cylinder("trim", CHROME, foot, (side * width, 0.42, nose + 0.1), 0.025, segments=8)
