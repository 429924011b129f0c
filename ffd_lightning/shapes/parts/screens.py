"""What flat screens are made of: cases, panels, feet, necks, speakers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.parts.furniture import UP, beam, bend, draw, lean
from ffd_lightning.shapes.shapes import (
    Array,
    Builder,
    Material,
    pick_material,
    rotation,
)


@dataclass(frozen=True)
class Case:
    """The materials of one set."""

    frame: Material
    back: Material
    stand: Material
    screen: Material
    accent: Material


def draw_case(rng: np.random.Generator) -> Case:
    """Draw the materials: mostly black, grey, white or silver, with a dark or lit screen."""
    body = draw_housing(rng)
    back = body if rng.random() < 0.6 else draw_housing(rng)
    stand = body if rng.random() < 0.5 else pick_material(rng, "metal")
    if rng.random() < 0.55:
        screen = Material((0.04, 0.05, rng.uniform(0.05, 0.12)))
    else:
        hue = Material(pick_material(rng, "paint").color)
        patterned = rng.random() < 0.3
        screen = Material(hue.color, "checker", 1.0) if patterned else hue
    return Case(body, back, stand, screen, pick_material(rng, draw(rng, ["metal", "paint"])))


def draw_housing(rng: np.random.Generator) -> Material:
    """Draw the plastic or metal of a housing."""
    kind = draw(rng, ["dark", "light", "metal", "plastic"], [0.45, 0.2, 0.2, 0.15])
    if kind == "dark":
        return pick_material(rng, "rubber")
    if kind == "light":
        shade = rng.uniform(0.75, 0.95)
        return Material((shade, shade, shade * rng.uniform(0.85, 1.0)))
    return pick_material(rng, kind)


@dataclass(frozen=True)
class Panel:
    """A flat panel.

    Attributes:
        center: of the panel's middle, (3,).
        width, height, thickness: overall.
        turn: (3, 3) rotation about the centre.
        bezel: width of the frame around the screen.
        chin: what the frame is wider by below.
    """

    center: Array
    width: float
    height: float
    thickness: float
    turn: Array
    bezel: float
    chin: float

    def at(self, x: float, y: float, z: float) -> Array:
        """Return the world position of panel coordinates: x right to left edge and y as +-0.5."""
        local = np.array([x * self.width, y * self.height, z])
        return np.asarray(self.turn @ local + self.center)


def draw_panel(
    rng: np.random.Generator,
    width: float,
    degrees: float = 0.0,
    upright: bool = False,
    chin: float | None = None,
) -> Panel:
    """Draw a panel at the origin, tipped back by `degrees`; `upright` swaps its sides."""
    ratio = rng.choice([9 / 16, 10 / 16, 3 / 4, 9 / 21, 4 / 5], p=[0.4, 0.2, 0.2, 0.1, 0.1])
    bezel = width * rng.uniform(0.012, 0.06)
    if chin is None:
        chin = bezel * rng.uniform(0.5, 2.5) if rng.random() < 0.5 and not upright else 0.0
    height = (width - 2 * bezel) * float(ratio) + 2 * bezel + chin
    thickness = width * rng.uniform(0.03, 0.09)
    sides = (height, width) if upright else (width, height)
    return Panel(np.zeros(3), *sides, thickness, lean(degrees), bezel, chin)


def moved(panel: Panel, center: Array, turn: Array | None = None) -> Panel:
    """Return the panel at another place, perhaps turned further."""
    matrix = panel.turn if turn is None else turn @ panel.turn
    return Panel(
        center, panel.width, panel.height, panel.thickness, matrix, panel.bezel, panel.chin
    )


def add_panel(b: Builder, rng: np.random.Generator, case: Case, panel: Panel) -> None:
    """Add a panel's frame, screen, bulging back and controls."""
    w, h, t = panel.width, panel.height, panel.thickness
    upright = panel.turn @ rotation((1, 0, 0), 90)  # rounded_box rounds the edges along its y
    radius = rng.choice([0.1, 0.6, 1.5]) * (panel.bezel + 0.01)
    front = (w, 0.55 * t, h)
    b.rounded_box("frame", case.frame, panel.at(0, 0, 0), front, radius, 0.12 * t, upright)
    screen = (w - 2 * panel.bezel, h - 2 * panel.bezel - panel.chin)
    size = (screen[0], 0.02 * w, screen[1])
    place = panel.at(0, 0.5 * panel.chin / h, -0.27 * t + 0.007 * w)
    b.rounded_box("screen", case.screen, place, size, 0.006, 0.002, upright)
    _add_back(b, rng, case, panel)
    spread = rng.uniform(0.02, 0.04)
    radius = 0.22 * panel.bezel
    x, y = rng.uniform(0.1, 0.42), -0.5 + (0.5 * panel.bezel + 0.4 * panel.chin) / h
    for i in range(int(rng.integers(1, 6))):
        start = panel.at(x - i * spread, y, -0.2 * t)
        end = panel.at(x - i * spread, y, -0.275 * t - 0.2 * radius)
        b.cylinder("button", case.accent, start, end, radius, segments=8)


