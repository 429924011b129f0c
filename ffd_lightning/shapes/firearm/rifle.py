"""Rifles: for war and for hunting."""

from __future__ import annotations

from ffd_lightning.shapes.firearm.fittings import (
    barrel,
    grip,
    iron_sights,
    magazine,
    muzzle,
    rail,
    scope,
    trigger,
)
from ffd_lightning.shapes.firearm.materials import BLACK, IRON, draw_furniture, draw_steel
from ffd_lightning.shapes.firearm.stocks import buttstock, handguard, sporting_stock
from ffd_lightning.shapes.firearm.swept import Cut, at, bar, even_bar, sweep
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.paths import bend


def _top(b: Builder, rng: Rng, steel: Material, back: float, front: float, up: float) -> None:
    """Put a scope, a carrying handle, a red-dot sight or nothing on a receiver's top at `up`."""
    kind = draw(rng, ["none", "handle", "scope", "dot"], [0.25, 0.25, 0.25, 0.25])
    middle = (back + front) / 2
    if kind == "handle":
        rise = rng.uniform(0.045, 0.065)
        loop = [(back + 0.01, up - 0.01), (back + 0.015, up + rise)]
        loop += [(front - 0.02, up + rise), (front, up - 0.01)]
        sweep(b, "sight", steel, bend(loop, 0.02, 3), depth=0.016, width=0.02)
    elif kind != "none":
        rail(b, "sight", steel, back, front, up, 0.026)
    if kind == "scope":
        scope(b, rng, IRON, middle, up + 0.014)
    elif kind == "dot":
        base = up + 0.018
        b.box("sight", IRON, at(middle, base + 0.008), (0.034, 0.02, 0.07))
        start = at(middle - 0.04, base + 0.035)
        b.cylinder("sight", BLACK, start, at(middle + 0.04, base + 0.035), 0.024)


def assault_rifle(rng: Rng) -> Builder:
    """Draw an assault rifle, also with its magazine behind the grip (bullpup)."""
    b, steel, furniture = Builder(), draw_steel(rng), draw_furniture(rng, wood=0.35)
    tall, wide = rng.uniform(0.07, 0.1), rng.uniform(0.038, 0.05)
    bullpup = rng.random() < 0.2
    length = rng.uniform(0.24, 0.34) + 0.12 * bullpup
    high, low = 0.35 * tall, -0.65 * tall
    body = furniture if bullpup or rng.random() < 0.2 else steel
    rows = [
        Cut(forward=0, low=low + 0.015, high=high - 0.008, width=wide),
        Cut(forward=0.05, low=low, high=high, width=wide),
        Cut(forward=length, low=low + 0.006, high=high, width=wide),
    ]
    bar(b, "body", body, rows, boxiness=0.8)
    grip_at = length - 0.12 if bullpup else 0.06
    top = (grip_at, low + 0.02)
    long, rake = rng.uniform(0.1, 0.13), rng.uniform(12, 28)
    grip(b, furniture, top, length=long, degrees=rake, depth=0.045, width=0.034)
    back = grip_at + 0.015
    trigger(b, steel, back=back, front=grip_at + 0.085, top=low + 0.005, drop=0.04, width=0.014)
    well = rng.uniform(0.04, 0.1) if bullpup else rng.uniform(0.62, 0.75) * length
    curl = rng.uniform(8, 45) if rng.random() < 0.7 else 0.0
    size = (rng.uniform(0.13, 0.24), rng.uniform(0.05, 0.07))
    magazine(b, steel, (well, low + 0.03), *size, 0.028, rng.uniform(0, 12), curl)
    guard = length + rng.uniform(0.16, 0.28)
    ends = (length - 0.005, guard)
    handguard(b, rng, furniture, ends, up=0.0, tall=rng.uniform(0.05, 0.065), wide=wide)
    end = guard + rng.uniform(0.06, 0.22)
    barrel(b, steel, start=length, end=end, up=0.0, radius=rng.uniform(0.009, 0.013))
    muzzle(b, rng, steel, end, 0.0)
    _top(b, rng, steel, 0.04, length, high)
    front = guard + rng.uniform(0.01, 0.03)
    post = [
        Cut(forward=front + 0.012, low=-0.018, high=0.06, width=0.014),
        Cut(forward=front + 0.032, low=-0.018, high=0.04, width=0.014),
    ]
    bar(b, "sight", steel, post)
    kinds = {"solid": 0.35, "tube": 0.3, "frame": 0.2, "wire": 0.15}
    kinds = {"solid": 1.0} if bullpup else kinds
    buttstock(b, rng, furniture, 0.0, (low + 0.01, high), kinds)
    return b


def hunting_rifle(rng: Rng) -> Builder:
    """Draw a bolt-action or lever-action rifle with a one-piece stock."""
    b, steel, wood = Builder(), draw_steel(rng), draw_furniture(rng, wood=0.75)
    wide, fore = rng.uniform(0.042, 0.055), rng.uniform(0.04, 0.055)
    end = rng.uniform(0.55, 0.85)
    front = rng.uniform(0.35, 0.6) if rng.random() < 0.6 else end - 0.05
    belly = sporting_stock(b, rng, wood, front, wide, fore)
    radius = rng.uniform(0.015, 0.02)
    stations = ((-0.04, 0.6), (-0.03, 1.0), (0.2, 1.0), (0.24, 0.8))
    tube = [at(f, 0.004) for f, _ in stations]
    b.tube("body", steel, tube, [radius * swell for _, swell in stations], segments=14)
    slim, taper = rng.uniform(0.6, 0.85) * radius, rng.uniform(0.65, 0.95)
    barrel(b, steel, start=0.2, end=end, up=0.002, radius=slim, taper=taper)
    top = belly + 0.012
    trigger(b, steel, back=0.0, front=rng.uniform(0.085, 0.1), top=top, drop=0.042, width=0.014)
    if rng.random() < 0.75:
        knob = at(-0.01, -0.035, 0.07)
        bolt = bend([at(0.0, 0.008), at(-0.005, 0.0, 0.035), knob], 0.02, 3)
        b.tube("body", steel, bolt, 0.006, segments=8)
        b.ellipsoid("body", steel, knob, (0.012, 0.012, 0.012), segments=10)
    else:
        path = [(0.12, belly + 0.01), (0.11, belly - 0.045), (-0.02, belly - 0.05)]
        path += [(-0.08, belly - 0.075), (-0.09, belly - 0.02)]
        sweep(b, "body", steel, bend(path, 0.03, 3), depth=0.009, width=0.016)
    if rng.random() < 0.5:
        well = (0.16, belly + 0.02)
        magazine(b, steel, well, length=rng.uniform(0.04, 0.09), depth=0.075, width=0.03)
    if rng.random() < 0.65:
        scope(b, rng, IRON, rng.uniform(0.06, 0.12), radius)
    else:
        iron_sights(b, steel, rear=0.26, front=end - 0.02, base=0.012, height=0.014)
    if rng.random() < 0.3:
        bands = rng.uniform(0.5, 0.95)
        band = (bands * front - 0.01, bands * front + 0.01)
        width = 0.95 * wide
        even_bar(b, "body", steel, band, low=-0.8 * fore, high=0.016, width=width, boxiness=0.3)
    return b
