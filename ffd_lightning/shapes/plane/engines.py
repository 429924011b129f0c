"""Engines of aeroplanes."""

import itertools

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, nothing
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair, about_y, about_z, lean, vec
from ffd_lightning.shapes.plane.plan import BLACK, STEEL, Plan, skin
from ffd_lightning.shapes.plane.wings import surface


def _fan(b: Builder, paint: Material, center: Array, size: Pair, hold: Array) -> None:
    """Add a turbofan of a radius and a length that faces -z, and its pylon up to `hold`."""
    (radius, long), turn = size, lean(90)
    rows = np.array([(0.82, 0.5), (0.9, 0.5), (1, 0.4), (1, 0.05), (0.78, -0.42), (0.68, -0.42)])
    b.lathe("engine", paint, rows * [radius, -long], center, segments=18, turn=turn)
    mouth = np.array([(0.84, -0.505), (0.84, -0.47)]) * size
    b.lathe("engine", BLACK, mouth, center, segments=18, turn=turn)
    hub = [(0.3, -0.48), (0.2, -0.53), (0.02, -0.58)]
    for points in (hub, [(0.55, 0.38), (0.45, 0.52), (0.1, 0.6)]):
        b.lathe("engine", STEEL, np.array(points) * size, center, segments=12, turn=turn)
    way = hold - center
    foot = center + 0.7 * radius * way / np.linalg.norm(way) - vec(0, 0, 0.2 * long)
    surface(b, "engine", paint, [foot, hold], (0.75 * long, 0.4 * long))


