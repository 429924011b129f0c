"""Speakers of the stage: boxes with a horn, floor wedges, guitar amplifiers; horns outdoors."""

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import UP, lean, vec
from ffd_lightning.shapes.speaker.boxes import Bay, Cabinet, Units, add_cabinet
from ffd_lightning.shapes.speaker.drivers import FORWARD, Finish, draw_cloth, draw_finish, skin
from ffd_lightning.shapes.speaker.fittings import corners, feet, grille, handle, knobs, tripod


def stage(b: Builder, rng: Rng) -> None:
    """Build a stage box: a horn above one or two cones, handles, corners; or a floor wedge."""
    finish = draw_finish(rng)
    finish = replace(finish, body=pick_material(rng, draw(rng, ["rubber", "plastic"], [0.7, 0.3])))
    kind = draw(rng, ["floor", "tripod", "wedge"], [0.45, 0.25, 0.3])
    low = rng.uniform(0.7, 1.0) if kind == "tripod" else 0.0
    wide, tall = rng.uniform(0.35, 0.5), rng.uniform(0.55, 0.95)
    back, deep = rng.uniform(0.5, 0.9), rng.uniform(0.28, 0.42)
    cabinet = Cabinet(width=wide, height=tall, depth=deep, foot=(0, low, 0), bevel=0.015, back=back)
    units: Units = [("woofer", wide * rng.uniform(0.36, 0.46)), ("horn", 0.4 * wide)]
    if tall > 1.7 * wide and rng.random() < 0.6:
        units.insert(0, units[0])
    if rng.random() < 0.3:
        units.insert(0, ("slot", 0.38 * wide))
    across = kind == "wedge"
    if across:
        tilt = rng.uniform(35, 50)
        cabinet = Cabinet(width=tall, height=wide, depth=0.62 * wide, tilt=tilt, bevel=0.012)
        units = [u for u in units if u[0] != "slot"][-2:]
    add_cabinet(b, cabinet, finish, cabinet.bays(units, 0.05, across))
    if rng.random() < 0.6 and not across:
        corners(b, pick_material(rng, "metal"), cabinet)
    if kind == "tripod":
        metal = pick_material(rng, "metal")
        tripod(b, metal, height=low + 0.005, spread=0.4, middle=vec(0, 0, 0.45 * deep))
    for side in (-1, 1) if not across and rng.random() < 0.6 else ():
        at = vec(side * (0.5 * wide * (1 - (1 - back) * 0.45)), low + 0.7 * tall, 0.45 * deep)
        start, end, out = at - 0.09 * UP, at + 0.09 * UP, vec(side * 0.05, 0, 0)
        path = bend([start, start + out + 0.02 * UP, end + out - 0.02 * UP, end], 0.03)
        b.tube("handle", finish.rim, path, 0.013, segments=8)
    if rng.random() < 0.15:
        grille(b, draw_cloth(rng), cabinet)


def amplifier(b: Builder, rng: Rng) -> None:
    """Build a guitar amplifier: cloth and a panel of knobs, in one box or a head on a cabinet."""
    finish = draw_finish(rng)
    finish = replace(finish, body=pick_material(rng, draw(rng, ["leather", "rubber", "paint"])))
    wide, deep = rng.uniform(0.4, 0.75), rng.uniform(0.2, 0.32)
    stacked = rng.random() < 0.35
    tall = wide * (rng.uniform(0.85, 1.1) if stacked else rng.uniform(0.6, 1.0))
    low = rng.uniform(0.015, 0.04)
    tilt = rng.uniform(3, 10) if rng.random() < 0.3 else 0.0
    case = cabinet = Cabinet(wide, tall, deep, (0, low, 0), tilt, bevel=0.012)
    knob, cloth = pick_material(rng, "metal"), draw_cloth(rng)
    feet(b, finish.rim, cabinet)
    rise = rng.uniform(0.09, 0.13)
    _speakers(b, rng, finish, cloth, cabinet, 0.0 if stacked else rise)
    if stacked:
        head = wide * rng.uniform(0.85, 1), rng.uniform(0.17, 0.26), 0.85 * deep
        x, y, z = cabinet.world((0, tall / 2 - 0.004, 0.1 * deep))
        case = Cabinet(*head, (x, y, z), bevel=0.01)
        add_cabinet(b, case, finish, [Bay("blank", 0, (0, 0), case.face)])
    panel = Material((0.75, 0.7, 0.55)) if rng.random() < 0.4 else finish.rim
    y = 0.0 if stacked else tall / 2 - case.bevel - rise / 2
    plate, turn = (0.9 * case.width, 0.014, 0.7 * rise), case.turn @ FORWARD
    b.rounded_box("panel", panel, case.world((0, y, 0)), plate, 0.008, turn=turn)
    ends = case.world([(x * case.width, y, -0.006) for x in (-0.38, 0.38)])
    knobs(b, knob, ends, 0.016, int(rng.integers(4, 9)))
    mounts = [(x * case.width, case.height / 2 - 0.004, 0.5 * deep) for x in (-0.2, 0.2)]
    handle(b, finish.rim, case.world(mounts), 0.04, 0.011)
    if rng.random() < 0.6 and not cabinet.tilt:
        corners(b, knob, cabinet)


