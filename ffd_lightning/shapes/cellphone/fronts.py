"""What is set into a telephone's front: screens, keys, slots to listen to."""

import numpy as np

from ffd_lightning.shapes.cellphone.plan import Body, Plan, tile
from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.vectors import Pair, lean


def display(
    b: Builder, rng: Rng, p: Plan, body: Body, ends: Pair, share: float, icons: bool
) -> None:
    """Add a screen with a rim, `share` of the body's width, perhaps with rows of `icons`.

    It reaches from the first of `ends` to the second, from -0.5 to 0.5 of the body's height.
    """
    low, high = ends
    wide, tall, middle = share * body.width, (high - low) * body.height, (low + high) / 2
    radius = rng.choice([0.02, 0.08]) * wide
    lift = 0.006
    if rng.random() < 0.5:
        rim = (wide + 0.03 * body.width, tall + 0.03 * body.width, 0.02)
        tile(b, "body", p.finish.trim, body, body.at(0, middle, lift / 2 - 0.008), rim, radius)
    center = body.at(0, middle, lift - 0.008)
    tile(b, "screen", p.finish.screen, body, center, (wide, tall, 0.02), radius, edge=0.003)
    if not icons:
        return
    columns = int(rng.integers(3, 6))
    cell = wide / columns
    rows, size = max(1, int(0.9 * tall / cell)), (0.62 * cell, 0.62 * cell, 0.008)
    paints = [pick_material(rng, "paint") for _ in range(4)]
    for row, column in np.ndindex(rows, columns):
        if 1 < row < rows - 1 and rng.random() < 0.4:
            continue
        x = (column + 0.5 - columns / 2) * cell / body.width
        y = low + 0.05 * tall / body.height + (row + 0.5) * cell / body.height
        paint = paints[int(rng.integers(4))]
        b.box("screen", paint, body.at(x, y, lift + 0.002), size, turn=body.turn)


def keypad(b: Builder, rng: Rng, p: Plan, body: Body, high: float, rows: int, columns: int) -> None:
    """Add a grid of keys, all of one shape, from the lower edge up to `high`, at most 0.5."""
    wide, tall = 0.84 * body.width / columns, (high + 0.48) * body.height / rows
    shape = draw(rng, ["round", "pill", "square", "flush"]) if rows * columns < 20 else "square"
    fill = rng.uniform(0.7, 0.9) if shape != "flush" else 0.94
    bend = rng.uniform(0.0, 0.25) if columns == 3 else 0.0  # the outer keys sit higher
    height, steps = rng.uniform(0.01, 0.03), 2 if rows * columns < 13 else 1
    last = pick_material(rng, "paint") if rng.random() < 0.3 else p.finish.keys
    size, taper = (fill * wide, fill * tall), 0.85 if shape == "square" else 0.97
    for row, column in np.ndindex(rows, columns):
        offset = column + 0.5 - columns / 2
        y = high + (-(row + 0.5) * tall + bend * tall * (abs(offset) - 0.5)) / body.height
        material = last if row == 0 else p.finish.keys
        place = body.at(offset * 0.84 / columns, y, 0.2 * height)
        if shape in ("square", "flush"):
            lying, turn = (size[0], height, size[1]), body.turn @ lean(-90)
            b.box("key", material, place, lying, turn=turn, taper=taper)
        else:
            flat = (min(size), min(size), height) if shape == "round" else (*size, height)
            tile(b, "key", material, body, place, flat, 0.49 * min(size), segments=steps)


_PADS = {  # width, height and radius of what carries the navigation keys
    "ring": (1, 1, 0.5), "square": (1, 1, 0.2), "ball": (0.6, 0.6, 0.3), "pill": (1, 0.5, 0.2),
}  # fmt: skip


def navigation(b: Builder, rng: Rng, p: Plan, body: Body, y: float, size: float) -> None:
    """Add a ring, a cross, a ball or a pill between two pairs of soft keys at height `y`."""
    kind, reach = draw(rng, list(_PADS)), size * body.width
    wide, tall, radius = np.array(_PADS[kind]) * reach
    tile(b, "key", p.finish.trim, body, body.at(0, y, 0.004), (wide, tall, 0.02), radius)
    if kind == "ball":
        ball, turn = [(0.2, 0.0), (0.2, 0.05), (0.15, 0.12), (0.07, 0.16)], body.turn @ lean(-90)
        place, profile = body.at(0, y, 0.008), np.array(ball) * reach
        b.lathe("key", p.finish.keys, profile, place, segments=16, turn=turn)
    else:
        place = body.at(0, y, 0.012 if kind == "ring" else 0.01)
        tile(b, "key", p.finish.keys, body, place, (wide / 2, tall / 2, 0.02), radius / 2)
    plain, soft = rng.random() < 0.5, (0.16 * body.width, 0.3 * reach, 0.016)
    for side, paint in ((-1, Material((0.1, 0.6, 0.2))), (1, Material((0.8, 0.12, 0.1)))):
        for dy in (-0.22, 0.22):
            place = body.at(side * (0.5 * size + 0.12), y + dy * reach / body.height, 0.002)
            material = p.finish.keys if plain or dy > 0 else paint
            tile(b, "key", material, body, place, soft, 0.12 * reach, segments=2)


