"""What carries a screen: feet and necks, wall mounts, legs, cabinets; loudspeakers and extras."""

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Rng, nothing, pick_material
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.legs import add_legs, draw_leg_style
from ffd_lightning.shapes.kit.paths import bend, corners
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair, lean, vec
from ffd_lightning.shapes.monitor.bodies import grille
from ffd_lightning.shapes.monitor.plan import Plan


def _mount(p: Plan, y: float) -> Array:
    """Return a point inside the housing's end, at `y` of the frame."""
    return p.at(0, y, 0.5 * p.thick + 0.8 * p.deep)


def foot(b: Builder, rng: Rng, p: Plan, kind: str) -> None:
    """Add a "disc", a "plate" or a "v" below the back of a screen."""
    share = min(1.0, 0.5 + p.height / p.width) * (1.8 if p.low > 0.5 else 1.0)
    reach, thick = share * rng.uniform(0.16, 0.32), rng.uniform(0.015, 0.04)
    z = _mount(p, -0.2)[2] + 0.03
    if kind == "disc":
        rows = np.array([(1, 0), (1, 0.6), (0.9, 1), (0.2, 1.3)]) * (reach, thick)
        b.lathe("base", p.stand, rows, (0, 0, z), segments=32, squash=rng.uniform(0.55, 1.0))
    elif kind == "plate":
        size, radius = (2 * reach, thick, rng.uniform(0.9, 1.5) * reach), rng.uniform(0.02, 0.6)
        middle = (0, thick / 2, z - 0.1 * reach)
        b.rounded_box("base", p.stand, middle, size, radius * reach, edge=0.3 * thick)
    else:
        spread = rng.uniform(0.6, 1.2)
        for side in (-1, 1):
            path = [(0, thick, z + 0.1), (0.5 * side * reach, thick, z)]
            path += [(spread * side * reach, 0.6 * thick, z - rng.uniform(0.9, 1.0) * reach)]
            b.tube("base", p.stand, bend(path, 0.4 * reach), 0.6 * thick, segments=10)
        start = (0, 0.6 * thick, z + 0.4 * reach)
        beam(b, "base", p.stand, start, (0, thick, z), width=0.05, height=thick)


def neck(b: Builder, rng: Rng, p: Plan, kind: str) -> None:
    """Join a foot to the back of a screen: by a flat, round, bent or twin post."""
    width, y = rng.uniform(0.05, 0.2), -rng.uniform(0.05, 0.3)
    hold = _mount(p, y)
    base, knee = vec(0, 0.01, hold[2] + 0.03), hold + vec(0, 0, 0.08)
    if kind == "twin":
        for shift in (vec(-width, 0, 0), vec(width, 0, 0)):
            b.cylinder("stand", p.stand, base + shift, hold + shift, 0.02, segments=12)
    elif kind == "round":
        b.cylinder("stand", p.stand, base, hold, 0.35 * width, radius_end=0.25 * width)
    elif kind == "bent":
        path = bend([base + vec(0, 0, 0.02), knee, hold], 0.06)
        b.tube("stand", p.stand, path, 0.2 * width, segments=12)
    else:
        beam(b, "stand", p.stand, base, hold + 0.02 * UP, width, height=0.03)
    b.rounded_box("stand", p.stand, hold, (2 * width + 0.06, 0.05, width + 0.06), 0.01, turn=p.flat)