def _speakers(
    b: Builder, rng: Rng, finish: Finish, cloth: Material, cabinet: Cabinet, reserve: float
) -> None:
    """Fill the front below `reserve` with cloth, or with one, two or four bare cones."""
    wide, tall = cabinet.face
    if rng.random() < 0.55:
        add_cabinet(b, cabinet, finish, [Bay("blank", 0, (0, 0), cabinet.face)])
        grille(b, cloth, cabinet, low=0.02, high=1 - reserve / tall)
        return
    across = int(rng.integers(1, 3))
    down = 2 if across == 2 and tall - reserve > 0.75 * wide else 1
    cell = (wide / across, (tall - reserve) / down)
    radius = min(cell) * rng.uniform(0.36, 0.46)
    xs = (np.arange(across) + 0.5) * cell[0] - wide / 2
    ys = (np.arange(down) + 0.5) * cell[1] - tall / 2
    bays = [Bay("woofer", radius, (float(x), float(y)), cell) for x in xs for y in ys]
    if reserve:
        bays.append(Bay("blank", 0, (0, (tall - reserve) / 2), (wide, reserve)))
    add_cabinet(b, cabinet, finish, bays)


def horn(b: Builder, rng: Rng) -> None:
    """Build a round or oblong public-address horn in a bracket, on a wall plate, post or foot."""
    paint = pick_material(rng, draw(rng, ["plastic", "paint", "metal"]))
    metal = pick_material(rng, "metal")
    long, mouth = rng.uniform(0.25, 0.5), rng.uniform(0.13, 0.24)
    throat, flare = rng.uniform(0.03, 0.05), rng.uniform(1.3, 3.0)
    squash = rng.uniform(0.5, 0.8) if rng.random() < 0.35 else 1.0
    low = mouth * squash + rng.uniform(0.06, 0.12)
    at, turn = low * UP, np.diag([1.0, squash, 1.0])
    t = np.linspace(0, 1, 12)
    outer = np.stack([throat + (mouth - throat) * t**flare, long * t], 1)
    lip = [(1.05 * mouth, long), (1.05 * mouth, long + 0.015), (0.97 * mouth, long + 0.012)]
    inner = outer[::-1] - (0.008, -0.002)
    skin(b, "body", paint, np.concatenate([outer, lip, inner]), at, turn)
    plug = np.array([(0.6, 0.15), (0.75, 0.3), (0.5, 0.42), (0.1, 0.48)]) * (1.3 * throat, long)
    b.lathe("driver", metal, plug, at, segments=20, turn=turn @ FORWARD)
    b.cylinder("driver", metal, at - vec(0, 0, 0.25 * long), at + vec(0, 0, 0.05), 0.35 * throat)
    deep, wide = rng.uniform(0.08, 0.16), rng.uniform(1.3, 2.2) * throat
    rows = [(throat, -0.02), (wide, 0.0), (wide, 0.8 * deep), (0.8 * wide, deep)]
    rows += [(0.1 * wide, deep)]
    b.lathe("driver", pick_material(rng, "metal"), rows, at, segments=28, turn=lean(90))
    arm, z = wide + 0.02, 0.5 * deep
    hook = [(-arm, low, z), (-arm, 0.02, z), (arm, 0.02, z), (arm, low, z)]
    b.tube("stand", metal, bend(hook, 0.03), 0.01, segments=8)
    b.cylinder("stand", metal, at + vec(-arm - 0.02, 0, z), at + vec(arm + 0.02, 0, z), 0.014)
    if rng.random() < 0.4:
        drop = rng.uniform(0.3, 0.9)
        b.cylinder("stand", metal, (0, -drop, z), (0, 0.02, z), 0.02)
        rows = [(0.13, 0), (0.13, 0.015), (0.03, 0.03)]
        b.lathe("stand", metal, rows, (0, -drop - 0.01, z), segments=28)
    else:
        size = (2.2 * wide, 0.016, 0.16)
        b.rounded_box("stand", metal, (0, 0.006, z), size, radius=0.01, edge=0.004)
