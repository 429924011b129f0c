"""What stands on deck: houses of one or more storeys, and what stands on their roofs."""

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng, draw, nothing, pick_material
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair, vec
from ffd_lightning.shapes.watercraft.hulls import bulwark, fin
from ffd_lightning.shapes.watercraft.plan import Plan, tint

_STACKS = {  # front station, length, share of the deck's width, storeys, how much each is set back
    # at front and back, how far it leans in per height
    "coachroof": ((0.26, 0.4), (0.2, 0.36), (0.5, 0.72), (1, 1), (0, 0), (0, 0), (0.6, 2)),
    "decks": ((0.24, 0.42), (0.3, 0.5), (0.7, 0.9), (1, 3), (0.02, 0.1), (0, 0.1), (0.2, 1.6)),
    "wheelhouse": ((0.18, 0.62), (0.18, 0.36), (0.5, 0.8), (1, 3), (0, 0.05), (0, 0.14), (0, 0.3)),
    "tower": ((0.72, 0.82), (0.06, 0.14), (0.7, 1), (3, 6), (0, 0.01), (0, 0.01), (0, 0)),
    "midships": ((0.14, 0.55), (0.08, 0.2), (0.7, 1), (2, 5), (0, 0.01), (0, 0.03), (0, 0.2)),
    "tiers": ((0.16, 0.28), (0.5, 0.7), (0.94, 1), (2, 6), (0, 0.04), (0, 0.05), (0, 0.5)),
    "citadel": ((0.3, 0.36), (0.3, 0.5), (0.6, 0.95), (1, 1), (0, 0), (0, 0), (0, 0.4)),
    "bridge": ((0.32, 0.36), (0.09, 0.16), (0.5, 0.8), (2, 4), (0, 0.02), (0, 0.02), (0, 0.4)),
}  # fmt: skip


def storey(
    b: Builder, p: Plan, width: float, z: Pair, y: Pair, slope: float = 0.0, windows: str = "panes"
) -> None:
    """Add walls that lean in by `slope` at the front, a roof, and windows: "band" or "panes"."""
    rise = y[1] - y[0]

    def ring(level: float, grow: float = 0.0) -> Array:
        up, cut = level * rise, min(0.25 * rise, 0.15 * width)
        w, front, back = width / 2 - 0.15 * slope * up + grow, z[0] + slope * up - grow, z[1] + grow
        flat = [(w - cut, front), (w, front + cut), (w, back - cut / 2), (w - cut / 2, back)]
        flat += [(-x, at) for x, at in flat[::-1]]
        return np.array([(x, y[0] + up, at) for x, at in flat])

    b.loft("cabin", p.wall, [ring(0), ring(1)])
    low, high = ring(0.42, 0.002), ring(0.8, 0.002)
    if windows == "band":
        b.loft("cabin", p.glass, [low, high])
    else:
        start, end = low[0, 2] + 0.2 * rise, z[1] - 0.1 * rise
        count = min(max(1, int((end - start) / (0.5 * rise))), 20)
        size = (2 * high[1, 0], 0.34 * rise, 0.6 * (end - start) / count)
        for i in range(count):
            at = start + (i + 0.5) * (end - start) / count
            b.box("cabin", p.glass, (0, y[0] + 0.61 * rise, at), size)
    b.loft("cabin", p.wall, [ring(1, 0.06 * rise), ring(1.1, 0.06 * rise)])


def stack(b: Builder, rng: Rng, p: Plan, kind: str) -> Plan:
    """Add a house of one or more storeys of a kind, on deck or on another house."""
    spans = _STACKS[kind]
    first, long, share, _, *steps, slope = (rng.uniform(*span) for span in spans)
    z = (p.hull.z(first), min(p.hull.z(first) + long, p.hull.z(0.95)))
    width, low = 2 * share * min(p.hull.half(t + 0.5) for t in z), p.level(sum(z) / 2) - 0.003
    house, tiers, windows = p.house if p.tiers else z, list(p.tiers), draw(rng, ["band", "panes"])
    most = min(spans[3][1], max(1, int(0.24 / p.storey)))  # so that none is too top-heavy
    floors = int(rng.integers(min(spans[3][0], most), most + 1))
    for i in range(floors):
        rise = p.storey * (rng.uniform(0.6, 0.9) if kind == "coachroof" else 1.0)
        bridge = 0 < i == floors - 1
        storey(b, p, width, z, (low, low + rise), slope, "band" if bridge else windows)
        if bridge and kind in ("tower", "midships"):
            wing = (rng.uniform(0.95, 1.05) * p.hull.beam, 0.3 * rise, 0.4 * rise)
            b.box("cabin", p.wall, (0, low + 0.2 * rise, z[0] + 0.3 * rise), wing)
        low, width = low + 1.08 * rise, 0.97 * width - 0.3 * slope * rise
        tiers.append(((z[0] + slope * rise, z[1]), low))
        z = (z[0] + slope * rise + steps[0], z[1] - steps[1])
        if z[1] - z[0] < 1.6 * rise:
            break
    return replace(p, house=house, tiers=tuple(tiers))


