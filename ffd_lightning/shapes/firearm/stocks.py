"""What is held and shouldered, and what feeds: stocks, grips, magazines."""

import numpy as np

from ffd_lightning.shapes.firearm.plan import BLACK, IRON, Plan, at, bar, block, sweep
from ffd_lightning.shapes.kit import Builder, Component, Rng, nothing
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import Pair

Cut = tuple[float, float, float, float]


def _butt(b: Builder, p: Plan, rows: list[Cut], boxiness: float) -> None:
    """Add a stock through rows from front to rear, and rubber on its rear face."""
    bar(b, "stock", p.hand, rows, boxiness)
    end, low, high, wide = rows[-1]
    pad = (end + 0.004, end - 0.016)
    block(b, "stock", BLACK, pad, (low - 0.002, high + 0.002), 1.03 * wide, boxiness)


def _reach(rng: Rng, p: Plan) -> Cut:
    """Draw where a stock ends, its butt's heel and toe, and its width."""
    end, heel = -rng.uniform(0.17, 0.36), p.high - 0.01 - rng.uniform(0.0, 0.07)
    end *= 0.5 if p.kind == "bullpup" else 1
    return end, heel, heel - rng.uniform(0.09, 0.16), max(rng.uniform(0.03, 0.045), 0.8 * p.wide)


def solid(b: Builder, rng: Rng, p: Plan, hump: float) -> None:
    """Add a stock of one piece of wood behind the body, with a `hump` for the hand or without."""
    (end, heel, toe, wide), low, high = _reach(rng, p), p.low + 0.008, p.high - 0.012
    sag, thin = hump * rng.uniform(0.0, 1.0), rng.uniform(0.0, 0.4) * (high - low) * (not hump)
    neck, slope = 0.45 * end, 0.3 * (high - heel)
    rows = [(0.02, low, high, 0.8 * wide), (0.2 * end, low + thin, high - 0.006, 0.8 * wide)]
    rows += [(neck, low + thin - sag - 0.3 * slope, high - slope, 0.9 * wide)]
    _butt(b, p, [*rows, (end * (1.2 if hump else 1), toe, heel, wide)], 0.3 if hump else 0.55)


