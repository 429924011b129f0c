"""What is set into a telephone's back and edges: buttons, lenses, aerials."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.cellphone.body import Body, tile
from ffd_lightning.shapes.cellphone.finish import Finish
from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.vectors import vec


def side_buttons(b: Builder, rng: Rng, finish: Finish, body: Body) -> None:
    """Add one to four buttons on the narrow sides, and sometimes one on top."""
    for i in range(int(rng.integers(1, 5))):
        side = -1 if i % 2 else 1
        tall = rng.uniform(0.05, 0.12)
        x = side * (0.5 - 0.024 / body.width)
        place = body.at(x, 0.32 - 0.14 * (i // 2) - 0.06 * i, -body.depth / 2)
        size = (0.068, tall * body.height, min(0.35 * body.depth, 0.05))
        b.rounded_box("button", finish.trim, place, size, 0.006, turn=body.turn, segments=1)
    if rng.random() < 0.4:
        place = body.at(rng.uniform(-0.3, 0.3), 0.5, -body.depth / 2)
        size = (0.14 * body.width, 0.02, min(0.35 * body.depth, 0.05))
        b.rounded_box("button", finish.trim, place, size, 0.006, turn=body.turn, segments=1)


def camera(b: Builder, rng: Rng, finish: Finish, body: Body, center: bool = False) -> None:
    """Add one to four lenses on the back, on a plate or bare, in a corner or in the `center`."""
    count = int(rng.integers(1, 5))
    radius = rng.uniform(0.05, 0.085) * body.width
    pitch = 2.4 * radius
    spots = [(0, 0), (0, 1), (1, 0), (1, 1)][:count]
    sizes = np.max(np.array(spots) + 1, axis=0) * pitch + 0.3 * radius
    x0 = 0.42 * body.width - sizes[0] if rng.random() < 0.7 and not center else -sizes[0] / 2
    y0 = (0.38 if center else 0.46) * body.height - sizes[1]
    middle = (x0 + sizes[0] / 2) / body.width, (y0 + sizes[1] / 2) / body.height
    raised = rng.uniform(0.005, 0.02)
    if count > 1 or rng.random() < 0.5:
        plate = (sizes[0], sizes[1], 0.012 + raised)
        place = body.behind(*middle, raised / 2 - 0.006)
        tile(b, "camera", finish.trim, body, place, plate, 0.3 * min(sizes))
    glass = Material((0.05, 0.05, 0.08))
    for column, row in spots:
        x = (x0 + 0.15 * radius + (column + 0.5) * pitch) / body.width
        y = (y0 + 0.15 * radius + (row + 0.5) * pitch) / body.height
        start, end = body.behind(x, y, -0.005), body.behind(x, y, raised + 0.012)
        b.cylinder("camera", finish.body, start, end, radius, segments=18)
        tip = body.behind(x, y, raised + 0.016)
        b.cylinder("camera", glass, end - 0.2 * (end - start), tip, 0.75 * radius, segments=18)


def aerial(b: Builder, rng: Rng, finish: Finish, body: Body, side: int) -> None:
    """Add a stub or a long rod on top of a body, at its left (-1) or right (1) edge."""
    radius = rng.uniform(0.12, 0.3) * body.depth
    x = side * (0.5 - 1.5 * radius / body.width)
    start = body.at(x, 0.44, -body.depth / 2)
    along = body.turn @ vec(0, 1, 0)
    rise = rng.uniform(0.1, 0.2) * body.height + 0.06 * body.height
    path = start + np.outer((0, rise, 1.03 * rise), along)
    b.tube("antenna", finish.keys, path, (radius, 0.85 * radius, 0.5 * radius), segments=14)
    if rng.random() < 0.4:
        reach = rise + rng.uniform(0.2, 0.5) * body.height
        end = start + reach * along
        b.cylinder("antenna", finish.trim, start + rise * along, end, 0.3 * radius, segments=10)
        knob = np.outer((reach, reach + 0.02, reach + 0.04), along) + start
        b.tube(
            "antenna", finish.keys, knob, (0.5 * radius, 0.55 * radius, 0.4 * radius), segments=10
        )
