"""Speakers of the stage: boxes with a horn, floor wedges, guitar amplifiers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import UP, vec
from ffd_lightning.shapes.speaker.drivers import FORWARD, Finish, draw_cloth, draw_finish
from ffd_lightning.shapes.speaker.enclosure import Bay, Cabinet, Units, add_cabinet, row_of_bays
from ffd_lightning.shapes.speaker.fittings import (
    add_corners,
    add_feet,
    add_grille,
    add_handle,
    add_knobs,
    add_tripod,
)


def stage(rng: Rng) -> Builder:
    """Build a stage box: a horn above one or two cones, handles, corners; or a floor wedge."""
    b, finish = Builder(), draw_finish(rng)
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
    add_cabinet(b, cabinet, finish, row_of_bays(cabinet.face, units, 0.05, across))
    if rng.random() < 0.6 and not across:
        add_corners(b, pick_material(rng, "metal"), cabinet)
    if kind == "tripod":
        metal = pick_material(rng, "metal")
        add_tripod(b, metal, height=low + 0.005, spread=0.4, middle=vec(0, 0, 0.45 * deep))
    if not across:
        middle = 0.45 * cabinet.depth
        x = 0.5 * wide * (1 - (1 - back) * 0.45)
        for side in (-1, 1) if rng.random() < 0.6 else ():
            at = vec(side * x, low + 0.7 * tall, middle)
            out = vec(side * 0.05, 0, 0)
            ends = at - 0.09 * UP, at + 0.09 * UP
            points = [ends[0], ends[0] + out + 0.02 * UP, ends[1] + out - 0.02 * UP, ends[1]]
            path = bend(points, 0.03)
            b.tube("handle", finish.rim, path, 0.013, segments=8)
    if rng.random() < 0.15:
        add_grille(b, draw_cloth(rng), cabinet)
    return b


def amplifier(rng: Rng) -> Builder:
    """Build a guitar amplifier: cloth and a panel of knobs, in one box or a head on a cabinet."""
    b, finish = Builder(), draw_finish(rng)
    finish = replace(finish, body=pick_material(rng, draw(rng, ["leather", "rubber", "paint"])))
    wide, deep = rng.uniform(0.4, 0.75), rng.uniform(0.2, 0.32)
    stacked = rng.random() < 0.35
    tall = wide * (rng.uniform(0.85, 1.1) if stacked else rng.uniform(0.6, 1.0))
    low = rng.uniform(0.015, 0.04)
    cabinet = Cabinet(width=wide, height=tall, depth=deep, foot=(0, low, 0), bevel=0.012)
    if rng.random() < 0.3:
        cabinet = replace(cabinet, tilt=rng.uniform(3, 10))
    knob, cloth = pick_material(rng, "metal"), draw_cloth(rng)
    add_feet(b, finish.rim, wide, deep, low)
    rise = rng.uniform(0.09, 0.13)
    _speakers(b, rng, finish, cloth, cabinet, 0.0 if stacked else rise)
    case = cabinet
    if stacked:
        head = wide * rng.uniform(0.85, 1), rng.uniform(0.17, 0.26), 0.85 * deep
        x, y, z = cabinet.world((0, tall / 2 - 0.004, 0.1 * deep))
        case = Cabinet(*head, (x, y, z), bevel=0.01)
        add_cabinet(b, case, finish, [Bay("blank", 0, (0, 0), case.face)])
    panel = Material((0.75, 0.7, 0.55)) if rng.random() < 0.4 else finish.rim
    y = 0.0 if stacked else tall / 2 - case.bevel - rise / 2
    plate = (0.9 * case.width, 0.014, 0.7 * rise)
    turn = case.turn @ FORWARD
    b.rounded_box("panel", panel, case.world((0, y, 0)), plate, 0.008, turn=turn)
    x = 0.38 * case.width
    ends = case.world([(-x, y, -0.006), (x, y, -0.006)])
    add_knobs(b, knob, ends, 0.016, int(rng.integers(4, 9)))
    mounts = [(x * case.width, case.height / 2 - 0.004, 0.5 * deep) for x in (-0.2, 0.2)]
    top = case.world(mounts)
    add_handle(b, finish.rim, top, 0.04, 0.011)
    if rng.random() < 0.6 and not cabinet.tilt:
        add_corners(b, knob, cabinet)
    return b


def _speakers(
    b: Builder, rng: Rng, finish: Finish, cloth: Material, cabinet: Cabinet, reserve: float
) -> None:
    """Fill the front below `reserve` with cloth, or with one, two or four bare cones."""
    wide, tall = cabinet.face
    if rng.random() < 0.55:
        add_cabinet(b, cabinet, finish, [Bay("blank", 0, (0, 0), cabinet.face)])
        add_grille(b, cloth, cabinet, low=0.02, high=1 - reserve / tall)
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
