"""Submachine guns and machine guns."""

from __future__ import annotations

from ffd_lightning.shapes.firearm.fittings import (
    barrel,
    drum,
    grip,
    iron_sights,
    magazine,
    muzzle,
    trigger,
)
from ffd_lightning.shapes.firearm.materials import BLACK, IRON, draw_furniture, draw_steel
from ffd_lightning.shapes.firearm.stocks import bipod, buttstock, handguard, jacket
from ffd_lightning.shapes.firearm.swept import Cut, at, bar, even_bar
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import vec


def submachine_gun(rng: Rng) -> Builder:
    """Draw a submachine gun: box or tube receiver, a stick or drum magazine, a light stock."""
    b, steel, furniture = Builder(), draw_steel(rng), draw_furniture(rng, wood=0.3)
    tall, length = rng.uniform(0.055, 0.085), rng.uniform(0.26, 0.38)
    round_ = rng.random() < 0.45
    high, low, wide = tall / 2, -tall / 2, tall * (1.0 if round_ else rng.uniform(0.55, 0.75))
    even_bar(b, "body", steel, (0, length), low, high, wide, 0.0 if round_ else 0.85)
    reach = rng.uniform(0.08, 0.22)
    end = length + rng.uniform(0.03, 0.12)
    if rng.random() < 0.5:
        jacket(b, steel, back=length - 0.005, front=length + reach, radius=0.42 * tall)
        end = length + reach + 0.02
    barrel(b, steel, start=length - 0.01, end=end, up=0.0, radius=rng.uniform(0.01, 0.015))
    muzzle(b, rng, BLACK, end, 0.0)
    central = rng.random() < 0.35  # the magazine goes through the grip
    hold = 0.5 * length if central else rng.uniform(0.05, 0.09)
    rake = rng.uniform(0, 5) if central else rng.uniform(8, 22)
    top = (hold, low + 0.015)
    grip(b, furniture, top, length=rng.uniform(0.1, 0.13), degrees=rake, depth=0.05, width=0.036)
    trigger(b, steel, back=hold + 0.018, front=hold + 0.09, top=low + 0.003, drop=0.04, width=0.014)
    if central:
        top = (hold, low + 0.02)
        magazine(b, IRON, top, length=rng.uniform(0.16, 0.27), depth=0.036, width=0.025)
    else:
        _forward_feed(b, rng, steel, rng.uniform(hold + 0.13, length - 0.03), low)
        if rng.random() < 0.35:
            top = (length - 0.01, low + 0.01)
            grip(b, furniture, top, length=0.09, degrees=-4, depth=0.035, width=0.03)
    iron_sights(b, steel, rear=0.05, front=length - 0.03, base=high - 0.003, height=0.016)
    handle = at(0.4 * length, 0.2 * tall)
    b.cylinder("body", steel, handle, handle + vec(0.8 * wide, 0, 0), 0.007)
    kinds = {"solid": 0.2, "wire": 0.4, "frame": 0.25, "tube": 0.15}
    buttstock(b, rng, furniture, 0.0, (low, high), kinds)
    return b


def _forward_feed(b: Builder, rng: Rng, steel: Material, well: float, low: float) -> None:
    """Add a drum or a straight or curved stick below a receiver's underside at `low`."""
    if rng.random() < 0.25:
        radius = rng.uniform(0.06, 0.08)
        drum(b, steel, (well, low - 0.75 * radius), radius, 0.06)
        return
    curl = rng.uniform(10, 30) if rng.random() < 0.4 else 0.0
    length, lean = rng.uniform(0.16, 0.27), rng.uniform(0, 8)
    top = (well, low + 0.02)
    magazine(b, IRON, top, length=length, depth=0.036, width=0.025, degrees=lean, curl=curl)


def machine_gun(rng: Rng) -> Builder:
    """Draw a machine gun on a bipod, fed from a box, a drum or from above."""
    b, steel, furniture = Builder(), draw_steel(rng), draw_furniture(rng, wood=0.4)
    tall, wide, length = rng.uniform(0.08, 0.11), rng.uniform(0.05, 0.065), rng.uniform(0.3, 0.42)
    high, low = 0.45 * tall, -0.55 * tall
    rows = [
        Cut(forward=0, low=low + 0.01, high=high - 0.015, width=wide),
        Cut(forward=0.04, low=low, high=high, width=wide),
        Cut(forward=0.7 * length, low=low, high=high, width=wide),
        Cut(forward=length, low=low + 0.01, high=high - 0.02, width=0.9 * wide),
    ]
    bar(b, "body", steel, rows, boxiness=0.85)
    end, guard = length + rng.uniform(0.3, 0.5), length + rng.uniform(0.0, 0.2)
    if rng.random() < 0.4:
        guard = end - rng.uniform(0.05, 0.12)
        jacket(b, steel, back=length - 0.01, front=guard, radius=rng.uniform(0.024, 0.034))
    elif guard > length + 0.07:
        handguard(b, rng, furniture, (length - 0.01, guard), up=-0.005, tall=0.06, wide=wide)
    barrel(b, steel, start=length - 0.02, end=end, up=0.0, radius=rng.uniform(0.013, 0.018))
    muzzle(b, rng, steel, end, 0.0)
    top, long, rake = (0.07, low + 0.02), rng.uniform(0.1, 0.12), rng.uniform(10, 25)
    grip(b, furniture, top, length=long, degrees=rake, depth=0.046, width=0.036)
    trigger(b, steel, back=0.085, front=0.155, top=low + 0.004, drop=0.04, width=0.014)
    _feed(b, rng, steel, 0.62 * length, low, high)
    bipod(b, rng, steel, end - rng.uniform(0.06, 0.16))
    if rng.random() < 0.5:
        hold = length + rng.uniform(0.0, 0.05)
        loop = [at(hold, 0.01), at(hold, 0.09), at(hold - 0.11, 0.1)]
        b.tube("body", furniture, bend(loop, 0.02, 3), 0.01, segments=10)
    iron_sights(b, steel, rear=0.1, front=end - 0.03, base=0.012, height=0.02)
    span = (low + 0.012, high)
    buttstock(b, rng, furniture, 0.0, span, {"solid": 0.65, "tube": 0.15, "frame": 0.2})
    return b


def _feed(b: Builder, rng: Rng, steel: Material, middle: float, low: float, high: float) -> None:
    """Add a hanging ammunition box, a drum, or a magazine that stands on top."""
    kind = draw(rng, ["box", "drum", "top", "pan"], [0.4, 0.25, 0.2, 0.15])
    if kind == "box":
        size = (rng.uniform(0.07, 0.1), rng.uniform(0.09, 0.15), rng.uniform(0.09, 0.14))
        center = at(middle, low - size[1] / 2 + 0.01)
        b.rounded_box("magazine", draw_furniture(rng, wood=0), center, size, 0.012)
    elif kind == "drum":
        radius = rng.uniform(0.06, 0.085)
        drum(b, steel, (middle, low - 0.8 * radius), radius, rng.uniform(0.06, 0.09))
    elif kind == "top":
        top, length, curl = (middle, high - 0.02), rng.uniform(0.16, 0.24), -rng.uniform(10, 35)
        magazine(b, steel, top, length=length, depth=0.06, width=0.03, degrees=180, curl=curl)
    else:
        radius = rng.uniform(0.09, 0.13)
        profile = [(0.0, 0), (radius, 0), (radius, 0.025), (0.6 * radius, 0.035), (0.0, 0.035)]
        b.lathe("magazine", steel, profile, at(middle, high - 0.002))