def citadel(b: Builder, rng: Rng, p: Plan) -> Plan:
    """Add a long storey and a bridge on its front."""
    return stack(b, rng, stack(b, rng, p, "citadel"), "bridge")


def cockpit(b: Builder, rng: Rng, p: Plan) -> Plan:
    """Add a cockpit with a coaming, behind a wrapped windscreen or about a steering console."""
    t, high = rng.uniform(0.32, 0.5), rng.uniform(0.6, 1.0) * p.storey
    z, y, wide = p.hull.z(t), p.hull.top(t), 1.5 * p.hull.half(t)
    long = p.hull.z(0.93) - z
    floor = (0, p.hull.top(0.7) + 0.004, z + long / 2)
    b.box("deck", tint(rng, "dark", "teak"), floor, (wide, 0.008, long))
    bulwark(b, p, 0.5 * high, 0.025, t - 0.05)
    if rng.random() < 0.3:
        z += 0.08
        storey(b, p, 0.5 * wide, (z, z + 0.14), (y - 0.01, y + high), 0.5, "band")
        return replace(p, house=(z, z + 0.14))
    a, tip = np.linspace(-0.5, 0.5, 9) * np.pi, vec(0, high, rng.uniform(0.4, 1.0) * high)
    foot = np.stack([0.5 * wide * np.sin(a), y + 0 * a, z + 0.12 - 0.14 * np.cos(a)], 1)
    head, back = foot * vec(0.9, 1, 1) + tip, vec(0, 0, 0.006)
    rings = np.stack([foot, head, head + back, foot + back], 1)
    b.loft("cabin", pick_material(rng, "glass"), [*rings])
    for path in (foot, head):
        b.tube("cabin", p.spar, path, 0.006, segments=6)
    return replace(p, house=(z, z + 0.1))


def castle(b: Builder, rng: Rng, p: Plan) -> Plan:
    """Add one to three raised decks at the stern, and sometimes one at the bow."""
    painted, tiers, low = replace(p, wall=p.paint), [], p.hull.top(0.75) - 0.02
    for i in range(int(rng.integers(1, 4))):
        z, high = (p.hull.z(0.7 + 0.1 * i), p.hull.z(0.99)), low + rng.uniform(0.5, 0.9) * p.storey
        storey(b, painted, (1.8 - 0.15 * i) * p.hull.half(1.0), z, (low, high))
        tiers.append((z, high))
        low = high
    if rng.random() < 0.4:
        z, low = (p.hull.z(0.08), p.hull.z(0.2)), p.hull.top(0.15)
        storey(b, painted, 1.7 * p.hull.half(0.09), z, (low, low + 0.6 * p.storey))
    return replace(p, house=tiers[0][0], tiers=tuple(tiers))


def tower(b: Builder, rng: Rng, p: Plan) -> Plan:
    """Add a submarine's tower, with planes or without, and what it puts up."""
    r, z, high = p.hull.depth / 2, rng.uniform(-0.24, 0.08), rng.uniform(0.05, 0.12)
    long, thick, top = rng.uniform(0.08, 0.2), rng.uniform(0.4, 0.7) * r, 2 * r + high
    fin(b, "cabin", p.paint, vec(0, 1.8 * r, z), (0, high + 0.2 * r, 0), (long, thick))
    for shift in np.arange(-0.2, 0.12 * rng.integers(1, 5) - 0.25, 0.12):
        foot = vec(0, top - 0.01, z + shift * long)
        b.cylinder("mast", p.lower, foot, foot + rng.uniform(0.02, 0.09) * UP, 0.005, segments=8)
    root = vec(0, 2 * r + 0.6 * high, z) if rng.random() < 0.5 else vec(0, r, -0.32)
    out = r + 0.05 - root[1] / 5
    for x in (-out, out):
        fin(b, "keel", p.paint, root, (x, 0, 0), (0.05, 0.01))
    return replace(p, house=(z - long / 2, z + long / 2))


