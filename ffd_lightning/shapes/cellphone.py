"""Telephones: smartphones, candy bars, flips, sliders, keyboards, bricks, docked handsets."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.parts.furniture import draw
from ffd_lightning.shapes.parts.handsets import (
    Body,
    Finish,
    aerial,
    camera,
    display,
    draw_finish,
    earpiece,
    keypad,
    navigation,
    shell,
    side_buttons,
    tile,
    upright,
)
from ffd_lightning.shapes.shapes import (
    Array,
    Builder,
    Family,
    pick_material,
    rotation,
)

PARTS = ("body", "screen", "key", "button", "camera", "speaker", "antenna", "stand")


def _smartphone(rng: np.random.Generator) -> Builder:
    """Build a flat slab that is nearly all screen, some in a bumper or on a prop."""
    b = Builder()
    finish = draw_finish(rng)
    width = rng.uniform(0.44, 0.72)
    body = upright(width, 1.0, width * rng.uniform(0.09, 0.2))
    radius = width * rng.uniform(0.03, 0.22)
    edge = rng.uniform(0.1, 0.45) * body.depth
    if rng.random() < 0.3:
        body = Body(body.center, width, 1.0, body.depth, rotation((1, 0, 0), rng.uniform(12, 32)))
        _prop(b, rng, finish, body)
    tile(b, "body", finish.body, body, body.center, (width, 1.0, body.depth), radius, edge, 5)
    plate = (0.95 * width, 0.97, 0.3 * body.depth)
    place = body.behind(0, 0, -0.12 * body.depth)
    tile(b, "body", finish.back, body, place, plate, 0.9 * radius)
    if rng.random() < 0.3:
        _bumper(b, rng, body, radius)
    chin = rng.uniform(0.08, 0.16) if rng.random() < 0.6 else rng.uniform(0.02, 0.04)
    brow = rng.uniform(0.05, 0.14) if chin > 0.05 else rng.uniform(0.02, 0.04)
    span = (-0.5 + chin, 0.5 - brow, rng.uniform(0.86, 0.95))
    display(b, rng, finish, body, span, icons=bool(rng.random() < 0.5))
    if chin > 0.07:
        _home(b, rng, finish, body, -0.5 + chin / 2, 0.7 * chin)
    earpiece(b, rng, body, 0.5 - max(brow, 0.05) / 2)
    side_buttons(b, rng, finish, body)
    camera(b, rng, finish, body)
    return b


def _home(
    b: Builder, rng: np.random.Generator, finish: Finish, body: Body, y: float, size: float
) -> None:
    """Add a round or long button, or a row of three, below a screen."""
    kind = draw(rng, ["round", "pill", "three"])
    if kind == "round":
        tile(b, "button", finish.trim, body, body.at(0, y), (size, size, 0.016), size / 2)
        tile(b, "button", finish.body, body, body.at(0, y, 0.004), (0.8 * size, 0.8 * size, 0.014),
             0.4 * size)  # fmt: skip
        return
    tile(b, "button", finish.trim, body, body.at(0, y), (1.8 * size, 0.6 * size, 0.02), 0.3 * size)
    if kind == "three":
        for x in (-0.3, 0.3):
            small = (0.7 * size, 0.35 * size, 0.012)
            tile(b, "button", finish.keys, body, body.at(x, y), small, 0.1 * size, segments=2)


def _bumper(b: Builder, rng: np.random.Generator, body: Body, radius: float) -> None:
    """Wrap a body's edges in a soft case."""
    material = pick_material(rng, draw(rng, ["rubber", "paint", "plastic"]))
    grow = rng.uniform(0.02, 0.05)
    size = (body.width + grow, body.height + grow, 0.7 * body.depth)
    place = body.behind(0, 0, -0.3 * body.depth)
    tile(b, "body", material, body, place, size, radius + grow / 2, 0.12 * body.depth)


