"""Seats of benches, what carries them, backs in the frame of `Plan.back`, and arms."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ffd_lightning.shapes.bench.plan import Plan
from ffd_lightning.shapes.kit import Builder, Component, Rng, draw, nothing
from ffd_lightning.shapes.kit.boards import beam, pad, slats
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs, add_trestles, draw_leg_style
from ffd_lightning.shapes.kit.paths import bend, corners
from ffd_lightning.shapes.kit.sheets import arc
from ffd_lightning.shapes.kit.vectors import SIDES, UP, lean, vec


def boards(b: Builder, rng: Rng, p: Plan, part: str = "seat", z: float = 0.0) -> None:
    """Add a level deck of boards."""
    count = int(rng.integers(2, 9)) if p.depth > 0.3 else int(rng.integers(1, 4))
    pitch = p.depth / count
    first, last = (vec(0, p.seat - p.thick / 2, z + s * (p.depth - pitch) / 2) for s in (-1, 1))
    size = (p.length, p.thick, pitch * (0.85 if count > 1 else 1.0))
    slats(b, part, p.wood, first, last, size, count)
    for x in p.xs:
        p.across(b, part, x, p.under - 0.018, 0.46 * p.depth, 0.04, z)


def board(b: Builder, rng: Rng, p: Plan, soft: float = 0.4) -> None:
    """Add one board or slab, with probability `soft` with a cushion on it."""
    size, middle = vec(p.length, p.thick, p.depth), vec(0, p.seat - p.thick / 2, 0)
    edge = min(0.4 * p.thick, 0.025)
    b.rounded_box("seat", p.wood, middle, size, rng.uniform(0.01, 0.12), edge=edge)
    if rng.random() < soft:
        size = vec(p.length - 2.2 * p.side, rng.uniform(0.03, 0.08), p.depth - p.side - 0.04)
        b.rounded_box("seat", p.cover, (0, p.seat + 0.45 * size[1], -0.01), size, 0.04)


def soft(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a thick pad, often buttoned or in two or three parts, on a frame."""
    count, edge = int(rng.choice([1, 2, 3], p=[0.7, 0.15, 0.15])), 0.4 * p.thick
    wide, middle = p.length / count, p.seat - p.thick / 2
    size, frame = (0.995 * wide, p.thick, p.depth), (0.97 * p.length, 0.05, 0.95 * p.depth)
    for x in (np.arange(count) + 0.5 - count / 2) * wide:
        b.rounded_box("seat", p.cover, (x, middle, 0), size, 0.05, edge=edge)
    b.rounded_box("seat", p.frame, (0, p.under - 0.01, 0), frame, 0.01)
    for x in np.linspace(-0.42, 0.42, round(p.length / 0.17)) if rng.random() < 0.4 else ():
        for z in (-0.3, 0.0, 0.3):
            at = (x * p.length, p.seat, z * p.depth)
            b.lathe("seat", p.frame, [(0.016, 0), (0.018, 0.004), (0.009, 0.01)], at, segments=8)


def legs(b: Builder, rng: Rng, p: Plan) -> None:
    """Add pairs of legs, straight or splayed, with rails below the seat and between the legs."""
    style = draw_leg_style(rng, (p.side, p.side), hairpin=0.12)
    reach, splay = p.depth / 2 - p.side / 2, rng.choice([0.0, rng.uniform(0.0, 0.08)])
    tops = np.array([(x, p.under, z) for x in p.xs for z in (splay - reach, reach - splay)])
    add_legs(b, "leg", p.frame, style, tops, tops * vec(1 + splay / p.length, 0, 1 + splay / reach))
    apron, paired = (rng.random(2) < 0.5) & style.plain
    t, tall = rng.uniform(0.2, 0.5), rng.uniform(0.05, 0.1)
    for x in p.xs if paired else ():
        wide = (reach - splay) * (1 + (1 - t) * splay / reach)
        p.across(b, "leg", x * (1 + (1 - t) * splay / p.length), t * p.under, wide, 0.03)
    for i in (-1, 1) if apron else ():
        y, z = p.under - tall / 2, i * (reach - splay)
        p.across(b, "leg", i * p.xs[-1], y, reach - splay, tall)
        beam(b, "leg", p.frame, (p.xs[0], y, z), (p.xs[-1], y, z), 0.022, tall)


