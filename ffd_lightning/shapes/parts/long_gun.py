"""Long guns: assault and hunting rifles, shotguns, submachine guns, machine guns."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.parts.furniture import bend, draw
from ffd_lightning.shapes.parts.gun_parts import (
    BLACK,
    IRON,
    at,
    bar,
    barrel,
    draw_furniture,
    draw_steel,
    drum,
    grip,
    iron_sights,
    magazine,
    muzzle,
    rail,
    scope,
    sweep,
    trigger,
)
from ffd_lightning.shapes.parts.gun_stocks import (
    bipod,
    buttstock,
    fore_end,
    handguard,
    jacket,
    sporting_stock,
    straight_stock,
)
from ffd_lightning.shapes.shapes import Builder, Material


def _top(
    b: Builder, rng: np.random.Generator, steel: Material, back: float, front: float, up: float
) -> None:
    """Put a scope, a carrying handle, a red-dot sight or nothing on a receiver's top at `up`."""
    kind = draw(rng, ["none", "handle", "scope", "dot"], [0.25, 0.25, 0.25, 0.25])
    middle = (back + front) / 2
    if kind == "handle":
        rise = rng.uniform(0.045, 0.065)
        loop = [
            (back + 0.01, up - 0.01),
            (back + 0.015, up + rise),
            (front - 0.02, up + rise),
            (front, up - 0.01),
        ]
        sweep(b, "sight", steel, bend(loop, 0.02, 3), 0.016, 0.02)
    elif kind != "none":
        rail(b, "sight", steel, back, front, up, 0.026)
    if kind == "scope":
        scope(b, rng, IRON, middle, up + 0.014)
    elif kind == "dot":
        base = up + 0.018
        b.box("sight", IRON, at(middle, base + 0.008), (0.034, 0.02, 0.07))
        b.cylinder(
            "sight", BLACK, at(middle - 0.04, base + 0.035), at(middle + 0.04, base + 0.035), 0.024
        )


def assault_rifle(rng: np.random.Generator) -> Builder:
    """Draw an assault rifle, also with its magazine behind the grip (bullpup)."""
    b, steel, furniture = Builder(), draw_steel(rng), draw_furniture(rng, wood=0.35)
    tall, wide = rng.uniform(0.07, 0.1), rng.uniform(0.038, 0.05)
    bullpup = rng.random() < 0.2
    length = rng.uniform(0.24, 0.34) + 0.12 * bullpup
    high, low = 0.35 * tall, -0.65 * tall
    body = furniture if bullpup or rng.random() < 0.2 else steel
    rows = [(0, low + 0.015, high - 0.008, wide), (0.05, low, high, wide)]
    rows += [(length, low + 0.006, high, wide)]
    bar(b, "body", body, rows, 0.8)
    grip_at = length - 0.12 if bullpup else 0.06
    top = (grip_at, low + 0.02)
    grip(b, furniture, top, rng.uniform(0.1, 0.13), rng.uniform(12, 28), 0.045, 0.034)
    trigger(b, steel, grip_at + 0.015, grip_at + 0.085, low + 0.005, 0.04, 0.014)
    well = rng.uniform(0.04, 0.1) if bullpup else rng.uniform(0.62, 0.75) * length
    curl = rng.uniform(8, 45) if rng.random() < 0.7 else 0.0
    size = (rng.uniform(0.13, 0.24), rng.uniform(0.05, 0.07))
    magazine(b, steel, (well, low + 0.03), *size, 0.028, rng.uniform(0, 12), curl)
    guard = length + rng.uniform(0.16, 0.28)
    handguard(b, rng, furniture, (length - 0.005, guard), 0.0, rng.uniform(0.05, 0.065), wide)
    end = guard + rng.uniform(0.06, 0.22)
    barrel(b, steel, length, end, 0.0, rng.uniform(0.009, 0.013))
    muzzle(b, rng, steel, end, 0.0)
    _top(b, rng, steel, 0.04, length, high)
    front = guard + rng.uniform(0.01, 0.03)
    bar(
        b,
        "sight",
        steel,
        [(front + 0.012, -0.018, 0.06, 0.014), (front + 0.032, -0.018, 0.04, 0.014)],
    )
    kinds = {"solid": 0.35, "tube": 0.3, "frame": 0.2, "wire": 0.15}
    kinds = {"solid": 1.0} if bullpup else kinds
    buttstock(b, rng, furniture, 0.0, (low + 0.01, high), kinds)
    return b


