"""Subwoofers."""

from __future__ import annotations

from dataclasses import replace

from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.vectors import UP, lean, vec
from ffd_lightning.shapes.speaker.drivers import Finish, add_driver, draw_cloth, draw_finish
from ffd_lightning.shapes.speaker.enclosure import Units, add_cabinet, draw_cabinet, row_of_bays
from ffd_lightning.shapes.speaker.fittings import add_feet, add_grille


def subwoofer(rng: Rng) -> Builder:
    """Build a cube with one or two large cones, or a drum that fires to the front or down."""
    b, finish = Builder(), draw_finish(rng)
    low, size = rng.uniform(0.02, 0.06), rng.uniform(0.3, 0.5)
    if rng.random() < 0.2:
        return _drum(b, rng, finish, 0.5 * size, low)
    width, height = (0.8 * size, 1.2 * size), (0.8 * size, 1.3 * size)
    cabinet = draw_cabinet(rng, width=width, height=height, depth=(0.7, 1.1), foot=(0, low, 0))
    cabinet = replace(cabinet, depth=cabinet.depth * size, back=max(cabinet.back, 0.75))
    units: Units = [("woofer", size * rng.uniform(0.3, 0.5))]
    if rng.random() < 0.45:
        kind = draw(rng, ["port", "slot"])
        units.insert(0, (kind, size * (0.1 if kind == "port" else 0.4)))
    if rng.random() < 0.2:
        units.append(units[-1])
    across = len(units) == 2 and units[0][0] == "port" and rng.random() < 0.4
    add_cabinet(b, cabinet, finish, row_of_bays(cabinet.face, units, 0.1, across))
    add_feet(
        b, finish.rim, cabinet.back * cabinet.width, cabinet.depth, low, cone=rng.random() < 0.4
    )
    if rng.random() < 0.25:
        add_grille(b, draw_cloth(rng), cabinet)
    return b


def _drum(b: Builder, rng: Rng, finish: Finish, radius: float, low: float) -> Builder:
    """Add an upright drum on feet whose cone looks up, between two plates."""
    tall, edge = radius * rng.uniform(1.2, 3.0), 0.08 * radius
    rows = [(0.93 * radius, low), (radius, low + edge), (radius, low + tall)]
    rows += [(0.9 * radius, low + tall + edge)]
    b.lathe("body", finish.body, rows, segments=40)
    top = vec(0, low + tall + edge + 0.3 * radius, 0)
    add_driver(b, finish, "woofer", top - 0.2 * radius * UP, 0.0 + 0.8 * radius, lean(90))
    for x, _, z in circle(count=4, radius=0.7 * radius, height=0, degrees=45):
        b.cylinder("stand", finish.rim, (x, 0, z), (x, low + 0.01, z), 0.08 * radius)
    return b
