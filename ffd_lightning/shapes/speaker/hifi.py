"""Speakers of the living room: on the shelf, on the floor, on stands, below the screen."""

from __future__ import annotations

from dataclasses import replace

from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.vectors import UP, vec
from ffd_lightning.shapes.speaker.drivers import draw_cloth, draw_finish
from ffd_lightning.shapes.speaker.enclosure import (
    Units,
    add_cabinet,
    draw_cabinet,
    row_of_bays,
    share_below,
    two_way,
)
from ffd_lightning.shapes.speaker.fittings import add_feet, add_grille, add_tripod


def bookshelf(rng: Rng) -> Builder:
    """Build a small box with two or three drivers, perhaps behind a cloth."""
    b, finish = Builder(), draw_finish(rng)
    low = rng.uniform(0.008, 0.025) if rng.random() < 0.4 else 0.0
    width, depth = (0.16, 0.3), (0.16, 0.38)
    cabinet = draw_cabinet(rng, width=width, height=(0.28, 0.5), depth=depth, foot=(0, low, 0))
    if rng.random() < 0.2:
        cabinet = replace(cabinet, tilt=rng.uniform(4, 14))
    bays = row_of_bays(cabinet.face, two_way(rng, cabinet.width), rng.uniform(0, 0.5))
    add_cabinet(b, cabinet, finish, bays)
    if low:
        add_feet(b, finish.rim, cabinet.back * cabinet.width, cabinet.depth, low)
    if rng.random() < 0.2:
        cover = bays[-2] if rng.random() < 0.4 else bays[-1]
        add_grille(b, draw_cloth(rng), cabinet, high=share_below(cabinet, cover))
    return b


def tower(rng: Rng) -> Builder:
    """Build a tall narrow box with three to six drivers on a plinth, spikes or nothing."""
    b, finish = Builder(), draw_finish(rng)
    base = draw(rng, ["plinth", "spikes", "outriggers", "none"], [0.45, 0.25, 0.15, 0.15])
    low = 0.0 if base == "none" else rng.uniform(0.02, 0.05)
    width, depth = (0.15, 0.3), (0.18, 0.42)
    cabinet = draw_cabinet(rng, width=width, height=(0.75, 1.3), depth=depth, foot=(0, low, 0))
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
    bays = row_of_bays(cabinet.face, units, rng.uniform(0.2, 0.95))
    add_cabinet(b, cabinet, finish, bays)
    if base == "plinth":
        size = (wide * rng.uniform(1.1, 1.4), low + 0.004, deep * rng.uniform(1.05, 1.25))
        b.rounded_box("stand", finish.rim, (0, low / 2, deep / 2), size, radius=0.02, edge=0.006)
    elif base == "spikes":
        add_feet(b, finish.rim, cabinet.back * wide, deep, low, cone=True)
    elif base == "outriggers":
        for z in (0.12, 0.88):
            size = (1.5 * wide, low, 0.1 * deep)
            b.rounded_box("stand", finish.rim, (0, low / 2 + 0.004, z * deep), size, 0.01)
    if rng.random() < 0.25:
        cover = bays[int(rng.integers(1, len(bays)))]
        add_grille(b, draw_cloth(rng), cabinet, high=share_below(cabinet, cover))
    return b


def stand(rng: Rng) -> Builder:
    """Build a small box on a stand of one, two or four posts, or on a tripod."""
    b, finish = Builder(), draw_finish(rng)
    metal, low = pick_material(rng, "metal"), rng.uniform(0.4, 0.9)
    width, depth = (0.13, 0.26), (0.14, 0.3)
    cabinet = draw_cabinet(rng, width=width, height=(0.2, 0.42), depth=depth, foot=(0, low, 0))
    bays = row_of_bays(cabinet.face, two_way(rng, cabinet.width), rng.uniform(0, 0.3))
    add_cabinet(b, cabinet, finish, bays)
    middle = vec(0, 0, cabinet.depth / 2)
    wide, deep = cabinet.width, cabinet.depth
    plate = (0.9 * min(1.0, cabinet.back + 0.3) * wide, 0.02, 0.9 * deep)
    b.rounded_box("stand", metal, middle + (low - 0.008) * UP, plate, 0.01)
    kind = draw(rng, ["round", "one", "two", "four", "tripod"], [0.25, 0.2, 0.2, 0.15, 0.2])
    if kind == "tripod":
        add_tripod(b, metal, height=low, spread=rng.uniform(0.2, 0.32), middle=middle)
        return b
    if kind == "round":
        radius = rng.uniform(0.12, 0.18)
        rows = [(radius, 0), (radius, 0.015), (0.9 * radius, 0.025), (0.02, 0.03)]
        b.lathe("stand", metal, rows, middle, segments=32)
        thick = rng.uniform(0.015, 0.03)
        b.cylinder("stand", metal, middle + 0.01 * UP, middle + (low - 0.005) * UP, thick)
        return b
    size = (wide * rng.uniform(1.0, 1.4), 0.03, deep * rng.uniform(1.0, 1.3))
    b.rounded_box("stand", metal, middle + 0.015 * UP, size, 0.01)
    four = [(-0.28, -0.3), (0.28, -0.3), (0.28, 0.3), (-0.28, 0.3)]
    places = {"one": [(0.0, 0.0)], "two": [(-0.25, 0.0), (0.25, 0.0)], "four": four}
    side = rng.uniform(0.05, 0.09) if kind == "one" else 0.035
    for x, z in places[kind]:
        at = middle + vec(x * wide, 0, z * deep)
        beam(b, "stand", metal, at + 0.02 * UP, at + (low - 0.01) * UP, width=side, height=side)
    return b


def soundbar(rng: Rng) -> Builder:
    """Build a long low box: a centre speaker with drivers in a row, or a bar behind cloth."""
    b, finish = Builder(), draw_finish(rng)
    low = rng.uniform(0.012, 0.03)
    width, depth = (0.5, 1.2), (0.08, 0.28)
    cabinet = draw_cabinet(rng, width=width, height=(0.09, 0.24), depth=depth, foot=(0, low, 0))
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
    add_feet(b, finish.rim, cabinet.width, cabinet.depth, low)
    if rng.random() < 0.35:
        add_grille(b, draw_cloth(rng), cabinet)
    return b
