"""Heads of lamps: shades, globes, lanterns, candles. Each is drawn once, for all its sockets."""

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import UP, Array
from ffd_lightning.shapes.lamp.bases import ROUND, outline, turned
from ffd_lightning.shapes.lamp.plan import FLIP, Plan, Socket, Sockets

_GLOW = Material((1.0, 0.95, 0.75))


def _shell(b: Builder, p: Plan, rows: Array, s: Socket, shape: Array = ROUND) -> None:
    """Add a thin open shade along (radius, height) rows from its mouth on, closed or spoked."""
    wall, mouth = max(0.004, 0.02 * rows[:, 0].max()), rows[0, 0]
    inner = np.maximum(rows[::-1] - (wall, 0), (0.002, -np.inf))
    turned(b, "shade", p.skin, [*rows, *inner, rows[0]], s, shape)
    if mouth < max(0.3 * rows[:, 0].max(), 0.03):
        ends = s.point(-0.4 * mouth), s.point(0.5 * mouth)
        b.cylinder("shade", p.metal, *ends, 0.6 * mouth, radius_end=1.1 * mouth, segments=14)
        return
    for x, z in shape[:: max(1, len(shape) // 4)] * (mouth - wall / 2):
        spoke = np.array([[0, 2 * wall, 0], [x, 2 * wall, z]])
        b.tube("shade", p.metal, spoke @ s.turn.T + s.at, 0.004, segments=6)
    b.cylinder("shade", p.metal, s.point(-0.2 * wall), s.point(3 * wall), 0.012, segments=10)


def _bulb(b: Builder, p: Plan, s: Socket, low: float, size: float) -> None:
    """Add a bulb, `size` long, in a holder that begins at `low`."""
    b.cylinder("bulb", p.metal, s.point(low), s.point(low + 0.4 * size), 0.17 * size, segments=10)
    rows = [(0.14, 0.36), (0.2, 0.48), (0.31, 0.68), (0.3, 0.82), (0.18, 0.95), (0.03, 1.0)]
    b.lathe("bulb", _GLOW, size * np.array(rows), s.point(low), segments=8, turn=s.turn)


def _draw_shape(rng: Rng, sockets: Sockets, plain: float) -> Array:
    """Draw a cross-section: round where there are many or with probability `plain`."""
    if len(sockets) > 3:
        return outline("few")
    others = ["square", "hexagon", "fluted", "oval"]
    return outline("round" if rng.random() < plain else draw(rng, others))


def _draw_shade(rng: Rng, sockets: Sockets, height: float, mouth: float) -> Array:
    """Draw (radius, height) rows of a shade, straight, domed or belled, from its mouth on."""
    power = 1.0 if rng.random() < 0.4 else rng.uniform(0.25, 2.8)
    lip = rng.uniform(0.1, 0.45) * (rng.random() < 0.2)  # draws the opening in
    t = np.linspace(0, 1, 3 if power == 1 and not lip else 9 if len(sockets) < 4 else 5)
    r = (mouth + (1 - mouth) * t**power) * (1 - lip * np.clip(2 * t - 1, 0, 1) ** 2)
    return np.stack([r / r.max(), t], 1) * (sockets[0].wide, height)


def cup(b: Builder, rng: Rng, p: Plan, sockets: Sockets) -> None:
    """Add shades that open away from their sockets, from spots and trumpets to bowls."""
    tall, mouth = sockets[0].wide * p.slender, rng.uniform(0.12, 0.28)
    rows, shape = _draw_shade(rng, sockets, tall, mouth), _draw_shape(rng, sockets, 0.8)
    for s in sockets:
        _shell(b, p, rows, s, shape)
        _bulb(b, p, s, 0.0, min(0.12, 0.75 * tall))


def cloth(b: Builder, rng: Rng, p: Plan, sockets: Sockets) -> None:
    """Add shades with a wide mouth, carried by wires around the bulbs or hung from spokes."""
    tall, mouth = sockets[0].wide * p.slender, rng.uniform(0.3, 1.0)
    rows, shape = _draw_shade(rng, sockets, tall, mouth), _draw_shape(rng, sockets, 0.6)
    gap = tall * (rng.uniform(-0.3, 0.1) if p.place == "floor" else rng.uniform(0.03, 0.3))
    low, bulb, a = max(gap, 0.0) + 0.1 * tall, min(0.12, 0.5 * tall), np.linspace(0, 2 * np.pi, 13)
    harp = np.stack([0.45 * bulb * np.sin(a), (gap + tall - low) * (1 - np.cos(a)) / 2, 0 * a], 1)
    for s in sockets:
        if s.turn[1, 1] < 0:
            _shell(b, p, rows, s, shape)
            _bulb(b, p, s, 0.0, bulb)
            continue
        _shell(b, p, rows, Socket(s.point(gap + tall), s.turn @ FLIP), shape)
        _bulb(b, p, s, low, bulb)
        b.cylinder("pole", p.metal, s.point(-0.01), s.point(low + 0.01), 0.004 + 0.04 * s.wide)
        b.tube("shade", p.metal, harp + s.point(low), 0.004, segments=4)
        b.ellipsoid("shade", p.metal, s.point(gap + tall + 0.01), (0.012, 0.02, 0.012), segments=8)


def globe(b: Builder, rng: Rng, p: Plan, sockets: Sockets) -> None:
    """Add closed bodies: balls, eggs, drops, boxes, ribbed paper, towers that stand alone."""
    few, wide = len(sockets) < 4, rng.uniform(0.6, 0.9) * sockets[0].wide
    slim = rng.uniform(0.85, 1.15) if rng.random() < 0.3 else rng.uniform(0.5, 1.7)
    tower = few and rng.random() < 0.3
    tall = wide * slim * (2 if tower else 1)
    a = np.linspace(-1.5, 1.5, 21 if few else 11)
    ribs = 1 + 0.025 * np.cos(np.pi * np.arange(len(a))) * (few and rng.random() < 0.3)
    power = rng.uniform(0.1, 0.3) if tower else rng.uniform(0.45, 1.0)
    r = ribs * (1 + rng.uniform(-0.3, 0.3) * np.sin(a)) * np.cos(a) ** power
    rows = np.stack([wide * r / r.max(), tall * (1 + np.sin(a))], 1)
    shape = _draw_shape(rng, sockets, 0.2 if tower else 0.9)
    for s in sockets:
        turned(b, "shade", p.skin, rows, s, shape)
        b.cylinder("shade", p.metal, s.point(-0.01), s.point(0.12 * tall), 0.4 * wide, segments=16)


def lantern(b: Builder, rng: Rng, p: Plan, sockets: Sockets) -> None:
    """Add roofed cases with posts and panes around a bulb, those for the table with a handle."""
    wide, shape = 0.8 * sockets[0].wide, outline(draw(rng, ["square", "hexagon"]))
    tall, waist, rise, eave = wide * rng.uniform((1.5, 0.55, 0.35, 1.1), (3.2, 1.0, 1.1, 1.4))
    pane = pick_material(rng, "glass") if rng.random() < 0.75 else p.skin
    sill = [(0.5 * waist, -0.01), (1.1 * waist, 0.01), (waist, 0.03)]
    t, power = np.linspace(0, 1, 6), rng.uniform(0.6, 1.3)
    roof = np.stack([eave + (0.16 * wide - eave) * t**power, tall + rise * t], 1)
    knob = wide * np.array([(0.1, -0.1), (0.2, 0.15), (0.05, 0.4)])
    a, high = np.linspace(0, np.pi, 21), rise + rng.uniform(0.3, 0.9) * wide
    handle = np.stack([0.9 * wide * np.cos(a), tall + high * np.sin(a), 0 * a], 1)
    for one in sockets:
        s = Socket(one.at - (tall + rise + 0.35 * wide if one.turn[1, 1] < 0 else 0.0) * UP)
        turned(b, "base", p.metal, sill, s, shape)
        turned(b, "shade", pane, [(0.93 * waist, 0.025), (0.93 * wide, tall)], s, shape)
        for x, z in shape:
            post = np.array([(x * waist, 0.02, z * waist), (x * wide, tall, z * wide)])
            b.tube("shade", p.metal, post + s.at, 0.07 * wide, segments=6)
        _bulb(b, p, s, 0.03, 0.5 * tall)
        turned(b, "shade", p.metal, [(eave, tall - 0.1 * wide), *roof], s, shape)
        b.lathe("shade", p.metal, knob, s.point(tall + rise), segments=14)
        if p.place == "table":
            b.tube("arm", p.metal, handle + s.at, 0.008, segments=8)


def candle(b: Builder, rng: Rng, p: Plan, sockets: Sockets) -> None:
    """Add candles on dishes."""
    wide, wax = min(0.4 * sockets[0].wide, 0.045), Material((0.93, 0.9, 0.82))
    tall = wide * rng.uniform(1.5, 5)
    dish = wide * np.array([(0.3, -0.3), (1, 0), (1.05, 0.25), (0.5, 0.3)])
    flame = wide * np.array([(0.15, 0), (0.32, 0.4), (0.24, 0.8), (0.03, 1.3)])
    for s in sockets:
        b.lathe("arm", p.metal, dish, s.at, segments=12)
        b.cylinder("bulb", wax, s.at, s.point(tall), 0.38 * wide, segments=10)
        b.lathe("bulb", _GLOW, flame, s.point(tall - 0.002), segments=8)


def leaves(b: Builder, rng: Rng, p: Plan, sockets: Sockets) -> None:
    """Add two to seven open discs, one below the other on a rod."""
    (s,), count = sockets, int(rng.integers(2, 8))
    gap, bulge = s.wide * rng.uniform(0.18, 0.5), rng.uniform(0.2, 0.8)
    top = s.at + (gap * (count + 0.2) if s.turn[1, 1] > 0 else 0) * UP
    b.cylinder("pole", p.metal, top, top - gap * count * UP, 0.02)
    for i, t in enumerate(np.linspace(-1, rng.uniform(-0.9, 1.1), count)):
        r = s.wide * (1 - bulge * t * t)
        rows = np.array([(0.03, 0.0), (0.62 * r, 0.35 * gap), (r, 1.1 * gap)])
        _shell(b, p, rows, Socket(top - i * gap * UP, FLIP))


def bar(b: Builder, rng: Rng, p: Plan, sockets: Sockets) -> None:
    """Add a long flat or rounded head with a glowing underside, across or along the arm."""
    (s,), across = sockets, rng.random() < 0.5
    long, wide, tall = s.wide * np.array([rng.uniform(2.8, 5), rng.uniform(0.4, 1), 0.25])
    size = np.array([long, tall, wide] if across else [wide, tall, long])
    center = s.at - (0, 0.4 * tall, 0.4 * long * (p.place == "desk" and not across))
    b.rounded_box("shade", p.body, center, size, rng.uniform(0.1, 0.5) * wide, edge=0.4 * tall)
    b.box("bulb", _GLOW, center - 0.42 * tall * UP, size * (0.9, 0.3, 0.8))


_BODIES = ("vase", "stack", "block", "loop", "tripod", "pole")
_UP = ("chandelier", "wheel", "bracket", "branches")
_DOWN = ("cord", "cords", "hook", "drops", "bow")
_ROOMS: dict[str, tuple[str, ...]] = {"place": ("table", "floor", "ceiling", "wall")}
HEADS = (
    Component("cloth", 4, cloth, {"stem": _BODIES, "place": ("table", "floor")}),
    Component("cloth", 1.2, cloth, _ROOMS | {"stem": (*_UP, *_DOWN)}),
    Component("cup", 2, cup, {"stem": (*_UP, *_DOWN, "jointed", "tree", "pole", "tripod")}),
    Component("globe", 1, globe, {"stem": (*_UP, *_DOWN, *_BODIES, "tree", "none")}),
    Component("lantern", 1, lantern, {"place": ("garden", "ceiling", "wall")}),
    Component("lantern", 1, lantern, {"stem": ("none",), "place": ("table",)}),
    Component("candle", 2, candle, _ROOMS | {"stem": _UP}),
    Component("leaves", 0.8, leaves, {"stem": ("cord", "pole", "block", "tripod", "none")}),
    Component("bar", 0.7, bar, {"stem": ("jointed", "cord"), "place": ("desk", "ceiling")}),
)