def _prop(b: Builder, rng: np.random.Generator, finish: Finish, body: Body) -> None:
    """Lean a tipped body on a foot: a tray with a back plate."""
    bottom = body.at(0, -0.5, -body.depth / 2)
    thickness, wide = rng.uniform(0.02, 0.05), rng.uniform(0.5, 1.1) * body.width
    hold = body.behind(0, -rng.uniform(0.05, 0.25), 0.01)
    reach = hold[2] - bottom[2] + 0.2
    tray = np.array([0, bottom[1] - 0.6 * body.depth - thickness / 2, bottom[2] + reach / 2 - 0.12])
    size = (wide, thickness, reach + 0.04)
    b.rounded_box("stand", finish.trim, tray, size, 0.05, 0.3 * thickness)
    low = np.array([0, tray[1], tray[2] + reach / 2 - 0.06])
    along = hold - low
    length = float(np.linalg.norm(along))
    turn = rotation((1, 0, 0), float(np.degrees(np.arctan2(along[2], along[1]))))
    post = (0.5 * wide, length, 0.03)
    b.rounded_box("stand", finish.trim, (hold + low) / 2, post, 0.012, turn=turn)
    lip = (0.8 * wide, 1.4 * body.depth, 0.03)
    front = np.array([0, tray[1] + 0.4 * body.depth, bottom[2] - 0.65 * body.depth])
    b.rounded_box("stand", finish.trim, front, lip, 0.012)


def _candybar(rng: np.random.Generator) -> Builder:
    """Build a bar with a small screen above a keypad, some with an aerial."""
    b = Builder()
    finish = draw_finish(rng)
    width = rng.uniform(0.34, 0.5)
    body = upright(width, 1.0, width * rng.uniform(0.24, 0.5))
    palm = rng.uniform(0.1, 0.5) if rng.random() < 0.6 else 0.0
    shell(b, rng, "body", finish.body, body, rng.uniform(-0.1, 0.14), rng.uniform(3.5, 8), palm)
    split = rng.uniform(-0.06, 0.14)
    share = rng.uniform(0.66, 0.8)
    display(b, rng, finish, body, (split + 0.04, rng.uniform(0.34, 0.4), share))
    low = -0.44
    if rng.random() < 0.7:
        navigation(b, rng, finish, body, split - 0.1, rng.uniform(0.26, 0.38))
        split -= 0.17
    rows = int(rng.integers(4, 6))
    keypad(b, rng, finish, body, (low, split - 0.02, rng.uniform(0.7, 0.82)), (rows, 3))
    earpiece(b, rng, body, 0.44)
    if rng.random() < 0.45:
        aerial(b, rng, finish, body, int(rng.choice([-1, 1])))
    side_buttons(b, rng, finish, body)
    if palm == 0.0:
        camera(b, rng, finish, body, center=True)
    return b


def _half(
    b: Builder,
    rng: np.random.Generator,
    finish: Finish,
    body: Body,
    radius: float,
) -> None:
    """Add one half of a folding or sliding telephone, its two shells of different material."""
    size = (body.width, body.height, 0.6 * body.depth)
    edge = 0.2 * body.depth
    tile(b, "body", finish.body, body, body.at(0, 0, -0.3 * body.depth), size, radius, edge)
    tile(b, "body", finish.back, body, body.at(0, 0, -0.7 * body.depth),
         (0.99 * size[0], 0.99 * size[1], size[2]), radius, edge)  # fmt: skip


def _flip(rng: np.random.Generator) -> Builder:
    """Build a clamshell, open by 105 to 178 degrees or shut, with a barrel hinge."""
    b = Builder()
    finish = draw_finish(rng)
    width, tall = rng.uniform(0.4, 0.6), rng.uniform(0.52, 0.6)
    depth, radius = rng.uniform(0.06, 0.12), width * rng.uniform(0.05, 0.3)
    opening = 0.0 if rng.random() < 0.2 else rng.uniform(105, 178)
    # The lid bends towards the viewer; the keys lean back so that the screen can be seen.
    fold = 180 - opening
    pose = rotation((1, 0, 0), fold * rng.uniform(0.5, 1.0) if opening else 0.0)
    lower = Body(pose @ np.array([0, tall / 2, 0]), width, tall, depth, pose)
    hinge = lower.at(0, 0.5)
    upper = _lid(
        hinge,
        pose @ rotation((1, 0, 0), -fold),
        width,
        tall * rng.uniform(0.9, 1.0),
        depth * rng.uniform(0.7, 1.0),
    )
    for half in (lower, upper):
        _half(b, rng, finish, half, radius)
    barrel = 0.5 * depth
    for x, part in ((-0.36, finish.body), (0.0, finish.trim), (0.36, finish.body)):
        reach = np.array([(0.2 if x == 0 else 0.1) * width, 0, 0])
        middle = hinge + (x * width, 0, 0)
        b.cylinder("body", part, middle - reach, middle + reach, barrel, segments=20)
    display(b, rng, finish, upper, (-0.28, 0.32, rng.uniform(0.68, 0.82)), rng.random() < 0.3)
    earpiece(b, rng, upper, 0.4)
    navigation(b, rng, finish, lower, 0.26, rng.uniform(0.24, 0.34))
    keypad(b, rng, finish, lower, (-0.44, 0.08, rng.uniform(0.74, 0.84)), (4, 3))
    outer = (0.5 * width, rng.uniform(0.15, 0.35) * tall, 0.014)
    if rng.random() < 0.7:
        spot = upper.behind(0, rng.uniform(-0.1, 0.2))
        tile(b, "screen", finish.screen, upper, spot, outer, 0.1 * width)
    if rng.random() < 0.4:
        aerial(b, rng, finish, lower, int(rng.choice([-1, 1])))
    side_buttons(b, rng, finish, lower)
    return b


