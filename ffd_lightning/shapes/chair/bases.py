"""What carries a chair's seat."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.chair.plan import Plan
from ffd_lightning.shapes.kit import Builder, Component, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, rails
from ffd_lightning.shapes.kit.legs import add_legs, draw_leg_style, stretchers
from ffd_lightning.shapes.kit.paths import bend, circle, corners
from ffd_lightning.shapes.kit.upholstery import Seating, add_base, add_feet
from ffd_lightning.shapes.kit.vectors import UP, Array, vec


def _four(rng: Rng, p: Plan, lift: float = 0.0) -> tuple[Array, Array]:
    """Return the tops and the feet of four legs, (4, 3) each, straight or splayed."""
    splay = rng.uniform(0.02, 0.16) if rng.random() < 0.5 else rng.uniform(0.0, 0.02)
    inset = 0.03 + 0.6 * splay
    tops = corners(p.width - 2 * inset, p.depth - 2 * inset, p.under)
    return tops, corners(p.width - 0.06 + splay, p.depth - 0.06 + splay, lift)


def legs(b: Builder, rng: Rng, p: Plan) -> None:
    """Add four legs, often with an apron, stretchers, or both; a bar stool has a footrest."""
    style = draw_leg_style(rng, (0.028, 0.048), hairpin=0.08)
    tops, feet = _four(rng, p)
    add_legs(b, "leg", p.frame, style, tops, feet)
    if style.plain and rng.random() < 0.5:
        rails(b, "leg", p.frame, feet + 0.93 * (tops - feet), width=0.018, height=0.05)
    kind = "box" if p.seat > 0.55 else draw(rng, ["none", "box", "h", "x"], [0.5, 0.2, 0.2, 0.1])
    if style.plain and kind != "none":
        points = feet + rng.uniform(0.2, 0.45) * (tops - feet)
        stretchers(b, "leg", p.frame, points, rng.uniform(0.014, 0.024), kind)


def tripod(b: Builder, rng: Rng, p: Plan) -> None:
    """Add three legs, sometimes joined."""
    style, reach = draw_leg_style(rng, (0.028, 0.045), hairpin=0.0), p.width / 2
    tops = circle(3, 0.7 * reach, p.under, 150.0)
    feet = circle(3, rng.uniform(0.85, 1.3) * reach, 0.0, 150.0)
    add_legs(b, "leg", p.frame, style, tops, feet)
    for level in np.sort(rng.uniform(0.2, 0.6, int(rng.integers(0, 3)))):
        rails(b, "leg", p.frame, feet + level * (tops - feet), width=0.018, height=0.022)


def sled(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two bent tubes on the floor, joined below the seat."""
    r, lean_in = rng.uniform(0.008, 0.014), rng.uniform(0.0, 0.1)
    front, rear = -0.5 * p.depth + 0.03, 0.5 * p.depth - 0.03
    for side in (-1, 1):
        x, top = side * (p.width / 2 - 0.02), side * (p.width / 2 - 0.02 - lean_in)
        path = [(top, p.under, front + 0.03), (x, r, front - 0.04 * (lean_in > 0.05))]
        path += [(x, r, rear + 0.05), (top, p.under, rear - 0.05)]
        b.tube("leg", p.frame, bend(path, 0.06), r, segments=8)
    for z in (front + 0.05, rear - 0.06):
        half = vec(p.width / 2 - 0.02 - lean_in, 0, 0)
        middle = vec(0, p.under - 0.01, z)
        b.cylinder("leg", p.frame, middle - half, middle + half, r, segments=8)


