"""Backs of chairs, drawn in the frame of `Plan.back`, and arms."""

import numpy as np

from ffd_lightning.shapes.chair.plan import Plan
from ffd_lightning.shapes.chair.seats import FRAMED
from ffd_lightning.shapes.kit import Builder, Component, Rng, nothing
from ffd_lightning.shapes.kit.boards import beam, pad, slats
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.upholstery import ARMS, Seating, armed
from ffd_lightning.shapes.kit.vectors import SIDES, lean, vec


def _posts(b: Builder, rng: Rng, p: Plan) -> tuple[float, float]:
    """Add two posts; return half the distance between them and where the filling begins."""
    post, flare = rng.uniform(0.02, 0.042), rng.uniform(0.0, 0.03)
    half = (p.width - post) / 2 - 0.01
    for side in (-1, 1):
        top = p.back(side * (half + flare), p.rise)
        beam(b, "back", p.frame, p.back(side * half, -0.03), top, post, post)
    return half, p.rise * rng.uniform(0.1, 0.45)


def _framed(b: Builder, rng: Rng, p: Plan) -> tuple[float, float]:
    """Add posts and a rail across their tops; return what `_posts` does."""
    half, low = _posts(b, rng, p)
    tall = rng.uniform(0.04, 0.11)
    size = (2 * half + rng.uniform(0.03, 0.09), tall, 0.035)
    pad(b, "back", p.frame, p.back(0, p.rise), size, rng.uniform(0.1, 0.5) * tall, p.rake)
    return half, low


def ladder(b: Builder, rng: Rng, p: Plan) -> None:
    """Add posts and level slats."""
    half, low = _posts(b, rng, p)
    count = int(rng.integers(1, 7))
    bar = min(rng.uniform(0.03, 0.12), 0.8 * (p.rise - low) / count)
    first, last = p.back(0, low + bar / 2), p.back(0, p.rise - bar / 2)
    slats(b, "back", p.frame, first, last, (2 * half, bar, 0.018), count, lean(p.rake))


def spindles(b: Builder, rng: Rng, p: Plan) -> None:
    """Add posts, a crest, and thin rods between the crest and the seat or a lower rail."""
    half, low = _framed(b, rng, p)
    low = 0.0 if rng.random() < 0.5 else low
    if low:
        beam(b, "back", p.frame, p.back(-half, low), p.back(half, low), 0.02, 0.03)
    for x in np.linspace(-half, half, int(rng.integers(5, 11)))[1:-1]:
        rod = [p.back(x, low - 0.01), p.back(x, p.rise)]
        b.tube("back", p.frame, rod, (0.008, 0.007), segments=8)


def cross(b: Builder, rng: Rng, p: Plan) -> None:
    """Add posts, a crest, and two crossed bars."""
    half, low = _framed(b, rng, p)
    for x, wide in ((-half, 0.02), (half, 0.016)):
        beam(b, "back", p.frame, p.back(x, low), p.back(-x, p.rise), wide, 0.03)


def panel(b: Builder, rng: Rng, p: Plan) -> None:
    """Add posts, a crest, and a board that fills all or the middle of the space."""
    half, low = _framed(b, rng, p)
    wide = 2 * half * (1 if rng.random() < 0.5 else rng.uniform(0.25, 0.45))
    low = 0.0 if wide < half else low
    size = (wide, p.rise - low, 0.018)
    pad(b, "back", p.frame, p.back(0, (p.rise + low) / 2), size, 0.02, p.rake)