def sliding(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a stock that slides on a tube."""
    end, _, _, wide = _reach(rng, p)
    up, toe = (p.low + p.high) / 2, -rng.uniform(0.06, 0.12)
    b.cylinder("stock", IRON, at(0.02, up), at(end + 0.02, up), 0.016)
    front = (rng.uniform(0.2, 0.5) * end, up - 0.03, up + 0.024, wide)
    middle, rear = (0.75 * end, up - 0.05, up + 0.026, wide), (end, up + toe, up + 0.028, wide)
    _butt(b, p, [front, middle, rear], 0.7)


def wire(b: Builder, rng: Rng, p: Plan, closed: bool) -> None:
    """Add a stock of bent rod: one closed loop, or two hooks that end in a shoulder rest."""
    end, heel, toe, _ = _reach(rng, p)
    low, up = p.low + 0.014, (p.high + p.low) / 2 + 0.008 * closed
    heel, half, radius = min(heel, up), 0.4 * p.wide * (not closed), 0.006 + 0.004 * closed
    path = [(0.03, up), (end, heel), (end, toe), (0.03, low) if closed else (end + 0.04, toe)]
    for side in (-half, half)[closed:]:
        b.tube("stock", IRON, bend([at(f, u, side) for f, u in path], 0.02, 3), radius, segments=8)
    for u in (heel, toe)[2 * closed :]:
        beam(b, "stock", IRON, at(end, u, -half), at(end, u, half), width=0.012, height=0.012)


def sporting(b: Builder, rng: Rng, p: Plan, full: bool) -> None:
    """Add a stock of one piece: butt, wrist, and a fore-end, `full` to near the muzzle."""
    butt, drop, wide, low = rng.uniform(0.1, 0.15), rng.uniform(0.02, 0.08), p.wide, p.low
    end, wrist, hump = -rng.uniform(0.28, 0.42), rng.uniform(0.036, 0.05), rng.uniform(0, 0.05)
    comb, slim = rng.uniform(0.15, 0.75) * drop, rng.uniform(0.6, 0.9)
    front = max(p.end - rng.uniform(0.03, 0.12), p.guard) if full else p.guard
    rows = [
        (front, 0.4 * low, 0, 0.5 * wide),
        (front - 0.03, slim * low + 0.008, 0, 0.75 * wide),
        (min(p.length, front - 0.05), low + 0.004, 0, wide),
        (0.06, low, 0, wide),
        (0.0, -0.02 - wrist, -0.008, 0.9 * wide),
        (-0.06, -0.028 - wrist - 0.2 * hump, -0.02, 0.8 * wide),
        (-0.12, -comb - 0.06 - hump, -comb - 0.005, 0.9 * wide),
        (0.65 * end, -drop - 0.75 * butt, -comb, wide),
        (end, -drop - butt, -drop, 0.9 * wide),
    ]
    _butt(b, p, rows, 0.3)


def grip(b: Builder, rng: Rng, p: Plan, style: str) -> None:
    """Add a raked pistol grip, or a revolver's: a plough, a bird's head or a broad target grip."""
    round_, long = p.kind == "revolver", rng.uniform(0.085, 0.135)
    a = np.radians(rng.uniform(0, 8) if p.kind == "machine_pistol" else rng.uniform(6, 32))
    top = np.array([p.hold - 0.011, 0.45 * p.low] if round_ else [p.hold, p.low + 0.012])
    sway = {"raked": 1.0, "plough": 0.45, "bird": 0.17, "target": 0.37}[style]
    knee = 0.5 * long * np.array([np.sin(a), np.cos(a)])
    foot = np.array([knee[0] * (1 + sway), long * np.cos(a)])
    t = np.linspace(0, 1, 8)
    path = top - 2 * np.outer(t * (1 - t), knee) - np.outer(t**2, foot)
    depth = {
        "raked": p.palm * (1.05 - 0.2 * t * (1 - t) + rng.uniform(0.0, 0.25) * t**3),
        "plough": 0.042 + 0.02 * t**2,
        "bird": 0.044 - 0.007 * t - 0.018 * t**6,
        "target": 0.048 + 0.011 * np.sin(3 * t) + 0.009 * t,
    }[style]
    wide = p.wide * (1 + 0.25 * t) if round_ else np.clip(p.wide, 0.026, 0.036) + 0 * t
    sweep(b, "grip", p.hand, path, depth, wide)
    if p.kind in _PISTOLS:  # the magazine's foot
        end = path[-1] + np.outer([-0.004, 0.006], [-np.sin(a), -np.cos(a)])
        sweep(b, "magazine", p.steel, end, p.palm, 0.8 * wide[-1])


def stick(
    b: Builder, rng: Rng, p: Plan, long: float = 0.2, curl: Pair = (0, 0), turn: float = 0.0
) -> None:
    """Add a box magazine, about as long as `long`, that curls; `turn` 180 is above, -1 a grip's."""
    held = turn < 0
    wide, depth = min(0.028, 0.8 * p.wide), rng.uniform(0.03, 0.038 if held else 0.08)
    lean = rng.uniform(0, 12) if turn == 0 else max(turn, 0)
    angles = np.radians(lean + rng.uniform(*curl) * np.linspace(0, 1, 8))
    steps = np.stack([np.sin(angles), -np.cos(angles)], 1)
    start = (p.hold if held else p.well, p.high - 0.02 if turn > 0 else p.low + 0.02)
    path = np.cumsum(np.vstack([start, steps * long * rng.uniform(0.6, 1.3) / 8]), 0)
    if held:  # it follows the grip's rake
        path[:, 0] += 0.3 * (path[:, 1] - start[1]) * (p.kind == "pistol")
    sweep(b, "magazine", p.steel, path, depth, wide)
    foot = path[-1] + np.outer([-0.01, 0.012], steps[-1])
    sweep(b, "magazine", BLACK, foot, 1.12 * depth, 1.15 * wide)


def drum(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a drum magazine on a short neck; its axis runs along the barrel or across it."""
    radius, half, across = rng.uniform(0.045, 0.09), rng.uniform(0.025, 0.045), rng.random() < 0.5
    up, turns = p.low - 0.85 * radius, np.array([-1.0, -0.8, 0.8, 1.0])
    path = [at(p.well + half * t * (not across), up, half * t * across) for t in turns]
    b.tube("magazine", p.steel, path, [0.9 * radius, radius, radius, 0.9 * radius], segments=20)
    block(b, "magazine", p.steel, (p.well - 0.025, p.well + 0.025), (up, p.low + 0.01), 0.026)


def case(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a hanging ammunition box."""
    size = rng.uniform((0.07, 0.08, 0.08), (0.1, 0.15, 0.14))
    center = at(p.well, p.low - size[1] / 2 + 0.01)
    b.rounded_box("magazine", p.body if rng.random() < 0.5 else p.hand, center, size, 0.012)


def pan(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a flat pan on top."""
    r = rng.uniform(0.07, 0.12)
    profile = [(0.0, 0), (r, 0), (r, 0.025), (0.6 * r, 0.035), (0.0, 0.035)]
    b.lathe("magazine", p.steel, profile, at(p.well, p.high - 0.002))


_PISTOLS = ("pistol", "machine_pistol")
_ARMS = ("compact", "service", "support")
_PUMP = {"body": ("sides",)}
STOCKS = (
    Component("none", 7, nothing, {"kind": ("pistol", "revolver")}),
    Component("none", 0.7, nothing, {"kind": ("compact", "machine_pistol")}),
    Component("none", 0.4, nothing, _PUMP),
    Component.of("solid", 1.2, solid, {"kind": (*_ARMS, "bullpup")}, hump=0.0),
    Component("tube", 0.9, sliding, {"kind": _ARMS}),
    Component.of("frame", 0.8, wire, {"kind": (*_PISTOLS, *_ARMS)}, closed=True),
    Component.of("wire", 0.7, wire, {"kind": (*_PISTOLS, *_ARMS[:2])}, closed=False),
    Component("tube", 0.2, sliding, _PUMP),
    Component.of("wrist", 1, solid, {"kind": ("hunting",)}, hump=0.05),
    Component.of("sporting", 1, sporting, {"kind": ("bolt",)}, full=False),
    Component.of("full", 0.5, sporting, {"kind": ("bolt",)}, full=True),
)
_REVOLVER = {"kind": ("revolver",)}
_HELD = (*_PISTOLS, "hunting", "bullpup", *_ARMS)
_FREE = ("none", "solid", "tube", "frame", "wire")
GRIPS = (
    Component("none", 1, nothing, {"stock": ("sporting", "full", "wrist")}),
    Component.of("raked", 1, grip, {"kind": _HELD, "stock": _FREE}, style="raked"),
    Component.of("plough", 1, grip, _REVOLVER, style="plough"),
    Component.of("bird", 0.8, grip, _REVOLVER, style="bird"),
    Component.of("target", 0.8, grip, _REVOLVER, style="target"),
)
FEEDS = (
    Component("none", 1, nothing, {"kind": ("revolver", "hunting", "bolt")}),
    Component("flush", 2, nothing, {"kind": ("pistol",)}),
    Component.of("grip", 0.6, stick, {"kind": _PISTOLS}, turn=-1),
    Component("straight", 1, stick, {"kind": (*_ARMS, "bullpup")}),
    Component.of("curved", 1.4, stick, {"kind": (*_ARMS, "bullpup")}, curl=(10, 55)),
    Component.of("short", 1, stick, {"kind": ("bolt", "service")}, long=0.09),
    Component("drum", 0.7, drum, {"kind": _ARMS}),
    Component("box", 1.4, case, {"kind": ("support",)}),
    Component.of("top", 0.9, stick, {"kind": ("support",)}, curl=(-40, 0), turn=180),
    Component("pan", 0.7, pan, {"kind": ("support",)}),
)