def flattop(b: Builder, rng: Rng, p: Plan) -> Plan:
    """Add a carrier's broad flat deck, its markings and an island at its side."""
    y, beam, front = p.hull.top(0.0), p.hull.beam, -0.5 - p.hull.rake[0]
    left, right, angle = -rng.uniform(0.7, 1.1), rng.uniform(0.6, 0.8), rng.uniform(0.0, 0.2)
    outline = [(-0.4, front), (0.4, front), (right, -0.3), (right, 0.4), (0.45, 0.5), (-0.5, 0.5)]
    outline += [(left, 0.3), (left, -0.15), (-0.5 - angle, -0.25)]
    ring, deck = np.array([(x * beam, 0.0, z) for x, z in outline]), y + 0.01
    slim = [ring * vec(0.6, 1, 0.9) + 0.5 * y * UP, ring * vec(0.92, 1, 0.99) + y * UP]
    b.loft("hull", p.paint, slim)
    b.loft("deck", p.deck, [ring + y * UP, ring + deck * UP])
    for z in np.linspace(front + 0.05, 0.45, 14):
        b.box("deck", tint(rng, "white"), (-0.2 * beam, deck, z), (0.006, 0.003, 0.03))
    at, y = vec((right - 0.12) * beam, 0, rng.uniform(-0.12, 0.18)), deck
    for i in range(int(rng.integers(2, 5))):
        size, middle = vec(0.2 * beam, p.storey, 0.2 - 0.035 * i), at + (y + p.storey / 2) * UP
        b.rounded_box("cabin", p.wall, middle, size, 0.008)
        b.box("cabin", p.glass, middle, size * (1.03, 0.3, 0.9))
        y += p.storey
    _mast(b, rng, p, at + y * UP)
    return replace(p, tiers=(((-0.5, 0.5), deck),), house=(left * beam, right * beam))


def _mast(b: Builder, rng: Rng, p: Plan, foot: Array) -> None:
    """Add a signal mast with cross-bars and a radar: a pole, or a tapering tower of a warship."""
    s, high = p.storey, rng.uniform(1.5, 3.5) * p.storey
    top = foot + high * UP
    if p.wall is p.paint and rng.random() < 0.6:
        b.box("mast", p.wall, foot + high / 2 * UP, (s, high + 0.01, s), taper=0.4)
        b.ellipsoid("mast", p.wall, top, (0.5 * s, 0.55 * s, 0.5 * s), segments=12)
    b.cylinder("mast", p.spar, foot - 0.01 * UP, top, 0.1 * s, radius_end=0.05 * s, segments=8)
    for level in (0.6, 0.85)[: int(rng.integers(0, 3))]:
        reach, at = vec((1.3 - level) * 0.4 * high, 0, 0), foot + level * high * UP
        b.cylinder("mast", p.spar, at - reach, at + reach, 0.05 * s, segments=6)
    b.box("mast", p.spar, foot + vec(0, 0.4 * high, -0.15 * s), (0.9 * s, 0.2 * s, 0.3 * s))


