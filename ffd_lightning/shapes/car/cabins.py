"""The cabins of cars, closed and open, with doors and mirrors."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffd_lightning.shapes.car.bodies import skin, walls
from ffd_lightning.shapes.car.plan import BLACK, CHROME, Plan
from ffd_lightning.shapes.kit import Builder, Component, Rng, pick_material
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import Array, Pair, lean, vec


@dataclass(frozen=True)
class Cabin:
    """Where a cabin stands on the body."""

    feet: Pair  # z of the windscreen's and the rear window's feet
    roof: Pair  # z of the roof's front and rear edges
    height: float  # of the roof
    drop: float  # how much lower the roof's rear edge is
    bend: float  # radius by which the outline is rounded at the roof's edges
    tumble: float  # how much narrower the roof is, as a share of the width
    sides: Pair  # z where the side windows begin and end
    pillars: tuple[float, ...]  # z of the pillars between them
    pillar: float  # how wide they are
    glass: tuple[Pair, ...]  # ends of each row of side windows, from 0 (belt) to 1 (roof)

    def wide(self, p: Plan) -> float:
        """Return half the width that what is on the roof may have."""
        return 0.76 * p.half(0) * (1 - self.tumble)


def draw_cabin(
    rng: Rng,
    p: Plan,
    spans: Sequence[Pair],
    bays: tuple[int, int] = (2, 3),
    tumble: Pair = (0.14, 0.3),
    blind: bool = False,
    decks: int = 1,
    soft: Pair = (0.08, 0.4),
) -> Cabin:
    """Draw a closed cabin.

    `spans` are the ranges of how far its feet are from the car's ends, over the length, and of
    how far windscreen and rear window lean, over their height. There are `bays` side windows.
    """
    half, height = p.length / 2, p.height + (decks - 1) * 1.4
    front, rear, rake, fall = (rng.uniform(*span) for span in spans)
    start, end = p.length * front - half, half - p.length * rear
    tall, long = p.height - p.belt, end - start
    header = start + min(tall * rake, 0.42 * long)
    edge = max(end - tall * fall, header + 0.2 * long)
    first = start + rng.uniform(0.25, 0.5) * (header - start) + 0.05
    last = edge + rng.uniform(0.05, 0.5) * (end - edge) - 0.05
    if blind:
        last = max(header + 0.5, first + 0.8)
    count = int(rng.integers(bays[0], bays[1] + 1))
    pillars = first + (last - first) * np.linspace(0, 1, count + 1)[1:-1] ** 0.9
    lintel = rng.uniform(0.72, 0.9) if p.height > 2.2 else 1.0
    return Cabin(
        feet=(start, end),
        roof=(header, edge),
        height=height,
        drop=rng.uniform(0.0, 0.12) * tall,
        bend=rng.uniform(*soft),
        tumble=rng.uniform(*tumble),
        sides=(first, last),
        pillars=tuple(pillars),
        pillar=rng.uniform(0.05, 0.12),
        glass=((0.0, lintel),) if decks == 1 else ((0.0, 0.42), (0.58, 0.92)),
    )


def greenhouse(b: Builder, p: Plan, c: Cabin) -> None:
    """Add a closed cabin: pillars and roof with the windows set into them."""
    (start, end), (header, edge), high = c.feet, c.roof, c.height
    line = [(0, p.top(start) - 0.02, start), (0, high - 0.04 * (high - p.belt), header)]
    line += [(0, high, 0.6 * header + 0.4 * edge), (0, high - c.drop, edge)]
    _, heights, places = bend([*line, (0, p.top(end) - 0.02, end)], c.bend).T
    stops = [z + side * c.pillar / 2 for z in c.pillars for side in (-1, 1)]
    zs = np.unique(np.concatenate([places, c.sides, stops]))
    tops = np.interp(zs, places, heights)
    rings = np.array([_ring(p, c, z, top) for z, top in zip(zs, tops, strict=True)])
    column, rows = np.arange(rings.shape[1]), len(c.glass)
    column = np.minimum(column, len(column) - 2 - column)  # the same for left and right
    middle = ((zs[1:] + zs[:-1]) / 2)[:, None]
    bay = (middle > c.sides[0]) & (middle < c.sides[1])
    for z in c.pillars:
        bay &= abs(middle - z) > c.pillar / 2
    level = ((tops[1:] + tops[:-1]) / 2)[:, None]
    screen = ((middle < header) | (middle > edge)) & (level < high - 0.08 * (high - p.belt))
    screen &= level > p.belt
    glass = (bay & (column % 2 == 1) & (column < 2 * rows)) | (screen & (column > 2 * rows + 2))
    # The cell that would close the skin below is within the body.
    whole = np.arange(rings.shape[1]) < rings.shape[1] - 1
    roof = whole & (column > 2 * rows) & (middle > header - 0.05) & (middle < edge + 0.05)
    panels = [("window", p.glass, glass), ("roof", p.roof, roof)]
    skin(b, rings, [*panels, ("roof", p.paint, whole & (middle < np.inf))])


def _ring(p: Plan, c: Cabin, z: float, top: float) -> Array:
    """Return the cross-section of a cabin at z whose roof is there at `top`."""
    low, tall = p.top(z), c.height - p.belt
    frame = min(0.09, 0.2 * tall)
    panes = [max(low + 0.03, p.belt + share * tall) for span in c.glass for share in span]
    levels = [min(y, top - frame) for y in (low - 0.15, *panes)]
    levels += [top - 0.6 * frame, top - 0.15 * frame, top]
    shifts = [0.0] * (len(levels) - 2) + [0.3 * frame, 0.9 * frame]
    inward = 1 - c.tumble * np.clip((np.array(levels) - p.belt) / tall, 0, 1)
    xs = (0.9 - 0.08 * p.soft) * p.half(z) * inward - shifts
    side = [*zip(xs, levels, strict=True), (0.5 * xs[-1], top + 0.015)]
    return np.array([(x, y, z) for x, y in side + [(-x, y) for x, y in reversed(side)]])


def doors(b: Builder, p: Plan, c: Cabin) -> None:
    """Add the doors' seams and handles, and two mirrors."""
    seams = (c.sides[0] - 0.05, *c.pillars[:2], c.sides[1] if not c.pillars else c.pillars[-1])
    for side in (-1, 1):
        for i, z in enumerate(sorted(set(seams))):
            bottom = max(p.clearance + 0.1, p.lower(z) + 0.02)
            top = p.clearance + (0.72 - 0.2 * p.soft) * (p.top(z) - p.clearance)
            if top - bottom < 0.1:
                continue
            x = side * (p.half(z) - 0.009)
            b.box("body", BLACK, (x, (bottom + top) / 2, z), (0.026, top - bottom, 0.012))
            if i:
                handle = (side * (p.half(z) + 0.002), top - 0.04, z - 0.14)
                b.box("trim", CHROME, handle, (0.03, 0.025, 0.14))
    mirrors(b, p, c.sides[0])


