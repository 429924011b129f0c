"""Speakers of the living room: on the shelf, on the floor, on stands, below the screen."""

from dataclasses import replace

from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.vectors import UP, lean, vec
from ffd_lightning.shapes.speaker.boxes import Units, add_cabinet, draw_cabinet, two_way
from ffd_lightning.shapes.speaker.drivers import Finish, draw_cloth, draw_finish, driver
from ffd_lightning.shapes.speaker.fittings import feet, grille, tripod


def bookshelf(b: Builder, rng: Rng) -> None:
    """Build a small box with two or three drivers, perhaps behind a cloth."""
    finish = draw_finish(rng)
    low = rng.uniform(0.008, 0.025) if rng.random() < 0.4 else 0.0
    cabinet = draw_cabinet(rng, (0.16, 0.3), (0.28, 0.5), (0.16, 0.38), low)
    cabinet = replace(cabinet, tilt=rng.uniform(4, 14) if rng.random() < 0.2 else 0.0)
    bays = cabinet.bays(two_way(rng, cabinet.width), rng.uniform(0, 0.5))
    add_cabinet(b, cabinet, finish, bays)
    if low:
        feet(b, finish.rim, cabinet)
    if rng.random() < 0.2:
        cover = bays[-2] if rng.random() < 0.4 else bays[-1]
        grille(b, draw_cloth(rng), cabinet, high=cabinet.share_below(cover))


def tower(b: Builder, rng: Rng) -> None:
    """Build a tall narrow box with three to six drivers on a plinth, spikes or nothing."""
    finish = draw_finish(rng)
    base = draw(rng, ["plinth", "spikes", "outriggers", "none"], [0.45, 0.25, 0.15, 0.15])
    low = 0.0 if base == "none" else rng.uniform(0.02, 0.05)
    cabinet = draw_cabinet(rng, (0.15, 0.3), (0.75, 1.3), (0.18, 0.42), low)
    cabinet = replace(cabinet, tilt=rng.uniform(2, 9) if rng.random() < 0.3 else 0.0)
    wide, deep = cabinet.width, cabinet.depth
    bass, mid = wide * rng.uniform(0.34, 0.46), wide * rng.uniform(0.22, 0.34)
    units: Units = [("woofer", bass)] * int(rng.integers(1, 4))
    units += [("woofer", mid)] * int(rng.integers(0, 2)) + [("tweeter", 0.18 * wide)]
    if rng.random() < 0.4:
        units.append(("woofer", mid))
    if rng.random() < 0.4:
        units.insert(0, ("port", 0.18 * wide))
    bays = cabinet.bays(units, rng.uniform(0.2, 0.95))
    add_cabinet(b, cabinet, finish, bays)
    if base == "plinth":
        size = (wide * rng.uniform(1.1, 1.4), low + 0.004, deep * rng.uniform(1.05, 1.25))
        b.rounded_box("stand", finish.rim, (0, low / 2, deep / 2), size, radius=0.02, edge=0.006)
    elif base == "spikes":
        feet(b, finish.rim, cabinet, cone=True)
    elif base == "outriggers":
        for z in (0.12, 0.88):
            size = (1.5 * wide, low, 0.1 * deep)
            b.rounded_box("stand", finish.rim, (0, low / 2 + 0.004, z * deep), size, 0.01)
    if rng.random() < 0.25:
        cover = bays[int(rng.integers(1, len(bays)))]
        grille(b, draw_cloth(rng), cabinet, high=cabinet.share_below(cover))