def hunting_rifle(rng: np.random.Generator) -> Builder:
    """Draw a bolt-action or lever-action rifle with a one-piece stock."""
    b, steel, wood = Builder(), draw_steel(rng), draw_furniture(rng, wood=0.75)
    wide, fore = rng.uniform(0.042, 0.055), rng.uniform(0.04, 0.055)
    end = rng.uniform(0.55, 0.85)
    front = rng.uniform(0.35, 0.6) if rng.random() < 0.6 else end - 0.05
    belly = sporting_stock(b, rng, wood, front, wide, fore)
    radius = rng.uniform(0.015, 0.02)
    stations = ((-0.04, 0.6), (-0.03, 1.0), (0.2, 1.0), (0.24, 0.8))
    tube = [at(f, 0.004) for f, _ in stations]
    b.tube("body", steel, tube, [radius * swell for _, swell in stations], 14)
    barrel(
        b, steel, 0.2, end, 0.002, rng.uniform(0.6, 0.85) * radius, taper=rng.uniform(0.65, 0.95)
    )
    trigger(b, steel, 0.0, rng.uniform(0.085, 0.1), belly + 0.012, 0.042, 0.014)
    if rng.random() < 0.75:
        knob = at(-0.01, -0.035, 0.07)
        b.tube(
            "body", steel, bend([at(0.0, 0.008), at(-0.005, 0.0, 0.035), knob], 0.02, 3), 0.006, 8
        )
        b.ellipsoid("body", steel, knob, (0.012, 0.012, 0.012), 10)
    else:
        path = [
            (0.12, belly + 0.01),
            (0.11, belly - 0.045),
            (-0.02, belly - 0.05),
            (-0.08, belly - 0.075),
            (-0.09, belly - 0.02),
        ]
        sweep(b, "body", steel, bend(path, 0.03, 3), 0.009, 0.016)
    if rng.random() < 0.5:
        magazine(b, steel, (0.16, belly + 0.02), rng.uniform(0.04, 0.09), 0.075, 0.03)
    if rng.random() < 0.65:
        scope(b, rng, IRON, rng.uniform(0.06, 0.12), radius)
    else:
        iron_sights(b, steel, 0.26, end - 0.02, 0.012, 0.014)
    if rng.random() < 0.3:
        bands = rng.uniform(0.5, 0.95)
        bar(
            b,
            "body",
            steel,
            [(bands * front + d, -0.8 * fore, 0.016, 0.95 * wide) for d in (-0.01, 0.01)],
            0.3,
        )
    return b


