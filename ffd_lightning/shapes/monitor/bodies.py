"""Screens with their frames and housings."""

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import Array, Pair, about_y, lean, vec
from ffd_lightning.shapes.monitor.plan import Plan


def _buttons(b: Builder, rng: Rng, p: Plan, x: float, rise: float) -> None:
    """Add a row of push buttons that begins at `x`, `rise` above the frame's lower edge."""
    r, step = min(0.22 * p.bezel, 0.01), rng.uniform(0.02, 0.05)
    y, front = -0.5 + rise / p.height, -0.5 * p.thick
    for i in range(int(rng.integers(1, 6))):
        start, end = (p.at(x - i * step, y, z) for z in (front + 0.01, front - 0.4 * r))
        b.cylinder("button", p.accent, start, end, r * (1 + (i == 0)), segments=8)


def _housing(b: Builder, rng: Rng, p: Plan, rows: list[Pair], sink: float) -> None:
    """Add a shell behind the frame through `rows` of (depth, scale), with slits in its end.

    `sink` is how far its smaller end is lowered, 1 to the level of the frame's lower edge.
    """
    flat = np.array([(0.5, 0.42), (0.47, 0.48), (0.42, 0.5), (-0.42, 0.5), (-0.47, 0.48)])
    outline = np.concatenate([flat, [(-0.5, 0.42)], -flat, [(0.5, -0.42)]])
    rings = [[p.at(s * x, s * y - sink * (1 - s) / 2, z) for x, y in outline] for z, s in rows]
    b.loft("back", p.back, rings)
    (z, scale), tall = rows[-1], 0.03 * rows[-1][1] * p.height
    for y in np.linspace(0.1, 0.3, int(rng.integers(0, 7))) * scale - sink * (1 - scale) / 2:
        b.box("back", p.frame, p.at(0, y, z), (0.5 * scale * p.width, tall / 2, 0.012), turn=p.turn)


