"""What aeroplanes stand on, and what they carry below their wings."""

from functools import partial

import numpy as np

from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, nothing
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair, vec
from ffd_lightning.shapes.plane.plan import BLACK, STEEL, Plan, skin
from ffd_lightning.shapes.plane.wings import surface


def _leg(b: Builder, paint: Material, hip: Array, foot: Array, radius: float, wheels: int) -> None:
    """Add a leg from `hip` to the ground at `foot` with one wheel, or two beside each other."""
    axle = foot + radius * UP
    b.cylinder("gear", paint, hip, axle, 0.28 * radius, segments=8)
    for x in [0.0] if wheels == 1 else [-0.55 * radius, 0.55 * radius]:
        middle, tyre, hub = axle + vec(x, 0, 0), vec(0.3 * radius, 0, 0), vec(0.33 * radius, 0, 0)
        b.cylinder("gear", BLACK, middle - tyre, middle + tyre, radius, segments=14)
        b.cylinder("gear", STEEL, middle - hub, middle + hub, 0.45 * radius, segments=8)


def wheels(
    b: Builder, rng: Rng, p: Plan, front: float, along: float, radius: Pair, count: int = 1
) -> None:
    """Add two main legs and one at z = `front`.

    Main legs are `along` the wing's chord. They come down from a low wing or from the flanks, or
    are splayed, with or without spats, where their wheels are large.
    """
    r, z = rng.uniform(*radius), p.lead + along * p.root
    x, light = p.half(z), r > 0.025
    splayed, spats = light and (p.level > 0 or rng.random() < 0.4), light and rng.random() < 0.4
    for side in (-1, 1):
        hip = vec(side * 0.8 * x, p.height(z, -0.6), z)
        foot = vec(side * (x + (0.05 if splayed else 0)), p.ground, z)
        if p.level < -0.2 * p.tall and not splayed:
            hip = p.wing(max(0.2, 1.3 * x / p.span), along, side)
            foot = hip * vec(1, 0, 1) + p.ground * UP
        _leg(b, p.paint if splayed else STEEL, hip, foot, r, count)
        if spats:
            middle, size = foot + vec(0, 1.15, 0.3) * r, vec(0.45, 0.75, 1.7) * r
            b.ellipsoid("gear", p.paint, middle, size, segments=12)
    top = vec(0, p.height(front, -0.8), front)
    low = top[1] - 0.045 if front > 0 else p.ground
    _leg(b, STEEL, top, vec(0, low, front), 0.013 if front > 0 else 0.8 * r, count)