def shotgun(rng: np.random.Generator) -> Builder:
    """Draw a shotgun: pump-action, side-by-side or over-and-under."""
    b, steel, wood = Builder(), draw_steel(rng), draw_furniture(rng, wood=0.7)
    kind = draw(rng, ["pump", "side", "over"], [0.5, 0.25, 0.25])
    radius, end = rng.uniform(0.012, 0.015), rng.uniform(0.4, 0.95)
    tall = 3.0 * radius + (1.9 * radius if kind != "side" else 0)
    wide = 2.6 * radius + (2 * radius if kind == "side" else 0.006)
    offsets = {"side": [(-1, 0), (1, 0)], "over": [(0, 0), (0, -2)], "pump": [(0, 0)]}[kind]
    for side, up in offsets:
        barrel(b, steel, 0.0, end, up * radius, radius, side * radius, taper=0.9)
    low, high = 1.5 * radius - tall, 1.35 * radius
    rows = [(-0.06, low + 0.012, high - 0.012, 0.7 * wide), (-0.03, low, high, wide)]
    rows += [(rng.uniform(0.08, 0.16) if kind == "pump" else 0.04, low, high, wide)]
    bar(b, "body", steel, rows, 0.6)
    fore_end(b, rng, wood, steel, kind, radius, end)
    trigger(b, steel, -0.05, 0.045, low + 0.004, 0.04, 0.014)
    if kind == "pump" and rng.random() < 0.4:
        grip(
            b, wood, (-0.055, low + 0.025), rng.uniform(0.1, 0.13), rng.uniform(15, 35), 0.05, 0.035
        )
        if rng.random() < 0.7:
            buttstock(b, rng, wood, -0.05, (low, high), {"tube": 0.4, "wire": 0.35, "frame": 0.25})
    else:
        straight_stock(b, rng, wood, (low, high), wide)
    b.ellipsoid("sight", _bead(steel), at(end - 0.015, radius + 0.002), (0.004, 0.005, 0.004), 8)
    return b


def _bead(steel: Material) -> Material:
    """Return the bright colour of a bead sight beside `steel`."""
    return Material((0.9, 0.8, 0.5)) if sum(steel.color) < 1.5 else BLACK


def submachine_gun(rng: np.random.Generator) -> Builder:
    """Draw a submachine gun: box or tube receiver, a stick or drum magazine, a light stock."""
    b, steel, furniture = Builder(), draw_steel(rng), draw_furniture(rng, wood=0.3)
    tall, length = rng.uniform(0.055, 0.085), rng.uniform(0.26, 0.38)
    round_ = rng.random() < 0.45
    high, low, wide = tall / 2, -tall / 2, tall * (1.0 if round_ else rng.uniform(0.55, 0.75))
    bar(b, "body", steel, [(f, low, high, wide) for f in (0, length)], 0.0 if round_ else 0.85)
    reach = rng.uniform(0.08, 0.22)
    end = length + rng.uniform(0.03, 0.12)
    if rng.random() < 0.5:
        jacket(b, steel, length - 0.005, length + reach, 0.42 * tall)
        end = length + reach + 0.02
    barrel(b, steel, length - 0.01, end, 0.0, rng.uniform(0.01, 0.015))
    muzzle(b, rng, BLACK, end, 0.0)
    central = rng.random() < 0.35  # the magazine goes through the grip
    hold = 0.5 * length if central else rng.uniform(0.05, 0.09)
    rake = rng.uniform(0, 5) if central else rng.uniform(8, 22)
    grip(b, furniture, (hold, low + 0.015), rng.uniform(0.1, 0.13), rake, 0.05, 0.036)
    trigger(b, steel, hold + 0.018, hold + 0.09, low + 0.003, 0.04, 0.014)
    if central:
        magazine(b, IRON, (hold, low + 0.02), rng.uniform(0.16, 0.27), 0.036, 0.025)
    else:
        _forward_feed(b, rng, steel, rng.uniform(hold + 0.13, length - 0.03), low)
        if rng.random() < 0.35:
            grip(b, furniture, (length - 0.01, low + 0.01), 0.09, -4, 0.035, 0.03)
    iron_sights(b, steel, 0.05, length - 0.03, high - 0.003, 0.016)
    handle = at(0.4 * length, 0.2 * tall)
    b.cylinder("body", steel, handle, handle + np.array([0.8 * wide, 0, 0]), 0.007)
    kinds = {"solid": 0.2, "wire": 0.4, "frame": 0.25, "tube": 0.15}
    buttstock(b, rng, furniture, 0.0, (low, high), kinds)
    return b