def feet(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two feet near a screen's ends: inverted V's, or posts on blades."""
    reach, spread, r = rng.uniform(0.08, 0.22), rng.uniform(0.2, 0.42), rng.uniform(0.008, 0.016)
    splay = rng.uniform(0, 0.12) * (rng.random() < 0.5)
    for side in (-1, 1):
        head = p.at(side * spread, -0.49, 0.0)
        for z in (-reach, reach):
            end = head * vec(1, 0, 1) + vec(side * splay, r, z)
            b.tube("stand", p.stand, [head + 0.02 * UP, end], (1.4 * r, r), segments=10)
        if not splay:
            middle, blade = head * vec(1, 0, 1) + 0.6 * r * UP, (2 * r, 1.2 * r, 2.2 * reach)
            b.rounded_box("base", p.stand, middle, blade, r)


def wall(b: Builder, rng: Rng, p: Plan, folded: bool) -> None:
    """Add a plate for the wall, joined to the screen by a folded arm or by rails."""
    wide, hold, out = rng.uniform(0.15, 0.4), _mount(p, 0), rng.uniform(0.06, 0.2)
    far = hold + vec(0, 0, out * (2.5 if folded else 1.0))
    plate = (0.12 if folded else wide, rng.uniform(0.25, 0.5) * p.height, 0.02)
    b.rounded_box("base", p.stand, far, plate, 0.01)
    b.rounded_box("stand", p.stand, hold, (0.18 if folded else wide, 0.04, 0.18), 0.01, turn=p.flat)
    if folded:
        elbow = (far + hold) / 2 + vec(rng.choice([-0.5, 0.5]) * wide, 0, 0)
        for end in (far, hold):
            beam(b, "stand", p.stand, end, elbow, width=0.03, height=0.05)
        b.cylinder("stand", p.stand, elbow - 0.035 * UP, elbow + 0.035 * UP, 0.022)
        return
    for shift in (vec(-0.4 * wide, 0, 0), vec(0.4 * wide, 0, 0)):
        beam(b, "stand", p.stand, hold + shift, far + shift, width=0.03, height=plate[1])


def bracket(b: Builder, rng: Rng, p: Plan, solid: bool) -> None:
    """Add a bent sheet or a bent rod that leans against the back and runs forward below."""
    wide, t = rng.uniform(0.2, 0.5), rng.uniform(0.01, 0.025)
    hold = p.at(0, rng.uniform(-0.25, 0.0), 0.5 * p.thick + 0.7 * p.deep)
    heel = vec(0, t / 2, hold[2] + rng.uniform(0.04, 0.12))
    toe = heel - vec(0, 0, rng.uniform(0.25, 0.4))
    path, half = bend([hold, heel, toe], 0.06), vec(wide / 2, 0, 0)
    if solid:
        sheet(b, "stand", p.stand, np.stack([path - half, path + half], 1), t)
    else:
        rod = np.concatenate([path - half, (path + half)[::-1]])
        b.tube("stand", p.stand, rod, t / 2 + 0.002, segments=10)


def easel(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two long legs at the front and one behind, as an easel has them."""
    top, spread = rng.uniform(-0.1, 0.4), rng.uniform(0.25, 0.45)
    z, reach = 0.5 * p.thick + 0.5 * p.deep, rng.uniform(0.2, 0.4)
    for x, y, foot_z in ((-0.6, -0.3, 0.0), (0.6, -0.3, 0.0), (0, top, reach)):
        head, toe = p.at(x * spread, y, z), vec(2 * x * spread, 0, z + foot_z)
        b.cylinder("stand", p.stand, head, toe, 0.022, radius_end=0.016, segments=10)
    beam(b, "stand", p.stand, p.at(-0.45, -0.3, z), p.at(0.45, -0.3, z), width=0.03, height=0.04)


def _depth(p: Plan) -> Pair:
    """Return the z of a deep housing's front and of where it can be carried at the back."""
    return -0.5 * p.thick, max(0.5 * p.thick, 0.6 * p.deep)


def legs(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board and four legs, straight or splayed."""
    front, back = _depth(p)
    style, z = draw_leg_style(rng, (0.035, 0.06), 0.15), (front + back) / 2
    tops = corners(0.82 * p.width, 0.75 * (back - front), p.low, z)
    ends = (tops - vec(0, 0, z)) * vec(1.1, 0, rng.uniform(1.0, 1.5)) + vec(0, 0, z)
    size = (0.94 * p.width, 0.03, 0.94 * (back - front))
    b.rounded_box("base", p.stand, (0, p.low, z), size, 0.01)
    add_legs(b, "stand", p.stand, style, tops, ends)


def swivel(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a round foot with a bowl on it."""
    r, at, low = rng.uniform(0.2, 0.34), (0, 0, 0.3 * p.deep), p.low
    b.lathe("base", p.stand, [(r, 0), (r, 0.25 * low), (0.55 * r, 0.5 * low)], at, segments=32)
    bowl = [(0.6 * r, 0.4 * low), (0.8 * r, 0.7 * low), (0.95 * r, low + 0.04)]
    b.lathe("stand", p.stand, bowl, at, segments=32)


def pads(b: Builder, rng: Rng, p: Plan) -> None:
    """Add four short feet."""
    front, back = _depth(p)
    for x, _, z in corners(0.8 * p.width, 0.7 * (back - front), 0, (front + back) / 2):
        b.cylinder("base", p.stand, (x, 0, z), (x, p.low + 0.15 * p.height, z), 0.03, segments=12)


def computer(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a desktop computer with drives below the screen."""
    front, back = _depth(p)
    wide, deep, tall = rng.uniform(0.95, 1.3), max(back - front + 0.1, 0.5), p.low - 0.03
    z = front + deep / 2 - 0.05
    b.rounded_box("base", p.frame, (0, tall / 2, z), (wide, tall, deep), 0.02)
    b.rounded_box("stand", p.frame, (0, tall, z), (0.5, 0.1, 0.6 * deep), 0.02)
    for x in (0.1, 0.33)[: int(rng.integers(1, 3))]:
        drive = (0.18 * wide, 0.25 * tall, 0.02)
        b.box("button", p.back, (x * wide, 0.6 * tall, z - deep / 2), drive)
    b.box("button", p.accent, (-0.4 * wide, 0.5 * tall, z - deep / 2), (0.05, 0.03, 0.02))


def pedestal(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a cabinet with loudspeakers below the screen."""
    front, back = _depth(p)
    wide, z = rng.uniform(0.9, 1.0) * p.width, (front + back) / 2 + 0.01
    b.rounded_box("base", p.frame, (0, p.low / 2, z), (wide, p.low + 0.01, back - front), 0.015)
    count, cones = int(rng.integers(1, 3)), rng.random() < 0.4
    size = ((0.9 if count == 1 else 0.42) * wide, 0.7 * p.low)
    for x in (np.arange(count) - (count - 1) / 2) * 0.46 * wide:
        grille(b, rng, p, vec(x, 0.5 * p.low, front + 0.01), size, cones)


def sides(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a loudspeaker at either edge of a screen."""
    wide, tall = rng.uniform(0.06, 0.14), rng.uniform(0.7, 1.0) * p.height
    for x in (-0.5 - wide / 2, 0.5 + wide / 2) if p.height < p.width else ():
        size, middle = (wide, 0.9 * p.thick, tall), p.at(0.99 * x, 0, 0)
        b.rounded_box("speaker", p.back, middle, size, 0.3 * wide, turn=p.flat)
        for y in (-0.25, 0.25):
            ends = [p.at(x, y, z * p.thick) for z in (-0.4, -0.52)]
            b.tube("speaker", p.accent, ends, (0.38 * wide, 0.3 * wide), segments=16)


def bar(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a strip of loudspeakers along the lower edge of a screen."""
    wide, tall = rng.uniform(0.5, 0.95), rng.uniform(0.03, 0.05)
    size, y = (wide, 0.9 * p.thick, tall), -0.5 - 0.4 * tall / p.height
    b.rounded_box("speaker", p.back, p.at(0, y, 0), size, 0.3 * tall, turn=p.flat)
    for x in np.linspace(-0.42, 0.42, int(rng.integers(2, 7))) * wide:
        ends = [p.at(x, y, z * p.thick) for z in (-0.4, -0.5)]
        b.tube("speaker", p.accent, ends, (0.36 * tall, 0.3 * tall), segments=14)


def keyboard(b: Builder, rng: Rng, p: Plan) -> None:
    """Lay a keyboard before the screen."""
    wide, deep = rng.uniform(0.6, 0.95), rng.uniform(0.2, 0.32)
    center, tip = vec(0, 0.02, -rng.uniform(0.4, 0.6) - deep / 2), lean(-4)
    b.rounded_box("base", p.frame, center, (wide, 0.025, deep), 0.02, turn=tip)
    for i in range(4):
        place = center + tip @ vec(0, 0.014, (i - 1.5) * 0.22 * deep)
        row = (0.94 * wide, 0.01, 0.17 * deep)
        b.rounded_box("button", p.back, place, row, 0.004, turn=tip, segments=1)


def aerial(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a block with two rods on the top."""
    middle = vec(0, p.low + p.height, 0.1)
    b.rounded_box("stand", p.stand, middle, (0.16, 0.05, 0.1), 0.02)
    for side in (-1, 1):
        end = middle + vec(side * rng.uniform(0.15, 0.5), rng.uniform(0.25, 0.6), 0.02)
        start, metal = middle + vec(0.04 * side, 0.01, 0), pick_material(rng, "metal")
        b.cylinder("stand", metal, start, end, radius=0.008, radius_end=0.006, segments=8)


def handle(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a handle on the top."""
    y, half = p.low + p.height - 0.01, rng.uniform(0.15, 0.35)
    path = [(-half, y, 0.04), (-half, y + 0.09, 0.04), (half, y + 0.09, 0.04), (half, y, 0.04)]
    b.tube("stand", p.stand, bend(path, 0.05), 0.018, segments=8)


_FLAT, _POSTED = ("panel", "curved", "array"), ("plate", "disc", "v", "floor")
_DESK = ("plate", "disc", "v", "sheet", "hoop", "swivel", "computer")
_BARRED = ("plate", "floor", "arm", "rails", "easel")
_PANEL, _ONE = {"body": ("panel",)}, {"body": ("panel", "curved")}
FEET = (
    Component.of("plate", 2, foot, {"body": _FLAT}, kind="plate"),
    Component.of("disc", 1.5, foot, {"body": _FLAT}, kind="disc"),
    Component.of("v", 1, foot, {"body": _FLAT}, kind="v"),
    Component.of("floor", 1, foot, {"body": _FLAT}, kind="plate"),
    Component("feet", 2, feet, _PANEL),
    Component.of("arm", 0.7, wall, _ONE, folded=True),
    Component.of("rails", 0.5, wall, _ONE, folded=False),
    Component.of("sheet", 1, bracket, _PANEL, solid=True),
    Component.of("hoop", 0.8, bracket, _PANEL, solid=False),
    Component("easel", 0.8, easel, _PANEL),
    Component("legs", 1, legs, {"body": ("tube", "console")}),
    Component("swivel", 2, swivel, {"body": ("tube",)}),
    Component("pads", 1.5, pads, {"body": ("tube", "console")}),
    Component("computer", 0.8, computer, {"body": ("tube",)}),
    Component("pedestal", 1, pedestal, {"body": ("tube", "projection")}),
)
NECKS = (
    Component("none", 1, nothing, {"foot": tuple(c.name for c in FEET if c.name not in _POSTED)}),
    *(Component.of(n, 1, neck, {"foot": _POSTED}, kind=n) for n in ("flat", "round", "bent")),
    Component.of("twin", 1, neck, {"foot": _POSTED, "body": ("panel",)}, kind="twin"),
)
SOUNDS = (
    Component("none", 4, nothing),
    Component("sides", 1, sides, _PANEL),
    Component("bar", 1, bar, {**_PANEL, "foot": _BARRED}),
)
EXTRAS = (
    Component("none", 6, nothing),
    Component("keyboard", 1, keyboard, {"foot": _DESK}),
    Component("aerial", 3, aerial, {"foot": ("pads", "legs")}),
    Component("handle", 2, handle, {"body": ("tube",), "foot": ("pads",)}),
)
