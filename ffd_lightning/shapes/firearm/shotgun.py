"""Shotguns."""

from __future__ import annotations

from ffd_lightning.shapes.firearm.fittings import barrel, grip, trigger
from ffd_lightning.shapes.firearm.materials import BLACK, draw_furniture, draw_steel
from ffd_lightning.shapes.firearm.stocks import buttstock, fore_end, straight_stock
from ffd_lightning.shapes.firearm.swept import Cut, at, bar
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw


def shotgun(rng: Rng) -> Builder:
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
    rows = [
        Cut(forward=-0.06, low=low + 0.012, high=high - 0.012, width=0.7 * wide),
        Cut(forward=-0.03, low=low, high=high, width=wide),
        Cut(
            forward=rng.uniform(0.08, 0.16) if kind == "pump" else 0.04,
            low=low,
            high=high,
            width=wide,
        ),
    ]
    bar(b, "body", steel, rows, boxiness=0.6)
    fore_end(b, rng, wood, steel, kind, radius, end)
    trigger(b, steel, back=-0.05, front=0.045, top=low + 0.004, drop=0.04, width=0.014)
    if kind == "pump" and rng.random() < 0.4:
        top, length = (-0.055, low + 0.025), rng.uniform(0.1, 0.13)
        grip(b, wood, top, length=length, degrees=rng.uniform(15, 35), depth=0.05, width=0.035)
        if rng.random() < 0.7:
            buttstock(b, rng, wood, -0.05, (low, high), {"tube": 0.4, "wire": 0.35, "frame": 0.25})
    else:
        straight_stock(b, rng, wood, (low, high), wide)
    center = at(end - 0.015, radius + 0.002)
    b.ellipsoid("sight", _bead(steel), center, (0.004, 0.005, 0.004), segments=8)
    return b


def _bead(steel: Material) -> Material:
    """Return the bright colour of a bead sight beside `steel`."""
    return Material((0.9, 0.8, 0.5)) if sum(steel.color) < 1.5 else BLACK
