"""The forms of telephones, in one piece, hinged or sliding, and their housings."""

import numpy as np

from ffd_lightning.shapes.cellphone.plan import Body, Finish, Plan, tile
from ffd_lightning.shapes.kit import Builder, Component, Rng
from ffd_lightning.shapes.kit.vectors import UP, Pair, about_y, about_z, lean, vec


def whole(b: Builder, rng: Rng, f: Finish, width: Pair, depth: Pair, tip: Pair = (0, 0)) -> Plan:
    """Return a body in one piece, tipped back; `depth` is over its width."""
    wide, turn = rng.uniform(*width), lean(rng.uniform(*tip))
    body = Body(turn @ vec(0, 0.55, 0), wide, 1.0, wide * rng.uniform(*depth), turn)
    return Plan(body, None, body, wide * rng.uniform(0.03, 0.28), f)


def clamshell(b: Builder, rng: Rng, f: Finish, width: Pair, tall: Pair, shut: float) -> Plan:
    """Return two bodies on a barrel hinge, open by 100 to 178 degrees or shut."""
    wide, high, depth = rng.uniform(*width), rng.uniform(*tall), rng.uniform(0.05, 0.14)
    fold = 180.0 if rng.random() < shut else 180 - rng.uniform(100, 178)
    # The lid bends towards the viewer; the keys lean back so that the screen can be seen.
    pose = lean(0.0 if fold == 180 else fold * rng.uniform(0.5, 1.0))
    main = Body(pose @ vec(0, high / 2, 0), wide, high, depth, pose)
    tip, hinge = pose @ lean(-fold), main.at(0, 0.5)
    rise, deep = high * rng.uniform(0.85, 1.0), depth * rng.uniform(0.7, 1.0)
    lid = Body(hinge + tip @ vec(0, rise / 2, deep / 2), wide, rise, deep, tip)
    for x, material in ((-0.36, f.body), (0.0, f.trim), (0.36, f.body)):
        reach, middle = vec((0.2 if x == 0 else 0.1) * wide, 0, 0), hinge + vec(x * wide, 0, 0)
        b.cylinder("body", material, middle - reach, middle + reach, 0.5 * depth)
    return Plan(main, lid, main.strip(0, -0.48, 0.42), wide * rng.uniform(0.05, 0.3), f)


def slider(b: Builder, rng: Rng, f: Finish, way: str) -> Plan:
    """Return two bodies, the upper one slid up, slid aside, or swivelled across."""
    wide, tall, depth = rng.uniform(0.4, 0.62), rng.uniform(0.8, 0.95), rng.uniform(0.045, 0.12)
    slide, turn = rng.uniform(0.3, 0.46), about_z(90 if way == "swivel" else 0)
    main = Body(vec(0, tall / 2, 0), wide, tall, depth, np.eye(3))
    if way == "aside":
        shift = vec(1.2 * slide * wide, 0, 0)
        keys = main.strip(0.6 * slide - 0.5, -0.48, 0.48, 1.2 * slide)
    elif way == "up":
        shift, keys = vec(0, slide * tall, 0), main.strip(0, -0.48, slide - 0.52)
    else:
        shift = vec(0, tall / 2 - 0.3 * wide, 0)
        keys = main.strip(0, -0.48, 0.46 - 0.8 * wide / tall)
    lid = Body(main.center + shift - vec(0, 0, 0.98 * depth), wide, tall, depth, turn)
    return Plan(main, lid, keys, wide * rng.uniform(0.04, 0.25), f)


def book(b: Builder, rng: Rng, f: Finish) -> Plan:
    """Return two bodies on an upright hinge, open like a book."""
    wide, tall, depth = rng.uniform(0.36, 0.62), rng.uniform(0.8, 1.0), rng.uniform(0.035, 0.09)
    half = rng.uniform(0, 40)
    main, lid = (
        Body(turn @ vec(side * wide / 2, tall / 2, depth / 2), wide, tall, depth, turn)
        for side, turn in ((-1, about_y(-half)), (1, about_y(half)))
    )
    start, end = vec(0, 0.02 * tall, depth / 2), vec(0, 0.98 * tall, depth / 2)
    b.cylinder("body", f.trim, start, end, 0.5 * depth)
    return Plan(main, lid, main, wide * rng.uniform(0.04, 0.14), f)