def fans(
    b: Builder, rng: Rng, p: Plan, count: int = 2, place: str = "below", third: bool = False
) -> None:
    """Add turbofans below or above the wing, or at the rear; `third` adds one below the fin."""
    radius = min(rng.uniform(0.24, 0.42) * p.wide, 0.043) * (1 if count == 2 else 0.8)
    size = (radius, radius * rng.uniform(2.6, 4.4))
    paint = p.paint if rng.random() < 0.6 else p.accent
    drop, ahead = rng.uniform(1.15, 1.6) * radius, rng.uniform(0.1, 0.4) * size[1]
    z, up = p.end - rng.uniform(0.24, 0.32), rng.uniform(0.2, 0.6)
    for t in (p.station, p.station + rng.uniform(0.26, 0.34))[: count // 2]:
        for side in (-1, 1):
            hold = p.wing(t, 0.03, side)
            center = hold - vec(0, drop, ahead)
            if place == "rear":
                hold = vec(side * 0.8 * p.half(z), p.height(z, up), z - 0.2 * size[1])
                center = vec(side * (p.half(z) + 1.25 * radius), hold[1], z)
            elif place == "above":
                hold = p.wing(t, 0.4, side)
                center = hold + vec(0, 1.5 * radius, 0.3 * size[1])
            elif p.chords[0] > 0.5:  # a long delta carries them at its rear edge
                center = p.wing(t, 1, side) - vec(0, drop, 0.4 * size[1])
                hold = center + vec(0, drop, -0.3 * size[1])
            _fan(b, paint, center, size, hold)
    if third:
        hold = vec(0, p.height(p.end - 0.2, 0.8), p.end - 0.22)
        center = vec(0, p.height(p.end - 0.2, 1) + 0.8 * radius, p.end - 0.14)
        _fan(b, paint, center, (0.9 * radius, max(size[1], 0.22)), hold)


def _duct(b: Builder, p: Plan, start: float, end: float, middle: Pair, size: Pair) -> None:
    """Add an air intake at (x, y) with a dark mouth at z = `start`, that runs out at `end`."""
    (x, y), (wide, tall) = middle, size
    body = [Section(z, y, wide, tall) for z in (start, 0.6 * start + 0.4 * end)]
    skin(b, "engine", p.paint, [*body, Section(end, 0.6 * y, 0.5 * wide, 0.6 * tall)], 0.6, x)
    mouth = [Section(start + d, y, 0.82 * wide, 0.82 * tall) for d in (-0.002, 0.01)]
    skin(b, "engine", BLACK, mouth, 0.6, x)


def jets(b: Builder, rng: Rng, p: Plan, mouth: str) -> None:
    """Add a fighter's exhausts, one or two, and its intakes: "flank", "chin" or "nose"."""
    last, start, small = p.rows[-1], rng.uniform(-0.22, -0.1), rng.uniform(0.4, 0.55)
    twin = last.width > 1.5 * last.height
    r = 0.47 * min(last.height, last.width * (0.5 if twin else 1))
    end = last.z + rng.uniform(0.02, 0.08)
    for x in (-0.24 * last.width, 0.24 * last.width) if twin else (0.0,):
        root, tip = (x, last.lift, last.z - 0.06), vec(x, last.lift, end)
        b.cylinder("engine", STEEL, root, tip, 1.08 * r, radius_end=0.85 * r)
        b.cylinder("engine", BLACK, tip - vec(0, 0, 0.01), tip + vec(0, 0, 0.002), 0.7 * r)
    if mouth == "flank":
        size = small * p.wide, rng.uniform(0.45, 0.8) * p.tall
        for side in (-1, 1):
            _duct(b, p, start, 0.28, (side * p.half(start), -0.04 * p.tall), size)
    elif mouth == "chin":
        _duct(b, p, start, 0.28, (0, -0.45 * p.tall), (1.3 * small * p.wide, small * p.tall))
    else:
        hole, cone = p.rows[0].width, 0.6 * (rng.random() < 0.6)
        rows = [(-0.502, 0.86), (-0.49, 0.5)]
        skin(b, "engine", BLACK, [Section(z, 0, s * hole, s * hole) for z, s in rows])
        rows = [(-0.545, 0.02), (-0.49, cone + 0.02)]
        skin(b, "engine", STEEL, [Section(z, 0, s * hole, s * hole) for z, s in rows])


def sunk(b: Builder, rng: Rng, p: Plan, count: int) -> None:
    """Add two or four jets sunk into the top of a flying wing."""
    step = rng.uniform(0.3, 0.42) * p.wide * (4 / count)
    for x in (np.arange(count) - (count - 1) / 2) * step:
        z = float(np.interp(abs(x), p.edge[:, 0], p.edge[:, 2])) + 0.1
        _duct(b, p, z, z + 0.27, (x, p.level + 0.028), (0.075, 0.05))


def _propeller(b: Builder, rng: Rng, p: Plan, hub: ArrayLike, radius: float, face: int = 1) -> None:
    """Add a propeller in the plane z = const, clear of the ground; `face` -1 turns it back."""
    c, start, blades = np.asarray(hub, float), rng.uniform(0, 360), int(rng.integers(2, 6))
    radius = min(radius, 0.95 * (c[1] - p.ground))
    wide, r = 0.1 * radius + 0.004, 0.13 * radius
    for i in range(blades):
        spin, rings = about_z(start + 360 * i / blades), []
        for t, w, twist in ((0.05, 0.5, 50), (0.35, 1.0, 35), (0.8, 0.9, 20), (1.0, 0.45, 15)):
            half, thin = vec(w * wide, 0, 0), vec(0, 0, 0.012 * radius)
            flat = np.array([-half, -thin, half, thin])
            rings.append((flat @ about_y(twist).T + t * radius * UP) @ spin.T + c)
        b.loft("engine", BLACK, rings)
    cone = [(r, -0.6 * r), (r, 0.2 * r), (0.75 * r, r), (0.1 * r, 1.7 * r)]
    b.lathe("engine", p.accent, cone, c, segments=14, turn=lean(-90 * face))


def nose(b: Builder, rng: Rng, p: Plan, radial: bool = False) -> None:
    """Add a propeller at the nose, before a round open cowl when the engine is `radial`."""
    if radial:
        places = [(-0.507, 0.85), (-0.5, 0.97), (-0.485, 1.02), (-0.42, 1.06), (-0.4, 0.98)]
        cowl = [Section(z, 0, s * p.rows[2].width, s * p.rows[2].height) for z, s in places]
        skin(b, "engine", p.accent if rng.random() < 0.5 else STEEL, cowl[1:])
        skin(b, "engine", BLACK, [cowl[0], cowl[0]._replace(z=-0.48)])
    _propeller(b, rng, p, (0, p.rows[0].lift, -0.512), rng.uniform(0.11, 0.19))


def pusher(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a propeller behind a short fuselage, within the tail's booms."""
    radius = min(rng.uniform(0.1, 0.15), 0.85 * p.station * p.span)
    _propeller(b, rng, p, (0, p.rows[-1].lift, p.end + 0.01), radius, -1)


def props(b: Builder, rng: Rng, p: Plan, count: int) -> None:
    """Add two or four propeller engines on the wing."""
    wide, tall, ahead = (rng.uniform(*ends) for ends in ((0.032, 0.055), (1, 1.3), (0.06, 0.12)))
    cowl, state = p.accent if rng.random() < 0.4 else p.paint, int(rng.integers(1 << 30))
    radius = min(rng.uniform(0.06, 0.11), 0.14 * p.span if count == 4 else 1.0)
    for t, side in itertools.product((p.station, p.station + 0.3)[: count // 2], (-1, 1)):
        same = np.random.default_rng(state)  # all propellers are equal
        x, y, z = p.wing(t, 0, side)
        chord = p.wing(t, 1)[2] - z
        places = [(0.006 - ahead, 0.7), (0.035 - ahead, 1), (0.5 * chord, 1), (1.15 * chord, 0.35)]
        pod = [Section(z + d, y, s * wide, s * tall * wide) for d, s in places]
        skin(b, "engine", cowl, pod, 0.2, x)
        _propeller(b, same, p, (x, y, z - ahead), radius)


_LINER, _BUSINESS = {"fuselage": ("tube",), "mount": ("low",)}, {"role": ("business",)}
_AIRLINER, _PROPLINER = {"role": ("airliner",)}, {"role": ("propliner",)}
_FLYING = {"role": ("flying",)}
ENGINES = (
    Component("wing2", 6, fans, {"fuselage": ("tube", "cargo"), **_AIRLINER}),
    Component.of("wing4", 1.5, fans, _AIRLINER, count=4),
    Component.of("wing3", 0.6, fans, _LINER, third=True),
    Component.of("rear2", 2, fans, _LINER, place="rear"),
    Component.of("rear3", 0.6, fans, _LINER, place="rear", third=True),
    Component.of("rear2", 5, fans, _BUSINESS, place="rear"),
    Component.of("rear3", 0.8, fans, _BUSINESS, place="rear", third=True),
    Component.of("over", 0.5, fans, _BUSINESS, place="above"),
    Component("below", 1, fans, {"role": ("supersonic",)}),
    Component.of("pods", 1, fans, {"wing": ("plain",), "fuselage": ("slim",)}, place="rear"),
    Component.of("flank", 3, jets, {"role": ("fighter",), "fuselage": ("slim", "broad", "pod")},
                 mouth="flank"),
    Component.of("chin", 1, jets, {"fuselage": ("slim", "broad")}, mouth="chin"),
    Component.of("mouth", 1, jets, {"fuselage": ("barrel",)}, mouth="nose"),
    Component("nose", 1, nose, {"fuselage": ("cowled", "inline")}),
    Component.of("nose", 1, nose, {"fuselage": ("radial",)}, radial=True),
    Component("pusher", 1, pusher, {"role": ("light",), "fuselage": ("pod",)}),
    Component.of("props2", 1, props, {"role": ("warbird",), "fuselage": ("pod",)}, count=2),
    Component.of("props2", 1.5, props, _PROPLINER, count=2),
    Component.of("props4", 1, props, _PROPLINER, count=4),
    Component("none", 1, nothing, {"role": ("glider",)}),
    Component.of("sunk2", 1.5, sunk, _FLYING, count=2),
    Component.of("sunk4", 1, sunk, _FLYING, count=4),
)  # fmt: skip
