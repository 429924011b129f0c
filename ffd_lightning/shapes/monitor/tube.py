"""Sets with a picture tube."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw, pick_material
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import Array, Pair, Triple, vec
from ffd_lightning.shapes.monitor.panel import Case, draw_case


def add_bulged_screen(b: Builder, case: Case, center: Triple, size: Pair, bulge: float) -> None:
    """Add a picture tube's face of `size` (width, height) that bulges towards -z."""
    u, v = np.meshgrid(np.linspace(-1, 1, 11), np.linspace(-1, 1, 9))
    round_x, round_y = u * (1 - 0.04 * v**2), v * (1 - 0.05 * u**2)
    z = -bulge * (1 - 0.6 * u**2) * (1 - 0.6 * v**2)
    grid = np.stack([round_x * size[0] / 2, round_y * size[1] / 2, z], -1)
    sheet(b, "screen", case.screen, grid + np.asarray(center, float), 0.02)


def add_bezel(
    b: Builder, case: Case, center: Triple, outer: Pair, inner: Pair, shift: float, depth: float
) -> None:
    """Add a frame of `outer` size around the opening `inner`, which is moved up by `shift`."""
    (x, y, z), half, hole = center, np.array(outer) / 2, np.array(inner) / 2
    bars = [
        ((0, (half[1] + hole[1] + shift) / 2), (outer[0], half[1] - hole[1] - shift)),
        ((0, -(half[1] + hole[1] - shift) / 2), (outer[0], half[1] - hole[1] + shift)),
    ]
    side = half[0] - hole[0]
    bars += [((s * (half[0] - side / 2), shift), (side, 2 * hole[1] + 0.004)) for s in (-1, 1)]
    for (dx, dy), (wide, tall) in bars:
        size = (wide, tall, depth)
        middle = (x + dx, y + dy, z)
        b.rounded_box("frame", case.frame, middle, size, radius=0.012, edge=0.01, segments=2)


def _housing(b: Builder, rng: Rng, case: Case, middle: Array, size: Pair, depth: float) -> None:
    """Add the shell behind a tube, tapering towards its neck, with slits."""
    flat = np.array(
        [(0.5, 0.42), (0.47, 0.48), (0.42, 0.5), (-0.42, 0.5), (-0.47, 0.48), (-0.5, 0.42)]
    )
    outline = np.concatenate([flat, -flat]) * np.asarray(size)
    waist, shoulder = rng.uniform(0.45, 0.8), rng.uniform(0.2, 0.5)
    rows = [(0.0, 0.98), (shoulder, rng.uniform(0.9, 0.97)), (shoulder + 0.25, 0.5 + waist / 2)]
    rows += [(0.97, waist), (1.0, 0.9 * waist)]
    sink = rng.uniform(0.3, 0.95)  # the shell's lower side stays lower than its upper side
    rings = []
    for t, scale in rows:
        ring = outline * scale
        ring[:, 1] -= sink * (1 - scale) * size[1] / 2
        rings.append(np.column_stack([ring, np.full(len(ring), t * depth)]) + middle)
    b.loft("back", case.back, rings)
    reach = shoulder * depth - 0.03
    for z in np.arange(0.03, reach, 0.035)[: int(rng.integers(2, 9))]:
        slit = (0.5 * size[0], 0.012, 0.014)
        center = middle + vec(0, 0.49 * size[1] - 0.04 * size[1] * z / reach, z)
        b.box("back", case.frame, center, slit)


def _controls(b: Builder, rng: Rng, case: Case, start: Triple, reach: float) -> None:
    """Add a row of push buttons from `start` towards -x over `reach`, the first one large."""
    x, y, z = start
    b.cylinder("button", case.accent, (x, y, z + 0.005), (x, y, z - 0.012), 0.016, segments=14)
    for i in range(int(rng.integers(2, 6))):
        size = (0.022, 0.01, 0.014)
        b.box("button", case.accent, (x - 0.04 - i * reach / 7, y, z), size)


def _side_grilles(b: Builder, rng: Rng, case: Case, x: float, place: Pair, size: Pair) -> None:
    """Add a loudspeaker grille of `size` at +-`x`: louvres or two cones; `place` is (y, z)."""
    (y, z), (wide, tall) = place, size
    cones = rng.random() < 0.4
    for side in (-1, 1):
        b.box("speaker", case.back, (side * x, y, z), (wide, tall, 0.012))
        if cones:
            for dy in (-0.25, 0.2):
                spot = vec(side * x, y + dy * tall, z)
                path, radii = [spot, spot - vec(0, 0, 0.014)], (0.42 * wide, 0.34 * wide)
                b.tube("speaker", case.accent, path, radii, segments=16)
            continue
        for dy in np.linspace(-0.45, 0.45, max(5, int(tall / 0.03))) * tall:
            b.box("speaker", case.accent, (side * x, y + dy, z - 0.004), (0.9 * wide, 0.008, 0.014))


