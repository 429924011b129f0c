"""The materials of screens, and flat panels."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.materials import draw_housing
from ffd_lightning.shapes.kit.vectors import Array, lean, vec


@dataclass(frozen=True)
class Case:
    """The materials of one set."""

    frame: Material
    back: Material
    stand: Material
    screen: Material
    accent: Material


def draw_case(rng: Rng) -> Case:
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
        local = vec(x * self.width, y * self.height, z)
        return np.asarray(self.turn @ local + self.center)


def draw_panel(
    rng: Rng, width: float, degrees: float = 0.0, upright: bool = False, chin: float | None = None
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
    return replace(panel, center=center, turn=matrix)


def add_panel(b: Builder, rng: Rng, case: Case, panel: Panel) -> None:
    """Add a panel's frame, screen, bulging back and controls."""
    w, h, t = panel.width, panel.height, panel.thickness
    upright = panel.turn @ lean(90)  # rounded_box rounds the edges along its y
    radius = rng.choice([0.1, 0.6, 1.5]) * (panel.bezel + 0.01)
    front = (w, 0.55 * t, h)
    center = panel.at(0, 0, 0)
    b.rounded_box("frame", case.frame, center, front, radius=radius, edge=0.12 * t, turn=upright)
    screen = (w - 2 * panel.bezel, h - 2 * panel.bezel - panel.chin)
    size = (screen[0], 0.02 * w, screen[1])
    place = panel.at(0, 0.5 * panel.chin / h, -0.27 * t + 0.007 * w)
    b.rounded_box("screen", case.screen, place, size, radius=0.006, edge=0.002, turn=upright)
    _add_back(b, rng, case, panel)
    spread = rng.uniform(0.02, 0.04)
    radius = 0.22 * panel.bezel
    x, y = rng.uniform(0.1, 0.42), -0.5 + (0.5 * panel.bezel + 0.4 * panel.chin) / h
    for i in range(int(rng.integers(1, 6))):
        start = panel.at(x - i * spread, y, -0.2 * t)
        end = panel.at(x - i * spread, y, -0.275 * t - 0.2 * radius)
        b.cylinder("button", case.accent, start, end, radius, segments=8)


def _add_back(b: Builder, rng: Rng, case: Case, panel: Panel) -> None:
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
        b.box("back", case.frame, place, slit, turn=panel.turn)