def mirrors(b: Builder, p: Plan, z: float) -> None:
    """Add two mirrors on the belt at z."""
    for side in (-1, 1):
        root = vec(0.88 * side * p.half(z), p.top(z) - 0.03, z)
        head = vec(side * (p.half(z) + 0.05), p.top(z) + 0.08, z - 0.02)
        b.cylinder("trim", BLACK, root, head, 0.02, segments=8)
        b.rounded_box("trim", p.paint, head, (0.18, 0.12, 0.08), 0.035, segments=2)


def draw_open(rng: Rng, p: Plan) -> Cabin:
    """Draw an open cockpit: where it begins and ends."""
    front = p.length * (rng.uniform(0.3, 0.44) - 0.5)
    rear = min(front + rng.uniform(1.05, 2.0), p.axles[1] - max(1.13 * p.arch, 0.1) - 0.05)
    ends = front, max(rear, front + 0.9)
    return Cabin(ends, ends, p.height, 0.0, 0.0, 0.0, ends, (), 0.1, ())


def cockpit(b: Builder, rng: Rng, p: Plan, c: Cabin) -> None:
    """Add the windscreen, one or two rows of seats, the steering wheel, some a roll bar."""
    front, rear = c.feet
    floor, belt = cockpit_floor(p), p.top(front)
    walls(b, p, (front, rear), (floor - 0.12, belt), thick=0.05 * p.width, closed=False)
    rise = min(rng.uniform(0.5, 0.9) * max(0.3, p.height - belt), 0.55)
    rake, half, glass = rng.uniform(0.05, 0.4), 0.82 * p.half(front), pick_material(rng, "glass")
    left = [vec(-half, belt - 0.02, front - 0.05), vec(-0.85 * half, belt + rise, front + rake)]
    frame = [*left, *(point * vec(-1, 1, 1) for point in left[::-1])]
    for start, end in itertools.pairwise(frame):
        beam(b, "window", BLACK, start, end, width=0.035, height=0.035)
    b.loft("window", glass, [np.array(frame) + shift for shift in ([0, 0, 0], [0, 0.004, 0.012])])
    cover, spread = pick_material(rng, "leather"), 0.21 * p.width
    wide = min(0.46, 1.8 * spread)
    for row in range(2 if rear - front > 1.5 else 1):
        z = rear - 0.25 - 0.8 * row
        for side in (-spread, spread):
            low, back = (side, floor + 0.1, z - 0.22), (side, (floor + belt) / 2 + 0.1, z + 0.06)
            b.rounded_box("seat", cover, low, (wide, 0.24, 0.5), 0.08, segments=2)
            size = (wide, belt - floor + 0.22, 0.16)
            b.rounded_box("seat", cover, back, size, 0.07, turn=lean(12), segments=2)
    hub = vec(rng.choice([-spread, spread]), belt, front + 0.3)
    b.cylinder("trim", BLACK, hub + vec(0, -0.1, -0.3), hub, 0.025, segments=8)
    rim = [(0.17, -0.015), (0.19, 0), (0.17, 0.015), (0.15, 0), (0.17, -0.015)]
    b.lathe("trim", BLACK, rim, hub, segments=14, turn=lean(65))
    kind = rng.random()
    if kind < 0.35:
        x, high = 0.8 * p.half(rear), belt + min(rise + 0.1, 0.6)
        hoop = [(-x, belt - 0.1, rear), (-0.85 * x, high, rear), (0.85 * x, high, rear)]
        b.tube("trim", BLACK, bend([*hoop, (x, belt - 0.1, rear)], 0.15, 4), 0.035, segments=8)
    elif kind < 0.65 and p.length / 2 - rear > 0.45:
        size = (1.5 * p.half(rear), 0.2, 0.3)
        b.rounded_box("roof", BLACK, (0, p.top(rear) + 0.04, rear + 0.15), size, 0.1)
    mirrors(b, p, front + 0.02)


