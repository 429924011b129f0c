"""Smooth curves through given points."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit.vectors import Array


def monotone(x: Array, y: Array, at: Array) -> Array:
    """Return the heights (m,) at the places `at` of a curve through (x, y), (n,) each, n > 2.

    The pieces are cubic, and between two points the curve stays between their heights: Fritsch and
    Butland's slopes. `x` ascends.
    """
    steps, rises = np.diff(x), np.diff(y) / np.diff(x)
    slopes = np.zeros(len(x))
    one, two = 2 * steps[1:] + steps[:-1], steps[1:] + 2 * steps[:-1]
    steady = np.sign(rises[1:]) * np.sign(rises[:-1]) > 0  # level where the curve turns
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (one / rises[:-1] + two / rises[1:]) / (one + two)
        slopes[1:-1][steady] = (1.0 / mean)[steady]
    slopes[0] = _end_slope(steps[:2], rises[:2])
    slopes[-1] = _end_slope(steps[:-3:-1], rises[:-3:-1])
    bend = (slopes[:-1] + slopes[1:] - 2 * rises) / steps
    piece = np.clip(np.searchsorted(x, at, "right") - 1, 0, len(x) - 2)
    s = at - x[piece]
    curve = y[piece] + slopes[piece] * s
    curve = curve + ((rises - slopes[:-1]) / steps - bend)[piece] * (s * s)
    return np.asarray(curve + (bend / steps)[piece] * (s * s * s))


def _end_slope(steps: Array, rises: Array) -> float:
    """Return the slope at an end from the two pieces next to it, (2,) each, the nearer first."""
    slope = ((2 * steps[0] + steps[1]) * rises[0] - steps[0] * rises[1]) / (steps[0] + steps[1])
    if np.sign(slope) != np.sign(rises[0]):
        return 0.0
    if np.sign(rises[0]) != np.sign(rises[1]) and abs(slope) > 3 * abs(rises[0]):
        return float(3 * rises[0])
    return float(slope)