def panel(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a flat screen in a frame, a tapering back and controls."""
    t, radius = p.thick, rng.choice([0.1, 0.6, 1.5]) * (p.bezel + 0.01)
    size = (p.width, t, p.height)
    b.rounded_box("frame", p.frame, p.at(0, 0, 0), size, radius, edge=0.2 * t, turn=p.flat)
    size = (p.width - 2 * p.bezel, 0.01, p.height - 2 * p.bezel - p.chin)
    middle = p.at(0, 0.5 * p.chin / p.height, -0.5 * t + 0.003)
    b.rounded_box("screen", p.screen, middle, size, 0.006, edge=0.002, turn=p.flat)
    waist, start = rng.uniform(0.4, 0.9), 0.45 * t
    rows = [(start, 0.96), (start + 0.2 * p.deep, 0.94), (start + p.deep, waist)]
    _housing(b, rng, p, rows, sink=rng.uniform(-0.1, 0.3))
    _buttons(b, rng, p, rng.uniform(0.1, 0.42), 0.5 * p.bezel + 0.4 * p.chin)


def curved(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a screen that is bent around the viewer, and a housing behind its middle."""
    sag, u, v = rng.uniform(0.04, 0.15), np.linspace(-0.5, 0.5, 17), np.linspace(-0.5, 0.5, 5)

    def bent(inset: float, z: float) -> Array:
        x, y = u * (1 - 2 * inset), v * (1 - 2 * inset / p.height)
        return np.array([[p.at(i, j, z - 4 * sag * i * i) for i in x] for j in y])

    sheet(b, "frame", p.frame, bent(0, 0), p.thick)
    sheet(b, "screen", p.screen, bent(p.bezel, -p.thick / 2), 0.006)
    sheet(b, "back", p.back, bent(0.16 * p.height, 0.6 * p.thick), p.thick)
    size = (rng.uniform(0.15, 0.35), p.deep, rng.uniform(0.4, 0.7) * p.height)
    b.rounded_box("back", p.back, p.at(0, 0, 0.8 * p.thick + p.deep / 2), size, 0.02, turn=p.flat)
    _buttons(b, rng, p, 0.06, 0.5 * p.bezel)


def array(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two to six flat screens beside and above each other, joined by bars."""
    pairs = [(2, 1), (3, 1), (1, 2), (2, 2), (3, 2)]
    columns, rows = pairs[int(rng.choice(5, p=[0.35, 0.25, 0.15, 0.15, 0.1]))]
    step, angle = 1.03 * p.width, rng.uniform(0, 28) if columns > 1 else 0.0
    z = p.at(0, 0, 0.5 * p.thick + 0.8 * p.deep)[2]
    for row in range(rows):
        y = p.center[1] + 1.04 * row * p.height
        for offset in np.arange(columns) - (columns - 1) / 2:
            swing = np.radians(angle * offset)  # each outer edge comes towards the viewer
            inner = max(abs(offset) - 0.5, 0.0)
            x = np.sign(offset) * step * (inner + 0.5 * np.cos(swing)) * (offset != 0)
            place = (x, y, -0.5 * step * np.sin(abs(swing)))
            one = replace(p, center=place, turn=about_y(angle * offset))
            panel(b, rng, one)
            start, end = one.at(0, 0, 0.4 * p.thick), (0.7 * x, y, z + 0.02)
            beam(b, "stand", p.stand, start, end, width=0.04, height=0.08)
        reach = 0.45 * (columns - 1) * step + 0.03
        beam(b, "stand", p.stand, (-reach, y, z + 0.02), (reach, y, z + 0.02), 0.035, 0.06)
    top = p.center[1] + (1.04 * (rows - 1) + 0.1) * p.height
    b.cylinder("stand", p.stand, (0, p.center[1], z + 0.02), (0, top, z + 0.02), 0.03)


def _bulged(b: Builder, p: Plan, middle: Array, size: Pair, bulge: float) -> None:
    """Add a picture of `size` that bulges towards the viewer."""
    u, v = np.meshgrid(np.linspace(-1, 1, 11), np.linspace(-1, 1, 9))
    z = -bulge * (1 - 0.6 * u**2) * (1 - 0.6 * v**2)
    x, y = u * (1 - 0.04 * v**2) * size[0] / 2, v * (1 - 0.05 * u**2) * size[1] / 2
    sheet(b, "screen", p.screen, np.stack([x, y, z], -1) + middle, 0.02)


def _framed(b: Builder, p: Plan, bulge: float) -> None:
    """Add four bars around a screen that lies deeper than they."""
    wide, tall = p.width - 2 * (p.bezel + p.side), p.height - 2 * p.bezel - p.chin
    edge, x = p.bezel + p.side, (p.width - p.bezel - p.side) / 2
    upper, lower = p.height / 2 - p.bezel / 2, -p.height / 2 + (p.bezel + p.chin) / 2
    bars = [(0.0, upper, p.width, p.bezel), (0.0, lower, p.width, p.bezel + p.chin)]
    bars += [(side * x, p.chin / 2, edge, tall + 0.01) for side in (-1, 1)]
    for dx, dy, width, height in bars:
        middle, size = p.center + vec(dx, dy, 0), (width, height, p.thick)
        b.rounded_box("frame", p.frame, middle, size, 0.02, edge=0.015, segments=2)
    middle = p.center + vec(0, p.chin / 2, 0.15 * p.thick)
    _bulged(b, p, middle, (wide + 0.03, tall + 0.03), bulge)


def grille(b: Builder, rng: Rng, p: Plan, middle: Array, size: Pair, cones: bool) -> None:
    """Add a loudspeaker's cloth of `size` with two cones or behind louvres."""
    b.box("speaker", p.back, middle, (*size, 0.012))
    if cones:
        r = min(0.4 * min(size), 0.2 * max(size))
        for x, y in ((-0.25, 0), (0.25, 0)) if size[0] > size[1] else ((0, -0.25), (0, 0.22)):
            spot = middle + vec(x * size[0], y * size[1], 0)
            b.tube("speaker", p.accent, [spot, spot - vec(0, 0, 0.016)], (r, 0.8 * r), segments=16)
        return
    for y in np.linspace(-0.45, 0.45, int(rng.integers(5, 14))) * size[1]:
        bar = (0.94 * size[0], 0.25 * size[1] / 14, 0.014)
        b.box("speaker", p.accent, middle + vec(0, y, -0.004), bar)


def tube(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a picture tube in a deep housing, with grilles beside the screen if the frame is wide."""
    _framed(b, p, rng.uniform(0.0, 0.06))
    waist, shoulder = rng.uniform(0.45, 0.8), rng.uniform(0.15, 0.5) * p.deep
    start = 0.4 * p.thick
    rows = [(start, 0.98), (start + shoulder, rng.uniform(0.9, 0.97))]
    rows += [(start + shoulder + 0.25 * p.deep, 0.5 + waist / 2), (start + 0.97 * p.deep, waist)]
    _housing(b, rng, p, [*rows, (start + p.deep, 0.9 * waist)], sink=rng.uniform(0.3, 0.95))
    _buttons(b, rng, p, 0.36, (p.bezel + p.chin) / 2)
    cones = rng.random() < 0.4
    for x in (-0.5, 0.5) if p.side else ():
        middle = p.center + vec(x * (p.width - p.bezel - p.side), p.chin / 2, -p.thick / 2)
        grille(b, rng, p, middle, (0.85 * p.side, 0.8 * (p.height - p.chin)), cones)


def projection(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a big flat screen before a housing that slopes down to the back."""
    _framed(b, p, 0.0)
    upper, peak, back = 0.48 * p.height, rng.uniform(0.1, 0.4) * p.deep, rng.uniform(0.6, 0.95)
    low = -0.49 * p.height
    knee = rng.uniform(0.1, 0.5) * p.height + low
    section = [(low, 0.02), (low, p.deep), (knee, p.deep), (upper, peak), (upper, 0.02)]
    flat = np.array([(back if z > 0.5 * p.deep else 1, y, z) for y, z in section])
    b.loft("back", p.back, [flat * (side, 1, 1) + p.center for side in (-0.49, 0.49)])
    _buttons(b, rng, p, 0.1, (p.bezel + p.chin) / 2)


def console(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a wooden cabinet with a bulged screen, a grille and dials beside or below it."""
    y, z, below = p.center[1], -p.thick / 2, p.height > 0.75
    b.rounded_box("frame", p.frame, p.center, (p.width, p.height, p.thick), 0.015)
    share = rng.uniform(0.24, 0.34)
    wide, tall = p.width - 2 * p.bezel, p.height - 2 * p.bezel
    if below:
        size = (wide, (1 - share) * tall)
        spot, other = vec(0, y + share * tall / 2, z), vec(0, y - (1 - share) * tall / 2, z)
    else:
        size, x = ((1 - share) * wide, tall), share * wide / 2
        spot, other = vec(x, y, z), vec(x - wide / 2, y - 0.2 * tall, z)
    b.rounded_box("frame", p.back, spot, (*size, 0.03), 0.03)
    _bulged(b, p, spot - vec(0, 0, 0.015), (0.9 * size[0], 0.9 * size[1]), rng.uniform(0.01, 0.04))
    if below:
        cloth, cones = (0.7 * wide, 0.8 * share * tall), rng.random() < 0.5
        grille(b, rng, p, other + vec(0.12 * wide, 0, 0), cloth, cones)
        for x in (-0.36, -0.45):
            spot = other + vec((x + 0.02) * wide, 0, 0)
            b.cylinder("button", p.accent, spot, spot - vec(0, 0, 0.03), 0.035 * wide, segments=16)
        return
    cloth = (0.8 * share * wide, 0.55 * tall)
    r = min(0.3 * cloth[0], 0.06)
    for i in range(int(rng.integers(1, 3))):
        dial = (other[0], y + (0.36 - 0.2 * i) * tall, z + 0.004)
        rows = [(r, 0), (r, 0.02), (0.6 * r, 0.025), (0.55 * r, 0.05)]
        b.lathe("button", p.accent, rows, dial, segments=20, turn=lean(-90))
    grille(b, rng, p, other, cloth, cones=False)


BODIES = (
    Component("panel", 5, panel),
    Component("curved", 1.2, curved),
    Component("array", 1, array),
    Component("tube", 2, tube),
    Component("projection", 0.9, projection),
    Component("console", 0.9, console),
)
