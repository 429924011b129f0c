"""What a telephone has besides its front: buttons, aerials, lenses, packs, what holds it."""

import numpy as np

from ffd_lightning.shapes.cellphone.fronts import earpiece
from ffd_lightning.shapes.cellphone.plan import Body, Plan, tile
from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, draw, nothing, pick_material
from ffd_lightning.shapes.kit.vectors import about_y, lean, vec


def side_buttons(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one to four buttons on the narrow sides, and sometimes one on top."""
    body, spots = p.main, []
    for i in range(int(rng.integers(1, 5))):
        x, y = 0.5 - 0.024 / body.width, 0.32 - 0.14 * (i // 2) - 0.06 * i
        spots.append((-x if i % 2 else x, y, 0.068, rng.uniform(0.05, 0.12) * body.height))
    if rng.random() < 0.4:
        spots.append((rng.uniform(-0.3, 0.3), 0.5, 0.14 * body.width, 0.02))
    for x, y, wide, tall in spots:
        place, size = body.at(x, y, -body.depth / 2), (wide, tall, min(0.35 * body.depth, 0.05))
        b.rounded_box("button", p.finish.trim, place, size, 0.006, turn=body.turn, segments=1)


def lenses(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one to four lenses on the back, on a plate or bare, in a corner or in the middle."""
    body, center = p.main, rng.random() < 0.4
    spots = np.array([(0, 0), (0, 1), (1, 0), (1, 1)][: int(rng.integers(1, 5))])
    radius, face = rng.uniform(0.05, 0.11) * body.width, np.array([body.width, body.height])
    pitch = 2.4 * radius
    wide, tall = sizes = (spots.max(0) + 1) * pitch + 0.3 * radius
    low = np.array([-wide / 2 if center else 0.36 * body.width - wide, 0.38 * body.height - tall])
    raised = rng.uniform(0.005, 0.02)
    if len(spots) > 1 or rng.random() < 0.5:
        x, y = (low + sizes / 2) / face
        place, plate = body.behind(x, y, raised / 2 - 0.006), (wide, tall, 0.012 + raised)
        tile(b, "camera", p.finish.trim, body, place, plate, 0.3 * min(sizes))
    for x, y in (low + 0.15 * radius + (spots + 0.5) * pitch) / face:
        start, end, tip = (body.behind(x, y, z) for z in (-0.005, raised + 0.012, raised + 0.016))
        b.cylinder("camera", p.finish.body, start, end, radius, segments=18)
        glass, back = Material((0.05, 0.05, 0.08)), end - 0.2 * (end - start)
        b.cylinder("camera", glass, back, tip, 0.75 * radius, segments=18)


def pack(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a thick battery on the back."""
    body = p.main.strip(0, rng.uniform(-0.45, -0.3), rng.uniform(0.1, 0.42), rng.uniform(0.8, 0.92))
    deep = rng.uniform(0.25, 0.6) * body.depth
    place = body.behind(0, 0, 0.5 * deep - 0.15 * body.depth)
    tile(b, "body", p.finish.back, body, place, (body.width, body.height, deep), 0.06, edge=0.03)


def aerial(b: Builder, rng: Rng, p: Plan, rod: bool) -> None:
    """Add a stub, with or without a long `rod`, at an upper corner."""
    finish, body, side = p.finish, p.main, int(rng.choice([-1, 1]))
    radius = min(rng.uniform(0.14, 0.3) * body.depth, 0.16 * body.width)
    start = body.at(side * (0.5 - 1.7 * radius / body.width), 0.44, -body.depth / 2)
    along = body.turn @ vec(0, 1, 0)
    rise = rng.uniform(0.08, 0.28) * body.height + 0.06 * body.height
    path, radii = start + np.outer((0, rise, 1.03 * rise), along), radius * np.array([1, 0.85, 0.5])
    b.tube("antenna", finish.keys, path, list(radii), segments=14)
    if rod:
        reach = rise + rng.uniform(0.1, 0.6) * body.height
        one, other = start + rise * along, start + reach * along
        b.cylinder("antenna", finish.trim, one, other, 0.3 * radius, segments=10)
        knob = np.outer((reach, reach + 0.02, reach + 0.04), along) + start
        radii = radius * np.array([0.5, 0.55, 0.4])
        b.tube("antenna", finish.keys, knob, list(radii), segments=10)


def prop(b: Builder, rng: Rng, p: Plan) -> None:
    """Lean a tipped body on a foot: a tray with a back plate."""
    finish, body = p.finish, p.main
    bottom = body.at(0, -0.5, -body.depth / 2)
    thickness, wide = rng.uniform(0.02, 0.05), rng.uniform(0.5, 1.1) * body.width
    hold = body.behind(0, -rng.uniform(0.05, 0.25), 0.01)
    reach = hold[2] - bottom[2] + 0.2
    tray = vec(0, bottom[1] - 0.6 * body.depth - thickness / 2, bottom[2] + reach / 2 - 0.12)
    size = (wide, thickness, reach + 0.04)
    b.rounded_box("stand", finish.trim, tray, size, radius=0.05, edge=0.3 * thickness)
    low = vec(0, tray[1], tray[2] + reach / 2 - 0.06)
    along = hold - low
    turn = lean(np.degrees(np.arctan2(along[2], along[1])))
    post = (0.5 * wide, float(np.linalg.norm(along)), 0.03)
    b.rounded_box("stand", finish.trim, (hold + low) / 2, post, 0.012, turn=turn)
    lip = vec(0, tray[1] + 0.4 * body.depth, bottom[2] - 0.65 * body.depth)
    b.rounded_box("stand", finish.trim, lip, (0.8 * wide, 1.4 * body.depth, 0.03), 0.012)


def bumper(b: Builder, rng: Rng, p: Plan) -> None:
    """Wrap a body's edges in a soft case."""
    body = p.main
    material = pick_material(rng, draw(rng, ["rubber", "paint", "plastic"]))
    grow = rng.uniform(0.02, 0.05)
    size = (body.width + grow, body.height + grow, 0.7 * body.depth)
    place = body.behind(0, 0, -0.3 * body.depth)
    tile(b, "body", material, body, place, size, p.radius + grow / 2, edge=0.12 * body.depth)


def flap(b: Builder, rng: Rng, p: Plan) -> None:
    """Hang a mouthpiece flap, turned forward and down, from the lower edge of a body."""
    finish, body = p.finish, p.main
    tall, deep = rng.uniform(0.22, 0.34), 0.035
    hinge = body.at(0, -0.44)
    tip = lean(rng.uniform(200, 240))
    leaf = Body(hinge + tip @ vec(0, tall / 2, deep / 2), 0.86 * body.width, tall, deep, tip)
    tile(b, "body", finish.back, leaf, leaf.center, (leaf.width, tall, deep), 0.05, edge=0.012)
    reach = vec(0.36 * body.width, 0, 0)
    b.cylinder("body", finish.trim, hinge - reach, hinge + reach, 0.03)
    earpiece(b, rng, leaf, 0.3)


def cradle(b: Builder, rng: Rng, p: Plan) -> None:
    """Stand a body in a charging cradle, round or square."""
    body, material = p.main, p.finish.back
    rim = max(0.62 * body.width, 0.8 * body.depth)
    reach, rise = max(body.width * rng.uniform(0.75, 1.3), 1.1 * rim), rng.uniform(0.1, 0.24)
    profile = [(reach, 0), (reach, 0.03), (0.5 * (reach + rim), 0.55 * rise), (rim, rise)]
    profile += [(0.9 * rim, 0.98 * rise), (0.85 * rim, 0.4 * rise)]
    center = (0, 0, 0.1 * body.depth)
    if rng.random() < 0.5:
        b.lathe("stand", material, profile, center, segments=36, squash=rng.uniform(0.75, 1.0))
    else:
        wide = np.array(profile) * (1.25, 1)
        b.lathe("stand", material, wide, center, segments=4, turn=about_y(45))


_FLAT = ("plate", "halves")
AERIALS = (
    Component("none", 3, nothing),
    Component.of("stub", 1.2, aerial, {"form": ("bar", "brick", "clamshell")}, rod=False),
    Component.of("rod", 1, aerial, {"form": ("bar", "brick", "clamshell")}, rod=True),
)
BACKS = (
    Component("plain", 2, nothing),
    Component("lenses", 2, lenses, {"housing": ("plate", "halves", "shell")}),
    Component("pack", 1.5, pack, {"form": ("bar", "brick"), "housing": (*_FLAT, "shell")}),
)
HOLDS = (
    Component("none", 5, nothing),
    Component("cradle", 2, cradle, {"form": ("bar",), "back": ("plain", "lenses")}),
    Component("prop", 2, prop, {"form": ("slab",), "housing": _FLAT}),
    Component("bumper", 1.5, bumper, {"form": ("slab",), "housing": ("plate",)}),
    Component("flap", 1.5, flap, {"form": ("bar", "brick")}),
)