def _forward_feed(
    b: Builder, rng: np.random.Generator, steel: Material, well: float, low: float
) -> None:
    """Add a drum or a straight or curved stick below a receiver's underside at `low`."""
    if rng.random() < 0.25:
        radius = rng.uniform(0.06, 0.08)
        drum(b, steel, (well, low - 0.75 * radius), radius, 0.06)
        return
    curl = rng.uniform(10, 30) if rng.random() < 0.4 else 0.0
    length, lean = rng.uniform(0.16, 0.27), rng.uniform(0, 8)
    magazine(b, IRON, (well, low + 0.02), length, 0.036, 0.025, lean, curl)


def machine_gun(rng: np.random.Generator) -> Builder:
    """Draw a machine gun on a bipod, fed from a box, a drum or from above."""
    b, steel, furniture = Builder(), draw_steel(rng), draw_furniture(rng, wood=0.4)
    tall, wide, length = rng.uniform(0.08, 0.11), rng.uniform(0.05, 0.065), rng.uniform(0.3, 0.42)
    high, low = 0.45 * tall, -0.55 * tall
    rows = [(0, low + 0.01, high - 0.015, wide), (0.04, low, high, wide)]
    rows += [(0.7 * length, low, high, wide), (length, low + 0.01, high - 0.02, 0.9 * wide)]
    bar(b, "body", steel, rows, 0.85)
    end, guard = length + rng.uniform(0.3, 0.5), length + rng.uniform(0.0, 0.2)
    if rng.random() < 0.4:
        guard = end - rng.uniform(0.05, 0.12)
        jacket(b, steel, length - 0.01, guard, rng.uniform(0.024, 0.034))
    elif guard > length + 0.07:
        handguard(b, rng, furniture, (length - 0.01, guard), -0.005, 0.06, wide)
    barrel(b, steel, length - 0.02, end, 0.0, rng.uniform(0.013, 0.018))
    muzzle(b, rng, steel, end, 0.0)
    grip(
        b, furniture, (0.07, low + 0.02), rng.uniform(0.1, 0.12), rng.uniform(10, 25), 0.046, 0.036
    )
    trigger(b, steel, 0.085, 0.155, low + 0.004, 0.04, 0.014)
    _feed(b, rng, steel, 0.62 * length, low, high)
    bipod(b, rng, steel, end - rng.uniform(0.06, 0.16))
    if rng.random() < 0.5:
        hold = length + rng.uniform(0.0, 0.05)
        loop = [at(hold, 0.01), at(hold, 0.09), at(hold - 0.11, 0.1)]
        b.tube("body", furniture, bend(loop, 0.02, 3), 0.01, 10)
    iron_sights(b, steel, 0.1, end - 0.03, 0.012, 0.02)
    buttstock(
        b, rng, furniture, 0.0, (low + 0.012, high), {"solid": 0.65, "tube": 0.15, "frame": 0.2}
    )
    return b


def _feed(
    b: Builder, rng: np.random.Generator, steel: Material, middle: float, low: float, high: float
) -> None:
    """Add a hanging ammunition box, a drum, or a magazine that stands on top."""
    kind = draw(rng, ["box", "drum", "top", "pan"], [0.4, 0.25, 0.2, 0.15])
    if kind == "box":
        size = (rng.uniform(0.07, 0.1), rng.uniform(0.09, 0.15), rng.uniform(0.09, 0.14))
        b.rounded_box(
            "magazine",
            draw_furniture(rng, wood=0),
            at(middle, low - size[1] / 2 + 0.01),
            size,
            0.012,
        )
    elif kind == "drum":
        radius = rng.uniform(0.06, 0.085)
        drum(b, steel, (middle, low - 0.8 * radius), radius, rng.uniform(0.06, 0.09))
    elif kind == "top":
        magazine(
            b,
            steel,
            (middle, high - 0.02),
            rng.uniform(0.16, 0.24),
            0.06,
            0.03,
            180,
            -rng.uniform(10, 35),
        )
    else:
        radius = rng.uniform(0.09, 0.13)
        profile = [(0.0, 0), (radius, 0), (radius, 0.025), (0.6 * radius, 0.035), (0.0, 0.035)]
        b.lathe("magazine", steel, profile, at(middle, high - 0.002))
