"""What lies or stands on the free deck: seats, cargo, gear, guns, planes."""

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng, nothing, pick_material
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.vectors import UP, about_z, lean, vec
from ffd_lightning.shapes.watercraft.plan import Plan, tint


def thwarts(b: Builder, rng: Rng, p: Plan) -> None:
    """Add boards to sit on from side to side."""
    for t in np.linspace(rng.uniform(0.2, 0.35), 0.85, int(rng.integers(2, 6))):
        middle = p.hull.edge(t, 0, up=-0.25 * p.hull.depth)
        b.rounded_box("seat", p.deck, middle, (1.9 * p.hull.half(t), 0.014, 0.07), 0.01)


def seats(b: Builder, rng: Rng, p: Plan) -> None:
    """Add rows of seats or benches that face the bow."""
    cover, s, (front, back) = pick_material(rng, "leather"), 0.9 * p.storey, p.rooms(0.0)[-1]
    wide, step = 1.4 * p.hull.half(front + 0.5), rng.uniform(1.8, 3) * s
    for z in np.arange(front + s, back - s, step)[: int(rng.integers(1, 5))]:
        pair = rng.random() < 0.5
        for x in (-0.25 * wide, 0.25 * wide) if pair else (0.0,):
            size, middle = vec((0.36 if pair else 0.8) * wide, 0.5 * s, s), vec(x, p.level(z), z)
            b.rounded_box("seat", cover, middle + 0.25 * s * UP, size, 0.02, segments=2)
            rest, place = size * (1, 2, 0.3), middle + s * vec(0, 0.7, 0.5)
            b.rounded_box("seat", cover, place, rest, 0.012, turn=lean(10), segments=2)


