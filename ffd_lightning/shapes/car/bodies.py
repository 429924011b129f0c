"""The bodies of cars: skins, shells, free-standing wings, walls of beds and cockpits."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ffd_lightning.shapes.car.plan import BLACK, CHROME, USES, Plan
from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, nothing
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import Array, Pair

Panel = tuple[str, Material, NDArray[np.bool_]]
"""A part, its material, and which cells (n - 1, k) of a skin it is."""


def skin(b: Builder, rings: ArrayLike, panels: Sequence[Panel]) -> None:
    """Join closed rings (n, k, 3) into a skin; a cell belongs to the first panel that has it."""
    points = np.asarray(rings, float)
    corner = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    after = np.roll(corner, -1, axis=1)
    quads = np.stack([corner[:-1], after[:-1], after[1:], corner[1:]], -1)
    left = np.ones(quads.shape[:2], bool)
    for part, material, cells in panels:
        chosen, left = quads[cells & left], left & ~cells
        if len(chosen):
            faces = np.concatenate([chosen[:, [0, 1, 2]], chosen[:, [0, 2, 3]]])
            used, index = np.unique(faces, return_inverse=True)
            b.add(part, material, points.reshape(-1, 3)[used], index.reshape(-1, 3))


def shell(b: Builder, p: Plan, cowl: float) -> None:
    """Add the body, the hood before `cowl`, and the dark underbody that wheel arches show."""
    half = p.length / 2
    stations = [*np.linspace(-half, half, 15), *(z for z, _ in p.line), cowl]
    for axle in p.axles if p.arch else ():
        inner = [axle - p.arch * np.cos(a) for a in np.linspace(0.02, np.pi - 0.02, 9)]
        stations += [axle - 1.002 * p.arch, *inner, axle + 1.002 * p.arch]
    inside = np.sort([z for z in stations if -half <= z <= half])
    kept = inside[np.diff(inside, prepend=-np.inf) > 1e-4]
    rings = np.array([_section(p, z) for z in kept])
    # Rings shrunk to points close both ends.
    ends = [np.broadcast_to(ring.mean(0), ring.shape) for ring in (rings[0], rings[-1])]
    column = np.arange(rings.shape[1])
    middle = np.array([-half, *(kept[1:] + kept[:-1]) / 2, half])[:, None]
    upper, whole = np.isin(column, (6, 7, 8)), np.full((len(middle), len(column)), True)
    hood = upper & (middle > 0.2 - half) & (middle < cowl)
    sill = np.isin(column, (0, 14)) & (abs(middle) < half)
    panels = [("hood", p.paint, hood), ("trim", p.sill, sill), ("body", p.paint, whole)]
    skin(b, [ends[0], *rings, ends[1]], panels)
    for axle in p.axles if p.arch else ():
        tall = p.arch + p.radius - p.clearance - 0.06
        size = (0.62 * p.width, tall, 2.1 * p.arch)
        b.box("body", BLACK, (0, p.clearance + 0.03 + tall / 2, axle), size)


def _section(p: Plan, z: float) -> Array:
    """Return the cross-section of the body at z, (16, 3)."""
    w, top, low = p.half(z), p.top(z), p.lower(z)
    shoulder = max(p.clearance + (0.74 - 0.2 * p.soft) * (top - p.clearance), low + 0.02)
    tall, inset = top - shoulder, 1 - 0.09 * p.soft
    side = [(0.95 * w, low), (0.99 * w, low + 0.3 * (shoulder - low))]
    side += [(w, 0.5 * (low + shoulder)), (0.99 * w, shoulder)]
    side += [((0.97 - 0.03 * p.soft) * w, top - 0.5 * tall), (0.92 * inset * w, top - 0.1 * tall)]
    side += [(0.84 * inset * w, top), (0.4 * w, top + 0.02 * w)]
    return np.array([(x, y, z) for x, y in side + [(-x, y) for x, y in reversed(side)]])


def walls(b: Builder, p: Plan, ends: Pair, span: Pair, thick: float, closed: bool) -> None:
    """Wall in a bed or cockpit between two z and two heights; `closed` ends get a wall."""
    low, high = span
    for side in (-1, 1):
        rings = []
        for z in np.linspace(*ends, 6):
            outer = side * 0.985 * p.half(z)
            inner = outer - side * thick
            flat = [(inner, low), (outer, low), (outer, high - 0.03)]
            flat += [(outer - 0.2 * side * thick, high), (inner, high)]
            rings.append([(x, y, z) for x, y in flat])
        b.loft("body", p.paint, rings)
    for z, shift in zip(ends, (0.5, -0.5), strict=True) if closed else ():
        size = (1.9 * p.half(z), high - low, thick)
        b.box("body", p.paint, (0, (low + high) / 2, z + shift * thick), size)


def fenders(b: Builder, rng: Rng, p: Plan) -> None:
    """Add swept wings that run out into running boards."""
    r, board, (front, rear) = p.radius, rng.uniform(0.28, 0.36), p.axles[:2]
    reach = 1.18 * r
    rows = _swept(front, r, (-0.1, 2.1))
    rows += [(front + 1.6 * reach, board + 0.25 * r), (front + 2.2 * reach, board)]
    rows += [(rear - 1.5 * reach, board), (rear - 1.15 * reach, board + 0.05)]
    _wing(b, p, rows + _swept(rear, r, (0.25, rng.uniform(2.3, 3.0))))


def cycle(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a narrow wing over each wheel."""
    for axle in p.axles:
        _wing(b, p, _swept(axle, p.radius, (rng.uniform(0.0, 0.5), rng.uniform(2.3, 2.9))))
        b.box("trim", BLACK, (0, p.radius, axle), (2 * p.half(axle) + 0.2, 0.06, 0.06))


def rod(b: Builder, rng: Rng, p: Plan) -> None:
    """Add bare axles."""
    half = p.track / 2 - 0.1
    for axle in p.axles:
        b.cylinder("trim", CHROME, (-half, p.radius, axle), (half, p.radius, axle), 0.04)


def _swept(axle: float, radius: float, angles: Pair) -> list[Pair]:
    """Return (z, height) rows of an arc over a wheel; angle 0 is at its front."""
    reach, turns = 1.18 * radius, np.linspace(*angles, 10)
    return [(axle - reach * np.cos(a), radius + reach * np.sin(a)) for a in turns]


def _wing(b: Builder, p: Plan, rows: Sequence[Pair]) -> None:
    """Add a pair of wings along (z, height) rows."""
    offsets, wide = np.linspace(-0.5, 0.5, 5), 0.21 * p.track
    for side in (-1, 1):
        row = [(side * (p.track / 2 - wide * (0.42 - t)), 0.36 * t**2 * p.radius) for t in offsets]
        sheet(b, "body", p.second, [[(x, y - sag, z) for x, sag in row] for z, y in rows], 0.03)


_OLD = {"use": ("vintage",)}
BODIES = (
    Component("flush", 1, nothing, {"use": tuple(u.name for u in USES[:-2])}),
    Component("fenders", 3, fenders, _OLD),
    Component("cycle", 1, cycle, _OLD),
    Component("rod", 0.7, rod, _OLD),
)