def cantilever(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one bent tube that carries the seat from its front."""
    r, half = rng.uniform(0.011, 0.018), p.width / 2 - 0.012
    front, rear = -p.depth / 2 - 0.01, p.depth / 2
    left = [(-half, p.under, rear - 0.04), (-half, p.under, front)]
    left += [(-half, r, front + rng.uniform(-0.03, 0.06)), (-half, r, rear + rng.uniform(0, 0.08))]
    right = [(-x, y, z) for x, y, z in left[::-1]]
    b.tube("leg", p.frame, bend(left + right, rng.uniform(0.05, 0.12)), r, segments=10)


def column(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one column on a disc or a trumpet foot; a bar stool has a ring for the feet."""
    foot, stem = p.width * rng.uniform(0.38, 0.55), rng.uniform(0.02, 0.04)
    if rng.random() < 0.5:
        rows = [(foot, 0), (foot, 0.012), (0.3 * foot, 0.035), (stem, 0.06)]
    else:
        t = np.linspace(0, 1, 9)
        rows = [(stem + (foot - stem) * (1 - s) ** 2.5, 0.008 + 0.45 * p.seat * s) for s in t]
        rows = [(foot, 0), *rows]
    rows += [(stem, p.under - 0.04), (0.3 * p.width, p.under)]
    b.lathe("leg", p.frame, rows, segments=32)
    if p.seat > 0.55:
        ring = circle(count=24, radius=0.4 * p.width, height=0.35 * p.seat)
        b.tube("leg", p.frame, [*ring, ring[0]], 0.009, segments=8)
        beam(b, "leg", p.frame, ring[0], ring[12], width=0.012, height=0.012)


def star(b: Builder, rng: Rng, p: Plan) -> None:
    """Add four or five feet, mostly on casters, below a gas column."""
    count, reach = int(rng.integers(4, 6)), rng.uniform(0.25, 0.34)
    rubber, hub = pick_material(rng, "rubber"), rng.uniform(0.08, 0.13)
    casters = rng.random() < 0.8
    for end in circle(count=count, radius=reach, height=0.055 if casters else 0.02, degrees=90.0):
        path = [(0, hub, 0), 0.5 * end + 0.6 * hub * UP, end]
        b.tube("leg", p.frame, path, (0.028, 0.022, 0.016), segments=8)
        if not casters:
            continue
        out = end * vec(1, 0, 1) / reach
        axle, wheel = vec(-out[2], 0, out[0]) * 0.02, end * vec(1, 0, 1) + 0.03 * UP
        b.cylinder("leg", rubber, wheel - axle, wheel + axle, 0.03, segments=12)
        b.cylinder("leg", rubber, wheel, end, 0.012, segments=8)
    rows = [(0.035, hub - 0.03), (0.035, 0.6 * p.seat), (0.02, 0.6 * p.seat), (0.02, p.under)]
    b.lathe("leg", p.frame, rows, segments=12)
    b.box("leg", p.frame, (0, p.under - 0.015, 0), (0.4 * p.width, 0.03, 0.45 * p.depth))


def rockers(b: Builder, rng: Rng, p: Plan) -> None:
    """Add four legs on two curved runners."""
    tops, feet = _four(rng, p, lift=0.05)
    add_legs(b, "leg", p.frame, draw_leg_style(rng, (0.028, 0.042), 0.0), tops, feet)
    stretchers(b, "leg", p.frame, feet + 0.5 * (tops - feet), 0.016, draw(rng, ["box", "h"]))
    z = np.linspace(-0.7 * p.depth, 0.9 * p.depth, 13)
    for x in feet[:2, 0]:
        runner = np.column_stack([np.full(13, x), 0.02 + 0.5 * z**2, z])
        b.tube("leg", p.frame, runner, 0.016, segments=8)


def scissors(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two crossed pairs of legs, as folding chairs have them."""
    front, rear = -0.5 * p.depth - 0.02, 0.5 * p.depth + 0.02
    for side in (-1, 1):
        x = side * (p.width / 2 - 0.02)
        beam(b, "leg", p.frame, (x, 0, front), (x, p.under, rear - 0.06), width=0.02, height=0.035)
        inner = x - 0.022 * side
        ends = (inner, p.under, front + 0.06), (inner, 0, rear)
        beam(b, "leg", p.frame, *ends, width=0.02, height=0.035)
    for z in (front + 0.03, rear - 0.02):
        half, middle = vec(p.width / 2 - 0.03, 0, 0), vec(0, 0.05, z)
        b.cylinder("leg", p.frame, middle - half, middle + half, 0.011, segments=8)


def sides(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two boards or two frames as sides."""
    wide = rng.uniform(0.02, 0.045)
    framed = rng.random() < 0.5
    for side in (-1, 1):
        x = side * (p.width / 2 - wide / 2 - 0.005)
        if framed:
            points = [(x, 0.02, -0.47), (x, p.under - 0.02, -0.47)]
            points += [(x, p.under - 0.02, 0.47), (x, 0.02, 0.47)]
            ring = np.array(points) * vec(1, 1, p.depth)
            rails(b, "leg", p.frame, ring, width=wide, height=0.045)
        else:
            size = (wide, p.under, 0.92 * p.depth)
            b.rounded_box("leg", p.frame, (x, p.under / 2, 0), size, 0.2 * wide)


def plinth(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a padded box on feet below a seat's cushions."""
    add_base(b, s)
    add_feet(b, rng, s)


_SITTING = {"use": ("dining", "lounge", "bar")}
_HOME = {"use": ("dining", "lounge")}
BASES = (
    Component("legs", 6, legs, _SITTING),
    Component("tripod", 0.6, tripod, {"use": ("bar",)}),
    Component("sled", 0.9, sled, _SITTING),
    Component("cantilever", 0.8, cantilever, _HOME),
    Component("column", 1.1, column),
    Component("star", 1.5, star, {"use": ("office", "lounge")}),
    Component("rockers", 0.4, rockers, _HOME),
    Component("scissors", 0.5, scissors, _HOME),
    Component("sides", 0.5, sides, _SITTING),
    Component("plinth", 5, plinth, {"use": ("lounge",)}),
)
