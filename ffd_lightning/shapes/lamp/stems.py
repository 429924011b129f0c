"""What carries the heads of a lamp: bodies, poles, arms, cords. All return sockets."""

import numpy as np
from scipy.interpolate import PchipInterpolator

from ffd_lightning.shapes.kit import Builder, Component, Rng, draw
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs
from ffd_lightning.shapes.kit.paths import bend, circle
from ffd_lightning.shapes.kit.sections import superellipse
from ffd_lightning.shapes.kit.vectors import UP, Array, about_y, about_z, lean, vec
from ffd_lightning.shapes.lamp.bases import ROUND, outline, turned
from ffd_lightning.shapes.lamp.plan import FLIP, Plan, Socket, Sockets


def none(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add nothing: the head sits on the base."""
    return p.heads(p.foot, hung=p.place == "ceiling")


def _vase_rows(rng: Rng, radius: float, height: float, neck: float) -> Array:
    """Draw the smooth (radius, height) rows of a vase."""
    levels = np.array([0, *np.sort(rng.uniform(0.1, 0.88, 3)), 0.95, 1])
    levels[1:-2] = np.maximum.accumulate(levels[1:-2] + 0.02 * np.arange(3))
    widths = rng.uniform(0.3, 1.0, 4) * radius
    widths[int(rng.integers(1, 4))] = radius
    t, knots = np.linspace(0, 1, 18), np.array([*widths, 1.2 * neck, neck])
    return np.stack([PchipInterpolator(levels, knots)(t), height * t], 1)


def vase(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add a turned body, round, fluted or with corners, sometimes twisted."""
    kind = draw(rng, ["round", "fluted", "hexagon", "square"], [0.7, 0.14, 0.08, 0.08])
    twist = rng.uniform(-150, 150) if kind in ("fluted", "square") else 0.0
    rows = _vase_rows(rng, p.radius * rng.uniform(0.6, 1.0), p.height, 0.016)
    turned(b, "base", p.body, rows, Socket(p.foot * UP), outline(kind), twist)
    return p.heads(p.foot + p.height)


def stack(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Thread two to six balls, discs or blocks on a rod, smaller toward the top."""
    b.cylinder("pole", p.metal, p.foot * UP, (p.foot + p.height) * UP, 0.01)
    shape, low = outline(draw(rng, ["round", "square", "hexagon"], [0.6, 0.25, 0.15])), p.foot
    a, power = np.linspace(-1.5, 1.5, 15), draw(rng, ["0.1", "0.6", "1"])
    shares = np.linspace(1, rng.uniform(0.4, 1.1), int(rng.integers(2, 7)))
    for i, size in enumerate(shares / shares.sum() * p.height):
        widths = 0.85 * p.radius * shares[i] * np.cos(a) ** float(power)
        rows, skin = np.stack([widths, 0.51 * size * np.sin(a)], 1), p.metal if i % 2 else p.body
        turned(b, "base", skin, rows, Socket((low + size / 2) * UP, about_y(30.0 * i)), shape)
        low += size
    return p.heads(low)


def block(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add a prism that widens or narrows upward: a drum, a box or a slab."""
    low, high = p.radius * rng.uniform(0.4, 1.0, 2)
    rows = [(low, 0), (high, 0.97 * p.height), (0.92 * high, p.height)]
    shape = outline(draw(rng, ["square", "hexagon", "round"])) * (1, rng.uniform(0.4, 1.0))
    turned(b, "base", p.body, rows, Socket(p.foot * UP), shape)
    return p.heads(p.foot + p.height)


def loop(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add an upright ring or frame of a thick tube."""
    half, thick = p.height / 2, rng.uniform(0.012, 0.028)
    ring = superellipse(rng.uniform(0, 0.9), 40)[[*range(40), 0]]
    flat = ring * (rng.uniform(0.4, 1.1) * half, half - 0.8 * thick) + (0, p.foot + half)
    b.tube("base", p.body, np.insert(flat, 2, 0, axis=1), thick)
    return p.heads(p.foot + p.height)


def tripod(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add three or four legs that meet below the shade, perhaps with a tray between them."""
    joint, spread = p.height * rng.uniform(0.55, 0.97), p.radius * rng.uniform(0.9, 1.7)
    count, k = int(rng.integers(3, 5)), 0.015 + 0.018 * p.height
    style = LegStyle(draw(rng, ["round", "square"]), k, ((0, 0.6), (0.5, 0.9), (1, 1)))
    tops, feet = circle(count, 0.6 * k, joint, 90), circle(count, spread, 0, 90)
    add_legs(b, "base", p.body, style, tops, feet)
    b.cylinder("pole", p.metal, (joint - k) * UP, (joint + 0.5 * k) * UP, 1.1 * k)
    b.cylinder("pole", p.metal, joint * UP, p.height * UP, 0.35 * k)
    if rng.random() < 0.35:
        level = rng.uniform(0.2, 0.5)
        tray = spread * (1 - level) + 0.6 * k * level
        b.lathe("base", p.body, [(tray, 0), (tray, 0.02)], level * joint * UP)
    return p.heads(p.height)


def pole(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add a slim or stout pole, often with knobs, sometimes with a tray."""
    slim = min(p.radius * rng.uniform(0.08, 0.22), 0.05 * p.height)
    b.cylinder("pole", p.metal, (p.foot - 0.01) * UP, (p.foot + p.height) * UP, slim)
    for y in rng.uniform(0.08, 0.9, int(rng.integers(0, 4))) * p.height + p.foot:
        rows = np.array([(1, -2), (rng.uniform(1.4, 2.4), -0.6), (2, 0.6), (1, 2)]) * slim
        b.lathe("pole", p.metal, rows, y * UP, segments=16)
    if p.place == "floor" and rng.random() < 0.15:
        tray = p.radius * rng.uniform(1.0, 1.4)
        b.lathe("base", p.body, [(tray, 0), (tray, 0.02)], 0.4 * p.height * UP)
    return p.heads(p.foot + p.height)


def jointed(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add an arm of two members on a joint, of one rod or two, sometimes with a counterweight."""
    tip, rise = np.radians(rng.uniform((-12, -25), (32, 40)))
    upper, k = p.height * rng.uniform(0.4, 0.8), 0.006 + 0.01 * p.height
    start, along = (p.foot + k) * UP, vec(0, np.sin(rise), -np.cos(rise))
    elbow = start + 0.8 * p.height * vec(0, np.cos(tip), np.sin(tip))
    end, rear = elbow + upper * along, elbow - 0.4 * upper * along * (rng.random() < 0.3)
    b.cylinder("arm", p.body, rear - 2 * k * along, rear + 4 * k * along, 2.2 * k)
    gap = 1.3 * k * (rng.random() < 0.5)
    for x in (-gap, gap) if gap else (0.0,):
        for one, other in ((start, elbow), (rear, end)):
            b.cylinder("arm", p.metal, one + (x, 0, 0), other + (x, 0, 0), 0.7 * k)
    axle = vec(k + gap, 0, 0)
    for joint in (start, elbow, end):
        b.cylinder("arm", p.body, joint - axle, joint + axle, 1.8 * k, segments=16)
    return [Socket(end, lean(rng.uniform(0, 55)) @ FLIP, min(p.wide, 0.45 * upper))]


def bow(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add a long bow whose end looks down, or a fan of three or five."""
    count, sockets = int(rng.choice([1, 3, 5], p=[0.75, 0.15, 0.1])), []
    last, share, reach = rng.uniform((1.8, 0.45, 0.35), (2.8, 0.9, 0.85))
    a, thick, bend_ = np.linspace(0, last, 24), 0.004 + 0.009 * p.height, rng.uniform(0.4, 1)
    for i, side in enumerate(np.linspace(-50, 50, count) if count > 1 else [0.0]):
        arch = np.sign(np.sin(a)) * np.abs(np.sin(a)) ** bend_
        rise = p.height * (1.2 - 0.14 * (i % 3)) * (share + (1 - share) * arch)
        along = reach * p.height * (1 - np.cos(a)) / (1 - np.cos(last))
        path = np.stack([0 * a, rise, -along], 1) @ about_y(side).T
        path = np.concatenate([[(0, p.foot - 0.01, 0)], path, [path[-1] - 0.04 * UP]])
        b.tube("pole", p.metal, path, list(np.linspace(thick, 0.6 * thick, 26)), segments=10)
        wide = min(p.wide, 0.45 * reach * p.height) / (1 if count == 1 else 2)
        sockets.append(Socket(path[-1], FLIP, wide))
    return sockets


def _arms(
    b: Builder, rng: Rng, p: Plan, level: float, reach: float, tilt: float, fall: float = 0.0
) -> Sockets:
    """Add curved arms around a pole from `level` down by `fall`; they end `tilt` degrees from up.

    Five or more that are level may have a second tier above them.
    """
    count, sockets = int(rng.integers(2, 6 if fall else 8)), []
    dip, low, rise = rng.uniform((-0.3, 0.05, 0.0), (0.5, 0.35, 0.3))
    flat = np.array([(0, 0), (0.35, -dip), (0.7, -low), (1, -low), (1, rise)])
    points = np.insert(flat * (1, 1 if tilt < 90 else -1) * reach, 2, 0, axis=1)
    path = bend(points, rng.uniform(0.1, 0.5) * reach, 4)
    tiers = 2 if count > 4 and not fall and rng.random() < 0.4 else 1
    wide = reach * min(rng.uniform(0.18, 0.45) / tiers, 0.85 * np.sin(np.pi / count))
    for tier in range(tiers):
        number = count - 2 * tier
        for i in range(number):
            turn = about_y(360.0 * i / number + 30 * tier)
            up = level + 0.6 * tier * reach - fall * i / number
            arm = (1 - 0.45 * tier) * path @ turn.T + up * UP
            b.tube("arm", p.metal, arm, 0.004 + 0.012 * reach, segments=6)
            sockets.append(Socket(arm[-1], turn @ about_z(-tilt), wide))
    if tiers == 2:
        b.cylinder("pole", p.metal, level * UP, (level + 0.65 * reach) * UP, 0.03 * reach)
    return sockets


def branches(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add a pole with upright heads on arms, as candelabra and street lamps have them."""
    pole(b, rng, p)
    reach = p.height * (rng.uniform(0.35, 0.8) if p.place == "table" else rng.uniform(0.2, 0.35))
    return _arms(b, rng, p, p.foot + p.height - 0.2 * reach, reach, 0.0)


def tree(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add a pole with short arms at several heights, their heads tilted outward."""
    pole(b, rng, p)
    reach, fall, tilt = rng.uniform((0.12, 0.2, 20), (0.25, 0.5, 130))
    return _arms(b, rng, p, p.foot + 0.93 * p.height, reach * p.height, tilt, fall * p.height)


def cord(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add a cord or a rod below the ceiling."""
    end, r = p.foot - p.height, rng.uniform(0.004, 0.014)
    b.cylinder("pole", p.metal, (p.foot + 0.01) * UP, (end - 0.005) * UP, r)
    return p.heads(end, hung=True)


def cords(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add two to seven cords, even or uneven, below a bar or around below a plate."""
    count, wide = int(rng.integers(2, 8)), rng.uniform(0.06, 0.16)
    ring, gap = 1.15 * wide / np.sin(np.pi / count), wide * rng.uniform(2.2, 3.2)
    tops = circle(count, ring, 0.0)
    if count < 3 or rng.random() < 0.5:
        tops = np.outer(np.arange(count) - (count - 1) / 2, (gap, 0, 0))
        bar = (gap * (count - 1) + 0.1, 0.03, 0.06)
        b.rounded_box("base", p.metal, (0, -0.015, 0), bar, radius=0.02, edge=0.005)
    else:
        b.lathe("base", p.metal, [(0.6 * ring, -0.03), (ring + 0.04, -0.01), (ring + 0.04, 0)])
    uneven = rng.uniform(0.2, 0.9) * (rng.random() < 0.6)
    ends = tops - np.outer(p.height * (1 + uneven * rng.uniform(-1, 1, count)) + 0.05, UP)
    for top, end in zip(tops, ends, strict=True):
        b.cylinder("pole", p.metal, top - 0.01 * UP, end - 0.005 * UP, 0.006, segments=8)
    return [Socket(end, FLIP, wide) for end in ends]


def chandelier(b: Builder, rng: Rng, p: Plan, tilt: float) -> Sockets:
    """Add a turned column on a cord, with arms around it."""
    tall, reach = rng.uniform((0.15, 0.25), (0.5, 0.55))
    low = Socket(cord(b, rng, p)[0].at - tall * UP)
    rows = _vase_rows(rng, rng.uniform(0.03, 0.08), tall + 0.005, 0.012)
    turned(b, "pole", p.metal if rng.random() < 0.6 else p.body, rows, low, ROUND)
    b.ellipsoid("pole", p.metal, low.at, (0.025, 0.05, 0.025))
    return _arms(b, rng, p, low.at[1] + rng.uniform(0.1, 0.3) * tall, reach, tilt)


def wheel(b: Builder, rng: Rng, p: Plan) -> Sockets:
    """Add a hoop on three or four cords, with heads around it."""
    count, r, end = int(rng.integers(4, 11)), rng.uniform(0.25, 0.5), p.foot - p.height - 0.15
    out, tall = r + rng.uniform(0.008, 0.02), rng.uniform(0.01, 0.06)
    hoop = [(r, 0), (out, 0), (out, -tall), (r, -tall), (r, 0)]
    turned(b, "arm", p.body, hoop, Socket(end * UP), ROUND)
    for point in circle(int(rng.integers(3, 5)), (r + out) / 2, end - 0.004, 20):
        b.cylinder("pole", p.metal, (p.foot + 0.005) * UP, point, 0.005, segments=6)
    wide = r * min(rng.uniform(0.15, 0.35), 0.8 * np.sin(np.pi / count))
    return [Socket(at, wide=wide) for at in circle(count, (r + out) / 2, end)]


def bracket(b: Builder, rng: Rng, p: Plan, sign: int) -> Sockets:
    """Add one to three arms before a plate on the wall, which end up (1) or down (-1)."""
    count, sockets = int(rng.choice([1, 2, 3], p=[0.6, 0.28, 0.12])), []
    reach, sag = p.wide + rng.uniform(0.03, 0.2), rng.uniform(0.0, 0.12)
    for x in 2.5 * p.wide * (np.arange(count) - (count - 1) / 2):
        z = -reach - 0.04 * (x == 0)
        points = [(0, 0, -0.01), (0, sign * sag, -0.4 * reach), (x, -sign * (0.05 + sag), z)]
        path = bend([*points, (x, sign * 0.025, z)], 0.1, 6)
        b.tube("arm", p.metal, path, 0.009, segments=8)
        sockets.append(Socket(path[-1], np.eye(3) if sign > 0 else FLIP, p.wide))
    return sockets


_TABLE, _FLOOR = {"place": ("table",)}, {"place": ("floor",)}
_CEILING, _WALL = {"place": ("ceiling",)}, {"place": ("wall",)}
_EITHER, _TALL = {"place": ("table", "floor")}, {"place": ("table", "floor", "garden")}
STEMS = (
    Component("none", 0.8, none, {"place": ("table", "floor", "garden", "ceiling")}),
    Component("vase", 2.4, vase, _TABLE),
    Component("stack", 0.9, stack, _EITHER),
    Component("block", 1, block, _TABLE),
    Component("loop", 0.7, loop, _TABLE),
    Component("tripod", 1.1, tripod, _EITHER),
    Component("pole", 1.6, pole, _TALL),
    Component("jointed", 1.1, jointed, {"place": ("floor", "desk")}),
    Component("bow", 1.8, bow, {"place": ("floor", "desk", "garden")}),
    Component("branches", 0.7, branches, _TALL),
    Component("tree", 0.9, tree, _FLOOR),
    Component("cord", 2.2, cord, _CEILING),
    Component("cords", 1.6, cords, _CEILING),
    Component.of("chandelier", 1.2, chandelier, _CEILING, tilt=0.0),
    Component.of("drops", 0.7, chandelier, _CEILING, tilt=180.0),
    Component("wheel", 0.6, wheel, _CEILING),
    Component.of("bracket", 1.2, bracket, _WALL, sign=1),
    Component.of("hook", 0.9, bracket, _WALL, sign=-1),
)
