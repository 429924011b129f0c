"""Monitors and televisions: desktop, television, tube, all-in-one, multiple, curved, projection."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.parts.furniture import UP, beam, bend, draw, lean, sheet
from ffd_lightning.shapes.parts.screens import (
    Case,
    Panel,
    add_panel,
    draw_case,
    draw_panel,
    foot,
    moved,
    neck,
    side_speaker,
)
from ffd_lightning.shapes.parts.tube_monitor import projection, tube
from ffd_lightning.shapes.shapes import Builder, Family, rotation

PARTS = ("screen", "frame", "back", "stand", "base", "speaker", "button")

_FEET = ("disc", "plate", "v")


def _desktop(rng: np.random.Generator) -> Builder:
    """Build a flat screen on a base with a neck, some turned upright or with side speakers."""
    b = Builder()
    case = draw_case(rng)
    upright = rng.random() < 0.12
    panel = draw_panel(rng, rng.uniform(0.5, 1.1), rng.uniform(-2, 15), upright)
    width = max(panel.width, 0.6 * panel.height)
    low = foot(b, rng, case, width, draw(rng, _FEET, [0.4, 0.4, 0.2]))
    rise = low + panel.width * rng.uniform(0.05, 0.28) + panel.height / 2
    panel = moved(panel, np.array([0, rise, -0.05 * width]))
    add_panel(b, rng, case, panel)
    neck(b, rng, case, low, panel)
    if rng.random() < 0.25 and not upright:
        for side in (-1, 1):
            side_speaker(b, rng, case, panel, side)
    return b


def _television(rng: np.random.Generator) -> Builder:
    """Build a wide set on two feet, on a short stand, or on an arm or plate on the wall."""
    b = Builder()
    case = draw_case(rng)
    panel = draw_panel(rng, rng.uniform(0.9, 1.5), rng.uniform(0, 4))
    kind = draw(rng, ["feet", "stand", "arm", "plate"], [0.35, 0.2, 0.25, 0.2])
    gap = rng.uniform(0.03, 0.1)
    panel = moved(panel, np.array([0, panel.height / 2 + gap, 0]))
    add_panel(b, rng, case, panel)
    if kind == "feet":
        _two_feet(b, rng, case, panel, gap)
    elif kind == "stand":
        low = foot(b, rng, case, 1.2 * panel.width, "plate")
        post = (rng.uniform(0.1, 0.35) * panel.width, gap + 0.06, 0.03)
        b.rounded_box("stand", case.stand, (0, low + gap / 2, 0.02), post, 0.01)
    else:
        _wall_mount(b, rng, case, panel, kind == "arm")
    if rng.random() < 0.4:
        _sound_bar(b, rng, case, panel)
    return b


def _two_feet(b: Builder, rng: np.random.Generator, case: Case, panel: Panel, gap: float) -> None:
    """Stand a panel on two feet near its ends: inverted V's or blades."""
    reach, spread = rng.uniform(0.08, 0.16), rng.uniform(0.2, 0.42)
    splay = rng.uniform(0, 0.12) if rng.random() < 0.5 else 0.0
    radius = rng.uniform(0.008, 0.016)
    for side in (-1, 1):
        x = side * spread * panel.width
        head = np.array([x, gap + 0.04, 0.3 * panel.thickness])
        for z in (-reach, reach):
            path = [head, head * (1, 0, 1) + (side * splay, radius, z)]
            b.tube("stand", case.stand, path, (1.4 * radius, radius), 10)
        if splay == 0:
            blade = (2 * radius, 1.2 * radius, 2.2 * reach)
            b.rounded_box("base", case.stand, (x, 0.6 * radius, head[2]), blade, radius)


