"""Tails of aeroplanes."""

from ffd_lightning.shapes.kit import Builder, Component, Rng, nothing
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import Pair, vec
from ffd_lightning.shapes.plane.plan import Plan, skin
from ffd_lightning.shapes.plane.wings import pair, surface

Sizes = tuple[Pair, Pair, Pair]
"""Ranges of a fin's chord, of its rise, and of its sweep, back per rise."""
_LINER: Sizes = ((0.11, 0.2), (0.12, 0.22), (0.3, 0.95))
_JET: Sizes = ((0.16, 0.26), (0.12, 0.22), (0.4, 1.1))
_PROP: Sizes = ((0.1, 0.18), (0.1, 0.2), (0.05, 0.7))


def tail(
    b: Builder, rng: Rng, p: Plan, sizes: Sizes, at: float | None = None, canted: bool = False
) -> None:
    """Add one fin, or two that lean outward when `canted`, and tailplanes.

    They are at the fuselage, at the share `at` of the fin's height, or nowhere.
    """
    chord, rise, slope = (rng.uniform(*ends) for ends in sizes)
    z = p.end - rng.uniform(0.95, 1.15) * chord
    root, slope = vec(0, p.height(p.end - 0.85 * chord, 0.55), z), min(slope, 0.2 / rise)
    tip = root + vec(0, rise, slope * rise)
    paint = p.accent if rng.random() < 0.5 else p.paint
    chords = (chord, rng.uniform(0.35, 0.7) * chord)
    if canted:
        side, out = vec(0.68 * p.half(z + 0.5 * chord), 0, 0), vec(rng.uniform(0, 0.6) * rise, 0, 0)
        pair(b, "tail", paint, [root + side, tip + side + out], chords, 0.06)
    else:
        surface(b, "tail", paint, [root, tip], chords)
    if at is None:
        return
    hold = root + at * (tip - root) + vec(0, 0, 0.1 * chord)
    if not at:
        hold = vec(0, p.height(p.end - 0.5 * chord, 0.1), p.end - rng.uniform(0.5, 0.9) * chord)
    wide = rng.uniform(0.75, 1.4) * chord + p.half(hold[2]) * (not at)
    droop = rng.uniform(-0.05, 0.15) * wide * (not at)
    end = hold + vec(wide, droop, rng.uniform(0.5, 1) * slope * wide)
    first = rng.uniform(0.65, 0.85) * chord
    pair(b, "tail", p.paint, [hold, end], (first, rng.uniform(0.4, 0.8) * first), 0.08)


