"""Seats of chairs, shells that are seat and back in one, and what carries them."""

import numpy as np

from ffd_lightning.shapes.chair.plan import Plan
from ffd_lightning.shapes.kit import Builder, Component, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, rails, slats
from ffd_lightning.shapes.kit.legs import add_legs, draw_leg_style, stretchers
from ffd_lightning.shapes.kit.paths import bend, circle, corners
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.upholstery import Seating, boxed
from ffd_lightning.shapes.kit.vectors import SIDES, UP, Array, vec


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
        rails(b, "leg", p.frame, feet + 0.93 * (tops - feet), 0.018, 0.05)
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
        rails(b, "leg", p.frame, feet + level * (tops - feet), 0.018, 0.022)


def sled(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two bent tubes on the floor, joined below the seat."""
    r, lean_in = rng.uniform(0.008, 0.014), rng.uniform(0.0, 0.1)
    front, rear, y = -0.5 * p.depth + 0.03, 0.5 * p.depth - 0.03, p.under - 0.01
    low, high = p.width / 2 - 0.02, p.width / 2 - 0.02 - lean_in
    for side in (-1, 1):
        x, top = side * low, side * high
        path = [(top, p.under, front + 0.03), (x, r, front - 0.04 * (lean_in > 0.05))]
        path += [(x, r, rear + 0.05), (top, p.under, rear - 0.05)]
        b.tube("leg", p.frame, bend(path, 0.06), r, segments=8)
    for z in (front + 0.05, rear - 0.06):
        b.cylinder("leg", p.frame, (-high, y, z), (high, y, z), r, segments=8)


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
        ring = circle(24, 0.4 * p.width, 0.35 * p.seat)
        b.tube("leg", p.frame, [*ring, ring[0]], 0.009, segments=8)
        beam(b, "leg", p.frame, ring[0], ring[12], 0.012, 0.012)


def star(b: Builder, rng: Rng, p: Plan) -> None:
    """Add four or five feet, mostly on casters, below a gas column."""
    count, reach = int(rng.integers(4, 6)), rng.uniform(0.25, 0.34)
    rubber, hub = pick_material(rng, "rubber"), rng.uniform(0.08, 0.13)
    casters = rng.random() < 0.8
    for end in circle(count, reach, 0.055 if casters else 0.02, 90.0):
        path = [(0, hub, 0), 0.5 * end + 0.6 * hub * UP, end]
        b.tube("leg", p.frame, path, (0.028, 0.022, 0.016), segments=8)
        if casters:
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
    along = np.linspace(-0.7 * p.depth, 0.9 * p.depth, 13)
    for x in feet[:2, 0]:
        b.tube("leg", p.frame, [(x, 0.02 + 0.5 * z**2, z) for z in along], 0.016, segments=8)


def scissors(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two crossed pairs of legs, as folding chairs have them."""
    front, rear = -0.5 * p.depth - 0.02, 0.5 * p.depth + 0.02
    for side in (-1, 1):
        x = side * (p.width / 2 - 0.02)
        beam(b, "leg", p.frame, (x, 0, front), (x, p.under, rear - 0.06), 0.02, 0.035)
        x -= 0.022 * side
        beam(b, "leg", p.frame, (x, p.under, front + 0.06), (x, 0, rear), 0.02, 0.035)
    x = p.width / 2 - 0.03
    for z in (front + 0.03, rear - 0.02):
        b.cylinder("leg", p.frame, (-x, 0.05, z), (x, 0.05, z), 0.011, segments=8)


def sides(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two boards or two frames as sides."""
    wide, framed = rng.uniform(0.02, 0.045), rng.random() < 0.5
    z, low, high = 0.47 * p.depth, 0.02, p.under - 0.02
    for x in SIDES * (p.width / 2 - wide / 2 - 0.005):
        if framed:
            ring = np.array([(x, low, -z), (x, high, -z), (x, high, z), (x, low, z)])
            rails(b, "leg", p.frame, ring, wide, 0.045)
        else:
            size = (wide, p.under, 0.92 * p.depth)
            b.rounded_box("leg", p.frame, (x, p.under / 2, 0), size, 0.2 * wide)


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
    Component("plinth", 5, boxed, {"use": ("lounge",)}),
)


def board(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a flat board with more or less rounded corners."""
    size, middle = (p.width, p.thick, p.depth), (0, p.seat - p.thick / 2, 0)
    b.rounded_box("seat", p.frame, middle, size, rng.uniform(0.01, 0.12), edge=0.4 * p.thick)


def cushion(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board and a cushion on it."""
    board(b, rng, p)
    soft = rng.uniform(0.025, 0.06)
    size = (0.96 * p.width, soft, 0.94 * p.depth)
    b.rounded_box("seat", p.cover, (0, p.seat + 0.3 * soft, -0.01), size, rng.uniform(0.04, 0.1))


def pad(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a thick padded seat."""
    soft = rng.uniform(0.05, 0.11)
    middle = (0, p.seat - p.thick + soft / 2, 0)
    b.rounded_box("seat", p.cover, middle, (p.width, soft, p.depth), rng.uniform(0.03, 0.16))


def boards(b: Builder, rng: Rng, p: Plan) -> None:
    """Add boards or narrow slats across two rails."""
    count = int(rng.integers(4, 9))
    gap = p.depth / count
    first, last = (vec(0, p.seat - 0.01, s * (p.depth - gap) / 2) for s in (-1, 1))
    slats(b, "seat", p.frame, first, last, (p.width, 0.02, rng.uniform(0.6, 0.9) * gap), count)
    for x in (-0.42, 0.42):
        half, middle = vec(0, 0, p.depth / 2), vec(x * p.width, p.under, 0)
        beam(b, "seat", p.frame, middle - half, middle + half, 0.025, 0.04)


def disc(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a round seat, a board or a cushion."""
    half, low = p.width / 2, p.seat - p.thick
    soft, material = (0.03, p.frame) if rng.random() < 0.5 else (rng.uniform(0.05, 0.1), p.cover)
    ease, high = 0.4 * soft, low + soft
    rows = [(half - ease, low), (half, low + ease), (half, high - ease), (half - ease, high)]
    b.lathe("seat", material, [*rows, (0.4 * half, high + 0.004)], segments=36)


def cushions(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a loose cushion between padded arms."""
    s.add_seat_cushions(b, front=rng.uniform(0.0, 0.03))


def shell(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a moulded seat and back, curled up at the sides, sometimes into arms."""
    front = -p.depth / 2
    path = [vec(0, p.seat - 0.01, front - 0.03), vec(0, p.seat + 0.015, front + 0.05)]
    path += [vec(0, p.under + 0.005, 0.4 * p.depth), p.back(0, p.rise)]
    bent = bend(path, 0.16, 7)
    lengths = np.insert(np.cumsum(np.linalg.norm(np.diff(bent, axis=0), axis=1)), 0, 0)
    s, at = np.linspace(0, 1, 30), np.linspace(0, lengths[-1], 30)
    flat = np.stack([np.interp(at, lengths, bent[:, i]) for i in range(3)], 1)
    normal = np.cross(np.gradient(flat, axis=0), (1, 0, 0))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal *= np.sign(normal[:, 1].mean())
    curl, arms = rng.uniform(0.01, 0.07), rng.uniform(0.1, 0.19) * (rng.random() < 0.4)
    lift = (curl + arms * np.exp(-(((s - 0.6) / 0.25) ** 2))) * (1 - 0.8 * np.clip(s - 0.85, 0, 1))
    # The front and the top are rounded.
    ends, top = np.clip(1 - s / 0.12, 0, 1), np.clip((s - 0.78) / 0.22, 0, 1)
    rounding = np.sqrt(1 - 0.35 * ends**2) * np.sqrt(1 - 0.85 * top**2)
    taper = (1 - rng.uniform(-0.1, 0.35) * np.clip(s - 0.5, 0, 1)) * rounding
    u = np.linspace(-1, 1, 17)
    out = (np.abs(u) ** rng.uniform(2, 4))[:, None]
    grid = flat[:, None] + lift[:, None, None] * normal[:, None] * out
    grid[:, :, 0] = p.width / 2 * taper[:, None] * np.sin(1.3 * u) / np.sin(1.3)
    thickness = rng.uniform(0.01, 0.03)
    sheet(b, "seat", p.cover, grid[:16], thickness)
    sheet(b, "back", p.cover, grid[15:], thickness)


_PLAIN = ("legs", "tripod", "sled", "column", "rockers", "scissors", "sides")
FRAMED = (*_PLAIN, "cantilever")
SEATS = (
    Component("board", 3, board, {"base": _PLAIN}),
    Component("cushion", 2.5, cushion, {"base": FRAMED}),
    Component("pad", 2.5, pad, {"base": (*FRAMED, "star")}),
    Component("boards", 1, boards, {"base": ("legs", "sled", "rockers", "scissors", "sides")}),
    Component("disc", 4, disc, {"base": ("tripod", "column"), "use": ("bar",)}),
    Component("shell", 1.2, shell, {"base": ("legs", "sled", "column", "star", "rockers")}),
    Component("cushions", 1, cushions, {"base": ("plinth",)}),
)