def floats(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two floats on struts."""
    x, deep = max(0.1, 1.3 * p.half(p.lead)), rng.uniform(0.05, 0.065)
    low, start = p.height(p.lead, -1) - rng.uniform(0.07, 0.1), rng.uniform(-0.48, -0.4)
    places = [(0, 0.3, 0.1), (0.04, 0.12, 0.6), (0.15, 0.0, 1.0), (0.4, 0.0, 1.0), (0.7, 0.25, 0.2)]
    rows = [Section(start + z, low + y * deep, s * 0.06, s * deep) for z, y, s in places]
    for side in (-1, 1):
        skin(b, "gear", p.accent, rows, 0.3, side * x)
        for z in (p.lead, p.lead + 0.2):
            foot = vec(side * x, low + 0.2 * deep, z)
            for inner in (0.5, 0.9):
                hip = (side * inner * p.half(z), p.height(z, -0.7), z)
                b.cylinder("gear", STEEL, hip, foot, 0.006, segments=6)
            b.cylinder("gear", STEEL, foot * vec(0, 1, 1), foot, 0.005, segments=6)


def one_wheel(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a sailplane's wheel, half sunk into the belly."""
    belly = vec(0, p.height(-0.2, -1), -0.2)
    _leg(b, STEEL, belly + 0.03 * UP, belly - 0.016 * UP, 0.024, 1)


_LINERS = ("airliner", "business", "supersonic", "propliner")
_BOGIES = partial(wheels, front=-0.38, along=0.65, radius=(0.013, 0.02), count=2)
_JET = partial(wheels, front=-0.28, along=0.6, radius=(0.017, 0.021))
_NOSE = partial(wheels, front=-0.42, along=0.6, radius=(0.028, 0.042))
_TAIL = partial(wheels, front=0.43, along=0.12, radius=(0.028, 0.042))
GEARS = (
    Component("up", 2, nothing, {"role": (*_LINERS, "fighter")}),
    Component("up", 0.7, nothing, {"role": ("warbird",)}),
    Component("bogies", 3, _BOGIES, {"role": _LINERS}),
    Component("tricycle", 1, _JET, {"role": ("fighter", "flying")}),
    Component("tricycle", 1.2, _NOSE, {"role": ("light",), "mount": ("low", "high", "raised")}),
    Component("tricycle", 1, _NOSE, {"role": ("warbird",), "fuselage": ("pod",)}),
    Component("tail", 1, _TAIL, {"fuselage": ("cowled", "inline", "radial")}),
    Component("floats", 0.3, floats, {"role": ("light",)}),
    Component("wheel", 1, one_wheel, {"role": ("glider",)}),
)


def _body(b: Builder, p: Plan, at: Array, size: tuple[float, float, float]) -> None:
    """Add a pointed body about a point, (length, thickness, width of its fins)."""
    long, thick, fins = size
    path = [at + vec(0, 0, t * long) for t in (-0.5, -0.4, -0.2, 0.25, 0.5)]
    radii = [s * thick / 2 for s in (0.1, 0.75, 1.0, 1.0, 0.8 if fins else 0.3)]
    b.tube("wing", STEEL if fins else p.accent, path, radii, segments=8)
    for shape in ((fins, 0.003, 0.02), (0.003, fins, 0.02)) if fins else ():
        b.box("wing", STEEL, at + vec(0, 0, 0.44 * long), shape)


_STORES = ((0.15, 0.014, 0.036), (0.11, 0.024, 0.03), (0.24, 0.036, 0.0))


def weapons(b: Builder, rng: Rng, p: Plan) -> None:
    """Hang missiles, bombs or tanks below the wings, missiles at the tips as well."""
    rows, tips = rng.integers(3, size=int(rng.integers(1, 4))), rng.random() < 0.4
    for side in (-1, 1):
        for t, row in zip((0.45, 0.62, 0.78), rows, strict=False):
            hold = p.wing(t, 0.35, side)
            at = hold - (_STORES[row][1] / 2 + 0.018) * UP
            _body(b, p, at, _STORES[row])
            surface(b, "wing", p.paint, [at, hold], (0.07, 0.07))
        if tips:
            _body(b, p, p.wing(1, 0.4, side), _STORES[0])


def tanks(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a tank at either tip."""
    size = rng.uniform(0.18, 0.28), rng.uniform(0.03, 0.042), 0.0
    for side in (-1, 1):
        _body(b, p, p.wing(1, 0.4, side), size)


def guns(b: Builder, rng: Rng, p: Plan) -> None:
    """Add barrels before the wings."""
    for t in np.linspace(0.42, 0.56, int(rng.integers(1, 4))):
        for side in (-1, 1):
            hold = p.wing(t, 0.2, side)
            b.cylinder("wing", BLACK, hold, hold - vec(0, 0, 0.08), 0.005, segments=8)


def braces(b: Builder, rng: Rng, p: Plan, inner: tuple[float, ...] = ()) -> None:
    """Add struts between the fuselage and a wing above it, also at the shares `inner`."""
    out, rows = rng.uniform(0.35, 0.6), (0.3,) if rng.random() < 0.5 else (0.15, 0.65)
    for t, along, side in [(t, a, s) for t in (out, *inner) for a in rows for s in (-1, 1)]:
        z = p.lead + along * p.root
        foot = (side * 0.75 * p.half(z), p.height(z, -0.55 if t == out else 0.5), z)
        b.cylinder("wing", p.paint, foot, p.wing(t, along, side), 0.007, segments=6)


_STRAIGHT = {"role": ("light", "business", "fighter"), "wing": ("straight", "plain", "arrow")}
STORES = (
    Component("none", 1, nothing, {"mount": ("low", "mid", "high", "stack")}),
    Component("none", 0.4, nothing, {"mount": ("raised",)}),
    Component("weapons", 1.5, weapons, {"role": ("fighter",)}),
    Component("tanks", 0.15, tanks, {"mount": ("low", "mid"), **_STRAIGHT}),
    Component("guns", 1, guns, {"role": ("warbird",)}),
    Component("braces", 1, braces, {"mount": ("raised",)}),
    Component.of("cabane", 1, braces, {"mount": ("parasol",)}, inner=(0.1,)),
)