def _wall_mount(b: Builder, rng: np.random.Generator, case: Case, panel: Panel, arm: bool) -> None:
    """Add a plate for the wall, joined to the panel by a folded arm or by two rails."""
    wide = rng.uniform(0.12, 0.4) * panel.width
    hold = panel.at(0, 0, 1.0 * panel.thickness)
    wall = hold[2] + rng.uniform(0.12, 0.4) * (1.0 if arm else 0.4)
    y = hold[1]
    plate = (wide if not arm else 0.12, rng.uniform(0.15, 0.4) * panel.height, 0.02)
    b.rounded_box("base", case.stand, (0, y, wall), plate, 0.01)
    if arm:
        elbow = np.array([rng.choice([-1, 1]) * 0.5 * wide, y, (wall + hold[2]) / 2])
        for end in (np.array([0, y, wall]), hold):
            beam(b, "stand", case.stand, end, elbow, 0.03, 0.05)
        b.cylinder("stand", case.stand, elbow - 0.035 * UP, elbow + 0.035 * UP, 0.022)
        size = (0.2, 0.03, 0.2)
        turn = panel.turn @ rotation((1, 0, 0), 90)
        b.rounded_box("stand", case.stand, hold - (0, 0, 0.01), size, 0.01, turn=turn)
        return
    for x in (-0.4 * wide, 0.4 * wide):
        for rise in (-0.3, 0.3):
            start = np.array([x, y + rise * plate[1], wall])
            beam(b, "stand", case.stand, start, (*start[:2], 0.3 * panel.thickness), 0.025, 0.04)


def _sound_bar(b: Builder, rng: np.random.Generator, case: Case, panel: Panel) -> None:
    """Add a strip of loudspeakers along the lower edge of a panel."""
    wide, tall = rng.uniform(0.5, 0.95) * panel.width, rng.uniform(0.04, 0.08)
    turn = panel.turn @ rotation((1, 0, 0), 90)
    place = panel.at(0, -0.5 + 0.2 * tall / panel.height, 0.1 * panel.thickness)
    size = (wide, 0.9 * panel.thickness, tall)
    b.rounded_box("speaker", case.back, place, size, 0.3 * tall, 0.004, turn)
    for x in np.linspace(-0.42, 0.42, int(rng.integers(2, 7))) * wide:
        spot = place + panel.turn @ np.array([x, 0, -0.44 * panel.thickness])
        end = spot + panel.turn @ np.array([0, 0, -0.05 * panel.thickness])
        b.cylinder("speaker", case.accent, spot, end, 0.36 * tall, 0.3 * tall, 14)


def _all_in_one(rng: np.random.Generator) -> Builder:
    """Build a screen with a deep chin on a bent sheet or a hoop, some with a keyboard."""
    b = Builder()
    case = draw_case(rng)
    panel = draw_panel(rng, rng.uniform(0.5, 0.8), rng.uniform(2, 18), chin=rng.uniform(0.04, 0.13))
    gap = rng.uniform(0.06, 0.2)
    panel = moved(panel, np.array([0, panel.height / 2 + gap, 0]))
    add_panel(b, rng, case, panel)
    wide, deep = rng.uniform(0.2, 0.5) * panel.width, rng.uniform(0.12, 0.22)
    thickness = rng.uniform(0.008, 0.02)
    hold = panel.at(0, rng.uniform(-0.25, 0.0), 0.7 * panel.thickness)
    heel = np.array([0, thickness / 2, hold[2] + rng.uniform(0.04, 0.12)])
    toe = np.array([0, thickness / 2, heel[2] - 1.6 * deep])
    path = bend([hold, heel, toe], 0.06)
    if rng.random() < 0.6:
        sides = np.array([[-wide / 2, 0, 0], [wide / 2, 0, 0]])
        sheet(b, "stand", case.stand, path[:, None] + sides[None], thickness)
    else:
        for x in (-wide / 2, wide / 2):
            b.tube("stand", case.stand, path + (x, 0, 0), thickness / 2 + 0.002, 10)
        bar = np.array([[-wide / 2, 0, 0], [wide / 2, 0, 0]])
        b.tube("base", case.stand, toe + bar, thickness / 2 + 0.002, 10)
    if rng.random() < 0.35:
        _keyboard(b, rng, case, panel, toe[2])
    return b


def _keyboard(b: Builder, rng: np.random.Generator, case: Case, panel: Panel, z: float) -> None:
    """Lay a keyboard in front of a screen whose stand ends at `z`."""
    wide, deep = rng.uniform(0.6, 0.85) * panel.width, rng.uniform(0.13, 0.18)
    center = np.array([0, 0.012, z - 0.05 - deep / 2])
    tip = lean(-4)
    b.rounded_box("base", case.frame, center, (wide, 0.018, deep), 0.015, turn=tip)
    for i in range(4):
        row = (0.94 * wide, 0.008, 0.17 * deep)
        place = center + tip @ np.array([0, 0.011, (i - 1.5) * 0.22 * deep])
        b.rounded_box("button", case.back, place, row, 0.004, turn=tip, segments=1)


