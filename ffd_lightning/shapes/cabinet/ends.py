"""What a cabinet stands on and what it ends with."""

import numpy as np

from ffd_lightning.shapes.cabinet.joinery import carcass, plank
from ffd_lightning.shapes.cabinet.layouts import fill
from ffd_lightning.shapes.cabinet.plan import Plan
from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, draw, nothing, pick_material
from ffd_lightning.shapes.kit.boards import rails
from ffd_lightning.shapes.kit.legs import LegStyle, add_legs, draw_leg_style
from ffd_lightning.shapes.kit.paths import bend, corners
from ffd_lightning.shapes.kit.vectors import UP, Triple, vec


def plinth(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box, flush with the front or set back."""
    low = (-0.49 * p.width, 0, -0.5 * p.depth + rng.uniform(0.0, 0.06))
    plank(b, "leg", p.style.body, low, (0.49 * p.width, p.foot + 0.003, 0.5 * p.depth))


def legs(b: Builder, rng: Rng, p: Plan, splayed: bool = False) -> None:
    """Add four legs, straight or splayed, and two more below what is long."""
    splay = rng.uniform(0.06, 0.12) if splayed else 0.0
    style = draw_leg_style(rng, (0.03, 0.065), hairpin=0.15 if p.foot > 0.12 else 0.0)
    margin, flat = 1.3 * style.thickness + splay, vec(1, 0, 1)
    tops = corners(p.width - margin, p.depth - margin, p.foot + 0.003)
    if p.width > 1.6:
        tops = np.concatenate([tops, tops[[0, 2]] * vec(0, 1, 1)])
    feet = tops * flat + 0.4 * splay * np.sign(tops) * flat
    add_legs(b, "leg", p.style.body, style, tops, feet)


def bracket(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two short boards at each corner."""
    for foot in corners(p.width - 0.07, p.depth - 0.07, p.foot / 2):
        inward = np.sign(foot) * vec(1, 0, 1)
        b.box("leg", p.style.body, foot + inward * vec(-0.03, 0, 0.02), (0.13, p.foot, 0.025))
        b.box("leg", p.style.body, foot + inward * vec(0.02, 0, -0.03), (0.025, p.foot, 0.13))


def sled(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a frame of bars."""
    side = rng.uniform(0.015, 0.035)
    metal = pick_material(rng, "metal") if rng.random() < 0.6 else p.style.body
    feet = corners(0.9 * p.width, 0.85 * p.depth, side / 2)
    for level in (0.0, p.foot - side):
        rails(b, "leg", metal, feet + level * UP, side, side)
    flat = feet * vec(1, 0, 1)
    add_legs(b, "leg", metal, LegStyle("square", side), flat + p.foot * UP, flat)


def casters(b: Builder, rng: Rng, p: Plan) -> None:
    """Add four wheels on forks."""
    metal, rubber = pick_material(rng, "metal"), pick_material(rng, "rubber")
    radius = p.foot / 2.3
    for x, _, z in corners(p.width - 0.09, p.depth - 0.09, 0):
        for side in (-0.012, 0.012):
            hub = vec(x + side, radius, z)
            b.cylinder("leg", rubber, hub - vec(0.007, 0, 0), hub + vec(0.007, 0, 0), radius)
        b.cylinder("leg", metal, (x, radius, z), (x, p.foot + 0.003, z), 0.012, segments=10)


_FIRM = ("drawers", "doors", "both", "sliding", "columns", "shelves")
_LIGHT = {"layout": _FIRM, "use": ("night", "chest", "low", "sideboard")}
_ROLLING = {"layout": ("drawers", "files"), "use": ("night", "office")}
STANDS = (
    Component("none", 1, nothing),
    Component("plinth", 1.3, plinth, {"layout": (*_FIRM, "files", "lockers")}),
    Component("legs", 3, legs, {"layout": (*_FIRM, "lockers")} | {"use": (*_LIGHT["use"], "tall")}),
    Component.of("splayed", 1.5, legs, _LIGHT, splayed=True),
    Component("bracket", 1, bracket, {"layout": _FIRM}),
    Component("sled", 1.5, sled, _LIGHT),
    Component("casters", 0.7, casters, _ROLLING),
)


def flat(b: Builder, rng: Rng, p: Plan, material: Material | None = None) -> None:
    """Add a board with an overhang."""
    over, thick = rng.uniform(0.0, 0.06), rng.uniform(0.02, 0.06)
    board = material or (p.style.body if rng.random() < 0.6 else p.style.front)
    size = (p.width + 2 * over + 0.004, thick, p.depth + over + 0.004)
    middle = (0, p.top + thick / 2 - 0.002, -over / 2)
    b.rounded_box("top", board, middle, size, radius=0.012, edge=rng.uniform(0.2, 0.45) * thick)


def cornice(b: Builder, rng: Rng, p: Plan, case: Triple | None = None, z: float = 0.0) -> None:
    """Add a moulding that flares, on a `case` (width, height of its top, depth) about `z`."""
    (width, top, depth), reach = case or (p.width, p.top, p.depth), rng.uniform(0.03, 0.09)
    profile = [(0.0, -0.01), (0.3, 0.15), (0.33, 0.4), (0.5, 0.65), (0.8, 0.78), (1.0, 0.85)]
    rings = []
    for out, rise in [*profile, (1.0, 1.2)]:
        wide, deep, back = width + 2 * out * reach, depth + out * reach, z - out * reach / 2
        rings.append(corners(wide, deep, top + rise * reach, back))
    b.loft("top", p.style.body, rings)


def gallery(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board with a rim at the back and the ends."""
    rise, x, z = rng.uniform(0.04, 0.25), p.width / 2, p.depth / 2
    flat(b, rng, p)
    plank(b, "top", p.style.body, (-x, p.top, z - 0.02), (x, p.top + rise, z))
    for side in (-x, x - 0.02):
        end = (side + 0.02, p.top + 0.7 * rise, z)
        plank(b, "top", p.style.body, (side, p.top, -0.5 * z), end)


def mirror(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board and a framed mirror on two posts."""
    flat(b, rng, p)
    wide, tall = rng.uniform(0.5, 0.85) * p.width, rng.uniform(0.45, 0.8)
    center = vec(0, p.top + 0.08 + tall / 2, p.depth / 2 - 0.03)
    b.rounded_box("top", p.style.body, center, (wide, tall, 0.03), 0.01)
    size, post = (wide - 0.1, tall - 0.1, 0.018), (0.04, 0.5 * tall + 0.16, 0.02)
    b.box("top", Material((0.75, 0.83, 0.88)), center - vec(0, 0, 0.01), size)
    for x in (-0.3 * wide, 0.3 * wide):
        b.box("top", p.style.body, center + vec(x, -0.25 * tall, 0.01), post)


def hutch(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board and a shallower case with glass doors or shelves, sometimes raised."""
    flat(b, rng, p)
    rise, deep = rng.uniform(0.5, 1.2), rng.uniform(0.5, 0.85) * p.depth
    z, bottom, t = (p.depth - deep) / 2, p.top + 0.015, p.style.board
    wide = p.width - rng.uniform(0, 0.1)
    gap = rng.uniform(0.15, 0.35) if rng.random() < 0.4 else 0.0
    if gap:
        end = (bottom + gap + 0.01, z + deep / 2)
        for x in (-wide / 2, wide / 2 - t):
            plank(b, "body", p.style.body, (x, bottom, z), (x + t, *end))
        plank(b, "body", p.style.body, (-wide / 2, bottom, end[1] - 0.015), (wide / 2, *end))
    bottom += gap
    bay, count = carcass(b, p.style, (wide, rise, deep), (0, bottom, z)), round(wide / 0.5)
    if rng.random() < 0.35:
        for cell in bay.split(max(1, count - 1), across=True):
            fill(rng, cell, "open")
    else:
        bay.shelves(int(rng.integers(1, 4)))
        bay.doors(max(1, count), glazed=True, handle=0.3)
    cornice(b, rng, p, (wide, bottom + rise, deep), z)


def worktop(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a worktop with a sink, a hob or both."""
    flat(b, rng, p, pick_material(rng, draw(rng, ["wood", "metal", "plastic"])))
    steel, level = pick_material(rng, "metal"), p.top + 0.035
    count = max(1, round(p.width / 0.6))
    spots = list(rng.permutation((np.arange(count) + 0.5) / count - 0.5) * p.width)
    x, size = spots.pop(), vec(rng.uniform(0.34, 0.4), 0.036, rng.uniform(0.3, 0.38))
    b.rounded_box("top", steel, (x, level, -0.04), size, 0.04, segments=2)
    bowl, middle = Material((0.35, 0.36, 0.38)), (x, level + 0.004, -0.04)
    b.rounded_box("top", bowl, middle, size * vec(0.85, 1, 0.8), 0.06, segments=2)
    rise, reach = rng.uniform(0.14, 0.3), rng.uniform(0.12, 0.18)
    path = [(x, level - 0.02, 0.2), (x, level + rise, 0.2)]
    path += [(x, level + y, 0.2 - reach) for y in (rise, 0.7 * rise)]
    b.tube("top", steel, bend(path, 0.06, 3), 0.013, segments=8)
    if spots and rng.random() < 0.6:
        x, plate = spots.pop(), (0.44, 0.04, 0.42)
        b.rounded_box("top", Material((0.08, 0.08, 0.09)), (x, level, 0), plate, 0.02, segments=2)
        for i, j in ((-1, -1), (1, -1), (-1, 1), (1, 1)):
            ring = [(0.05, 0.015), (0.075, 0.022), (0.05, 0.024), (0.03, 0.018)]
            b.lathe("top", steel, ring, (x + 0.11 * i, level, 0.1 * j), segments=12)


def wall(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a worktop, tiles and a row of cases on the wall."""
    worktop(b, rng, p)
    gap, rise, deep = rng.uniform(0.4, 0.6), rng.uniform(0.4, 0.8), rng.uniform(0.28, 0.36)
    tiles, z = Material(pick_material(rng, "plastic").color, "checker", 5.0), p.depth / 2
    low, high = (-p.width / 2, p.top, z - 0.02), (p.width / 2, p.top + gap + 0.05, z)
    plank(b, "body", tiles, low, high)
    bay = carcass(b, p.style, (p.width, rise, deep), (0, p.top + gap + 0.03, z - deep / 2))
    for cell in bay.split(max(1, round(p.width / 0.6)), across=True):
        fill(rng, cell, draw(rng, ["door", "door", "glass", "open"]))


_LOW = ("night", "chest", "low", "sideboard", "office")
_TALL = ("tall", "wardrobe", "shelving")
_CASES = ("drawers", "doors", "both", "sliding", "columns", "shelves", "kneehole")
_BROAD = {"use": ("chest", "sideboard")}
TOPS = (
    Component("bare", 1, nothing, {"use": (*_LOW, *_TALL, "lockers")}),
    Component("flat", 2.2, flat, {"use": (*_LOW, *_TALL), "layout": _CASES}),
    Component("cornice", 1.2, cornice, {"use": _TALL, "layout": _CASES}),
    Component("gallery", 1, gallery, {"use": ("night", "chest", "sideboard")}),
    Component("mirror", 1, mirror, _BROAD | {"layout": ("drawers", "both", "kneehole")}),
    Component("hutch", 1.8, hutch, _BROAD | {"layout": _CASES}),
    Component("worktop", 1, worktop, {"use": ("kitchen",)}),
    Component("wall", 1.2, wall, {"use": ("kitchen",)}),
)
