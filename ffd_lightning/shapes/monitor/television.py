"""Wide sets on feet, on a stand or on the wall."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.vectors import UP, lean, vec
from ffd_lightning.shapes.monitor.panel import Case, Panel, add_panel, draw_case, draw_panel, moved
from ffd_lightning.shapes.monitor.stands import foot


def television(rng: Rng) -> Builder:
    """Build a wide set on two feet, on a short stand, or on an arm or plate on the wall."""
    b = Builder()
    case = draw_case(rng)
    panel = draw_panel(rng, rng.uniform(0.9, 1.5), rng.uniform(0, 4))
    kind = draw(rng, ["feet", "stand", "arm", "plate"], [0.35, 0.2, 0.25, 0.2])
    gap = rng.uniform(0.03, 0.1)
    panel = moved(panel, vec(0, panel.height / 2 + gap, 0))
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


def _two_feet(b: Builder, rng: Rng, case: Case, panel: Panel, gap: float) -> None:
    """Stand a panel on two feet near its ends: inverted V's or blades."""
    reach, spread = rng.uniform(0.08, 0.16), rng.uniform(0.2, 0.42)
    splay = rng.uniform(0, 0.12) if rng.random() < 0.5 else 0.0
    radius = rng.uniform(0.008, 0.016)
    for side in (-1, 1):
        x = side * spread * panel.width
        head = vec(x, gap + 0.04, 0.3 * panel.thickness)
        for z in (-reach, reach):
            path = [head, head * vec(1, 0, 1) + vec(side * splay, radius, z)]
            b.tube("stand", case.stand, path, (1.4 * radius, radius), segments=10)
        if splay == 0:
            blade = (2 * radius, 1.2 * radius, 2.2 * reach)
            b.rounded_box("base", case.stand, (x, 0.6 * radius, head[2]), blade, radius)


def _wall_mount(b: Builder, rng: Rng, case: Case, panel: Panel, arm: bool) -> None:
    """Add a plate for the wall, joined to the panel by a folded arm or by two rails."""
    wide = rng.uniform(0.12, 0.4) * panel.width
    hold = panel.at(0, 0, 1.0 * panel.thickness)
    wall = hold[2] + rng.uniform(0.12, 0.4) * (1.0 if arm else 0.4)
    y = hold[1]
    plate = (wide if not arm else 0.12, rng.uniform(0.15, 0.4) * panel.height, 0.02)
    b.rounded_box("base", case.stand, (0, y, wall), plate, 0.01)
    if arm:
        elbow = vec(rng.choice([-1, 1]) * 0.5 * wide, y, (wall + hold[2]) / 2)
        for end in (vec(0, y, wall), hold):
            beam(b, "stand", case.stand, end, elbow, width=0.03, height=0.05)
        b.cylinder("stand", case.stand, elbow - 0.035 * UP, elbow + 0.035 * UP, 0.022)
        size = (0.2, 0.03, 0.2)
        turn = panel.turn @ lean(90)
        b.rounded_box("stand", case.stand, hold - vec(0, 0, 0.01), size, 0.01, turn=turn)
        return
    for x in (-0.4 * wide, 0.4 * wide):
        for rise in (-0.3, 0.3):
            start = vec(x, y + rise * plate[1], wall)
            tip = (*start[:2], 0.3 * panel.thickness)
            beam(b, "stand", case.stand, start, tip, width=0.025, height=0.04)


def _sound_bar(b: Builder, rng: Rng, case: Case, panel: Panel) -> None:
    """Add a strip of loudspeakers along the lower edge of a panel."""
    wide, tall = rng.uniform(0.5, 0.95) * panel.width, rng.uniform(0.04, 0.08)
    turn = panel.turn @ lean(90)
    place = panel.at(0, -0.5 + 0.2 * tall / panel.height, 0.1 * panel.thickness)
    size = (wide, 0.9 * panel.thickness, tall)
    b.rounded_box("speaker", case.back, place, size, radius=0.3 * tall, edge=0.004, turn=turn)
    for x in np.linspace(-0.42, 0.42, int(rng.integers(2, 7))) * wide:
        spot = place + panel.turn @ vec(x, 0, -0.44 * panel.thickness)
        end = spot + panel.turn @ vec(0, 0, -0.05 * panel.thickness)
        radius = 0.36 * tall
        b.tube("speaker", case.accent, [spot, end], (radius, 0.3 * tall), segments=14)