def pole(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a signal mast on the highest roof, sometimes with domes beside it."""
    (front, back), roof = p.tiers[-1]
    foot, r = vec(0, roof, 0.6 * front + 0.4 * back), 0.25 * p.storey
    _mast(b, rng, p, foot)
    for x in (-4 * r, 4 * r) if rng.random() < 0.4 and p.hull.beam > 2.4 * p.storey else ():
        b.ellipsoid("mast", p.wall, foot + vec(0.6 * x, 0.9 * r, 0), (r, r, r), segments=12)


def funnels(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a mast, and one to four funnels behind it that reach equally high."""
    (front, back), roof = p.tiers[-1]
    _mast(b, rng, p, vec(0, roof, 0.85 * front + 0.15 * back))
    base = p.wall if p.wall is p.paint else tint(rng, "red", "blue", "black", "orange", "white")
    width, long = rng.uniform(0.16, 0.36) * p.hull.beam, rng.uniform(0.9, 2.2) * p.storey
    start, end, top = back - 0.7 * long, p.house[1] - long, roof + rng.uniform(0.8, 2.5) * p.storey
    count = int(rng.integers(1, min(4, max(1, int((end - start) / (1.6 * long)))) + 1))
    band, black = tint(rng, "black", "white", "red"), tint(rng, "black")
    oval = circle(20, 1.0, 0.0) * vec(width / 2, 1, long / 2)
    for z in np.linspace(end, start + 1.5 * long, count) if count > 1 else [max(start, end)]:
        low = p.level(z) - 0.4 * p.storey
        rows = [(0, 1), (1, 0.88), (0.7, 0.95), (0.88, 0.93), (0.98, 0.7), (1.04, 0.7)]
        rings = [oval * s + vec(0, low + t * (top - low), z + 0.2 * t * long) for t, s in rows]
        for i, paint in enumerate((base, band, black)):
            b.loft("funnel", paint, rings[2 * i : 2 * i + 2])


def canopy(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a roof or an awning on posts."""
    front = p.house[0] if p.house[0] < 0.3 else -0.25
    z, roof = (front - 0.02, front + rng.uniform(0.22, 0.45)), rng.uniform(1.7, 2.4) * p.storey
    width = 1.8 * min(p.hull.half(t + 0.5) for t in z)
    foot, cloth = p.hull.top(0.6), pick_material(rng, "fabric") if rng.random() < 0.6 else p.wall
    for at in np.linspace(z[0] + 0.02, z[1] - 0.02, int(rng.integers(2, 4))):
        for x in (-0.47 * width, 0.47 * width):
            b.cylinder("cabin", p.spar, (x, foot, at), (x, foot + roof, at), 0.006, segments=6)
    arch, a = rng.uniform(0.0, 0.2) * width, np.linspace(-1, 1, 9)
    upper = np.column_stack([a * width / 2, foot + roof + arch * (1 - a * a), 0 * a])
    ring = np.concatenate([upper, upper[::-1] - 0.012 * UP])
    b.loft("cabin", cloth, [ring + vec(0, 0, at) for at in z])


def _stack(name: str, weight: float, *hulls: str) -> Component:
    """Return a house of storeys that goes with some hulls."""
    return Component.of(name, weight, stack, {"hull": hulls}, kind=name)


HOUSES = (
    Component("open", 1.5, nothing, {"hull": ("skiff", "canoe", "galleon", "barge", "catamaran")}),
    _stack("coachroof", 3, "yacht", "planing", "catamaran"),
    _stack("decks", 4, "planing", "catamaran"),
    _stack("wheelhouse", 2, "planing", "yacht", "tub", "barge"),
    _stack("tower", 3, "freighter"),
    _stack("midships", 2, "freighter"),
    _stack("tiers", 1.2, "liner", "barge"),
    Component("citadel", 5, citadel, {"hull": ("navy",)}),
    Component("flattop", 1.5, flattop, {"hull": ("navy",)}),
    Component("cockpit", 4, cockpit, {"hull": ("planing",)}),
    Component("castle", 2, castle, {"hull": ("galleon",)}),
    Component("fin", 1, tower, {"hull": ("submarine",)}),
)
_OPEN = {"house": ("open", "cockpit"), "hull": ("skiff", "canoe", "barge", "planing", "catamaran")}
_BARE = ("open", "coachroof", "decks", "wheelhouse", "flattop", "cockpit", "castle", "fin")
_MOTORED = ("planing", "catamaran", "tub", "barge")
_SHIPS = ("tub", "freighter", "liner", "navy", "barge")
_HIGH = ("wheelhouse", "tower", "midships", "tiers", "citadel")
TOPS = (
    Component("bare", 2, nothing, {"house": _BARE}),
    Component("pole", 2, pole, {"house": ("decks", "wheelhouse"), "hull": _MOTORED}),
    Component("canopy", 0.6, canopy, _OPEN),
    Component("funnels", 3, funnels, {"hull": _SHIPS, "house": _HIGH}),
)
