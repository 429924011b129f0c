"""What goes around and into a carcass: stands, tops, cornices and the filling of bays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ffd_lightning.shapes.cabinet.fronts import doors, fronts, shelves
from ffd_lightning.shapes.cabinet.joinery import Bay, Joinery, dividers, plank
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import rails
from ffd_lightning.shapes.kit.legs import LegStyle, add_leg, add_legs, draw_leg_style
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import UP, Pair, Triple, vec


def add_top(b: Builder, rng: Rng, material: Material, size: Triple) -> None:
    """Add a top with an overhang over `size` (width, height of its underside, depth)."""
    width, height, depth = size
    over, thickness = rng.uniform(0.0, 0.04), rng.uniform(0.02, 0.045)
    center = (0, height + thickness / 2 - 0.002, -over / 2)
    board = (width + 2 * over + 0.004, thickness, depth + over + 0.004)
    edge = rng.uniform(0.2, 0.45) * thickness
    b.rounded_box("top", material, center, board, radius=0.012, edge=edge)


def add_cornice(b: Builder, material: Material, size: Triple, reach: float, z: float = 0.0) -> None:
    """Add a moulding around the top of `size` (width, its height, depth) that flares by `reach`."""
    width, height, depth = size
    rings = []
    profile = [(0.0, -0.01), (0.3, 0.15), (0.33, 0.4), (0.5, 0.65), (0.8, 0.78), (1.0, 0.85)]
    for out, rise in [*profile, (1.0, 1.2)]:
        ring = corners(width + 2 * out * reach, depth + out * reach, height + rise * reach)
        rings.append(ring + vec(0, 0, z - out * reach / 2))
    b.loft("top", material, rings)


def fill(b: Builder, rng: Rng, style: Joinery, bay: Bay, kind: str) -> None:
    """Close or furnish a bay: "drawers", "door", "glass", "open" or "mixed" (one above another)."""
    if kind == "mixed":
        share = rng.uniform(0.2, 0.45)
        low, high = bay.split((1 - share, share), across=False)
        dividers(b, style, [low, high], across=False)
        first = draw(rng, ["door", "drawers", "open"])
        fill(b, rng, style, low, first)
        fill(b, rng, style, high, "drawers" if first != "drawers" else "open")
    elif kind == "drawers":
        rows = max(1, round(bay.height / rng.uniform(0.14, 0.28)))
        fronts(b, style, bay, min(rows, 6))
    elif kind in ("door", "glass"):
        shelves(b, style, bay, min(4, int(bay.height / 0.35)))
        handle = 0.5 if bay.height > 1.1 else 0.85
        count = 2 if bay.width > 0.55 else 1
        doors(b, style, bay, count, glazed=kind == "glass", handle=handle)
    elif bay.height > 0.3:
        most = max(2, min(5, int(bay.height / 0.28)))
        shelves(b, style, bay, int(rng.integers(1, most)))


def stand(
    b: Builder, rng: Rng, material: Material, size: Pair, kinds: Sequence[str], height: float = 0.15
) -> float:
    """Add what carries a carcass of `size` (width, depth); return its height.

    `kinds` are any of "none", "plinth", "legs", "splayed", "bracket", "casters" and "sled";
    `height` is that of the tallest legs.
    """
    kind, (width, depth) = draw(rng, kinds), size
    if kind == "none":
        return 0.0
    if kind == "plinth":
        rise = rng.uniform(0.03, 0.09)
        low = (-0.49 * width, 0, -0.5 * depth + rng.uniform(0.0, 0.06))
        plank(b, "leg", material, low, (0.49 * width, rise + 0.003, 0.5 * depth))
        return rise
    if kind == "casters":
        return _casters(b, rng, width, depth)
    rise = rng.uniform(0.4, 1.0) * height
    if kind == "sled":
        side = rng.uniform(0.015, 0.03)
        feet = corners(0.9 * width, 0.85 * depth, side / 2)
        style = LegStyle("square", side, ((0, 1), (1, 1)))
        rails(b, "leg", material, feet, width=side, height=side)
        rails(b, "leg", material, feet + (rise - side) * UP, width=side, height=side)
        add_legs(b, "leg", material, style, feet * vec(1, 0, 1) + rise * UP, feet * vec(1, 0, 1))
    elif kind == "bracket":
        rise *= 0.7
        for foot in corners(width - 0.07, depth - 0.07, rise / 2):
            inward = np.sign(foot) * vec(1, 0, 1)
            b.box("leg", material, foot + inward * vec(-0.03, 0, 0.02), (0.13, rise, 0.025))
            b.box("leg", material, foot + inward * vec(0.02, 0, -0.03), (0.025, rise, 0.13))
    else:
        style = draw_leg_style(rng, (0.03, 0.06), hairpin=0.15 if height > 0.12 else 0.0)
        margin = 1.3 * style.thickness
        tops = corners(width - margin, depth - margin, rise + 0.003)
        spread = vec(1.04, 0, 1.1) if kind == "splayed" else vec(1, 0, 1)
        inset = vec(0.86, 1, 0.8) if kind == "splayed" else vec(1, 1, 1)
        add_legs(b, "leg", material, style, tops * inset, tops * inset * spread)
        if width > 1.6:
            for z in tops[[0, 2], 2] * inset[2]:
                add_leg(b, "leg", material, style, (0, rise + 0.003, z), (0, 0, z))
    return rise


def _casters(b: Builder, rng: Rng, width: float, depth: float) -> float:
    """Add four wheels on forks; return their height."""
    metal, rubber = pick_material(rng, "metal"), pick_material(rng, "rubber")
    radius = rng.uniform(0.02, 0.035)
    for x, _, z in corners(width - 0.09, depth - 0.09, 0):
        for side in (-0.012, 0.012):
            hub = vec(x + side, radius, z)
            b.cylinder("leg", rubber, hub - vec(0.007, 0, 0), hub + vec(0.007, 0, 0), radius)
        b.cylinder("leg", metal, (x, radius, z), (x, 2.3 * radius + 0.003, z), 0.012, segments=10)
    return 2.3 * radius


STANDS = ("plinth", "legs", "splayed", "bracket", "sled", "none")