def well(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a coaming about a dark well, with a wheel or a tiller."""
    front, back, y = min(p.house[1], 0.25), p.hull.z(0.93), p.hull.top(0.8)
    long, width = back - front, 0.52 * min(p.hull.beam, 2.2 * p.hull.half(0.9))
    middle = vec(0, y + 0.004, (front + back) / 2)
    b.box("deck", tint(rng, "dark", "teak"), middle, (width, 0.01, long))
    for x in (-width / 2, width / 2):
        b.rounded_box("deck", p.wall, middle + vec(x, 0.01, 0), (0.022, 0.035, long), 0.01)
    at, end = vec(0, y + 0.07, front + 0.65 * long), vec(0, y, front + 0.65 * long)
    if rng.random() < 0.5:
        wheel = circle(14, 0.045, 0.0) @ lean(90).T + at
        b.tube("deck", p.spar, [*wheel, wheel[0]], 0.005, segments=6)
    else:
        end = vec(0, y + 0.01, back)
    b.cylinder("deck", p.spar, at, end, 0.007, segments=8)


def containers(b: Builder, rng: Rng, p: Plan) -> None:
    """Stack containers of a few colours in bays along the deck."""
    colors = [pick_material(rng, "paint") for _ in range(5)]
    long, columns, most = rng.uniform(0.05, 0.1), int(rng.integers(4, 8)), int(rng.integers(1, 7))
    wide = 0.94 * p.hull.beam / columns
    tall = rng.uniform(0.8, 1.1) * wide
    for front, back in p.rooms(1.1 * long):
        bays = int((back - front) / (1.08 * long))
        for z in front + (np.arange(bays) + 0.5) * (back - front) / bays:
            half = 1.02 * min(p.hull.half(z + 0.5 + s * long / 2) for s in (-1, 1))
            for x in (np.arange(columns) - (columns - 1) / 2) * wide:
                rows = max(1, most - int(rng.integers(0, 2))) if abs(x) + wide / 2 < half else 0
                for row in range(rows):
                    middle = (x, p.hull.top(z + 0.5) + (row + 0.5) * tall, z)
                    size = (0.95 * wide, 0.97 * tall, long)
                    b.box("cargo", colors[int(rng.integers(5))], middle, size)


def hatches(b: Builder, rng: Rng, p: Plan) -> None:
    """Add hatch covers, mostly with cranes or derricks between them."""
    cover, steel = tint(rng, "grey", "green", "red", "cream"), tint(rng, "cream", "grey", "orange")
    share, tall = rng.uniform(0.55, 0.8), rng.uniform(0.3, 1) * p.storey
    pitch = rng.uniform(0.1, 0.2)
    kind, high = int(rng.integers(3)), rng.uniform(3, 6) * p.storey
    for front, back in p.rooms(0.1):
        for z in np.arange(front + pitch / 2, back - 0.4 * pitch, pitch):
            foot = vec(0, p.hull.top(z + 0.5), z - pitch / 2)
            wide = 2 * share * min(p.hull.half(z + 0.5 + s * pitch / 2) for s in (-1, 1))
            lid = foot + vec(0, tall / 2, pitch / 2)
            b.box("cargo", cover, lid, (wide, tall, 0.66 * pitch))
            b.box("cargo", cover, lid + tall / 2 * UP, (0.9 * wide, 0.2 * tall, 0.6 * pitch))
            if kind == 0 or z < front + pitch:
                continue
            head = foot + high * UP
            b.cylinder("mast", steel, foot, head, 0.01, segments=8)
            start, tips = head, [head + vec(0, 0.3 * high, -0.85 * pitch)]
            if kind == 2:
                start = foot + 0.2 * high * UP
                tips = [foot + vec(x * wide, 0.8 * high, -0.6 * pitch) for x in (-0.4, 0.4)]
            for tip in tips:
                b.cylinder("mast", steel, start, tip, 0.006, segments=6)


def tanks(b: Builder, rng: Rng, p: Plan) -> None:
    """Add the domes of gas tanks, or heaps of what a barge carries."""
    stuff = tint(rng, "orange", "white", "grey", "blue", "teak")
    wide, share = rng.uniform(0.36, 0.46) * p.hull.beam, rng.uniform(0.55, 1.05)
    for front, back in p.rooms(1.5 * wide):
        count = max(1, int((back - front) / (rng.uniform(2.1, 5) * wide)))
        pitch = (back - front) / count
        middle, size = (0, p.hull.depth, (front + back) / 2), (1.6 * wide, 0.03, back - front)
        b.box("deck", p.paint, middle, size)
        for z in front + (np.arange(count) + 0.5) * pitch:
            b.ellipsoid("cargo", stuff, (0, p.hull.depth, z), (wide, share * wide, 0.48 * pitch))


def pipes(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a tanker's pipes, manifold and hose cranes."""
    steel, beam, y = tint(rng, "grey", "red", "cream"), p.hull.beam, p.hull.depth + 0.016
    for front, back in p.rooms(0.15):
        middle = vec(0, y, (front + back) / 2)
        for x in np.linspace(-0.15, 0.15, int(rng.integers(3, 6))) * beam:
            b.cylinder("cargo", steel, (x, y, front), (x, y, back), 0.005, segments=8)
        for z in np.linspace(front, back, 9):
            b.box("cargo", steel, (0, y - 0.006, z), (0.4 * beam, 0.024, 0.007))
        for shift in np.linspace(-0.03, 0.03, 4):
            b.box("cargo", steel, middle + vec(0, 0, shift), (0.8 * beam, 0.03, 0.008))
        for x in (-0.2 * beam, 0.2 * beam):
            foot = middle + vec(x, -0.02, -0.06)
            b.cylinder("mast", steel, foot, foot + 0.1 * UP, 0.006, segments=8)
            tip = foot + vec(0, 0.09, 0.08)
            b.cylinder("mast", steel, foot + 0.06 * UP, tip, 0.004, segments=6)


def gear(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a derrick with its boom, a winch, crates, and often tyres along the sides."""
    front, back = max(p.rooms(0.0), key=lambda room: room[1] - room[0])
    way, z = (1, front + 0.04) if front > p.house[0] else (-1, back - 0.04)
    steel, crate = tint(rng, "orange", "grey", "cream"), pick_material(rng, "plastic")
    foot, high, long = vec(0, p.level(z), z), rng.uniform(0.15, 0.45), 0.8 * (back - front)
    b.cylinder("mast", steel, foot, foot + high * UP, 0.015, radius_end=0.01, segments=10)
    tip = foot + vec(0, rng.uniform(0.3, 0.9) * high, way * rng.uniform(0.5, 1.0) * long)
    b.cylinder("mast", steel, foot + 0.06 * UP, tip, 0.01, segments=8)
    b.cylinder("mast", steel, tip, foot + 0.95 * high * UP, 0.004, segments=5)
    winch, reach = foot + vec(0, 0.03, 0.07 * way), vec(0.07, 0, 0)
    b.cylinder("cargo", tint(rng, "dark"), winch - reach, winch + reach, 0.028, segments=14)
    for x in np.linspace(-0.25, 0.25, int(rng.integers(0, 4))) * p.hull.beam:
        b.rounded_box("cargo", crate, foot + (x, 0.022, 0.14 * way), (0.06, 0.05, 0.05), 0.008)
    for t in np.linspace(0.18, 0.9, int(rng.integers(5, 9))) if rng.random() < 0.5 else ():
        for side in (-1, 1):
            tyre = circle(10, 0.032, 0.0) @ about_z(90).T + p.hull.edge(t, side, -0.012, -0.025)
            b.tube("rail", pick_material(rng, "rubber"), [*tyre, tyre[0]], 0.013, segments=6)


def guns(b: Builder, rng: Rng, p: Plan) -> None:
    """Add gun turrets before and behind the houses, the inner ones higher."""
    s, barrels = rng.uniform(0.7, 1.4) * p.storey, np.arange(rng.integers(1, 4))
    for (front, back), way in zip(p.rooms(-1.0), (-1.0, 1.0), strict=True):
        count = min(int(rng.integers(1, 4)), int((back - front) / (2.8 * s)))
        for i in range(count):
            z = (back if way < 0 else front) + way * (1.4 + 2.8 * i) * s
            deck = vec(0, p.hull.top(z + 0.5), z)
            middle = deck + (0.7 + 0.8 * (count - 1 - i)) * s * UP
            b.cylinder("gun", p.wall, deck, middle, 0.75 * s, segments=16)
            b.box("gun", p.wall, middle, s * vec(1.6, 0.8, 2.1), taper=0.8)
            for x in (barrels - barrels.mean()) * 0.45 * s:
                ends = middle + vec(x, 0, way * 0.8 * s), middle + vec(x, 0.4 * s, way * 3 * s)
                b.cylinder("gun", p.wall, *ends, radius=0.14 * s, segments=8)


def planes(b: Builder, rng: Rng, p: Plan) -> None:
    """Park small jets on deck, their noses turned inboard."""
    s, count = 0.3 * p.hull.beam, int(rng.integers(2, 9))
    delta = [(0.3, 0), (-0.35, 0.45), (-0.45, 0.45), (-0.45, -0.45), (-0.35, -0.45)]
    wing = np.array([(x, 0, z) for x, z in delta]) * s
    for z in np.linspace(-0.08, -0.12 + 0.04 * count, count):
        middle = vec(p.house[0] + 0.55 * s, p.roof + 0.18 * s, z)
        b.ellipsoid("cargo", p.wall, middle, s * vec(0.5, 0.11, 0.09), segments=10)
        b.loft("cargo", p.wall, [wing + middle, wing + middle + 0.05 * s * UP])
        b.box("cargo", p.wall, middle + s * vec(-0.38, 0.15, 0), s * vec(0.16, 0.25, 0.03))
        b.box("cargo", p.wall, middle - 0.1 * s * UP, s * vec(0.1, 0.2, 0.1))


def boats(b: Builder, rng: Rng, p: Plan) -> None:
    """Hang lifeboats along the houses' sides."""
    paint, (front, back) = tint(rng, "orange", "white"), p.house
    for z in np.linspace(front + 0.08, back - 0.08, int(rng.integers(3, 9))):
        for side in (-1, 1):
            middle = p.hull.edge(z + 0.5, side, -0.004, 0.5 * p.storey)
            b.ellipsoid("cargo", paint, middle, (0.01, 0.011, 0.028), segments=8)


_CARGO = {"hull": ("freighter", "barge"), "house": ("tower", "midships", "wheelhouse", "open"),
          "top": ("bare", "pole", "funnels")}  # fmt: skip
_CLEAR = ("planing", "catamaran", "tub", "galleon", "liner", "submarine")
LOADS = (
    Component("clear", 1, nothing, {"hull": _CLEAR}),
    Component("clear", 1, nothing, {"hull": ("barge",), "house": ("tiers",)}),
    Component("seats", 1, seats, {"hull": ("barge",), "top": ("canopy",)}),
    Component("thwarts", 1, thwarts, {"hull": ("skiff", "canoe")}),
    Component("seats", 6, seats, {"house": ("cockpit",)}),
    Component("seats", 1, seats, {"hull": ("planing",), "house": ("decks", "coachroof")}),
    Component("well", 1, well, {"hull": ("yacht",)}),
    Component("containers", 2, containers, _CARGO),
    Component("hatches", 2, hatches, _CARGO),
    Component("tanks", 1, tanks, _CARGO),
    Component("pipes", 1, pipes, {"hull": ("freighter",)}),
    Component("gear", 4, gear, {"hull": ("tub",)}),
    Component("guns", 1, guns, {"house": ("citadel",)}),
    Component("planes", 1, planes, {"house": ("flattop",)}),
    Component("boats", 2, boats, {"hull": ("liner",)}),
)