def slabs(b: Builder, rng: Rng, p: Plan) -> None:
    """Add an upright board at each end, and one on edge between them."""
    size = (rng.uniform(0.6, 1.0) * p.side, p.under, p.depth * 0.92)
    for x in p.xs[[0, -1]]:
        b.rounded_box("leg", p.frame, (x, p.under / 2, 0), size, 0.01, segments=4)
    y, tall = p.under * rng.uniform(0.3, 0.8), rng.uniform(0.0, 0.35) * p.under
    beam(b, "leg", p.frame, (p.xs[0], y, 0), (p.xs[-1], y, 0), 0.03, max(tall, 0.04))


def trestles(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two trestles joined by a beam."""
    add_trestles(b, rng, p.frame, "leg", (p.xs[0], p.xs[-1]), (0.46 * p.depth, p.under, p.side))


def loops(b: Builder, rng: Rng, p: Plan) -> None:
    """Add loops of tube, as wide as the seat or wider on the floor."""
    r, z, out = 0.22 * p.side, 0.45 * p.depth, rng.choice([0.0, rng.uniform(-0.05, 0.06)])
    for x in p.xs:
        path = [(x, p.under, -z), (x, r, -z - out), (x, r, z + out), (x, p.under, z)]
        b.tube("leg", p.frame, bend(path, rng.uniform(0.04, 0.12)), r, segments=10)
        p.across(b, "leg", x, p.under - 0.01, z, 0.02)


def iron(b: Builder, rng: Rng, p: Plan) -> None:
    """Add curved iron legs that are joined in pairs."""
    z, low = 0.44 * p.depth, p.under - 0.01
    for x in p.xs:
        for side in (-1, 1):
            path = [(x, 0.01, side * (z + 0.07)), (x, 0.5 * low, side * (z - 0.05))]
            b.tube("leg", p.frame, bend([*path, (x, low, side * z)], 0.2), 0.018, segments=8)
        p.across(b, "leg", x, low, z, 0.03)
        p.across(b, "leg", x, 0.45 * low, z - 0.03, 0.03)


def chest(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box with panels below the seat, on the floor or on short feet."""
    low, count = rng.choice([0.0, rng.uniform(0.03, 0.35) * p.under]), int(rng.integers(1, 6))
    size, y = vec(p.length - 0.02, p.under - low, p.depth - 0.03), (p.under + low) / 2
    b.rounded_box("seat", p.frame, (0, y, 0), size, 0.008)
    panel = (0.88 * size[0] / count, 0.8 * size[1], 0.03)
    for x in (np.arange(count) + 0.5 - count / 2) * size[0] / count:
        b.rounded_box("seat", p.wood, (x, y, -size[2] / 2), panel, 0.008)
    tops = corners(size[0] - p.side, size[2] - p.side, low + 0.005)
    add_legs(b, "leg", p.frame, LegStyle("square", p.side), tops, tops * vec(1, 0, 1))


def blocks(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two blocks, flared blocks or turned feet of stone."""
    kind, wide, x = draw(rng, ["block", "flared", "turned"]), rng.uniform(0.08, 0.3), p.length / 2
    radii = np.array([1, 1, 0.6, 0.8, 0.55, 1, 1]) * 0.42 * p.depth
    for shift in x * rng.uniform(0.55, 0.8) * SIDES:
        if kind == "turned":
            heights = np.array([0, 0.1, 0.18, 0.45, 0.8, 0.93, 1]) * p.under
            b.lathe("leg", p.frame, np.column_stack([radii, heights]), (shift, 0, 0))
            continue
        rings = []
        for t in (0, 0.12, 0.3, 0.7, 0.88, 1):
            grow = 1.5 if kind == "flared" and abs(t - 0.5) > 0.3 else 1.0
            ring = corners(grow * wide, (0.5 + 0.2 * grow) * p.depth, t * p.under)
            rings.append(ring + vec(shift, 0, 0))
        b.loft("leg", p.frame, rings)


def picnic(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a table between two benches on common frames."""
    wide, state = rng.uniform(0.5, 0.95), int(rng.integers(1 << 30))
    out, length = wide / 2 + rng.uniform(0.2, 0.45), p.length * rng.uniform(0.95, 1.15)
    table = replace(p, seat=rng.uniform(0.66, 0.82), depth=wide, length=length)
    boards(b, rng, table, "table")
    for z in (-out, out):
        boards(b, np.random.default_rng(state), p, z=z)
    post = LegStyle("square", p.side, stretch=(0.7, 1.4))
    low, top, tip = p.under - 0.06, table.under, out + 0.45 * p.depth
    for x in p.length * rng.uniform(0.28, 0.4) * SIDES:
        heads, feet = ([(x, y, -z), (x, y, z)] for y, z in ((top, 0.3 * wide), (0, 0.95 * out)))
        add_legs(b, "leg", p.frame, post, heads, feet)
        p.across(b, "leg", x, low, tip, 0.08)
        p.across(b, "leg", x, top - 0.03, 0.45 * wide, 0.06)
        beam(b, "leg", p.frame, (x, low, 0), (0.25 * x, top - 0.01, 0), 0.04, 0.06)


def bows(b: Builder, rng: Rng, p: Plan, backed: bool = False) -> None:
    """Add bows of boards on pairs of posts, `backed` with some behind them."""
    half, inner = np.radians(rng.uniform(25, 125)), rng.uniform(0.3, 1.0)
    inner += 0.25 / half
    angles, outer, low = np.linspace(-half, half, 29), inner + p.depth, p.under
    for start, end in pairwise(np.linspace(inner, outer, int(rng.integers(2, 7)))):
        arc(b, "seat", p.wood, (start, end - 0.01), (low, p.seat), angles)
    levels = p.seat + np.linspace(0.35, 1.0, int(rng.integers(2, 5))) * p.rise
    for bottom, top in pairwise(levels) if backed else ():
        heights = bottom, top - 0.15 * (top - bottom)
        arc(b, "back", p.wood, (outer, outer + 0.03), heights, angles)
    style = LegStyle(draw(rng, ["square", "round"]), p.side)
    for angle in np.linspace(-0.92, 0.92, max(3, round(2 * half * inner / 0.7))) * half:
        out = vec(np.sin(angle), 0, np.cos(angle))
        feet = np.outer((inner + 0.12 * p.depth, inner + 0.85 * p.depth), out)
        add_legs(b, "leg", p.frame, style, feet + low * UP, feet)
        level, rear = (low - 0.02) * UP, (outer - 0.012) * out
        beam(b, "leg", p.frame, (inner + 0.03) * out + level, outer * out + level, 0.04, 0.04)
        if backed:
            top = rear + (p.seat + 0.97 * p.rise) * UP
            beam(b, "back", p.frame, rear + level, top, 0.03, 0.025)


def shelf(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one or two shelves of boards below the seat."""
    wide, count = p.xs[-1] - p.xs[0] + p.side, int(rng.integers(1, 3))
    low = replace(p, length=wide, inset=p.side / 2, depth=0.84 * p.depth, thick=0.02)
    for t in np.linspace(rng.uniform(0.2, 0.45), 1, count + 1)[:-1]:
        boards(b, rng, replace(low, seat=t * p.under), "leg")


def slatted(b: Builder, rng: Rng, p: Plan) -> None:
    """Add posts and one to six long boards before them."""
    for x in p.xs:
        beam(b, "back", p.frame, p.back(x, -0.06), p.back(x, p.rise), 0.8 * p.side, 0.04)
    count, low = int(rng.integers(1, 7)), p.rise * rng.uniform(0.05, 0.6)
    pitch = (p.rise - low) / count
    first, last = p.back(0, low + pitch / 2, -0.03), p.back(0, p.rise - pitch / 2, -0.03)
    size = (p.length, rng.uniform(0.6, 0.9) * pitch, 0.022)
    slats(b, "back", p.wood, first, last, size, count, lean(p.rake))


def _framed(b: Builder, rng: Rng, p: Plan) -> float:
    """Add posts, a crest and a lower rail; return the height of the rail."""
    xs, low = p.xs, p.rise * rng.choice([0.02, rng.uniform(0.15, 0.35)])
    for x in xs:
        beam(b, "back", p.frame, p.back(x, -0.05), p.back(x, p.rise), p.side, p.side)
    crest = (xs[-1] - xs[0] + p.side + rng.uniform(0.0, 0.1), rng.uniform(0.04, 0.12), 0.035)
    pad(b, "back", p.frame, p.back(0, p.rise), crest, rng.uniform(0.1, 0.5) * crest[1], p.rake)
    beam(b, "back", p.frame, p.back(xs[0], low), p.back(xs[-1], low), 0.03, 0.04)
    return low


def bars(b: Builder, rng: Rng, p: Plan) -> None:
    """Fill a frame with thin rods or upright laths."""
    low, flat = _framed(b, rng, p), rng.random() < 0.4
    for x in np.linspace(p.xs[0], p.xs[-1], round(p.length / rng.uniform(0.07, 0.16)))[1:-1]:
        rod = p.back(x, low), p.back(x, p.rise)
        if flat:
            beam(b, "back", p.wood, *rod, 0.045, 0.015)
        else:
            b.cylinder("back", p.wood, *rod, 0.01, segments=8)


def cross(b: Builder, rng: Rng, p: Plan) -> None:
    """Fill a frame with crossed bars."""
    low, first, last = _framed(b, rng, p), p.xs[0], p.xs[-1]
    count = max(1, round((last - first) / rng.uniform(0.5, 0.9)))
    for start, end in pairwise(np.linspace(first, last, count + 1)):
        for one, two, thick in ((start, end, 0.02), (end, start, 0.016)):
            beam(b, "back", p.wood, p.back(one, low), p.back(two, p.rise), thick, 0.03)


def panel(b: Builder, rng: Rng, p: Plan) -> None:
    """Fill a frame with a board."""
    low = _framed(b, rng, p)
    size = (p.xs[-1] - p.xs[0], p.rise - low, 0.02)
    pad(b, "back", p.wood, p.back(0, (p.rise + low) / 2), size, 0.02, p.rake)


def padded(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a pad or slab, or one for each seat."""
    count, rise = int(rng.choice([1, 2, 3], p=[0.7, 0.15, 0.15])), min(p.rise, 0.45 * p.length)
    wide, tall = p.length / count, rise + p.thick
    size, radius = (0.995 * wide, tall, rng.uniform(0.05, 0.12)), rng.uniform(0.1, 0.3) * tall
    for x in (np.arange(count) + 0.5 - count / 2) * wide:
        pad(b, "back", p.cover, p.back(x, (rise - p.thick) / 2), size, radius, p.rake)


def rests(b: Builder, rng: Rng, p: Plan, backed: bool = True) -> None:
    """Add an arm at each end: a rest on a post, and on a second one if there is no back."""
    front, top = -p.depth / 2 + p.side / 2, p.seat + p.arm
    rear = p.back(0, p.arm)[2] if backed else p.depth / 2 - p.side / 2
    for x in p.xs[[0, -1]]:
        for z in (front,) if backed else (front, rear):
            post = (x, p.under - 0.05, z), (x, top, z)
            beam(b, "arm", p.frame, *post, 0.8 * p.side, 0.8 * p.side)
        rest = (1.2 * p.side, 0.03, rear - front + 0.08)
        b.rounded_box("arm", p.frame, (x, top, (front + rear) / 2 - 0.03), rest, 0.02)


def hoops(b: Builder, rng: Rng, p: Plan) -> None:
    """Add bent tubes as arms."""
    for x in p.xs[[0, -1]]:
        front, rear = -0.42 * p.depth, p.back(x, p.arm)
        path = [vec(x, p.under, front + 0.05), vec(x, p.seat + p.arm, front - 0.04), rear]
        b.tube("arm", p.frame, bend(path, 0.12), 0.018, segments=8)


def ends(b: Builder, rng: Rng, p: Plan) -> None:
    """Close both ends by boards between the seat and a rest."""
    front, rear, top = -p.depth / 2, p.back(0, p.arm)[2], p.seat + p.arm
    low, z, deep = rng.choice([0.0, p.under - 0.02]), (front + rear) / 2, rear - front
    for x in (-p.length / 2, p.length / 2):
        b.rounded_box("arm", p.wood, (x, (top + low) / 2, z), (0.025, top - low, deep), 0.008)
        b.rounded_box("arm", p.frame, (x, top, z - 0.01), (0.06, 0.03, deep + 0.03), 0.012)


def scrolls(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a padded end at each side, rolled outward or plain."""
    thick, rolled = rng.uniform(0.05, 0.1), rng.random() < 0.6
    tall, half = p.arm + p.thick, vec(0, 0, p.depth / 2)
    for side in (-1, 1):
        x = side * (p.length / 2 + 0.4 * thick)
        middle = (x, p.seat + (p.arm - p.thick) / 2, 0)
        b.rounded_box("arm", p.cover, middle, (thick, tall, p.depth), 0.02)
        if rolled:
            roll = vec(x + side * 0.3 * thick, p.seat + p.arm, 0)
            b.cylinder("arm", p.cover, roll - half, roll + half, 0.75 * thick)


_BOARDED = {"use": ("garden", "hall", "row", "stool")}
_LEVEL = {"seat": ("boards", "board", "pad")}
_WOODEN = {"seat": ("boards", "board")}
_ROUND = {"use": ("round",)}
SEATS = (
    Component("boards", 4, boards, _BOARDED),
    Component("board", 3, board, _BOARDED),
    Component("pad", 4, soft, {"use": ("hall", "bed", "stool")}),
    Component.of("slab", 1, board, {"use": ("stone",)}, soft=0.0),
    Component("bows", 1, nothing, _ROUND),
    Component("pair", 1, nothing, {"use": ("picnic",)}),
)
BASES = (
    Component("legs", 4, legs, _LEVEL),
    Component("slabs", 1.5, slabs, _WOODEN),
    Component("trestles", 1.5, trestles, _LEVEL),
    Component("loops", 1.5, loops, _LEVEL),
    Component("iron", 2, iron, {"use": ("garden",), **_WOODEN}),
    Component("chest", 2.5, chest, {"use": ("hall", "bed"), "seat": ("board", "pad")}),
    Component("blocks", 1, blocks, {"seat": ("slab",)}),
    Component("bows", 1, bows, _ROUND),
    Component.of("backed bows", 1, bows, _ROUND, backed=True),
    Component("picnic", 1, picnic, {"use": ("picnic",)}),
)
_SAT = {"use": ("garden", "hall"), **_WOODEN}
BACKS = (
    Component("open", 2, nothing),
    Component("slats", 2.5, slatted, _SAT),
    Component("bars", 2.5, bars, _SAT),
    Component("cross", 1, cross, _SAT),
    Component("panel", 1.5, panel, _SAT),
    Component("padded", 2, padded, {"use": ("hall", "bed"), "seat": ("pad",)}),
    Component("slab", 1.2, padded, {"seat": ("slab",)}),
)
_POSTS = ("slats", "bars", "cross", "panel")
ARMS = (
    Component("none", 2, nothing),
    Component("rests", 3, rests, {"back": _POSTS}),
    Component.of("posts", 1, rests, {**_SAT, "back": ("open",)}, backed=False),
    Component("hoops", 1, hoops, {"back": _POSTS, "base": ("iron", "loops")}),
    Component("ends", 1.5, ends, {"use": ("hall",), "back": _POSTS}),
    Component("scrolls", 2, scrolls, {"seat": ("pad",)}),
)
BELOW = (
    Component("nothing", 1, nothing),
    Component("shelf", 1, shelf, {"use": ("hall",), "base": ("legs", "slabs", "loops")}),
)
