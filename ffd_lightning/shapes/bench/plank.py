"""Benches of boards without a back: planks on legs, and picnic tables between two benches."""

from __future__ import annotations

from ffd_lightning.shapes.bench.boards import add_boards, draw_bench_size
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, rails
from ffd_lightning.shapes.kit.legs import add_leg, add_legs, draw_leg_style, square_post
from ffd_lightning.shapes.kit.paths import bend, corners
from ffd_lightning.shapes.kit.vectors import vec


def plank(rng: Rng) -> Builder:
    """Build a backless bench: boards on legs, slab ends, crossed legs or trestles."""
    b = Builder()
    length, depth, height = draw_bench_size(rng)
    depth *= 0.85
    top = pick_material(rng, draw(rng, ["wood", "paint", "plastic"], [0.75, 0.15, 0.1]))
    base = top if rng.random() < 0.5 else pick_material(rng, draw(rng, ["metal", "wood"]))
    under = add_boards(b, rng, top, (length, depth, height), int(rng.integers(1, 6))) + 0.002
    reach, half = length / 2 * rng.uniform(0.72, 0.92), 0.42 * depth
    kind = draw(rng, ["legs", "slabs", "cross", "loops"])
    if kind == "legs":
        style = draw_leg_style(rng, (0.035, 0.07), hairpin=0.2)
        out = rng.uniform(1.0, 1.08)
        tops = corners(2 * reach, 1.8 * half, under)
        feet = tops * vec(out, 0, out)
        add_legs(b, "leg", base, style, tops, feet)
        if style.plain:
            rails(b, "leg", base, feet + 0.9 * (tops - feet), width=0.02, height=0.07)
            if rng.random() < 0.4:
                level = rng.uniform(0.25, 0.45) * height
                shelf = (2 * reach, depth, level)
                add_boards(b, rng, base, shelf, int(rng.integers(3, 6)))
        return b
    thick = rng.uniform(0.03, 0.06)
    for x in (-reach, reach):
        _plank_end(b, base, kind, x, half, under, thick)
    if kind != "loops" or rng.random() < 0.5:
        y = height * (0.5 if kind == "cross" else rng.uniform(0.3, 0.9))
        start = (-reach, y, 0)
        beam(b, "leg", base, start, (reach, y, 0), width=0.03, height=rng.uniform(0.03, 0.08))
    return b


def _plank_end(
    b: Builder, base: Material, kind: str, x: float, half: float, top: float, thick: float
) -> None:
    """Carry a plank at `x` by a slab, a cross or a loop that reaches +-`half` along z."""
    if kind == "slabs":
        b.rounded_box("leg", base, (x, top / 2, 0), (thick, top, 1.9 * half), 0.01, segments=4)
    elif kind == "cross":
        post = square_post(thick)
        for sign in (-1, 1):
            high, low = (x, top, -sign * half), (x, 0, sign * half)
            add_leg(b, "leg", base, post, high, low, (0.7 + 0.2 * sign, 1.5))
    else:
        path = [(x, top, -half), (x, 0.014, -half), (x, 0.014, half), (x, top, half)]
        b.tube("leg", base, bend(path, 0.04), 0.014, segments=10)
        beam(b, "leg", base, (x, top - 0.01, -half), (x, top - 0.01, half), width=0.03, height=0.02)


def picnic(rng: Rng) -> Builder:
    """Build a table and two benches on common A-frames."""
    b = Builder()
    wood = pick_material(rng, draw(rng, ["wood", "paint"], [0.8, 0.2]))
    base = wood if rng.random() < 0.6 else pick_material(rng, "metal")
    length, height, seat = rng.uniform(1.2, 2.2), rng.uniform(0.7, 0.78), rng.uniform(0.42, 0.47)
    depth, out = rng.uniform(0.6, 0.85), rng.uniform(0.58, 0.72)
    table = (length, depth, height)
    under = add_boards(b, rng, wood, table, int(rng.integers(4, 7)), part="table")
    wide = rng.uniform(0.22, 0.32)
    stretch, boards = length * rng.uniform(0.9, 1.0), int(rng.integers(1, 4))
    for z in (-out, out):
        low = add_boards(b, rng, wood, (stretch, wide, seat), boards, z)
    post = square_post(rng.uniform(0.045, 0.07))
    reach = length * rng.uniform(0.3, 0.38)
    for x in (-reach, reach):
        for sign in (-1, 1):
            foot = (x, 0, sign * out * 0.95)
            add_leg(b, "leg", base, post, (x, under, sign * 0.3 * depth), foot, (0.7, 1.4))
        tip = out + 0.45 * wide
        beam(b, "leg", base, (x, low - 0.04, -tip), (x, low - 0.04, tip), width=0.045, height=0.08)
        ends = (x, under - 0.03, -0.45 * depth), (x, under - 0.03, 0.45 * depth)
        beam(b, "leg", base, *ends, width=0.045, height=0.06)
        end = (0.25 * x, under - 0.01, 0)
        beam(b, "leg", base, (x, low - 0.04, 0), end, width=0.04, height=0.06)
    return b