def _multiple(rng: np.random.Generator) -> Builder:
    """Build two to four panels, side by side, above each other or both, on one post."""
    b = Builder()
    case = draw_case(rng)
    panel = draw_panel(rng, rng.uniform(0.5, 0.7), 0.0)
    columns, rows = [(2, 1), (3, 1), (1, 2), (2, 2)][int(rng.choice(4, p=[0.4, 0.25, 0.2, 0.15]))]
    angle = rng.uniform(0, 25) if columns > 1 else 0.0
    low = foot(b, rng, case, (0.7 + 0.45 * columns) * panel.width, draw(rng, _FEET))
    bottom = low + rng.uniform(0.05, 0.2) + panel.height / 2
    bar = 2.2 * panel.thickness + 0.03
    step = 1.03 * panel.width
    levels = bottom + np.arange(rows) * 1.04 * panel.height
    for y in levels:
        for offset in np.arange(columns) - (columns - 1) / 2:
            swing = np.radians(angle * offset)  # each outer edge comes towards the viewer
            inner = max(abs(offset) - 0.5, 0.0)
            x = np.sign(offset) * step * (inner + 0.5 * np.cos(swing))
            place = np.array([x, y, -0.5 * step * np.sin(abs(swing))])
            turned = moved(panel, place, rotation(UP, angle * offset))
            add_panel(b, rng, case, turned)
            knob = turned.at(0, 0, 0.3 * panel.thickness)
            beam(b, "stand", case.stand, knob, (0.8 * x, y, bar), 0.03, 0.05)
        if columns > 1:
            reach = 0.4 * columns * (columns - 1) / 2 * step
            beam(b, "stand", case.stand, (-reach, y, bar), (reach, y, bar), 0.025, 0.04)
    b.cylinder("stand", case.stand, (0, 0.3 * low, bar), (0, levels[-1] + 0.06, bar), 0.022)
    b.rounded_box("base", case.stand, (0, low / 2, bar), (0.12, low, 0.1), 0.01)
    return b


def _curved(rng: np.random.Generator) -> Builder:
    """Build a wide screen bent around the viewer, on a V-shaped or flat foot."""
    b = Builder()
    case = draw_case(rng)
    width, ratio = rng.uniform(0.8, 1.3), rng.uniform(0.36, 0.6)
    height, sag = width * ratio, rng.uniform(0.06, 0.16) * width
    thickness, bezel = rng.uniform(0.02, 0.05), rng.uniform(0.008, 0.03)
    low = foot(b, rng, case, width, draw(rng, _FEET))
    bottom = low + rng.uniform(0.03, 0.16)
    u, v = np.linspace(-0.5, 0.5, 17), np.linspace(0, 1, 5)

    def bent(inset: float, z: float) -> np.ndarray:
        x = u * (width - 2 * inset)
        y = bottom + inset + v * (height - 2 * inset)
        depth = z - sag * (x / (0.5 * width)) ** 2
        grid = [np.broadcast_to(a, (len(v), len(u))) for a in (x, y[:, None], depth)]
        return np.stack(grid, -1)

    sheet(b, "frame", case.frame, bent(0.0, 0.0), thickness)
    sheet(b, "screen", case.screen, bent(bezel, -thickness / 2), 0.006)
    sheet(b, "back", case.back, bent(0.16 * height, 0.7 * thickness), thickness)
    size = (rng.uniform(0.15, 0.35) * width, 0.5 * height, 0.05)
    middle = np.array([0, bottom + 0.5 * height, 1.3 * thickness])
    b.rounded_box("back", case.back, middle, size, 0.02)
    start, end = np.array([0, 0.4 * low, middle[2] + 0.07]), middle + (0, 0, 0.01)
    beam(b, "stand", case.stand, start, end, rng.uniform(0.05, 0.14), 0.03)
    for i in range(int(rng.integers(1, 5))):
        spot = np.array([0.06 * i - 0.1, bottom + 0.4 * bezel, -0.4 * thickness])
        b.cylinder("button", case.accent, spot, spot - (0, 0, 0.2 * thickness), 0.3 * bezel,
                   segments=8)  # fmt: skip
    return b


FAMILIES: dict[str, Family] = {
    "desktop": _desktop,
    "television": _television,
    "tube": tube,
    "all_in_one": _all_in_one,
    "multiple": _multiple,
    "curved": _curved,
    "projection": projection,
}
