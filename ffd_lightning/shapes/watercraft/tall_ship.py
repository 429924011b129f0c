"""Square-riggers."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, pick_material
from ffd_lightning.shapes.kit.vectors import UP, Array, vec
from ffd_lightning.shapes.watercraft.hull import Hull, bulwark, plank, solid_hull, tint
from ffd_lightning.shapes.watercraft.rig import add_jibs, add_rig, add_rope, add_sail, draw_cloth
from ffd_lightning.shapes.watercraft.superstructure import House, add_house


def tall_ship(rng: Rng) -> Builder:
    """Build a galleon, frigate or clipper: a wooden hull and two to four square-rigged masts."""
    b = Builder()
    length = rng.uniform(1.2, 1.7)
    beam, depth = length * rng.uniform(0.17, 0.25), rng.uniform(0.17, 0.25)
    castle = rng.uniform(0.0, 0.12)
    hull = Hull(
        length=length,
        beam=beam,
        depth=depth,
        widest=rng.uniform(0.4, 0.5),
        transom=rng.uniform(0.5, 0.75),
        fineness=rng.uniform(0.5, 0.75),
        fullness=rng.uniform(1.8, 2.6),
        sheer=(rng.uniform(0.04, 0.1), 0.05 + castle),
        rake=(rng.uniform(0.03, 0.12), rng.uniform(0.0, 0.08)),
        lift=(0.4 * depth, 0.3 * depth),
    )
    wood, spar = plank(rng), pick_material(rng, "wood")
    paint = wood if rng.random() < 0.5 else tint(rng, "black", "navy", "white", "red", "green")
    lower = tint(rng, "red", "teak", "dark", "green")
    solid_hull(b, hull, paint, lower, 0.45 * depth, plank(rng))
    bulwark(b, hull, paint, height=rng.uniform(0.03, 0.05), thickness=0.02)
    trim = tint(rng, "orange", "cream", "black", "red")
    _wales(b, rng, hull, trim)
    if castle > 0.03:
        poop = House(
            width=1.6 * hull.half(0.9),
            z=(hull.z(0.72), hull.z(0.99)),
            y=(hull.top(0.75), hull.top(0.99) + 0.5 * castle),
            slope=(0, -0.2),
            taper=0.2,
        )
        add_house(b, poop, paint, tint(rng, "window", "orange"), windows="panes", roof=0.01)
    bow = hull.edge(0.0, 0) * vec(0, 1, 1)
    tip = bow + vec(0, 0.1, -rng.uniform(0.22, 0.35))
    start = bow + vec(0, -0.03, 0.12)
    b.cylinder("mast", spar, start, tip, radius=0.018, radius_end=0.008, segments=8)
    masts, height = int(rng.integers(2, 5)), length * rng.uniform(0.65, 0.85)
    places = np.linspace(0.2, 0.8, masts) if masts > 2 else np.array([0.3, 0.62])
    cloth, furled = draw_cloth(rng), rng.random() < 0.15
    tiers, aft = int(rng.integers(2, 5)), rng.random() < 0.6
    for i, t in enumerate(places):
        foot = vec(0, hull.top(t) - 0.01, hull.z(t))
        tall = height * (1.0, 1.12, 0.95, 0.8)[i]
        last = aft and i == masts - 1
        if last:
            add_rig(b, rng, spar, cloth, foot, 0.85 * tall, 0.3 * length)
        else:
            _square_rig(b, rng, spar, cloth, foot, tall, 1.2 * beam, tiers, furled)
        for side in (-1, 1):
            for back in (0.0, 0.05):
                chain = hull.edge(t, side) + vec(0, 0.02, back)
                add_rope(b, chain, foot + 0.62 * tall * UP)
    fore = vec(0, hull.top(places[0]), hull.z(places[0]))
    add_jibs(b, rng, cloth, tip, fore, height)
    return b


def _wales(b: Builder, rng: Rng, hull: Hull, trim: Material) -> None:
    """Add painted strakes along the sides and perhaps a row of gun ports."""
    for t_level in np.linspace(0.06, 0.26, int(rng.integers(1, 4))):
        for side in (-1, 1):
            edge = [hull.edge(t, side, -0.004) for t in np.linspace(0.03, 1.0, 13)]
            path = np.array(edge) - t_level * hull.depth * UP
            b.tube("hull", trim, path, 0.007, segments=5)
    if rng.random() < 0.55:
        for t in np.linspace(0.25, 0.85, int(rng.integers(6, 12))):
            center = (0, hull.top(t) - 0.34 * hull.depth, hull.z(t))
            wide = 2 * hull.half(t) + 0.004
            b.box("gun", tint(rng, "black"), center, (wide, 0.026, 0.03))


def _square_rig(
    b: Builder,
    rng: Rng,
    spar: Material,
    cloth: Material,
    foot: Array,
    height: float,
    width: float,
    tiers: int,
    furled: bool,
) -> None:
    """Add a mast with yards and square sails, each narrower than the one below."""
    end = foot + height * UP
    b.cylinder("mast", spar, foot, end, radius=0.018, radius_end=0.008, segments=10)
    levels = np.linspace(0.16, 0.95, tiers + 1) * height
    ahead = vec(0, 0, -0.028)
    halves = 0.5 * width * np.linspace(1.0, 0.5, tiers + 1)
    for i in range(tiers):
        low, high = (foot + y * UP + ahead for y in (levels[i] + 0.015, levels[i + 1]))
        reach = vec(halves[i + 1] * 1.08, 0, 0)
        b.cylinder("mast", spar, high - reach, high + reach, 0.009, segments=6)
        top, bottom = reach * 0.92, vec(halves[i] * 0.95, 0, 0)
        if furled:
            path = [high + t * top + 0.01 * UP for t in (-0.95, -0.4, 0.0, 0.4, 0.95)]
            b.tube("sail", cloth, path, (0.01, 0.02, 0.026, 0.02, 0.01), segments=7)
        else:
            blown = (0, 0, -rng.uniform(0.05, 0.09))
            sides = (low - bottom, low + bottom, high - top, high + top)
            add_sail(b, cloth, sides, blown, rows=5, cols=6)
