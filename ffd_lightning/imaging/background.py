"""Telling an object from the background by the colour of a picture's border."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

Floats = NDArray[np.floating[Any]]

_SPECK = 0.005  # of what is covered: smaller parts do not decide where the object is
_TOLERANCES = 3.0, 24.0  # least and most, in levels of 255
# Twice the levels that a soft shadow changes by near by. The edge of a white wing is steeper.
_SHADE = 7.0
_TERMS = ((0, 0, 0, 1, 1, 2), (0, 1, 2, 0, 1, 0))  # powers of y and x in a quadratic


def split_by_border(pixels: Floats) -> tuple[Floats, Floats, str, str]:
    """Take for the object what differs from the border's colour.

    A quadratic surface is fitted to each channel at the border, robustly, so that an object that
    touches it does not count. What is like the surface and connected to the border is background;
    so is what has the same colour as such places in its neighbourhood (soft shadows, vignettes),
    and holes that have the surface's colour on average. Then, since the background is known, its
    share is taken out of the pixels, (h, w, 3) levels of 255, at the object's edge.

    Returns:
        The picture over white, (h, w, 3) levels of 255, and the object's coverage, (h, w), 1 where
        it is; what was done, in words; and a warning, "" if the border is of one colour.
    """
    ring = border_ring(pixels.shape[:2])
    # Noise would otherwise widen the tolerance.
    smooth = ndimage.uniform_filter(pixels, (3, 3, 0)) if min(ring.shape) > 2 else pixels
    known = ring
    for _ in range(3):
        surface = _surface(smooth, known)
        apart = _apart(smooth, surface)
        spread = 1.4826 * float(np.median(apart[ring]))  # a robust standard deviation
        tolerance = min(max(2.2 * spread, _TOLERANCES[0]), _TOLERANCES[1])
        known = _reached(apart < tolerance, ring)
    colour = tuple(int(v) for v in np.round(np.median(surface[ring], axis=0)))
    outside = float((apart[ring] > tolerance).mean())
    known, surface = _spread_out(smooth, surface, known, ring, tolerance)
    known |= _holes(smooth - surface, _apart(smooth, surface) < tolerance, known, spread)
    parts, specks = main_parts(~known)
    coverage = _soft_edge(parts, _apart(pixels, surface))
    share = coverage[..., None]
    rgb = np.where(share > 0, pixels + (1 - share) * (255 - surface), 255)
    step = f"background: border colour {colour}, {tolerance / 2.55:.1f}% tolerance"
    if specks:
        step += f", {specks} specks left out"
    warning = ""
    if outside > 0.03 or tolerance >= _TOLERANCES[1]:
        warning = (
            f"the background is not uniform ({100 * outside:.0f}% of the border has other "
            f"colours, it varies by {spread / 2.55:.1f}%): check the result, or give mask=..."
        )
    return rgb, coverage, step, warning


def border_ring(shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return where the border is, (h, w): 1.5% of the shorter side wide."""
    wide = max(1, round(0.015 * min(shape)))
    ring = np.ones(shape, np.bool_)
    ring[wide:-wide, wide:-wide] = False
    return ring


def _apart(first: Floats, second: Floats) -> Floats:
    """Return how far colours are apart, (h, w): the largest difference of a channel, in levels."""
    difference = np.abs(first - second)
    return np.maximum(np.maximum(difference[..., 0], difference[..., 1]), difference[..., 2])