def _add_back(b: Builder, rng: np.random.Generator, case: Case, panel: Panel) -> None:
    """Add the housing behind a panel: a tapering shell, sometimes with slits."""
    w, h, t = panel.width, panel.height, panel.thickness
    waist, deep = rng.uniform(0.4, 0.85), rng.uniform(0.3, 1.1) * t
    shift = rng.uniform(-0.15, 0.05)
    rows = [(0.97, 0.2 * t, 0.0), (0.95, 0.3 * t, 0.0), (waist, 0.3 * t + deep, shift)]
    rows.append((0.9 * waist, 0.36 * t + deep, shift))
    flat = np.array([(0.5, 0.46), (0.46, 0.5), (-0.46, 0.5), (-0.5, 0.46)])
    outline = np.concatenate([flat, -flat])
    rings = [[panel.at(s * x, s * y + o * (1 - s), z) for x, y in outline] for s, z, o in rows]
    b.loft("back", case.back, rings)
    for i in range(int(rng.integers(0, 7))):
        slit = (0.5 * waist * w, 0.012 * h, 0.02 * t)
        place = panel.at(0, (0.3 - 0.05 * i) * waist + shift * (1 - waist), 0.36 * t + deep)
        b.box("back", case.frame, place, slit, panel.turn)


def foot(b: Builder, rng: np.random.Generator, case: Case, width: float, kind: str) -> float:
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
        b.rounded_box("base", case.stand, (0, thick / 2, 0), size, radius, 0.3 * thick)
    elif kind == "v":
        for side in (-1, 1):
            path = [(0, 1.2 * thick, 0.3 * reach), (0.5 * side * reach, thick, -0.2 * reach),
                    (1.2 * side * reach, 0.5 * thick, -0.75 * reach)]  # fmt: skip
            b.tube("base", case.stand, bend(path, 0.4 * reach), 0.5 * thick, 10)
        beam(b, "base", case.stand, (0, 0.5 * thick, 0.8 * reach), (0, thick, 0), 2 * thick, thick)
    else:
        raise ValueError(f"unknown base {kind!r}")
    return thick


def neck(b: Builder, rng: np.random.Generator, case: Case, low: float, panel: Panel) -> None:
    """Join a base at height `low` to the back of a panel: a flat, round, bent or twin post."""
    width = panel.width * rng.uniform(0.06, 0.2)
    deep = rng.uniform(0.25, 0.5) * width
    z = panel.thickness * 0.5
    mount = panel.at(0, -rng.uniform(0.05, 0.3), z)
    kind = draw(rng, ["flat", "round", "bent", "twin"])
    foot = np.array([0, 0.4 * low, mount[2] + rng.uniform(0.2, 0.6) * deep])
    if kind == "twin":
        for x in (-1.2, 1.2):
            shift = np.array([x * width, 0, 0])
            b.cylinder("stand", case.stand, foot + shift, mount + shift + 0.1 * deep * UP,
                       0.15 * width, segments=12)  # fmt: skip
    elif kind == "round":
        b.cylinder("stand", case.stand, foot, mount + 0.2 * width * UP, 0.35 * width, 0.25 * width)
    elif kind == "bent":
        behind = foot + np.array([0, 0, 0.9 * deep])
        knee = np.array([0, mount[1], mount[2] + 1.2 * deep])
        b.tube("stand", case.stand, bend([behind, knee, mount], 0.5 * deep), 0.18 * width, 12)
    else:
        beam(b, "stand", case.stand, foot, mount + 0.2 * width * UP, width, 0.35 * deep)
    plate = (1.3 * width + 0.03, 1.1 * width + 0.03, 0.9 * panel.thickness)
    b.rounded_box("stand", case.stand, panel.at(0, (panel.turn.T @ (mount - panel.center))[1]
                  / panel.height, 0.5 * panel.thickness), plate, 0.01, turn=panel.turn)  # fmt: skip


def side_speaker(b: Builder, rng: np.random.Generator, case: Case, panel: Panel, side: int) -> None:
    """Add a speaker on the left (-1) or right (1) edge of a panel."""
    wide, tall = 0.09 * panel.width, 0.85 * panel.height
    place = panel.at(side * (0.5 + 0.5 * wide / panel.width - 0.005), 0, 0.1 * panel.thickness)
    turn = panel.turn @ rotation((1, 0, 0), 90)
    size = (wide, 0.8 * panel.thickness, tall)
    b.rounded_box("speaker", case.back, place, size, 0.3 * wide, 0.1 * panel.thickness, turn)
    for y in (-0.25, 0.25):
        spot = place + panel.turn @ np.array([0, y * tall, -0.38 * panel.thickness])
        end = spot + panel.turn @ np.array([0, 0, -0.06 * panel.thickness])
        b.cylinder("speaker", case.accent, spot, end, 0.38 * wide, 0.3 * wide, 16)
