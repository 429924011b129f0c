"""Stocks, handguards and bipods of long guns."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.firearm.materials import BLACK, IRON
from ffd_lightning.shapes.firearm.swept import Cut, at, bar, even_bar, sweep
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import Pair


def buttstock(
    b: Builder, rng: Rng, material: Material, start: float, span: Pair, kinds: dict[str, float]
) -> None:
    """Add a stock behind `start` on a body that spans the heights `span`; `kinds` are odds."""
    kind = draw(rng, list(kinds), list(kinds.values()))
    low, high = span
    end, butt = start - rng.uniform(0.2, 0.32), rng.uniform(0.11, 0.15)
    wide, heel = rng.uniform(0.032, 0.045), high - 0.01 - rng.uniform(0.0, 0.06)
    if kind == "solid":
        neck = 0.7 * start + 0.3 * end
        rows = [
            Cut(forward=start + 0.02, low=low + 0.003, high=high - 0.01, width=wide),
            Cut(forward=neck, low=low + 0.003, high=high - 0.01, width=wide),
            Cut(forward=end, low=heel - butt, high=heel, width=wide),
        ]
        bar(b, "stock", material, rows, boxiness=0.55)
        _butt_pad(b, end, (heel - butt, heel), wide, 0.55)
    elif kind == "tube":
        _tube_stock(b, material, (start, end), (low + high) / 2, butt, wide)
    elif kind == "frame":
        loop = [(start + 0.02, high - 0.025), (end, heel - 0.01), (end, heel - butt)]
        loop += [(start + 0.02, low + 0.015)]
        sweep(b, "stock", IRON, bend(loop, 0.03, 3), depth=0.024, width=0.7 * wide)
    elif kind == "wire":
        hooked = [(start + 0.03, high - 0.03), (end, heel - 0.02), (end, heel - butt)]
        hooked += [(end + 0.04, heel - butt)]
        for side in (-0.4 * wide, 0.4 * wide):
            wire = np.stack([at(f, up, side) for f, up in hooked])
            b.tube("stock", IRON, bend(wire, 0.02, 3), 0.006, segments=8)
        for up in (heel - 0.02, heel - butt):
            left, right = (at(end, up, side) for side in (-0.4 * wide, 0.4 * wide))
            beam(b, "stock", IRON, left, right, width=0.012, height=0.012)


def _tube_stock(
    b: Builder, material: Material, ends: Pair, up: float, butt: float, wide: float
) -> None:
    """Add a stock that slides on a tube, from `ends[0]` back to `ends[1]`."""
    start, end = ends
    length = start - end
    b.cylinder("stock", IRON, at(start + 0.02, up), at(end + 0.02, up), 0.017)
    rows = [
        Cut(forward=end + 0.6 * length, low=up - 0.03, high=up + 0.024, width=wide),
        Cut(forward=end + 0.25 * length, low=up - 0.05, high=up + 0.026, width=wide),
        Cut(forward=end, low=up + 0.03 - butt, high=up + 0.028, width=wide),
    ]
    bar(b, "stock", material, rows)
    _butt_pad(b, end, (up + 0.03 - butt, up + 0.028), wide, 0.7)


def _butt_pad(b: Builder, end: float, span: Pair, wide: float, boxiness: float) -> None:
    """Cover a stock's rear face at `end`, which spans the heights `span`, with rubber."""
    low, high = span
    faces = (end + 0.004, end - 0.016)
    width = 1.03 * wide
    even_bar(
        b, "stock", BLACK, faces, low=low - 0.002, high=high + 0.002, width=width, boxiness=boxiness
    )


def sporting_stock(
    b: Builder, rng: Rng, wood: Material, front: float, wide: float, fore: float
) -> float:
    """Add a one-piece stock to `front`: butt, wrist, trench; return the height of its belly.

    The barrel's axis is at height 0; `fore` is the depth of the forestock below it.
    """
    butt, drop = rng.uniform(0.1, 0.14), rng.uniform(0.02, 0.07)
    end, wrist = -rng.uniform(0.34, 0.42), rng.uniform(0.038, 0.05)
    comb = rng.uniform(0.2, 0.75) * drop
    rows = [
        Cut(forward=end, low=-drop - butt, high=-drop, width=0.9 * wide),
        Cut(forward=end + 0.12, low=-drop - 0.8 * butt, high=-comb, width=wide),
        Cut(forward=-0.12, low=-comb - 0.1, high=-comb - 0.005, width=0.9 * wide),
        Cut(forward=-0.06, low=-0.028 - wrist, high=-0.02, width=0.8 * wide),
        Cut(forward=0.0, low=-0.02 - wrist, high=-0.008, width=0.9 * wide),
        Cut(forward=0.06, low=-0.014 - fore, high=0.0, width=wide),
        Cut(forward=0.25, low=-0.01 - fore, high=0.0, width=wide),
        Cut(forward=front - 0.03, low=-0.72 * fore, high=0.0, width=0.75 * wide),
        Cut(forward=front, low=-0.4 * fore, high=0.0, width=0.5 * wide),
    ]
    bar(b, "stock", wood, rows, boxiness=0.3)
    _butt_pad(b, end=end, span=(-drop - butt, -drop), wide=0.9 * wide, boxiness=0.3)
    return -0.01 - fore


