"""Few shapes become many: deformed variants of each, to train on."""

import hashlib
from dataclasses import replace
from itertools import product
from math import comb

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.data.source import SourceShape
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.mesh import Mesh

WANTED = 300
"""Shapes and variants, to which `auto` brings fewer shapes."""
MOST = 15
"""Variants of each at most under `auto`: further ones teach nothing more."""

_BEND = 0.08  # standard deviation of control points' offsets, of the box's sides
_STRETCH = 0.18  # of the logarithm of each axis' factor
_TINT = 0.2  # of the logarithm of each colour's factor
_DEGREE = 3  # of the lattice, along each axis


def enough_variants(shapes: int) -> int:
    """Return how many variants of each shape `auto` means.

    >>> [enough_variants(count) for count in (1, 63, 299, 300)]
    [15, 4, 1, 0]
    """
    return min(MOST, -(-WANTED // max(shapes, 1)) - 1)


def variant_ids(ids: list[str], count: int) -> dict[str, str]:
    """Return the ids of `count` variants of each shape, and which shape each is of.

    >>> variant_ids(["a", "b"], 2)
    {'a~0': 'a', 'a~1': 'a', 'b~0': 'b', 'b~1': 'b'}
    """
    found = {f"{shape_id}~{k}": shape_id for shape_id in ids for k in range(count)}
    if taken := found.keys() & set(ids):
        own = min(taken)
        raise ConfigError(
            f"the shape {own} has the name of a variant of {found[own]}: give it another name, or "
            "make no variants (data.variants=0)"
        )
    return found


def vary(shape: SourceShape, key: str) -> SourceShape:
    """Return a deformed variant of a shape in other colours; `key` decides which.

    Control points of a lattice are moved at random, left and right alike, so that a symmetric shape
    stays symmetric; then each axis is stretched or squeezed. Colour channels change places and are
    scaled. Part labels, textures, family and annotated points go along, and no warnings.
    """
    rng = np.random.default_rng(list(hashlib.sha256(key.encode()).digest()))
    mesh, parts = shape.mesh, shape.parts
    used = mesh.used_vertices()
    low, size = used.min(0), np.ptp(used, axis=0)
    offsets = rng.normal(0, _BEND, (*[_DEGREE + 1] * 3, 3)) * size
    offsets = (offsets + offsets[::-1] * (-1, 1, 1)) / np.sqrt(2)  # of the same deviation
    factors = np.exp(rng.normal(0, _STRETCH, 3))

    def moved(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return deformed(points, low, size, offsets) * factors

    channels, gains = rng.permutation(3), np.exp(rng.normal(0, _TINT, 3))
    mesh = _tinted(mesh.with_vertices(moved(mesh.vertices)), channels, gains)
    if parts is not None:
        parts = replace(parts, points=moved(parts.points))
    return replace(shape, mesh=mesh, parts=parts, warning="")


def deformed(
    points: NDArray[np.float64],
    low: NDArray[np.float64],
    size: NDArray[np.float64],
    offsets: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return points, (N, 3), moved by offsets of a lattice's control points, (l, m, n, 3).

    As `geometry.ffd` deforms, without torch, which worker processes do not import. The lattice is
    the box of sides `size`, (3,), from its corner `low` on.
    """
    along = (points - low) / np.where(size > 0, size, 1)
    along[:, size <= 0] = 0.5
    weights = [_bernstein(along[:, axis], offsets.shape[axis] - 1) for axis in range(3)]
    result = points.copy()
    for i, j in product(*map(range, offsets.shape[:2])):  # all at once would take much memory
        share = weights[0][:, i] * weights[1][:, j]
        result += share[:, None] * (weights[2] @ offsets[i, j])
    return result


def _bernstein(t: NDArray[np.float64], degree: int) -> NDArray[np.float64]:
    """Return the Bernstein polynomials of a degree at t, (N,), as (N, degree + 1)."""
    each = (comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1))
    return np.stack(list(each), axis=1)


def _tinted(mesh: Mesh, channels: NDArray[np.int64], gains: NDArray[np.float64]) -> Mesh:
    """Return a mesh whose red, green and blue are other channels of its own, scaled by gains."""
    table = np.clip(np.arange(256)[:, None] * gains, 0, 255).astype(np.uint8)

    def tint(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
        other = [table[colors[..., channel], k] for k, channel in enumerate(channels)]
        return np.stack([*other, colors[..., 3]], axis=-1)

    textures = tuple(tint(texture) for texture in mesh.textures)
    return replace(mesh, face_colors=tint(mesh.face_colors), textures=textures)