def stand(b: Builder, rng: Rng) -> None:
    """Build a small box on a stand of one, two or four posts, or on a tripod."""
    finish, metal, low = draw_finish(rng), pick_material(rng, "metal"), rng.uniform(0.4, 0.9)
    cabinet = draw_cabinet(rng, (0.13, 0.26), (0.2, 0.42), (0.14, 0.3), low)
    add_cabinet(b, cabinet, finish, cabinet.bays(two_way(rng, cabinet.width), rng.uniform(0, 0.3)))
    wide, deep, middle = cabinet.width, cabinet.depth, vec(0, 0, cabinet.depth / 2)
    plate = (0.9 * min(1.0, cabinet.back + 0.3) * wide, 0.02, 0.9 * deep)
    b.rounded_box("stand", metal, middle + (low - 0.008) * UP, plate, 0.01)
    kind = draw(rng, ["round", "one", "two", "four", "tripod"], [0.25, 0.2, 0.2, 0.15, 0.2])
    if kind == "tripod":
        tripod(b, metal, height=low, spread=rng.uniform(0.2, 0.32), middle=middle)
    elif kind == "round":
        radius = rng.uniform(0.12, 0.18)
        rows = [(radius, 0), (radius, 0.015), (0.9 * radius, 0.025), (0.02, 0.03)]
        b.lathe("stand", metal, rows, middle, segments=32)
        thick = rng.uniform(0.015, 0.03)
        b.cylinder("stand", metal, middle + 0.01 * UP, middle + (low - 0.005) * UP, thick)
    else:
        size = (wide * rng.uniform(1.0, 1.4), 0.03, deep * rng.uniform(1.0, 1.3))
        b.rounded_box("stand", metal, middle + 0.015 * UP, size, 0.01)
        four = [(-0.28, -0.3), (0.28, -0.3), (0.28, 0.3), (-0.28, 0.3)]
        places = {"one": [(0.0, 0.0)], "two": [(-0.25, 0.0), (0.25, 0.0)], "four": four}
        side = rng.uniform(0.05, 0.09) if kind == "one" else 0.035
        for x, z in places[kind]:
            at = middle + vec(x * wide, 0, z * deep)
            beam(b, "stand", metal, at + 0.02 * UP, at + (low - 0.01) * UP, side, side)


def soundbar(b: Builder, rng: Rng) -> None:
    """Build a long low box: a centre speaker with drivers in a row, or a bar behind cloth."""
    finish = draw_finish(rng)
    cabinet = draw_cabinet(rng, (0.5, 1.2), (0.09, 0.24), (0.08, 0.28), rng.uniform(0.012, 0.03))
    tall = cabinet.height
    cabinet = replace(cabinet, bevel=tall * rng.uniform(0.04, 0.2), back=1.0)
    cabinet = replace(cabinet, tilt=rng.uniform(5, 20) if rng.random() < 0.25 else 0.0)
    small = tall * rng.uniform(0.18, 0.3)
    half: Units = [("woofer", 0.46 * tall)] * int(rng.integers(1, 3))
    if rng.random() < 0.4:
        half = [("port", 0.7 * small), *half]
    units = [*half, (draw(rng, ["tweeter", "horn"], [0.8, 0.2]), small), *half[::-1]]
    add_cabinet(b, cabinet, finish, cabinet.bays(units, across=True))
    feet(b, finish.rim, cabinet)
    if rng.random() < 0.35:
        grille(b, draw_cloth(rng), cabinet)


def subwoofer(b: Builder, rng: Rng) -> None:
    """Build a cube with one or two large cones, or a drum that fires up."""
    finish, low, size = draw_finish(rng), rng.uniform(0.02, 0.06), rng.uniform(0.3, 0.5)
    if rng.random() < 0.2:
        _drum(b, rng, finish, 0.5 * size, low)
        return
    cabinet = draw_cabinet(rng, (0.8 * size, 1.2 * size), (0.8 * size, 1.3 * size), (0.7, 1.1), low)
    cabinet = replace(cabinet, depth=cabinet.depth * size, back=max(cabinet.back, 0.75))
    units: Units = [("woofer", size * rng.uniform(0.3, 0.5))]
    if rng.random() < 0.45:
        kind = draw(rng, ["port", "slot"])
        units.insert(0, (kind, size * (0.1 if kind == "port" else 0.4)))
    if rng.random() < 0.2:
        units.append(units[-1])
    across = len(units) == 2 and units[0][0] == "port" and rng.random() < 0.4
    add_cabinet(b, cabinet, finish, cabinet.bays(units, 0.1, across))
    feet(b, finish.rim, cabinet, cone=rng.random() < 0.4)
    if rng.random() < 0.25:
        grille(b, draw_cloth(rng), cabinet)


def _drum(b: Builder, rng: Rng, finish: Finish, radius: float, low: float) -> None:
    """Add an upright drum on feet whose cone looks up, between two plates."""
    top, edge = low + radius * rng.uniform(1.2, 3.0), 0.08 * radius
    rows = [(0.93 * radius, low), (radius, low + edge), (radius, top), (0.9 * radius, top + edge)]
    b.lathe("body", finish.body, rows, segments=40)
    center = (top + edge + 0.3 * radius) * UP - 0.2 * radius * UP
    driver(b, finish, "woofer", center, 0.8 * radius, lean(90))
    for x, _, z in circle(count=4, radius=0.7 * radius, height=0, degrees=45):
        b.cylinder("stand", finish.rim, (x, 0, z), (x, low + 0.01, z), 0.08 * radius)