def _lid(hinge: Array, tip: Array, width: float, height: float, depth: float) -> Body:
    """Return the lid of a clamshell: it ends at the hinge, tipped by `tip` from upright."""
    return Body(hinge + tip @ np.array([0, height / 2, depth / 2]), width, height, depth, tip)


def _slider(rng: np.random.Generator) -> Builder:
    """Build a telephone whose screen half has slid up, or aside, from its keys."""
    b = Builder()
    finish = draw_finish(rng)
    aside = rng.random() < 0.4
    width = rng.uniform(0.44, 0.56)
    tall, depth = rng.uniform(0.82, 0.95), rng.uniform(0.05, 0.09)
    radius, slide = width * rng.uniform(0.04, 0.2), rng.uniform(0.3, 0.42)
    lower = upright(width, tall, depth)
    shift = np.array([slide * 1.2 * width, 0, 0]) if aside else np.array([0, slide * tall, 0])
    upper = Body(lower.center + shift - (0, 0, 0.98 * depth), width, tall, depth, np.eye(3))
    for half in (lower, upper):
        _half(b, rng, finish, half, radius)
    low, share = (-0.4, rng.uniform(0.82, 0.92))
    display(b, rng, finish, upper, (low + 0.14, 0.4, share - 0.05), bool(rng.random() < 0.5))
    if rng.random() < 0.6:
        navigation(b, rng, finish, upper, low + 0.03, 0.24)
    else:
        _home(b, rng, finish, upper, low, 0.09)
    earpiece(b, rng, upper, 0.45)
    if aside:
        _side_keys(b, rng, finish, lower, 1.2 * slide)
    else:
        keypad(b, rng, finish, lower, (-0.46, slide - 0.53, 0.82), (4, 3))
    side_buttons(b, rng, finish, lower)
    camera(b, rng, finish, lower)
    return b


def _side_keys(
    b: Builder, rng: np.random.Generator, finish: Finish, body: Body, share: float
) -> None:
    """Fill the strip `share` of the width that a lid slid aside leaves free with small keys."""
    strip = Body(body.at(-0.5 + share / 2, 0, -body.depth / 2), share * body.width, body.height,
                 body.depth, body.turn)  # fmt: skip
    keypad(b, rng, finish, strip, (-0.44, 0.44, 0.84), (int(rng.integers(9, 12)), 4))


def _keyboard(rng: np.random.Generator) -> Builder:
    """Build a wide telephone with a full keyboard below its screen."""
    b = Builder()
    finish = draw_finish(rng)
    width, height = rng.uniform(0.55, 0.85), rng.uniform(0.9, 1.05)
    body = upright(width, height, width * rng.uniform(0.12, 0.22))
    rounded = bool(rng.random() < 0.5)
    if rounded:
        shell(b, rng, "body", finish.body, body, rng.uniform(-0.05, 0.06), rng.uniform(5, 9))
    else:
        _half(b, rng, finish, body, width * rng.uniform(0.06, 0.22))
    rows = int(rng.integers(3, 5))
    split = -0.45 + 0.095 * rows + rng.uniform(0.0, 0.04)
    keypad(b, rng, finish, body, (-0.45, split, 0.86), (rows, int(rng.integers(7, 11))))
    navigation(b, rng, finish, body, split + 0.075, rng.uniform(0.16, 0.22))
    display(b, rng, finish, body, (split + 0.16, 0.39, rng.uniform(0.76, 0.86)), rng.random() < 0.5)
    earpiece(b, rng, body, 0.445)
    side_buttons(b, rng, finish, body)
    camera(b, rng, finish, body, center=rounded)
    return b