def earpiece(b: Builder, rng: Rng, body: Body, y: float) -> None:
    """Add the slots that one listens to, at height `y`."""
    count = int(rng.integers(1, 4))
    for i in range(count):
        size = (rng.uniform(0.12, 0.3) * body.width, 0.012, 0.012)
        place = body.at(0, y + 0.025 * (i - (count - 1) / 2) / body.height)
        b.box("speaker", Material((0.05, 0.05, 0.05)), place, size, turn=body.turn)


def home_button(b: Builder, rng: Rng, p: Plan, chin: float) -> None:
    """Add a round or long button, or a row of three, in the `chin` below a screen."""
    kind, body, y, size = draw(rng, ["round", "pill", "three"]), p.main, -0.5 + chin / 2, 0.7 * chin
    if kind == "round":
        tile(b, "button", p.finish.trim, body, body.at(0, y), (size, size, 0.016), size / 2)
        inner = (0.8 * size, 0.8 * size, 0.014)
        tile(b, "button", p.finish.body, body, body.at(0, y, 0.004), inner, 0.4 * size)
        return
    long, small = (1.8 * size, 0.6 * size, 0.02), (0.7 * size, 0.35 * size, 0.012)
    tile(b, "button", p.finish.trim, body, body.at(0, y), long, 0.3 * size)
    for x in (-0.3, 0.3) if kind == "three" else ():
        tile(b, "button", p.finish.keys, body, body.at(x, y), small, 0.1 * size, segments=2)


def touch(b: Builder, rng: Rng, p: Plan) -> None:
    """Cover each body's front with a screen, some with a button below it."""
    chin = rng.uniform(0.08, 0.16) if rng.random() < 0.6 else rng.uniform(0.03, 0.06)
    brow = rng.uniform(0.06, 0.14) if chin > 0.07 else rng.uniform(0.05, 0.06)
    share, icons = rng.uniform(0.82, 0.9), bool(rng.random() < 0.5)
    for body in (p.main,) if p.lid is None else (p.main, p.lid):
        display(b, rng, p, body, (chin - 0.5, 0.5 - brow), share, icons)
    if chin > 0.07:
        home_button(b, rng, p, chin)
    earpiece(b, rng, p.main, 0.5 - brow / 2)


def keyed(b: Builder, rng: Rng, p: Plan, full: bool) -> None:
    """Add a screen and a keypad or a `full` keyboard, often with navigation keys between."""
    keys, rows = p.keys, int(rng.integers(3, 5) if full else rng.integers(4, 6))
    share, icons = rng.uniform(0.7, 0.84), bool(rng.random() < 0.4)
    nav = rng.random() < 0.7
    size = rng.uniform(0.16, 0.22) if full else rng.uniform(0.24, 0.34)
    if p.lid is None:
        split = -0.45 + 0.095 * rows if full else rng.uniform(-0.12, 0.1)
        gap = 0.6 * size * p.main.width if nav else 0.0
        if nav:
            navigation(b, rng, p, p.main, split + gap, size)
        low = split + 2 * gap + 0.03
        high = rng.uniform(0.34, 0.39) if full else min(low + rng.uniform(0.12, 0.4), 0.38)
        display(b, rng, p, p.main, (low, high), share, icons)
        keys = p.main.strip(0, -0.45, split)
        earpiece(b, rng, p.main, 0.43)
    else:
        display(b, rng, p, p.lid, (-0.34, 0.36), share, icons)
        earpiece(b, rng, p.lid, 0.43)
    pad_high = 0.5
    if p.lid is not None and nav and keys.height > 0.75 * keys.width:
        pad_high = 0.46 - 1.1 * size * keys.width / keys.height
        navigation(b, rng, p, keys, 0.5 - 0.6 * size * keys.width / keys.height, size)
    columns = int(rng.integers(7, 11)) if full else 3
    if full and keys.height > 1.3 * keys.width:
        rows, columns, pad_high = int(rng.integers(9, 12)), 4, 0.5
    keypad(b, rng, p, keys, pad_high, rows, columns)


_KEYED = {"form": ("bar", "brick", "clamshell", "up", "swivel")}
_TYPED = {"form": ("slab", "organiser", "up", "aside")}
FRONTS = (
    Component("touch", 8, touch, {"form": ("slab", "book"), "housing": ("plate", "halves")}),
    Component.of("keypad", 2, keyed, _KEYED, full=False),
    Component.of("keyboard", 1, keyed, _TYPED, full=True),
)