def _surface(pixels: Floats, known: NDArray[np.bool_]) -> Floats:
    """Fit a quadratic in x and y to each channel where `known`: least absolute deviations.

    By iteratively reweighted least squares on 4,000 pixels or fewer.
    """
    y, x = (np.linspace(-1, 1, size)[:, None] ** [0, 1, 2] for size in known.shape)  # powers
    rows, columns = np.nonzero(known)
    every = max(1, len(rows) // 4000)
    rows, columns = rows[::every], columns[::every]
    products = y[rows][:, :, None] * x[columns][:, None, :]
    terms = products[:, *_TERMS]
    colours = pixels[rows, columns].astype(np.float64)
    weights = np.ones(len(terms))
    for _ in range(12):
        weighted = terms * weights[:, None]
        ridge = 1e-6 * len(terms) * np.eye(6)  # for pictures a pixel wide
        factors = np.linalg.solve(weighted.T @ terms + ridge, weighted.T @ colours)
        weights = 1 / np.maximum(_apart(colours, terms @ factors), 1)
    surface = np.empty_like(pixels)
    for channel in range(3):
        matrix = np.zeros((3, 3))
        matrix[_TERMS] = factors[:, channel]
        surface[..., channel] = y @ matrix @ x.T
    return surface


def _reached(like: NDArray[np.bool_], ring: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return where `like` is connected to the border."""
    labels, count = ndimage.label(like)
    touching = np.zeros(count + 1, np.bool_)
    touching[labels[ring]] = True
    touching[0] = False
    return touching[labels]


def _spread_out(
    pixels: Floats,
    surface: Floats,
    known: NDArray[np.bool_],
    ring: NDArray[np.bool_],
    tolerance: float,
) -> tuple[NDArray[np.bool_], Floats]:
    """Grow the background along its own colours, and return it with its colour everywhere.

    A pixel joins whose colour is that of the background near by, to half the tolerance or 3.5,
    and a shade, darker or lighter, of the surface's.
    """
    plain = _apart(pixels, surface) < tolerance
    shade = pixels.mean(axis=2) / np.maximum(surface.mean(axis=2), 1)
    shaded = _apart(pixels, surface * shade[..., None]) < max(12, tolerance)
    shaded &= (shade > 0.45) & (shade < 1.8)
    cell = max(1, max(known.shape) // 160)
    local = surface
    for _ in range(24):
        before = np.count_nonzero(known)
        local = _near_by(pixels, known, surface, cell)
        close = _apart(pixels, local) < max(tolerance, _SHADE) / 2
        known = _reached(plain | close & shaded | known, ring)
        if np.count_nonzero(known) - before < 0.001 * known.size:
            break
    return known, local


def _near_by(pixels: Floats, known: NDArray[np.bool_], surface: Floats, cell: int) -> Floats:
    """Return the mean colour of `known` near each pixel, within cells, `surface` where none is."""
    height, width = known.shape
    rows, columns = -(-height // cell), -(-width // cell)
    sums = np.zeros((rows * cell, columns * cell, 4), np.float32)
    sums[:height, :width, :3] = (pixels - surface) * known[..., None]
    sums[:height, :width, 3] = known
    sums = sums.reshape(rows, cell, columns, cell, 4).sum(axis=(1, 3))
    sums = ndimage.gaussian_filter(sums, (1, 1, 0), truncate=2.5)
    means = sums[..., :3] / np.maximum(sums[..., 3:], 0.02 * cell**2)  # none near by: 0
    size = columns * cell, rows * cell
    channels = [
        np.asarray(Image.fromarray(means[..., c]).resize(size, Image.Resampling.BILINEAR))
        for c in range(3)
    ]
    return surface + np.stack(channels, axis=-1)[:height, :width]


def _holes(
    difference: Floats, like: NDArray[np.bool_], known: NDArray[np.bool_], spread: float
) -> NDArray[np.bool_]:
    """Return where the background is seen through the object: on average it has its colour."""
    labels, count = ndimage.label(like & ~known)
    area = np.bincount(labels.ravel(), minlength=count + 1)
    hole = area >= 4
    for channel in range(3):
        sums = np.bincount(labels.ravel(), difference[..., channel].ravel(), count + 1)
        hole &= np.abs(sums) < max(3, spread / 2) * area
    hole[0] = False
    return hole[labels]


def main_parts(covered: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], int]:
    """Return what is covered without specks, and how many those are."""
    labels, count = ndimage.label(covered, np.ones((3, 3)))
    area = np.bincount(labels.ravel(), minlength=count + 1)
    keep = area >= _SPECK * area[1:].sum()
    keep[0] = False
    return keep[labels], count - int(np.count_nonzero(keep))


def _soft_edge(parts: NDArray[np.bool_], apart: Floats) -> Floats:
    """Return coverage in [0, 1]: at edges, a pixel's share of the way to the object's colour."""
    inner = ndimage.binary_erosion(parts, iterations=3, border_value=1)
    share = apart / np.maximum(ndimage.maximum_filter(apart, 5), 1)
    return np.where(inner, 1, share * parts).astype(np.float32)