def hoop(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a bow from side to side and rods or rings inside it."""
    half, r = p.width / 2 - 0.03, rng.uniform(0.01, 0.016)
    a, power = np.linspace(0, np.pi, 17), rng.uniform(0.6, 1.0)
    xs, ups = -half * np.cos(a), p.rise * np.sin(a) ** power
    bow = [p.back(x, up) for x, up in zip(xs, ups, strict=True)]
    b.tube("back", p.frame, bow, r, segments=8)
    if rng.random() < 0.65:
        for x in np.linspace(-0.75, 0.75, int(rng.integers(4, 9))) * half:
            rod = p.back(x, -0.01), p.back(x, float(np.interp(x, xs, ups)))
            b.cylinder("back", p.frame, *rod, 0.007, segments=8)
    else:
        inner = [p.back(0.6 * x, 0.68 * up) for x, up in zip(xs, ups, strict=True)]
        b.tube("back", p.frame, inner, 0.9 * r, segments=8)


def planks(b: Builder, rng: Rng, p: Plan) -> None:
    """Add upright boards, fanned or not, arched or not, on two rails."""
    count, half = int(rng.integers(3, 8)), 0.47 * p.width
    fan, arch = rng.uniform(0.0, 0.22), rng.uniform(0.0, 0.18)
    for i in range(count):
        u = (i + 0.5) / count * 2 - 1
        ends = p.back(u * half, -0.03), p.back(u * half * (1 + fan), p.rise * (1 - arch * u * u))
        beam(b, "back", p.frame, *ends, 0.02, 1.6 * half / count)
    for up in (0.22 * p.rise, 0.75 * p.rise):
        size = (2 * half * (1 + fan * up / p.rise), 0.05, 0.02)
        b.rounded_box("back", p.frame, p.back(0, up, 0.018), size, 0.005, turn=lean(p.rake))


def cushion(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one to four padded panels on posts or on a spine."""
    low = p.rise * rng.uniform(0.0, 0.4)
    count = 1 if p.rise < 0.5 or rng.random() < 0.6 else int(rng.integers(2, 5))
    tall, soft = (p.rise - low) / count, rng.uniform(0.035, 0.08)
    for i in range(count):
        size = (p.width * rng.uniform(0.86, 1.0), tall + 0.005, soft)
        radius = min(0.4 * tall, rng.uniform(0.02, 0.15))
        pad(b, "back", p.cover, p.back(0, low + (i + 0.5) * tall), size, radius, p.rake)
    if rng.random() < 0.5:
        for x in SIDES * 0.42 * p.width:
            post = p.back(x, -0.03, 0.01), p.back(x, p.rise - 0.05, 0.01)
            beam(b, "back", p.frame, *post, 0.025, 0.02)
    else:
        path = [vec(0, p.under, 0.1 * p.depth), vec(0, p.under, p.depth / 2 + 0.06)]
        path += [p.back(0, low + 0.3 * tall, 0.6 * soft)]
        b.tube("back", p.frame, bend(path, 0.08), 0.016, segments=8)


def curved(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a bent sheet, from a low rail to a wrap around the whole seat, on posts."""
    spread, half = np.radians(rng.uniform(35, 90)), p.width / 2
    low = rng.uniform(0.0, 0.6) * p.rise
    a = np.linspace(-spread, spread, 15)
    drop = rng.uniform(0.0, 0.6) * (np.abs(a) / spread) ** 2  # how far the ends come down
    grid = []
    for t in np.linspace(0, 1, 5):
        ups = low + t * (p.rise * (1 - drop) - low).clip(0.03)
        row = [p.back(half * np.sin(x), up) for x, up in zip(a, ups, strict=True)]
        grid.append(np.array(row) - np.outer(p.depth * 0.75 * (1 - np.cos(a)), [0, 0, 1]))
    sheet(b, "back", p.cover if rng.random() < 0.6 else p.frame, grid, rng.uniform(0.012, 0.05))
    for i in (3, 11) if spread < 1.2 else (0, 5, 9, 14):
        foot = grid[0][i] * (0.97, 0, 0.97)
        foot[1] = p.seat - 0.01
        b.cylinder("back", p.frame, foot, (grid[0][i] + grid[1][i]) / 2, 0.011, segments=8)


def tight(b: Builder, rng: Rng, s: Seating) -> None:
    """Add one padded panel, sometimes buttoned, sometimes with wings."""
    s.add_tight_back(b, s.width + 0.6 * s.arm)
    if rng.random() < 0.35:
        s.add_tufts(b, int(rng.integers(3, 5)), 4)
    if s.arms == "open" or s.back < 0.5 or rng.random() < 0.4:
        return
    low, high, out = s.arm_rise - 0.05, 0.95 * s.back, -rng.uniform(0.1, 0.14)
    for side in (-1, 1):
        middle = s.point(side * (s.width / 2 + 0.3 * s.arm), (low + high) / 2, out)
        size = (0.06, high - low, s.thick - 2 * out)
        b.rounded_box("back", s.cover, middle, size, 0.03, turn=lean(s.rake))


def loose(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a thin panel and a cushion before it."""
    s.add_loose_back(b, rng.uniform(0.0, 0.12))


_WOODEN = ("legs", "rockers", "scissors", "sides")
_FLAT = ("board", "cushion", "pad", "boards")
BACKS = (
    Component("open", 6, nothing, {"use": ("bar",), "seat": (*_FLAT, "disc")}),
    Component("ladder", 2.2, ladder, {"base": FRAMED, "seat": _FLAT}),
    Component("spindles", 1.6, spindles, {"base": _WOODEN, "seat": ("board", "cushion")}),
    Component("cross", 0.7, cross, {"base": _WOODEN, "seat": ("board", "cushion", "pad")}),
    Component("panel", 1.6, panel, {"base": FRAMED, "seat": _FLAT}),
    Component("hoop", 1, hoop, {"base": FRAMED, "seat": ("board", "cushion", "disc")}),
    Component("planks", 1, planks, {"base": _WOODEN, "seat": ("board", "boards")}),
    Component("cushion", 2.6, cushion, {"seat": ("pad", "cushion")}),
    Component("curved", 1.6, curved, {"seat": (*_FLAT, "disc")}),
    Component("moulded", 1, nothing, {"seat": ("shell",)}),
    Component("tight", 1.4, tight, {"seat": ("cushions",)}),
    Component("loose", 1, loose, {"seat": ("cushions",)}),
)


def _reach(p: Plan, level: float) -> float:
    """Return the back's z at `level` above the seat."""
    return float(p.back(0, level / np.cos(np.radians(p.rake)))[2])


def rests(b: Builder, rng: Rng, p: Plan) -> None:
    """Add narrow or broad boards on posts, from the back to the front."""
    level, width = rng.uniform(0.18, 0.25), rng.uniform(0.035, 0.12)
    front, rear = -rng.uniform(0.2, 0.5) * p.depth, _reach(p, level) + 0.02
    for x in SIDES * (p.width / 2 - 0.01):
        middle, size = (x, p.seat + level, (front + rear) / 2), (width, 0.026, rear - front)
        b.rounded_box("arm", p.frame, middle, size, 0.4 * width)
        foot, head = (0.97 * x, p.under, front + 0.06), (x, p.seat + level, front + 0.04)
        beam(b, "arm", p.frame, foot, head, 0.03, 0.03)


def loops(b: Builder, rng: Rng, p: Plan) -> None:
    """Add bent tubes from the seat's side to the back, with or without a rest on them."""
    level, r = rng.uniform(0.18, 0.25), rng.uniform(0.01, 0.016)
    front, rear = -rng.uniform(0.15, 0.4) * p.depth, _reach(p, level)
    for x in SIDES * (p.width / 2 + 0.01):
        path = [(x, p.seat + level, rear), (x, p.seat + level, front)]
        path += [(x, p.seat - 0.01, front + 0.03), (0.8 * x, p.seat - 0.01, front + 0.05)]
        b.tube("arm", p.frame, bend(path, 0.06), r, segments=8)
        if rng.random() < 0.6:
            middle = (x, p.seat + level + r, (rear + front) / 2)
            b.rounded_box("arm", p.cover, middle, (0.04, 0.022, 0.6 * (rear - front)), 0.015)


def pads(b: Builder, rng: Rng, p: Plan) -> None:
    """Add padded rests on one post each, as office chairs have them."""
    level, length = rng.uniform(0.18, 0.25), rng.uniform(0.22, 0.3)
    for x in SIDES * (p.width / 2 + 0.03):
        b.rounded_box("arm", p.cover, (x, p.seat + level, 0.02), (0.07, 0.028, length), 0.03)
        path = [(0, p.under, 0.05), (x, p.under, 0.05), (x, p.seat + level, 0.05)]
        b.tube("arm", p.frame, bend(path, 0.05), 0.014, segments=8)


_STANDING = {"use": ("dining", "lounge"), "seat": _FLAT}
_OPEN = ("ladder", "spindles", "cross", "panel", "planks", "cushion")
ARM_KINDS = (
    Component("none", 7, nothing, {"base": (*FRAMED, "star")}),
    Component("rests", 2.2, rests, _STANDING | {"back": _OPEN}),
    Component("loops", 1, loops, _STANDING | {"back": ("cushion", "panel", "ladder")}),
    Component("pads", 8, pads, {"base": ("star",), "seat": ("pad",)}),
    *(Component(name, 1, armed, {"base": ("plinth",)}) for name in ARMS),
)
