"""Wings of aeroplanes, where they sit, and what is before them."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, nothing
from ffd_lightning.shapes.kit.vectors import Pair, vec
from ffd_lightning.shapes.plane.plan import STEEL, Plan

_AIRFOIL = np.array(
    [(0, 0), (0.04, 0.32), (0.15, 0.5), (0.35, 0.55), (0.65, 0.36), (1, 0.04)]
    + [(1, -0.04), (0.65, -0.26), (0.35, -0.4), (0.15, -0.4), (0.04, -0.26)]
)
"""Rows of (fraction of the chord, fraction of the thickness)."""


def surface(
    b: Builder, part: str, paint: Material, edge: ArrayLike, chords: ArrayLike, thick: float = 0.1
) -> None:
    """Add a lifting surface along a leading edge (k, 3); `thick` is a fraction of its chords."""
    points = np.asarray(edge, float)
    span = np.gradient(points, axis=0) * vec(1, 1, 0)
    normals = np.stack([-span[:, 1], span[:, 0], np.zeros(len(points))], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rings = []
    for point, normal, chord in zip(points, normals, np.asarray(chords, float), strict=True):
        along = _AIRFOIL[:, :1] * vec(0, 0, chord)
        rings.append(point + along + _AIRFOIL[:, 1:] * thick * chord * normal)
    b.loft(part, paint, rings)


def pair(
    b: Builder, part: str, paint: Material, edge: ArrayLike, chords: ArrayLike, thick: float = 0.1
) -> None:
    """Add a lifting surface and its mirror image; see `surface`."""
    surface(b, part, paint, edge, chords, thick)
    # from tip to root, so that the normals point up on this side as well
    mirrored = (np.asarray(edge, float) * vec(-1, 1, 1))[::-1]
    surface(b, part, paint, mirrored, np.asarray(chords)[::-1], thick)


def level(rng: Rng, p: Plan, ups: Pair) -> float:
    """Draw the wing's height, between two shares of the fuselage's half-height."""
    return p.height(p.lead + 0.3 * p.root, rng.uniform(*ups))


_MID, _OPEN = ("slim", "broad", "barrel", "sailplane", "centre"), {"fuselage": ("cowled", "radial")}
_LOW = ("tube", "short", "sleek", "radial", "inline", "cowled", "pod", "decks", "hump", "needle")
MOUNTS = (
    Component.of("low", 5, level, {"fuselage": _LOW}, ups=(-0.75, -0.45)),
    Component.of("mid", 2, level, {"fuselage": _MID}, ups=(-0.25, 0.3)),
    Component.of("high", 0.5, level, {"fuselage": ("tube", "pod", *_MID[:4])}, ups=(0.75, 0.9)),
    Component.of("high", 5, level, {"fuselage": ("short", "cargo")}, ups=(0.8, 0.92)),
    Component.of("raised", 5, level, {"fuselage": ("cowled",)}, ups=(1.3, 1.8)),
    Component.of("parasol", 0.5, level, {"role": ("light",), **_OPEN}, ups=(1.8, 2.2)),
    Component.of("stack", 1.2, level, {"role": ("light",), **_OPEN}, ups=(-0.8, -0.6)),
)


class Form(NamedTuple):
    """The ranges of a wing's shape."""

    knee: Pair  # share of the span at which it bends
    mid: Pair  # chord at the knee, 1 for straight edges
    tip: Pair  # chord at the tip, of the root's
    slope: Pair  # how far both edges go back, per span
    fore: Pair  # share of the chord's loss that is at the front: 1 for a straight rear edge
    bow: Pair = (0, 0)  # rise of the knee, per span
    root: float = 1.0  # chord in the middle, of the plan's
    thick: float = 0.12  # fraction of the chord
    winglets: float = 0.0  # how probable


