"""Lifting surfaces: wings, fins, tailplanes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng
from ffd_lightning.shapes.kit.sections import Section
from ffd_lightning.shapes.kit.vectors import Array, vec
from ffd_lightning.shapes.plane.fuselage import height_at

_AIRFOIL = np.array(
    [(0, 0), (0.04, 0.32), (0.15, 0.5), (0.35, 0.55), (0.65, 0.36), (1, 0.04)]
    + [(1, -0.04), (0.65, -0.26), (0.35, -0.4), (0.15, -0.4), (0.04, -0.26)]
)
"""Rows of (fraction of the chord, fraction of the thickness)."""


def surface(
    b: Builder,
    part: str,
    material: Material,
    edge: ArrayLike,
    chords: ArrayLike,
    thickness: float = 0.12,
) -> None:
    """Add a lifting surface with an aerofoil section.

    Args:
        b: collects it.
        part: its part.
        material: its colour.
        edge: points (k, 3) of the leading edge, from root to tip.
        chords: (k,) lengths along z.
        thickness: fraction of the chord.
    """
    points = np.asarray(edge, float)
    span = np.gradient(points, axis=0) * vec(1, 1, 0)
    normals = np.stack([-span[:, 1], span[:, 0], np.zeros(len(points))], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rings = []
    for point, normal, chord in zip(points, normals, np.asarray(chords, float), strict=True):
        along = _AIRFOIL[:, :1] * vec(0, 0, chord)
        rings.append(point + along + _AIRFOIL[:, 1:] * thickness * chord * normal)
    b.loft(part, material, rings)


def pair(
    b: Builder,
    part: str,
    material: Material,
    edge: ArrayLike,
    chords: ArrayLike,
    thickness: float = 0.12,
) -> None:
    """Add a lifting surface and its mirror image; see `surface`."""
    points = np.asarray(edge, float)
    surface(b, part, material, points, chords, thickness)
    # from tip to root, so that the normals point up on this side as well
    surface(b, part, material, (points * vec(-1, 1, 1))[::-1], np.asarray(chords)[::-1], thickness)


def on_wing(edge: ArrayLike, t: float) -> Array:
    """Return the point of a straight leading edge at the fraction t from root to tip."""
    points = np.asarray(edge, float)
    return points[0] + t * (points[-1] - points[0])


def tail(
    b: Builder, rng: Rng, paint: Material, rows: Sequence[Section], size: float, kind: str
) -> None:
    """Add fin and tailplane at a fuselage's end; `kind` is "low", "cross" or "tee"."""
    rear = rows[-1].z
    chord, rise = size * rng.uniform(0.75, 1.0), size * rng.uniform(0.9, 1.3)
    swept = rng.uniform(0.35, 0.8)
    root = vec(0, height_at(rows, rear - 0.9 * chord, 0.6), rear - 1.05 * chord)
    tip = root + vec(0, rise, swept * rise)
    surface(b, "tail", paint, [root, tip], (chord, 0.5 * chord), 0.1)
    at = {"low": 0.0, "cross": 0.4, "tee": 0.97}[kind]
    hold = root + at * (tip - root) + vec(0, 0, 0.1 * chord)
    if kind == "low":
        hold = vec(0, height_at(rows, rear - 0.5 * chord, 0.1), rear - 0.85 * chord)
    out = size * rng.uniform(0.9, 1.25)
    edge = [hold, hold + vec(out, 0.08 * out * (kind == "low"), 0.6 * swept * out)]
    pair(b, "tail", paint, edge, (0.75 * chord, 0.4 * chord), 0.09)