def plate(b: Builder, rng: Rng, p: Plan) -> None:
    """Add each body as one plate, mostly with a back of its own set in."""
    edge, inlaid = rng.uniform(0.1, 0.45), rng.random() < 0.6
    for body in (p.main,) if p.lid is None else (p.main, p.lid):
        size, rim = (body.width, body.height, body.depth), min(edge * body.depth, 0.06 * body.width)
        tile(b, "body", p.finish.body, body, body.center, size, p.radius, rim, segments=5)
        if inlaid:
            inset = (0.9 * body.width, 0.94 * body.height, 0.3 * body.depth)
            rear = body.behind(0, 0, -0.14 * body.depth)
            tile(b, "body", p.finish.back, body, rear, inset, 0.9 * p.radius)


def halves(b: Builder, rng: Rng, p: Plan) -> None:
    """Add each body as two shells of different material, front and back."""
    for body in (p.main,) if p.lid is None else (p.main, p.lid):
        edge = min(0.2 * body.depth, 0.06 * body.width)
        for material, share, place in ((p.finish.body, 1.0, -0.3), (p.finish.back, 0.99, -0.7)):
            size = (share * body.width, share * body.height, 0.6 * body.depth)
            tile(b, "body", material, body, body.at(0, 0, place * body.depth), size, p.radius, edge)


def shell(b: Builder, rng: Rng, p: Plan, palm: bool) -> None:
    """Add a rounded housing, narrower or wider in the middle; its back may fill the palm."""
    body, waist, squareness = p.main, rng.uniform(-0.12, 0.14), rng.uniform(3.5, 9)
    bulge = rng.uniform(0.15, 0.55) if palm else 0.0
    a = 2 * np.pi * np.arange(28) / 28
    section = np.stack([np.cos(a), np.zeros(28), np.sin(a)], 1)
    section = np.sign(section) * np.abs(section) ** (2 / squareness)
    tilt = rng.uniform(-0.1, 0.1)
    ends = np.array([0.0, 0.015, 0.05, 0.12])
    t = np.concatenate([ends, np.linspace(0.2, 0.8, 7), 1 - ends[::-1]])
    nose = rng.uniform(0.5, 0.85)  # how blunt the ends are
    blunt = np.minimum(1.0, nose + (1 - nose) * np.sqrt(np.minimum(t, 1 - t) / 0.12))
    wide = blunt * (1 - waist * np.sin(np.pi * t) ** 2 + tilt * (t - 0.5))
    deep = np.minimum(1.0, 0.6 + 0.4 * np.sqrt(np.minimum(t, 1 - t) / 0.05))
    rings = []
    for level, w, d in zip(t, wide, deep, strict=True):
        ring = section * vec(w * body.width / 2, 1, d * body.depth / 2)
        ring[ring[:, 2] > 0, 2] *= 1 + bulge * np.sin(np.pi * level)
        rings.append((ring + (level - 0.5) * body.height * UP) @ body.turn.T + body.center)
    b.loft("body", p.finish.body, rings)


FORMS = (
    Component.of("slab", 7, whole, width=(0.42, 0.9), depth=(0.08, 0.22)),
    Component.of("bar", 2.5, whole, width=(0.28, 0.56), depth=(0.24, 0.6)),
    Component.of("brick", 2, whole, width=(0.26, 0.48), depth=(0.6, 1.2)),
    Component.of("clamshell", 3, clamshell, width=(0.38, 0.66), tall=(0.48, 0.64), shut=0.2),
    Component.of("organiser", 1, clamshell, width=(0.9, 1.3), tall=(0.44, 0.6), shut=0.1),
    Component.of("up", 1.5, slider, way="up"),
    Component.of("aside", 1.2, slider, way="aside"),
    Component.of("swivel", 0.7, slider, way="swivel"),
    Component("book", 1, book),
)
HOUSINGS = (
    Component("plate", 3, plate),
    Component("halves", 2, halves),
    Component.of("shell", 3, shell, {"form": ("slab", "bar", "brick")}, palm=False),
    Component.of("palm", 1.5, shell, {"form": ("bar", "brick")}, palm=True),
)