def wing(b: Builder, rng: Rng, p: Plan, form: Form) -> Plan:
    """Add a wing of a form: with straight edges, kinked or not."""
    knee, mid, tip, slope, fore, bow = (rng.uniform(*ends) for ends in form[:6])
    share, low = np.array([0, knee, 1]), p.level < -0.15 * p.tall
    chords = form.root * p.root * np.array([1, mid * (1 - knee * (1 - tip)), tip])
    rise = rng.uniform(0.04, 0.16) if low else rng.uniform(-0.08, 0.05)
    backs = slope * p.span * share + fore * (chords[0] - chords)
    heights = p.span * (rise * share + np.array([0, bow * (1 if rise < 0 else -1), 0]))
    lead = min(p.lead, max(p.end - 0.06, 0.2) - chords[0])
    edge = np.stack([p.span * share, p.level + heights, lead + backs], 1)
    pair(b, "wing", STEEL if rng.random() < 0.1 else p.paint, edge, chords, form.thick)
    if rng.random() < form.winglets:
        up = rng.uniform(0.03, 0.08)
        end = edge[-1] + vec(rng.uniform(0, 0.03), up, 0.6 * up)
        pair(b, "wing", p.accent, [edge[-1], end], chords[-1] * np.array([1, 0.4]))
    return replace(p, edge=edge, chords=chords)


def elliptic(b: Builder, rng: Rng, p: Plan) -> Plan:
    """Add a wing whose chord shrinks like an ellipse."""
    t = np.array([0, 0.2, 0.4, 0.6, 0.75, 0.87, 0.95, 0.99, 1.0])
    chords = 1.15 * p.root * np.sqrt(1 - 0.985 * t ** rng.uniform(2, 3))
    heights, backs = rng.uniform(0.04, 0.14) * t, rng.uniform(0.25, 0.55) * (chords[0] - chords)
    edge = np.stack([p.span * t, p.level + p.span * heights, p.lead + backs], 1)
    pair(b, "wing", p.paint, edge, chords, 0.12)
    return replace(p, edge=edge, chords=chords)


def stacked(b: Builder, rng: Rng, p: Plan) -> Plan:
    """Add two or three wings above each other, joined by struts and wires."""
    count, chord, span = 3 if rng.random() < 0.2 else 2, 0.8 * p.root, 0.9 * p.span
    gap, stagger = rng.uniform(0.34, 0.56) / (count + 0.5), rng.uniform(-0.02, 0.07)
    paint = p.accent if rng.random() < 0.6 else p.paint
    shape = np.array([0, rng.uniform(0.8, 1), 1])
    low, high = vec(0, p.level, p.lead), vec(0, p.level + (count - 1) * gap, p.lead - stagger)
    for t in np.linspace(0, 1, count):
        x = shape * span * (1 if t else rng.uniform(0.78, 1))
        edge = low + t * (high - low) + np.stack([x, [0, 0.02, 0.02], [0, 0, 0.02]], 1)
        pair(b, "wing", paint, edge, (chord, chord, 0.7 * chord), 0.09)
    bays = [0.6] if rng.random() < 0.6 else [0.38, 0.68]
    for side, t in [(side, t) for side in (-1, 1) for t in (0.08, *bays)]:
        for along in (0.15, 0.7):
            out = vec(side * t * span, 0.02 * t, along * chord)
            b.cylinder("wing", STEEL, low + out, high + out, 0.007, segments=6)
        wire, outer = vec(side * 0.1 * span, 0, 0.4 * chord), vec(side * t * span, 0, 0.4 * chord)
        for ends in ((low + wire, high + outer), (high + wire, low + outer)):
            b.cylinder("wing", STEEL, *ends, 0.0025, segments=4)
    edge = np.array([low, low + vec(span, 0, 0)])
    return replace(p, edge=edge, chords=np.array([chord, chord]))