def cockpit_floor(p: Plan) -> float:
    """Return the height of an open car's floor."""
    return min(p.clearance + 0.22, p.belt - 0.3)


_SALOONS = ("compact", "family", "large")
_OPEN = ("sports", "compact", "family", "suv", "vintage")
_STEEP = {"tumble": (0.04, 0.16), "soft": (0.04, 0.15)}
_ONE = {**_STEEP, "bays": (1, 1)}
# Rows of: name, weight, uses; ranges of front, rear, rake and fall; other arguments of draw_cabin.
_CLOSED: tuple[tuple[Any, ...], ...] = (
    ("notchback", 3.2, _SALOONS, (0.22, 0.37), (0.08, 0.24), (0.6, 1.9), (0.5, 1.9), {}),
    ("hatch", 3, ("city", "compact", "suv"), (0.2, 0.35), (0.02, 0.07), (0.7, 1.9), (0.2, 1.3), {}),
    ("estate", 1.7, (*_SALOONS, "suv"), (0.22, 0.35), (0.012, 0.03), (0.6, 1.7), (0.03, 0.7),
     {"bays": (3, 4)}),
    ("fastback", 1, (*_SALOONS, "sports"), (0.26, 0.42), (0.02, 0.08), (0.9, 2), (1.8, 3.4), {}),
    ("coupe", 0.8, (*_SALOONS, "sports"), (0.3, 0.48), (0.1, 0.26), (0.9, 2), (1, 2.5),
     {"bays": (1, 2)}),
    ("arch", 0.7, ("city", "compact"), (0.2, 0.3), (0.03, 0.15), (0.6, 1.3), (0.8, 2),
     {"soft": (0.6, 1.2)}),
    ("box", 2, ("suv", "vintage"), (0.24, 0.37), (0.012, 0.03), (0.06, 0.6), (0.02, 0.3), _STEEP),
    ("minivan", 0.8, ("city", "compact", "van"), (0.08, 0.2), (0.012, 0.03), (0.9, 2), (0.05, 0.6),
     {"bays": (3, 4)}),
    ("windows", 1, ("van",), (0.04, 0.16), (0.012, 0.02), (0.2, 0.9), (0.02, 0.2),
     {**_STEEP, "bays": (3, 5)}),
    ("panel", 1, ("van",), (0.04, 0.2), (0.012, 0.02), (0.2, 0.9), (0.02, 0.15),
     {**_ONE, "blind": True}),
    ("cab", 1, ("pickup", "vintage", "lorry"), (0.2, 0.3), (0.4, 0.52), (0.3, 1.1), (0.02, 0.3),
     _ONE),
    ("crew", 1, ("pickup",), (0.18, 0.28), (0.26, 0.38), (0.5, 1.2), (0.02, 0.4), _STEEP),
    ("cabover", 1.5, ("lorry",), (0.01, 0.03), (0.62, 0.74), (0.05, 0.3), (0.01, 0.1), _ONE),
    ("coach", 1.6, ("bus",), (0.004, 0.01), (0.004, 0.01), (0.02, 0.3), (0.01, 0.06),
     {**_STEEP, "bays": (4, 8)}),
    ("double", 0.5, ("bus",), (0.004, 0.01), (0.004, 0.01), (0.02, 0.2), (0.01, 0.06),
     {**_STEEP, "bays": (3, 6), "decks": 2}),
)  # fmt: skip
CABINS = (
    *(
        Component.of(name, weight, draw_cabin, {"use": uses}, spans=spans, **rest)
        for name, weight, uses, *spans, rest in _CLOSED
    ),
    Component("open", 0.6, draw_open, {"use": _OPEN}),
)