def vee(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two surfaces in a V."""
    chord, out, z = rng.uniform(0.1, 0.17), rng.uniform(0.13, 0.2), p.end - 0.15
    hold = vec(0.3 * p.half(z), p.height(z, 0.4), z)
    tip = hold + vec(out, rng.uniform(0.55, 0.95) * out, rng.uniform(0.3, 0.7) * out)
    pair(b, "tail", p.accent, [hold, tip], (chord, 0.5 * chord))


def plates(b: Builder, rng: Rng, p: Plan) -> None:
    """Add tailplanes that carry a fin at either end, sometimes a third in the middle."""
    chord, out, rise = rng.uniform(0.09, 0.14), rng.uniform(0.13, 0.24), rng.uniform(0.06, 0.1)
    hold = vec(0, p.height(p.end - 0.6 * chord, 0.3), p.end - 0.9 * chord)
    end = hold + vec(out, rng.uniform(0, 0.1) * out, 0.02)
    pair(b, "tail", p.paint, [hold, end], (chord, 0.85 * chord))
    for x in (-out, 0.0, out) if rng.random() < 0.3 else (-out, out):
        foot = end * vec(0, 1, 1) + vec(x, -0.6 * rise * bool(x), -0.1 * chord)
        fin = [foot, foot + vec(0, 0.8 * rise, 0), foot + vec(0, 1.7 * rise, 0.3 * chord)]
        surface(b, "tail", p.accent, fin, (0.9 * chord, 1.1 * chord, 0.6 * chord), 0.08)


def booms(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two booms from the wing back, a fin on each and a tailplane between them."""
    (x, y, z), thick = p.wing(p.station, 0.05), rng.uniform(0.03, 0.045)
    chord, rise = rng.uniform(0.09, 0.13), rng.uniform(0.08, 0.14)
    places = [(z - 0.02, 0.3), (z + 0.05, 1), (z + 0.15, 1), (0.5, 0.5)]
    rows = [Section(at, y, s * thick, s * thick) for at, s in places]
    for side in (-x, x):
        skin(b, "body", p.paint, rows, 0.1, side)
        foot = vec(side, y - 0.3 * rise, 0.5 - 0.8 * chord)
        bend, tip = vec(0, 0.3 * rise, -0.2 * chord), vec(0, 1.3 * rise, 0.2 * chord)
        fin = [foot, foot + bend, foot + tip]
        surface(b, "tail", p.accent, fin, (0.6 * chord, chord, 0.55 * chord))
    up = float(rng.choice([0.01, 0.95])) * rise
    plane = [(side, y + up, 0.5 - (0.95 - 0.35 * up / rise) * chord) for side in (-x, x)]
    surface(b, "tail", p.paint, plane, (0.7 * chord,) * 2)


def tips(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a fin at either tip of a flying wing."""
    chord, hold = p.chords[-1], p.edge[-1] - vec(0.04, 0, 0)
    fin = [hold, hold + vec(0.02, rng.uniform(0.08, 0.18), 0.08)]
    pair(b, "tail", p.accent, fin, (1.1 * chord, 0.6 * chord))


_CLOSE = {"wing": ("delta", "cranked")}
_FREE = {"wing": ("plain", "arrow", "trapezoid", "forward", "delta")}
_ONE, _TWO = {"fuselage": ("slim", "barrel")}, {"fuselage": ("broad",)}
_PISTON = {"fuselage": ("cowled", "inline", "radial", "sailplane", "short", "cargo")}
_SLENDER = {"fuselage": ("cowled", "short", "cargo", "sailplane"),
            "mount": ("low", "mid", "high", "raised")}  # fmt: skip
_HUNG, _SLIM = {"engines": ("wing2", "wing4", "wing3")}, {"fuselage": ("slim",)}
_SLOW = ("propliner", "light", "glider")
TAILS = (
    Component.of("low", 6, tail, _HUNG, sizes=_LINER, at=0.0),
    Component.of("low", 0.5, tail, {"engines": ("over",)}, sizes=_LINER, at=0.0),
    Component.of("tee", 8, tail, {"mount": ("high",), **_HUNG}, sizes=_LINER, at=0.96),
    Component.of("tee", 2, tail, {"engines": ("rear2", "rear3")}, sizes=_LINER, at=0.96),
    Component.of("cross", 0.7, tail, {"role": ("business",)}, sizes=_LINER, at=0.4),
    Component.of("low", 3, tail, {"role": (*_SLOW, "warbird"), **_PISTON}, sizes=_PROP, at=0.0),
    Component.of("cross", 0.5, tail, {"role": _SLOW, **_PISTON}, sizes=_PROP, at=0.4),
    Component.of("tee", 1, tail, {"role": _SLOW, **_SLENDER}, sizes=_PROP, at=0.96),
    Component.of("low", 1.5, tail, {**_FREE, **_ONE}, sizes=_JET, at=0.0),
    Component.of("cross", 0.3, tail, {"wing": ("arrow", "plain"), **_ONE}, sizes=_JET, at=0.35),
    Component.of("tee", 0.2, tail, {"wing": ("arrow", "delta"), **_ONE}, sizes=_JET, at=0.96),
    Component.of("fin", 1, tail, {**_CLOSE, "fuselage": ("slim", "barrel", "needle")}, sizes=_JET),
    Component.of("canted", 3, tail, {**_FREE, **_TWO}, sizes=_JET, at=0.0, canted=True),
    Component.of("canted", 0.4, tail, {**_FREE, **_SLIM}, sizes=_JET, at=0.0, canted=True),
    Component.of("fins", 1, tail, {**_CLOSE, **_TWO}, sizes=_JET, canted=True),
    Component("vee", 0.3, vee, {"fuselage": ("sleek", "cowled", "broad", "sailplane")}),
    Component("plates", 0.7, plates, {"role": ("propliner",)}),
    Component("booms", 1, booms, {"fuselage": ("pod",)}),
    Component("none", 1, nothing, {"role": ("flying",)}),
    Component("tips", 1, tips, {"role": ("flying",)}),
)