def tube(rng: Rng) -> Builder:
    """Build a set with a picture tube: on a tilting foot, flat on a desk, or a portable."""
    b = Builder()
    case = draw_case(rng)
    screen = np.array([rng.uniform(0.45, 0.75), 0.0])
    screen[1] = screen[0] * rng.choice([0.75, 0.8, 0.5625], p=[0.6, 0.25, 0.15])
    border, side = rng.uniform(0.03, 0.06), 0.0
    chin = rng.uniform(0.0, 0.1)
    grilles = rng.random() < 0.4
    if grilles:
        side = rng.uniform(0.07, 0.12)
    outer = (screen[0] + 2 * border + 2 * side, screen[1] + 2 * border + chin)
    opening = (screen[0], screen[1])
    kind = draw(rng, ["tilt", "flat", "portable"], [0.5, 0.3, 0.2])
    base = rng.uniform(0.05, 0.1) if kind == "tilt" else 0.02
    middle = vec(0, base + outer[1] / 2, 0.0)
    lip = rng.uniform(0.05, 0.12)
    shift = chin / 2
    add_bezel(b, case, (0, middle[1], 0), outer, opening, shift, lip)
    bulge = rng.uniform(0.0, 0.05)
    size = (screen[0] + 0.02, screen[1] + 0.02)
    add_bulged_screen(b, case, (0, middle[1] + shift, -0.1 * lip), size, bulge)
    depth = rng.uniform(0.5, 0.95) * screen[0]
    _housing(b, rng, case, middle + vec(0, 0, 0.4 * lip), outer, depth)
    y = middle[1] - outer[1] / 2 + (border + chin) * 0.5
    _controls(b, rng, case, (0.36 * outer[0], y, -lip / 2), rng.uniform(0.2, 0.4))
    if grilles:
        x = outer[0] / 2 - side / 2 - 0.25 * border
        block = (side * 0.8, 0.85 * screen[1])
        _side_grilles(b, rng, case, x, (middle[1] + shift, -lip / 2), block)
    _tube_foot(b, rng, case, kind, outer, base=base, depth=depth)
    return b


def _tube_foot(
    b: Builder, rng: Rng, case: Case, kind: str, outer: Pair, base: float, depth: float
) -> None:
    """Add what a tube set stands on: a swivel, four pads, or pads with aerials or a handle."""
    width, height = outer
    if kind == "tilt":
        radius, z = rng.uniform(0.22, 0.34) * width, 0.3 * depth
        rows = [(radius, 0), (radius, 0.25 * base), (0.55 * radius, 0.5 * base)]
        b.lathe("base", case.stand, rows, (0, 0, z), segments=32)
        rows = [(0.6 * radius, 0.4 * base), (0.8 * radius, 0.7 * base), (0.95 * radius, 1.3 * base)]
        b.lathe("stand", case.stand, rows, (0, 0, z), segments=32)
        return
    for x, _, z in corners(0.75 * width, 0.5 * depth, 0, 0.3 * depth):
        b.cylinder("base", case.stand, (x, 0, z), (x, 0.1 * height + base, z), 0.03, segments=12)
    if kind != "portable":
        return
    top, metal = base + height, pick_material(rng, "metal")
    if rng.random() < 0.5:
        b.rounded_box("stand", case.stand, (0, top + 0.005, 0.15 * depth), (0.12, 0.04, 0.08), 0.02)
        for side in (-1, 1):
            reach = vec(side * rng.uniform(0.1, 0.4), rng.uniform(0.25, 0.5), 0.02)
            start = vec(side * 0.03, top + 0.01, 0.15 * depth)
            end = start + reach
            b.cylinder("stand", metal, start, end, radius=0.007, radius_end=0.005, segments=8)
        return
    for side in (-1, 1):
        x = side * 0.25 * width
        b.rounded_box("stand", case.stand, (x, top + 0.02, 0.1), (0.03, 0.07, 0.04), 0.01)
    b.rounded_box("stand", case.stand, (0, top + 0.055, 0.1), (0.55 * width, 0.03, 0.045), 0.014)
