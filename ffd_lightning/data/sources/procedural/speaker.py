"""Speakers: bookshelf, tower, stand, subwoofer, soundbar, stage, amplifier, pod, horn, set."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.data.sources.procedural.furniture import UP, bend, circle, draw
from ffd_lightning.data.sources.procedural.shapes import (
    Array,
    Builder,
    Family,
    Material,
    pick_material,
    rotation,
)
from ffd_lightning.data.sources.procedural.speaker_parts import (
    FORWARD,
    Bay,
    Cabinet,
    Finish,
    add_cabinet,
    add_corners,
    add_driver,
    add_feet,
    add_grille,
    add_handle,
    add_knobs,
    add_post,
    draw_cloth,
    draw_finish,
    row_of_bays,
)

PARTS = ("body", "driver", "port", "grille", "panel", "handle", "stand")

Units = list[tuple[str, float]]


def _draw_cabinet(
    rng: np.random.Generator,
    width: tuple[float, float],
    height: tuple[float, float],
    depth: tuple[float, float],
    foot: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Cabinet:
    """Draw the sizes within their ranges, the bevel, and straight, tapered or bowed sides."""
    w, h, d = rng.uniform(*width), rng.uniform(*height), rng.uniform(*depth)
    side = draw(rng, ["straight", "tapered", "bowed"], [0.6, 0.15, 0.25])
    back = 1.0 if side == "straight" else rng.uniform(0.4, 0.8)
    curve = rng.uniform(1.8, 3.0) if side == "bowed" else 1.0
    bevel = w * rng.uniform(0.02, 0.1)
    return Cabinet(w, h, d, foot, bevel=bevel, back=back, curve=curve)


def _two_way(rng: np.random.Generator, width: float) -> Units:
    """Draw one or two cones, a tweeter and perhaps a port, from below up."""
    big = width * rng.uniform(0.32, 0.46)
    units: Units = [("woofer", big)]
    if rng.random() < 0.25:
        units.append(("woofer", big * rng.uniform(0.6, 1.0)))
    treble = "horn" if rng.random() < 0.12 else "tweeter"
    units.append((treble, width * (0.38 if treble == "horn" else rng.uniform(0.15, 0.26))))
    if rng.random() < 0.2:
        units.reverse()
    if rng.random() < 0.35:
        kind = draw(rng, ["port", "slot"])
        units.insert(0, (kind, width * (rng.uniform(0.12, 0.2) if kind == "port" else 0.35)))
    return units


def _bookshelf(rng: np.random.Generator) -> Builder:
    """Build a small box with two or three drivers, perhaps behind a cloth."""
    b, finish = Builder(), draw_finish(rng)
    low = rng.uniform(0.008, 0.025) if rng.random() < 0.4 else 0.0
    cabinet = _draw_cabinet(rng, (0.16, 0.3), (0.28, 0.5), (0.16, 0.38), (0, low, 0))
    if rng.random() < 0.2:
        cabinet = replace(cabinet, tilt=rng.uniform(4, 14))
    bays = row_of_bays(cabinet.face, _two_way(rng, cabinet.width), rng.uniform(0, 0.5))
    add_cabinet(b, cabinet, finish, bays)
    if low:
        add_feet(b, finish.rim, cabinet.back * cabinet.width, cabinet.depth, low, False)
    if rng.random() < 0.2:
        add_grille(b, draw_cloth(rng), cabinet, 0.0, rng.choice([1.0, 0.6]))
    return b


def _tower(rng: np.random.Generator) -> Builder:
    """Build a tall narrow box with three to six drivers on a plinth, spikes or nothing."""
    b, finish = Builder(), draw_finish(rng)
    base = draw(rng, ["plinth", "spikes", "outriggers", "none"], [0.45, 0.25, 0.15, 0.15])
    low = 0.0 if base == "none" else rng.uniform(0.02, 0.05)
    cabinet = _draw_cabinet(rng, (0.15, 0.3), (0.75, 1.3), (0.18, 0.42), (0, low, 0))
    if rng.random() < 0.3:
        cabinet = replace(cabinet, tilt=rng.uniform(2, 9))
    wide, deep = cabinet.width, cabinet.depth
    bass, mid = wide * rng.uniform(0.34, 0.46), wide * rng.uniform(0.22, 0.34)
    units: Units = [("woofer", bass)] * int(rng.integers(1, 4))
    units += [("woofer", mid)] * int(rng.integers(0, 2)) + [("tweeter", 0.18 * wide)]
    if rng.random() < 0.4:
        units.append(("woofer", mid))
    if rng.random() < 0.4:
        units.insert(0, ("port", 0.18 * wide))
    add_cabinet(b, cabinet, finish, row_of_bays(cabinet.face, units, rng.uniform(0.2, 0.95)))
    if base == "plinth":
        size = (wide * rng.uniform(1.1, 1.4), low + 0.004, deep * rng.uniform(1.05, 1.25))
        b.rounded_box("stand", finish.rim, (0, low / 2, deep / 2), size, 0.02, 0.006)
    elif base == "spikes":
        add_feet(b, finish.rim, cabinet.back * wide, deep, low, True)
    elif base == "outriggers":
        for z in (0.12, 0.88):
            size = (1.5 * wide, low, 0.1 * deep)
            b.rounded_box("stand", finish.rim, (0, low / 2 + 0.004, z * deep), size, 0.01)
    if rng.random() < 0.25:
        add_grille(b, draw_cloth(rng), cabinet, 0.0, rng.uniform(0.45, 1.0))
    return b


def _stand(rng: np.random.Generator) -> Builder:
    """Build a small box on a stand of one, two or four posts, or on a tripod."""
    b, finish = Builder(), draw_finish(rng)
    metal, low = pick_material(rng, "metal"), rng.uniform(0.4, 0.9)
    cabinet = _draw_cabinet(rng, (0.13, 0.26), (0.2, 0.42), (0.14, 0.3), (0, low, 0))
    bays = row_of_bays(cabinet.face, _two_way(rng, cabinet.width), rng.uniform(0, 0.3))
    add_cabinet(b, cabinet, finish, bays)
    middle = np.array([0, 0, cabinet.depth / 2])
    wide, deep = cabinet.width, cabinet.depth
    plate = (0.9 * min(1.0, cabinet.back + 0.3) * wide, 0.02, 0.9 * deep)
    b.rounded_box("stand", metal, middle + (low - 0.008) * UP, plate, 0.01)
    kind = draw(rng, ["round", "one", "two", "four", "tripod"], [0.25, 0.2, 0.2, 0.15, 0.2])
    if kind == "tripod":
        _tripod(b, metal, low, rng.uniform(0.2, 0.32), middle)
        return b
    if kind == "round":
        radius = rng.uniform(0.12, 0.18)
        rows = [(radius, 0), (radius, 0.015), (0.9 * radius, 0.025), (0.02, 0.03)]
        b.lathe("stand", metal, rows, middle, 32)
        thick = rng.uniform(0.015, 0.03)
        b.cylinder("stand", metal, middle + 0.01 * UP, middle + (low - 0.005) * UP, thick)
        return b
    size = (wide * rng.uniform(1.0, 1.4), 0.03, deep * rng.uniform(1.0, 1.3))
    b.rounded_box("stand", metal, middle + 0.015 * UP, size, 0.01)
    places = {"one": [(0, 0)], "two": [(-0.25, 0), (0.25, 0)]}
    side = rng.uniform(0.05, 0.09) if kind == "one" else 0.035
    for x, z in places.get(kind, [(-0.28, -0.3), (0.28, -0.3), (0.28, 0.3), (-0.28, 0.3)]):
        at = middle + (x * wide, 0, z * deep)
        add_post(b, metal, at + 0.02 * UP, at + (low - 0.01) * UP, side)
    return b


def _tripod(b: Builder, metal: Material, height: float, spread: float, middle: Array) -> None:
    """Add a pole on three splayed legs with braces."""
    b.cylinder("stand", metal, middle + 0.1 * UP, middle + (height - 0.005) * UP, 0.016)
    joint = middle + 0.55 * height * UP
    b.cylinder("stand", metal, joint - 0.03 * UP, joint + 0.03 * UP, 0.028)
    for foot in circle(3, spread, 0.012, 90) + middle:
        b.cylinder("stand", metal, joint, foot, 0.011, segments=10)
        brace = 0.35 * joint + 0.65 * foot
        b.cylinder("stand", metal, middle + 0.12 * UP, brace, 0.008, segments=8)


def _subwoofer(rng: np.random.Generator) -> Builder:
    """Build a cube with one or two large cones, or a drum that fires to the front or down."""
    b, finish = Builder(), draw_finish(rng)
    low, size = rng.uniform(0.02, 0.06), rng.uniform(0.3, 0.5)
    if rng.random() < 0.2:
        return _drum(b, rng, finish, 0.5 * size, low)
    cabinet = _draw_cabinet(
        rng, (0.8 * size, 1.2 * size), (0.8 * size, 1.3 * size), (0.7, 1.1), (0, low, 0)
    )
    cabinet = replace(cabinet, depth=cabinet.depth * size, back=max(cabinet.back, 0.75))
    units: Units = [("woofer", size * rng.uniform(0.3, 0.5))]
    if rng.random() < 0.45:
        kind = draw(rng, ["port", "slot"])
        units.insert(0, (kind, size * (0.1 if kind == "port" else 0.4)))
    if rng.random() < 0.2:
        units.append(units[-1])
    across = len(units) == 2 and units[0][0] == "port" and rng.random() < 0.4
    add_cabinet(b, cabinet, finish, row_of_bays(cabinet.face, units, 0.1, across))
    add_feet(b, finish.rim, cabinet.back * cabinet.width, cabinet.depth, low, rng.random() < 0.4)
    if rng.random() < 0.25:
        add_grille(b, draw_cloth(rng), cabinet, 0.0, rng.uniform(0.75, 1.0))
    return b


def _drum(
    b: Builder, rng: np.random.Generator, finish: Finish, radius: float, low: float
) -> Builder:
    """Add an upright drum on feet whose cone looks up, between two plates."""
    tall, edge = radius * rng.uniform(1.2, 3.0), 0.08 * radius
    rows = [
        (0.93 * radius, low),
        (radius, low + edge),
        (radius, low + tall),
        (0.9 * radius, low + tall + edge),
    ]
    b.lathe("body", finish.body, rows, segments=40)
    top = np.array([0, low + tall + edge + 0.3 * radius, 0])
    add_driver(
        b, finish, "woofer", top - (0, 0.2 * radius, 0), 0.0 + 0.8 * radius, rotation((1, 0, 0), 90)
    )
    for x, _, z in circle(4, 0.7 * radius, 0, 45):
        b.cylinder("stand", finish.rim, (x, 0, z), (x, low + 0.01, z), 0.08 * radius)
    return b


def _soundbar(rng: np.random.Generator) -> Builder:
    """Build a long low box: a centre speaker with drivers in a row, or a bar behind cloth."""
    b, finish = Builder(), draw_finish(rng)
    low = rng.uniform(0.012, 0.03)
    cabinet = _draw_cabinet(rng, (0.5, 1.2), (0.09, 0.24), (0.08, 0.28), (0, low, 0))
    cabinet = replace(cabinet, bevel=cabinet.height * rng.uniform(0.04, 0.2), back=1.0)
    if rng.random() < 0.25:
        cabinet = replace(cabinet, tilt=rng.uniform(5, 20))
    big, small = 0.46 * cabinet.height, cabinet.height * rng.uniform(0.18, 0.3)
    half: Units = [("woofer", big)] * int(rng.integers(1, 3))
    if rng.random() < 0.4:
        half = [("port", 0.7 * small), *half]
    middle: Units = [(draw(rng, ["tweeter", "horn"], [0.8, 0.2]), small)]
    units = [*half, *middle, *half[::-1]]
    add_cabinet(b, cabinet, finish, row_of_bays(cabinet.face, units, across=True))
    add_feet(b, finish.rim, cabinet.width, cabinet.depth, low, False)
    if rng.random() < 0.35:
        add_grille(b, draw_cloth(rng), cabinet)
    return b


def _stage(rng: np.random.Generator) -> Builder:
    """Build a stage box: a horn above one or two cones, handles, corners; or a floor wedge."""
    b, finish = Builder(), draw_finish(rng)
    finish = replace(finish, body=pick_material(rng, draw(rng, ["rubber", "plastic"], [0.7, 0.3])))
    kind = draw(rng, ["floor", "tripod", "wedge"], [0.45, 0.25, 0.3])
    low = rng.uniform(0.7, 1.0) if kind == "tripod" else 0.0
    wide, tall = rng.uniform(0.35, 0.5), rng.uniform(0.55, 0.95)
    back, deep = rng.uniform(0.5, 0.9), rng.uniform(0.28, 0.42)
    cabinet = Cabinet(wide, tall, deep, (0, low, 0), bevel=0.015, back=back)
    units: Units = [("woofer", wide * rng.uniform(0.36, 0.46)), ("horn", 0.4 * wide)]
    if tall > 1.7 * wide and rng.random() < 0.6:
        units.insert(0, units[0])
    if rng.random() < 0.3:
        units.insert(0, ("slot", 0.38 * wide))
    across = kind == "wedge"
    if across:
        tilt = rng.uniform(35, 50)
        cabinet = Cabinet(tall, wide, 0.62 * wide, tilt=tilt, bevel=0.012)
        units = [u for u in units if u[0] != "slot"][-2:]
    add_cabinet(b, cabinet, finish, row_of_bays(cabinet.face, units, 0.05, across))
    if rng.random() < 0.6 and not across:
        add_corners(b, pick_material(rng, "metal"), cabinet)
    if kind == "tripod":
        _tripod(b, pick_material(rng, "metal"), low + 0.005, 0.4, np.array([0, 0, 0.45 * deep]))
    if not across:
        middle = 0.45 * cabinet.depth
        x = 0.5 * wide * (1 - (1 - back) * 0.45)
        for side in (-1, 1) if rng.random() < 0.6 else ():
            at = np.array([side * x, low + 0.7 * tall, middle])
            path = bend([at - 0.09 * UP, at + (side * 0.05, -0.07, 0), at + (side * 0.05, 0.07, 0),
                         at + 0.09 * UP], 0.03)  # fmt: skip
            b.tube("handle", finish.rim, path, 0.013, 8)
    if rng.random() < 0.15:
        add_grille(b, draw_cloth(rng), cabinet)
    return b


def _amplifier(rng: np.random.Generator) -> Builder:
    """Build a guitar amplifier: cloth and a panel of knobs, in one box or a head on a cabinet."""
    b, finish = Builder(), draw_finish(rng)
    finish = replace(finish, body=pick_material(rng, draw(rng, ["leather", "rubber", "paint"])))
    wide, deep = rng.uniform(0.4, 0.75), rng.uniform(0.2, 0.32)
    stacked = rng.random() < 0.35
    tall = wide * (rng.uniform(0.85, 1.1) if stacked else rng.uniform(0.6, 1.0))
    low = rng.uniform(0.015, 0.04)
    cabinet = Cabinet(wide, tall, deep, (0, low, 0), bevel=0.012)
    if rng.random() < 0.3:
        cabinet = replace(cabinet, tilt=rng.uniform(3, 10))
    knob, cloth = pick_material(rng, "metal"), draw_cloth(rng)
    add_feet(b, finish.rim, wide, deep, low, False)
    rise = rng.uniform(0.09, 0.13)
    _speakers(b, rng, finish, cloth, cabinet, 0.0 if stacked else rise)
    case = cabinet
    if stacked:
        case = Cabinet(wide * rng.uniform(0.85, 1), rng.uniform(0.17, 0.26), 0.85 * deep,
                       tuple(cabinet.world((0, tall / 2 - 0.004, 0.1 * deep))), bevel=0.01)  # fmt: skip
        add_cabinet(b, case, finish, [Bay("blank", 0, (0, 0), case.face)])
    panel = Material((0.75, 0.7, 0.55)) if rng.random() < 0.4 else finish.rim
    y = 0.0 if stacked else tall / 2 - case.bevel - rise / 2
    turn = case.turn @ FORWARD
    b.rounded_box("panel", panel, case.world((0, y, 0)), (0.9 * case.width, 0.014, 0.7 * rise), 0.008,
                  turn=turn)  # fmt: skip
    ends = (case.world((side * 0.38 * case.width, y, -0.006)) for side in (-1, 1))
    add_knobs(b, knob, *ends, 0.016, int(rng.integers(4, 9)))
    top = [
        case.world((side * 0.2 * case.width, case.height / 2 - 0.004, 0.5 * deep))
        for side in (-1, 1)
    ]
    add_handle(b, finish.rim, top, 0.04, 0.011)
    if rng.random() < 0.6:
        add_corners(b, knob, cabinet)
    return b


def _speakers(
    b: Builder,
    rng: np.random.Generator,
    finish: Finish,
    cloth: Material,
    cabinet: Cabinet,
    reserve: float,
) -> None:
    """Fill the front below `reserve` with cloth, or with one, two or four bare cones."""
    wide, tall = cabinet.face
    if rng.random() < 0.55:
        add_cabinet(b, cabinet, finish, [Bay("blank", 0, (0, 0), cabinet.face)])
        add_grille(b, cloth, cabinet, 0.02, 1 - reserve / tall)
        return
    across = int(rng.integers(1, 3))
    down = 2 if across == 2 and tall - reserve > 0.75 * wide else 1
    cell = (wide / across, (tall - reserve) / down)
    radius = min(cell) * rng.uniform(0.36, 0.46)
    bays = [Bay("woofer", radius, ((i + 0.5) * cell[0] - wide / 2, (j + 0.5) * cell[1] - tall / 2), cell)
            for i in range(across) for j in range(down)]  # fmt: skip
    if reserve:
        bays.append(Bay("blank", 0, (0, (tall - reserve) / 2), (wide, reserve)))
    add_cabinet(b, cabinet, finish, bays)


def _pod(rng: np.random.Generator) -> Builder:
    """Build an egg, ball, tube or bell around one driver, on a neck, on legs or on the ground."""
    b, finish = Builder(), draw_finish(rng)
    radius, low = rng.uniform(0.09, 0.16), rng.uniform(0.0, 0.15)
    long, front = radius * rng.uniform(0.9, 2.4), rng.uniform(0.6, 0.92)
    stretch = np.diag([1.0, rng.uniform(0.8, 1.5), 1.0])
    a = np.linspace(np.arccos(front), np.pi - 0.03, 14)
    blunt = rng.uniform(0.5, 1.0)
    rows = np.stack([radius * np.sin(np.pi / 2 - np.arccos(front) + 0 * a), a], 1)
    rows[:, 0] = radius * np.where(a < np.pi / 2, np.sin(a) * 0 + front + (1 - front) * np.sin(
        (a - a[0]) / (np.pi / 2 - a[0]) * np.pi / 2), np.sin(a) ** blunt)  # fmt: skip
    return b


FAMILIES: dict[str, Family] = {
    "bookshelf": _bookshelf,
    "tower": _tower,
    "stand": _stand,
    "subwoofer": _subwoofer,
    "soundbar": _soundbar,
    "stage": _stage,
    "amplifier": _amplifier,
}
