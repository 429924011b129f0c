"""Deep sets: picture tubes of the desk and the living room, and projection televisions."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.parts.furniture import (
    LegStyle,
    add_legs,
    corners,
    draw,
    lean,
    sheet,
)
from ffd_lightning.shapes.parts.screens import Case, draw_case
from ffd_lightning.shapes.shapes import Array, Builder, pick_material


def _bulged(
    b: Builder,
    case: Case,
    center: tuple[float, float, float],
    size: tuple[float, float],
    bulge: float,
) -> None:
    """Add a picture tube's face of `size` (width, height) that bulges towards -z."""
    u, v = np.meshgrid(np.linspace(-1, 1, 11), np.linspace(-1, 1, 9))
    round_x, round_y = u * (1 - 0.04 * v**2), v * (1 - 0.05 * u**2)
    z = -bulge * (1 - 0.6 * u**2) * (1 - 0.6 * v**2)
    grid = np.stack([round_x * size[0] / 2, round_y * size[1] / 2, z], -1)
    sheet(b, "screen", case.screen, grid + np.asarray(center, float), 0.02)


def _bezel(
    b: Builder,
    case: Case,
    center: tuple[float, float, float],
    outer: tuple[float, float],
    inner: tuple[float, float],
    shift: float,
    depth: float,
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
        b.rounded_box("frame", case.frame, (x + dx, y + dy, z), size, 0.012, 0.01, segments=2)


def _housing(
    b: Builder,
    rng: np.random.Generator,
    case: Case,
    middle: Array,
    size: tuple[float, float],
    depth: float,
) -> None:
    """Add the shell behind a tube, tapering towards its neck, with slits."""
    flat = np.array([(0.5, 0.42), (0.47, 0.48), (0.42, 0.5), (-0.42, 0.5), (-0.47, 0.48),
                     (-0.5, 0.42)])  # fmt: skip
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
        b.box(
            "back", case.frame, middle + (0, 0.49 * size[1] - 0.04 * size[1] * z / reach, z), slit
        )


def _controls(
    b: Builder,
    rng: np.random.Generator,
    case: Case,
    start: tuple[float, float, float],
    reach: float,
) -> None:
    """Add a row of push buttons from `start` towards -x over `reach`, the first one large."""
    x, y, z = start
    b.cylinder("button", case.accent, (x, y, z + 0.005), (x, y, z - 0.012), 0.016, segments=14)
    for i in range(int(rng.integers(2, 6))):
        size = (0.022, 0.01, 0.014)
        b.box("button", case.accent, (x - 0.04 - i * reach / 7, y, z), size)


def _side_grilles(
    b: Builder,
    rng: np.random.Generator,
    case: Case,
    x: float,
    place: tuple[float, float],
    size: tuple[float, float],
) -> None:
    """Add a loudspeaker grille of `size` at +-`x`: louvres or two cones; `place` is (y, z)."""
    (y, z), (wide, tall) = place, size
    cones = rng.random() < 0.4
    for side in (-1, 1):
        b.box("speaker", case.back, (side * x, y, z), (wide, tall, 0.012))
        if cones:
            for dy in (-0.25, 0.2):
                spot = np.array([side * x, y + dy * tall, z])
                b.cylinder("speaker", case.accent, spot, spot - (0, 0, 0.014), 0.42 * wide,
                           0.34 * wide, 16)  # fmt: skip
            continue
        for dy in np.linspace(-0.45, 0.45, max(5, int(tall / 0.03))) * tall:
            b.box("speaker", case.accent, (side * x, y + dy, z - 0.004), (0.9 * wide, 0.008, 0.014))


def tube(rng: np.random.Generator) -> Builder:
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
    middle = np.array([0, base + outer[1] / 2, 0.0])
    lip = rng.uniform(0.05, 0.12)
    shift = chin / 2
    _bezel(b, case, (0, middle[1], 0), outer, opening, shift, lip)
    bulge = rng.uniform(0.0, 0.05)
    size = (screen[0] + 0.02, screen[1] + 0.02)
    _bulged(b, case, (0, middle[1] + shift, -0.1 * lip), size, bulge)
    depth = rng.uniform(0.5, 0.95) * screen[0]
    _housing(b, rng, case, middle + (0, 0, 0.4 * lip), outer, depth)
    y = middle[1] - outer[1] / 2 + (border + chin) * 0.5
    _controls(b, rng, case, (0.36 * outer[0], y, -lip / 2), rng.uniform(0.2, 0.4))
    if grilles:
        x = outer[0] / 2 - side / 2 - 0.25 * border
        _side_grilles(
            b, rng, case, x, (middle[1] + shift, -lip / 2), (side * 0.8, 0.85 * screen[1])
        )
    _tube_foot(b, rng, case, kind, outer, (base, depth))
    return b


def _tube_foot(
    b: Builder,
    rng: np.random.Generator,
    case: Case,
    kind: str,
    outer: tuple[float, float],
    extent: tuple[float, float],
) -> None:
    """Add what a tube set stands on: a swivel, four pads, or pads with aerials or a handle."""
    (width, height), (base, depth) = outer, extent
    if kind == "tilt":
        radius, z = rng.uniform(0.22, 0.34) * width, 0.3 * depth
        rows = [(radius, 0), (radius, 0.25 * base), (0.55 * radius, 0.5 * base)]
        b.lathe("base", case.stand, rows, (0, 0, z), 32)
        rows = [(0.6 * radius, 0.4 * base), (0.8 * radius, 0.7 * base), (0.95 * radius, 1.3 * base)]
        b.lathe("stand", case.stand, rows, (0, 0, z), 32)
        return
    for x, _, z in corners(0.75 * width, 0.5 * depth, 0, 0.3 * depth):
        b.cylinder("base", case.stand, (x, 0, z), (x, 0.1 * height + base, z), 0.03, segments=12)
    if kind != "portable":
        return
    top, metal = base + height, pick_material(rng, "metal")
    if rng.random() < 0.5:
        b.rounded_box("stand", case.stand, (0, top + 0.005, 0.15 * depth), (0.12, 0.04, 0.08), 0.02)
        for side in (-1, 1):
            reach = np.array([side * rng.uniform(0.1, 0.4), rng.uniform(0.25, 0.5), 0.02])
            start = np.array([side * 0.03, top + 0.01, 0.15 * depth])
            b.cylinder("stand", metal, start, start + reach, 0.007, 0.005, 8)
        return
    for side in (-1, 1):
        x = side * 0.25 * width
        b.rounded_box("stand", case.stand, (x, top + 0.02, 0.1), (0.03, 0.07, 0.04), 0.01)
    b.rounded_box("stand", case.stand, (0, top + 0.055, 0.1), (0.55 * width, 0.03, 0.045), 0.014)


def projection(rng: np.random.Generator) -> Builder:
    """Build a floor-standing set: a big screen above a grille, or a wooden console on legs."""
    b = Builder()
    case = draw_case(rng)
    width, depth = rng.uniform(0.9, 1.4), rng.uniform(0.35, 0.55)
    console = rng.random() < 0.4
    body = pick_material(rng, "wood") if console else case.frame
    case = Case(body, case.back, case.stand, case.screen, case.accent)
    height = width * rng.uniform(0.6, 0.75)
    low = rng.uniform(0.12, 0.3) if console else rng.uniform(0.2, 0.5) * height
    border = rng.uniform(0.04, 0.08)
    y, lip = low + height / 2, 0.08
    hole = (width - 2 * border, height - 2 * border)
    if console:
        hole = (hole[0] - rng.uniform(0.25, 0.35) * width, hole[1])
    x = 0.0 if not console else (width - 2 * border - hole[0]) / 2
    size = (hole[0] + 0.02, hole[1] + 0.02)
    if console:
        b.rounded_box("frame", body, (0, y, depth / 2), (width, height, depth), 0.01)
        inner = np.array([x, y, 0.0])
        b.rounded_box("frame", case.back, inner, (size[0], size[1], 0.03), 0.03)
        _bulged(b, case, (x, y, -0.015), (0.92 * size[0], 0.92 * size[1]), 0.03)
        _console_panel(b, rng, case, (border - width / 2, x - size[0] / 2), (y, hole[1]))
        style = LegStyle("round", 0.05, ((0, 0.5), (0.5, 0.75), (1, 1)))
        tops = corners(0.85 * width, 0.75 * depth, low + 0.01, depth / 2)
        spread = (tops - (0, low + 0.01, depth / 2)) * rng.uniform(1.0, 1.1) + (0, 0, depth / 2)
        add_legs(b, "base", body, style, tops, spread)
        return b
    _bezel(b, case, (0, y, 0), (width, height), hole, 0.0, lip)
    _bulged(b, case, (0, y, 0.0), size, 0.0)
    _hood(b, rng, case, (width, height, depth), low)
    _grille(b, rng, case, (width, low), lip)
    return b


def _console_panel(
    b: Builder,
    rng: np.random.Generator,
    case: Case,
    span: tuple[float, float],
    extent: tuple[float, float],
) -> None:
    """Add dials above a loudspeaker cloth between the x of `span`; `extent` is (y, height)."""
    x, wide = sum(span) / 2, span[1] - span[0] - 0.04
    y, tall = extent
    b.box("speaker", case.back, (x, y - 0.2 * tall, -0.004), (wide, 0.55 * tall, 0.015))
    for dy in np.linspace(-0.45, 0.05, int(rng.integers(5, 11))) * tall:
        b.box("speaker", case.accent, (x, y + dy, -0.008), (wide, 0.012, 0.015))
    for i in range(int(rng.integers(1, 3))):
        radius = min(0.35 * wide, 0.07)
        rows = [(radius, 0), (radius, 0.02), (0.6 * radius, 0.025), (0.55 * radius, 0.05)]
        spot = (x, y + (0.36 - 0.2 * i) * tall, 0.004)
        b.lathe("button", case.accent, rows, spot, 20, turn=lean(-90))


def _hood(
    b: Builder,
    rng: np.random.Generator,
    case: Case,
    size: tuple[float, float, float],
    low: float,
) -> None:
    """Add the sloping housing behind a projection screen of `size` (width, height, depth)."""
    width, height, depth = size
    peak, back = rng.uniform(0.4, 0.8), rng.uniform(0.6, 0.9)
    y, upper = low + 0.01, low + 0.98 * height
    profile = [(y, 0.02), (y, depth), (y + 0.25 * height, depth)]
    profile += [(upper, peak * 0.5 * depth), (upper, 0.02)]
    section = np.array(profile)
    rings = []
    for side in (-1, 1):
        reach = np.where(section[:, 1] > 0.5 * depth, 0.49 * back, 0.49)
        rings.append(np.stack([side * reach * width, section[:, 0], section[:, 1]], 1))
    b.loft("back", case.back, rings)


def _grille(
    b: Builder, rng: np.random.Generator, case: Case, size: tuple[float, float], lip: float
) -> None:
    """Add the pedestal below a projection screen, `size` (width, height), with its loudspeakers."""
    width, height = size
    deep = rng.uniform(0.28, 0.34)
    inset = rng.uniform(0.0, 0.06)
    box = (width - inset, height + 0.01, deep)
    z = deep / 2 - lip / 2 + 0.01
    b.rounded_box("base", case.frame, (0, height / 2, z), box, 0.015)
    front = z - deep / 2
    for side in (-1, 1) if rng.random() < 0.6 else (0,):
        wide = 0.42 * width if side else 0.85 * width
        place = np.array([side * 0.24 * width, 0.5 * height, front])
        b.box("speaker", case.back, place, (wide, 0.7 * height, 0.02))
        for dy in np.linspace(-0.3, 0.3, int(rng.integers(4, 10))) * height:
            b.box("speaker", case.accent, place + (0, dy, -0.006), (wide, 0.01, 0.016))
    for i in range(int(rng.integers(2, 6))):
        spot = np.array([(i - 2) * 0.05, 0.93 * height, front])
        b.cylinder("button", case.accent, spot, spot - (0, 0, 0.012), 0.012, segments=10)