_NO, _ONE = (0.0, 0.0), (1.0, 1.0)
_FORMS: dict[str, tuple[Form, float, tuple[str, ...]]] = {  # form, weight, roles
    "swept": (Form((0.26, 0.45), (0.7, 1), (0.18, 0.38), (0.3, 0.7), (0, 0.3), winglets=0.45),
              1, ("airliner", "business")),
    "straight": (Form((0.2, 0.65), (1, 1.25), (0.35, 1), (0, 0.06), (0, 0.7)),
                 2, ("light", "propliner", "warbird")),
    "gull": (Form((0.22, 0.36), (1, 1.3), (0.4, 0.7), _NO, (0.2, 0.6), (0.06, 0.1)),
             0.4, ("warbird",)),
    "plain": (Form((0.3, 0.6), (1, 1.2), (0.4, 0.8), (0, 0.1), (0, 0.6), thick=0.09),
              0.3, ("business", "fighter")),
    "delta": (Form((0.3, 0.5), (0.9, 1), (0.05, 0.2), _NO, (0.85, 1.05), root=1.6, thick=0.05),
              1.6, ("fighter",)),
    "cranked": (Form((0.3, 0.5), (0.6, 0.8), (0.04, 0.15), _NO, _ONE, root=1.8, thick=0.04),
                0.8, ("fighter", "supersonic")),
    "arrow": (Form((0.4, 0.6), _ONE, (0.3, 0.8), (0.6, 0.95), (0, 0.5), thick=0.06),
              1.2, ("fighter",)),
    "trapezoid": (Form((0.4, 0.6), _ONE, (0.12, 0.5), (0, 0.3), (0.4, 1), thick=0.05),
                  2, ("fighter",)),
    "forward": (Form((0.4, 0.6), _ONE, (0.35, 0.6), (-0.5, -0.25), (0.5, 1)), 0.2, ("fighter",)),
    "slender": (Form((0.5, 0.7), (1, 1.3), (0.25, 0.45), (0, 0.03), (0.3, 0.8), winglets=0.4),
                1, ("glider",)),
    "blended": (Form((0.25, 0.45), (0.6, 0.8), (0.1, 0.22), (0.4, 0.85), _NO), 1, ("flying",)),
}  # fmt: skip
_SINGLE = ("low", "mid", "high", "raised", "parasol")
WINGS = (
    *(
        Component.of(name, weight, wing, {"role": roles, "mount": _SINGLE}, form=form)
        for name, (form, weight, roles) in _FORMS.items()
    ),
    Component("elliptic", 0.6, elliptic, {"role": ("warbird", "light"), "mount": ("low",)}),
    Component("stacked", 1, stacked, {"mount": ("stack",)}),
)


def canards(b: Builder, rng: Rng, p: Plan) -> None:
    """Add small surfaces at the front fuselage."""
    z, out, y = rng.uniform(-0.3, -0.22), rng.uniform(0.08, 0.16), p.height(-0.25, 0.3)
    edge = [(0.5 * p.half(z), y, z), (p.half(z) + out, y + 0.01, z + rng.uniform(0.3, 1.0) * out)]
    pair(b, "wing", p.paint, edge, (rng.uniform(0.09, 0.13), 0.04), 0.06)


def strakes(b: Builder, rng: Rng, p: Plan) -> None:
    """Add slender extensions of the wing's root toward the nose."""
    z, chord, x = p.edge[0, 2], p.chords[0], p.half(p.edge[0, 2])
    edge = [(0.5 * x, p.level, z - rng.uniform(0.12, 0.2)), (1.6 * x, p.level, z + 0.03)]
    pair(b, "wing", p.paint, edge, (0.2 + 0.5 * chord, 0.5 * chord), 0.03)


_POINTED = {"fuselage": ("slim", "broad")}
FORES = (
    Component("none", 1, nothing),
    Component("canards", 0.7, canards, {"wing": ("delta", "cranked", "forward"), **_POINTED}),
    Component("strakes", 0.6, strakes, {"wing": ("trapezoid",), **_POINTED}),
)