def straight_stock(b: Builder, rng: Rng, wood: Material, span: Pair, wide: float) -> None:
    """Add a wooden butt with a wrist, straight or with a pistol grip, behind a receiver."""
    low, high = span
    butt, drop = rng.uniform(0.1, 0.13), rng.uniform(0.03, 0.07)
    end, sag = -rng.uniform(0.36, 0.44), rng.uniform(0.0, 0.05)
    wide = max(wide, 0.036)
    rows = [
        Cut(forward=-0.035, low=low + 0.005, high=high - 0.012, width=0.85 * wide),
        Cut(forward=-0.08, low=low + 0.002, high=high - 0.02, width=0.8 * wide),
        Cut(forward=-0.13, low=low - 0.01 - sag, high=high - 0.018 - 0.3 * drop, width=0.8 * wide),
        Cut(
            forward=-0.18,
            low=low - 0.018 - 0.6 * sag,
            high=high - 0.008 - 0.4 * drop,
            width=0.9 * wide,
        ),
        Cut(forward=end, low=high - drop - butt, high=high - drop, width=wide),
    ]
    bar(b, "stock", wood, rows, boxiness=0.3)
    _butt_pad(b, end, (high - drop - butt, high - drop), wide, 0.3)


def handguard(
    b: Builder, rng: Rng, material: Material, ends: Pair, up: float, tall: float, wide: float
) -> None:
    """Add a handguard around the barrel: plain and tapered, ribbed, or slotted."""
    back, front = ends
    taper, boxiness = rng.uniform(0.75, 1.05), rng.uniform(0.1, 0.9)
    rows = [
        Cut(back, up - tall / 2, up + tall / 2, wide),
        Cut(front, up - taper * tall / 2, up + taper * tall / 2, taper * wide),
    ]
    bar(b, "body", material, rows, boxiness=boxiness)
    style = draw(rng, ["plain", "ribs", "slots"])
    for f in np.linspace(back, front, int(rng.integers(5, 10)))[1:-1]:
        swell = tall * (1 + (taper - 1) * (f - back) / (front - back))
        across = wide * swell / tall
        if style == "ribs":
            ends, rib = (f - 0.006, f + 0.006), 0.54 * swell
            even_bar(b, "body", material, ends, up - rib, up + rib, 1.08 * across, boxiness)
        elif style == "slots":
            b.box("body", BLACK, at(f, up), (1.02 * across, 0.3 * swell, 0.022))


def fore_end(
    b: Builder, rng: Rng, wood: Material, steel: Material, kind: str, radius: float, end: float
) -> None:
    """Add what the front hand holds: a sliding pump on a tube magazine, or a wedge of wood."""
    if kind == "pump":
        tube, up = rng.uniform(0.6, 0.98) * end, -2.05 * radius
        b.cylinder("magazine", steel, at(0.05, up), at(tube, up), 0.9 * radius)
        b.cylinder("magazine", steel, at(tube - 0.02, up), at(tube + 0.005, up), 1.05 * radius)
        back = rng.uniform(0.17, 0.24)
        front = min(back + rng.uniform(0.12, 0.2), tube - 0.03)
        handguard(b, rng, wood, (back, front), up=up, tall=3.4 * radius, wide=3.6 * radius)
        return
    base = 0.0 if kind == "side" else -2 * radius
    front, wide = rng.uniform(0.22, 0.32), (4.4 if kind == "side" else 3.0) * radius
    rows = [
        Cut(forward=0.035, low=base - 2.2 * radius, high=base + 0.3 * radius, width=wide),
        Cut(forward=0.8 * front, low=base - 2.0 * radius, high=base + 0.3 * radius, width=wide),
        Cut(forward=front, low=base - 1.1 * radius, high=base + 0.2 * radius, width=0.6 * wide),
    ]
    bar(b, "body", wood, rows, boxiness=0.35)


def jacket(b: Builder, steel: Material, back: float, front: float, radius: float) -> None:
    """Add a perforated barrel jacket; its holes are dark discs on the surface."""
    b.cylinder("barrel", steel, at(back, 0), at(front, 0), radius, segments=16)
    for f in np.arange(back + 0.025, front - 0.012, 0.03):
        for a in np.radians([0, 60, 120, 180]):
            rim = radius * np.array([np.cos(a), np.sin(a)])
            inner, outer = at(f, 0.9 * rim[1], 0.9 * rim[0]), at(f, 1.02 * rim[1], 1.02 * rim[0])
            b.cylinder("barrel", BLACK, inner, outer, 0.009, segments=8)


def bipod(b: Builder, rng: Rng, steel: Material, forward: float) -> None:
    """Add two splayed legs with feet and their collar on the barrel."""
    drop, splay, rake = rng.uniform(0.18, 0.28), rng.uniform(0.06, 0.14), rng.uniform(-0.04, 0.06)
    b.cylinder("stock", steel, at(forward - 0.02, 0), at(forward + 0.02, 0), 0.026)
    for side in (-1, 1):
        hip, foot = at(forward, -0.01, 0.012 * side), at(forward + rake, -drop, splay * side)
        b.cylinder("stock", steel, hip, foot, radius=0.009, radius_end=0.007, segments=10)
        b.ellipsoid("stock", steel, foot, (0.018, 0.009, 0.02), segments=10)
