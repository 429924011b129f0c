"""What carries flat panels, and the speakers at their sides."""

from __future__ import annotations

from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import UP, lean, vec
from ffd_lightning.shapes.monitor.panel import Case, Panel

FEET = ("disc", "plate", "v")


def foot(b: Builder, rng: Rng, case: Case, width: float, kind: str) -> float:
    """Add a base of a `kind` for a panel of `width`; return the height of its upper side."""
    reach = width * rng.uniform(0.16, 0.3)
    thick = width * rng.uniform(0.015, 0.04)
    if kind == "disc":
        rows = [(reach, 0), (reach, 0.6 * thick), (0.9 * reach, thick), (0.2 * reach, 1.3 * thick)]
        squash = rng.uniform(0.55, 0.95)
        b.lathe("base", case.stand, rows, segments=32, squash=squash)
    elif kind == "plate":
        size = (2 * reach, thick, rng.uniform(0.9, 1.5) * reach)
        radius = rng.uniform(0.02, 0.6) * reach
        b.rounded_box("base", case.stand, (0, thick / 2, 0), size, radius=radius, edge=0.3 * thick)
    elif kind == "v":
        for side in (-1, 1):
            path = [(0, 1.2 * thick, 0.3 * reach), (0.5 * side * reach, thick, -0.2 * reach)]
            path += [(1.2 * side * reach, 0.5 * thick, -0.75 * reach)]
            b.tube("base", case.stand, bend(path, 0.4 * reach), 0.5 * thick, segments=10)
        start = (0, 0.5 * thick, 0.8 * reach)
        beam(b, "base", case.stand, start, (0, thick, 0), width=2 * thick, height=thick)
    else:
        raise ValueError(f"unknown base {kind!r}")
    return thick


def neck(b: Builder, rng: Rng, case: Case, low: float, panel: Panel) -> None:
    """Join a base at height `low` to the back of a panel: a flat, round, bent or twin post."""
    width = panel.width * rng.uniform(0.06, 0.2)
    deep = rng.uniform(0.25, 0.5) * width
    z = panel.thickness * 0.5
    mount = panel.at(0, -rng.uniform(0.05, 0.3), z)
    kind = draw(rng, ["flat", "round", "bent", "twin"])
    foot = vec(0, 0.4 * low, mount[2] + rng.uniform(0.2, 0.6) * deep)
    if kind == "twin":
        for x in (-1.2, 1.2):
            shift = vec(x * width, 0, 0)
            end = mount + shift + 0.1 * deep * UP
            b.cylinder("stand", case.stand, foot + shift, end, 0.15 * width, segments=12)
    elif kind == "round":
        end = mount + 0.2 * width * UP
        b.cylinder("stand", case.stand, foot, end, 0.35 * width, radius_end=0.25 * width)
    elif kind == "bent":
        behind = foot + vec(0, 0, 0.9 * deep)
        knee = vec(0, mount[1], mount[2] + 1.2 * deep)
        path = bend([behind, knee, mount], 0.5 * deep)
        b.tube("stand", case.stand, path, 0.18 * width, segments=12)
    else:
        upper = mount + 0.2 * width * UP
        beam(b, "stand", case.stand, foot, upper, width=width, height=0.35 * deep)
    plate = (1.3 * width + 0.03, 1.1 * width + 0.03, 0.9 * panel.thickness)
    rise = (panel.turn.T @ (mount - panel.center))[1] / panel.height
    place = panel.at(0, rise, 0.5 * panel.thickness)
    b.rounded_box("stand", case.stand, place, plate, 0.01, turn=panel.turn)


def side_speaker(b: Builder, rng: Rng, case: Case, panel: Panel, side: int) -> None:
    """Add a speaker on the left (-1) or right (1) edge of a panel."""
    wide, tall = 0.09 * panel.width, 0.85 * panel.height
    place = panel.at(side * (0.5 + 0.5 * wide / panel.width - 0.005), 0, 0.1 * panel.thickness)
    turn = panel.turn @ lean(90)
    size = (wide, 0.8 * panel.thickness, tall)
    edge = 0.1 * panel.thickness
    b.rounded_box("speaker", case.back, place, size, radius=0.3 * wide, edge=edge, turn=turn)
    for y in (-0.25, 0.25):
        spot = place + panel.turn @ vec(0, y * tall, -0.38 * panel.thickness)
        end = spot + panel.turn @ vec(0, 0, -0.06 * panel.thickness)
        radius = 0.38 * wide
        b.tube("speaker", case.accent, [spot, end], (radius, 0.3 * wide), segments=16)