def _brick(rng: np.random.Generator) -> Builder:
    """Build an early, thick handset: a row of keys, a tiny screen, an aerial, some with a flap."""
    b = Builder()
    finish = draw_finish(rng)
    width = rng.uniform(0.3, 0.42)
    body = upright(width, 1.0, width * rng.uniform(0.6, 1.1))
    squareness = rng.uniform(5, 9)
    shell(b, rng, "body", finish.body, body, rng.uniform(-0.04, 0.1), squareness)
    pack = upright(0.92 * width, rng.uniform(0.5, 0.85), 0.4 * body.depth)
    back = body.behind(0, 0, 0.05 * body.depth) * (1, 0, 1) + pack.center * (0, 1, 0) + (0, 0.04, 0)
    tile(b, "body", finish.back, pack, back, (pack.width, pack.height, pack.depth), 0.06, 0.03)
    top = rng.uniform(0.0, 0.12)
    rows = int(rng.integers(4, 7))
    display(b, rng, finish, body, (top + 0.03, top + rng.uniform(0.1, 0.2), 0.72))
    keypad(b, rng, finish, body, (-0.36, top - 0.02, 0.76), (rows, 3))
    earpiece(b, rng, body, 0.4)
    earpiece(b, rng, body, -0.43)
    aerial(b, rng, finish, body, int(rng.choice([-1, 1])))
    side_buttons(b, rng, finish, body)
    if rng.random() < 0.35:
        _flap(b, rng, finish, body)
    return b


def _flap(b: Builder, rng: np.random.Generator, finish: Finish, body: Body) -> None:
    """Hang a mouthpiece flap, turned forward and down, from the lower edge of a body."""
    tall, deep = rng.uniform(0.22, 0.34), 0.035
    hinge = body.at(0, -0.44)
    tip = rotation((1, 0, 0), rng.uniform(200, 240))
    flap = _lid(hinge, tip, 0.86 * body.width, tall, deep)
    tile(b, "body", finish.back, flap, flap.center, (flap.width, tall, deep), 0.05, 0.012)
    reach = np.array([0.36 * body.width, 0, 0])
    b.cylinder("body", finish.trim, hinge - reach, hinge + reach, 0.03)
    earpiece(b, rng, flap, 0.3)


def _docked(rng: np.random.Generator) -> Builder:
    """Build a slender cordless handset, tipped back in its charging cradle."""
    b = Builder()
    finish = draw_finish(rng)
    width = rng.uniform(0.26, 0.38)
    body = upright(width, 1.0, width * rng.uniform(0.35, 0.6))
    tip = rotation((1, 0, 0), rng.uniform(5, 25))
    body = Body(tip @ np.array([0, 0.55, 0]), width, 1.0, body.depth, tip)
    shell(b, rng, "body", finish.body, body, rng.uniform(-0.1, 0.15), rng.uniform(3, 6), 0.3)
    split = rng.uniform(0.02, 0.12)
    display(b, rng, finish, body, (split, split + rng.uniform(0.14, 0.24), 0.72))
    navigation(b, rng, finish, body, split - 0.07, 0.3)
    keypad(b, rng, finish, body, (-0.3, split - 0.14, 0.74), (int(rng.integers(4, 6)), 3))
    earpiece(b, rng, body, 0.42)
    if rng.random() < 0.5:
        aerial(b, rng, finish, body, int(rng.choice([-1, 1])))
    reach, rise = width * rng.uniform(0.75, 1.2), rng.uniform(0.1, 0.24)
    rim = max(0.62 * width, 0.8 * body.depth)
    rows = [(reach, 0), (reach, 0.03), (0.5 * (reach + rim), 0.55 * rise), (rim, rise)]
    rows += [(0.9 * rim, 0.98 * rise), (0.85 * rim, 0.4 * rise)]
    center = (0, 0, 0.1 * body.depth)
    squash = rng.uniform(0.75, 1.0)
    if rng.random() < 0.5:
        b.lathe("stand", finish.back, rows, center, 36, squash=squash)
    else:
        turn = rotation((0, 1, 0), 45)
        b.lathe("stand", finish.back, np.array(rows) * (1.25, 1), center, 4, turn)
    return b


FAMILIES: dict[str, Family] = {
    "smartphone": _smartphone,
    "candybar": _candybar,
    "flip": _flip,
    "slider": _slider,
    "keyboard": _keyboard,
    "brick": _brick,
    "docked": _docked,
}
