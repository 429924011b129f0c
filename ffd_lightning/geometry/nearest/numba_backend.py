"""Nearest neighbours on the CPU: every distance once, serving both directions.

How it gets near the arithmetic's own speed, measured by `benchmarks/nearest.py`:

- The points of `a` are the lanes of the vector registers, eight points of `b` at a time are
  scalars: the compiler sees nothing but elementwise operations, which it vectorises.
- No index is carried along. The sweep keeps, for a point of `a`, which block of 8 points held its
  minimum, and for a point of `b`, the minimum of every lane. The index is then looked for among the
  few points of that block or lane.
- The order of non-negative floats is that of their bits read as integers, and integer minima
  vectorise without a promise about nan.
"""

from functools import partial
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.geometry.compiled import jit, over_threads

# Integers as wide as the floats. Arrays, since numba takes long to recognise a dtype at each call.
_BITS = {torch.float32: np.empty(0, np.int32), torch.float64: np.empty(0, np.int64)}

_LANES = 128  # with AVX2, 64 and 256 took a fifth longer; with AVX-512 as long
_BLOCK = 8  # points of b swept at once, as written out in _sweep


# Fused multiply-add is allowed, nothing else that fast-math means: padding relies on inf and nan.
_jit = partial(jit, fastmath={"contract"})


def search(a: Tensor, b: Tensor, index_a: Tensor, index_b: Tensor) -> tuple[Tensor, ...]:
    """Return squared distances and indices, both ways; see `torch_backend.search`."""
    if a.shape[1] < b.shape[1]:  # the larger cloud fills the lanes
        d_ba, i_ba, d_ab, i_ab = search(b, a, index_b, index_a)
        return d_ab, i_ab, d_ba, i_ba
    pairs = len(index_a)
    d_ab, d_ba = a.new_empty(pairs, a.shape[1]), a.new_empty(pairs, b.shape[1])
    i_ab, i_ba = (torch.empty(d.shape, dtype=torch.int64) for d in (d_ab, d_ba))
    arrays = (a.contiguous(), b.contiguous(), index_a, index_b, d_ab, i_ab, d_ba, i_ba)
    over_threads(_search_pairs, pairs, *(t.numpy() for t in arrays), _BITS[a.dtype])
    return d_ab, i_ab, d_ba, i_ba


def gradient(
    a: Tensor,
    b: Tensor,
    index_a: Tensor,
    index_b: Tensor,
    i_ab: Tensor,
    i_ba: Tensor,
    g_ab: Tensor,
    g_ba: Tensor,
) -> Tensor:
    """Return the gradient with respect to `a`, (A, N, 3); shapes as in `torch_backend`."""
    result = a.new_empty(len(index_a), *a.shape[1:])
    arrays = (a, b, index_a, index_b, i_ab, i_ba, g_ab, g_ba, result)
    over_threads(_gradient_pairs, len(index_a), *(t.contiguous().numpy() for t in arrays))
    if len(a) == len(index_a):
        return result
    # Sum the pairs that share a cloud; in a fixed order, so that runs repeat to the last bit.
    return torch.zeros_like(a).index_add_(0, index_a, result)


@_jit
def _search_pairs(
    clouds_a: NDArray,
    clouds_b: NDArray,
    index_a: NDArray,
    index_b: NDArray,
    d_ab: NDArray,
    i_ab: NDArray,
    d_ba: NDArray,
    i_ba: NDArray,
    bits: NDArray,
    start: int,
    stop: int,
) -> None:  # pragma: no cover - compiled
    """Search pairs start..stop; `bits` is of the integers as wide as the floats."""
    dtype = clouds_a.dtype
    num_a, num_b = clouds_a.shape[1], clouds_b.shape[1]
    slabs = (num_a + _LANES - 1) // _LANES
    a = np.empty((3, slabs * _LANES), dtype)
    b = np.empty((3, (num_b + _BLOCK - 1) // _BLOCK * _BLOCK), dtype)
    lanes = np.empty((3, slabs * _LANES), dtype)
    nearest = np.empty(lanes.shape[1], dtype)
    block = np.empty(lanes.shape[1], np.int32)
    columns = np.empty(_BLOCK * _LANES, dtype)
    column_bits = columns.view(bits.dtype)
    for pair in range(start, stop):
        _coordinates(clouds_a[index_a[pair]], a)
        _coordinates(clouds_b[index_b[pair]], b)
        far_a, to_b, far_b, to_a = d_ab[pair], i_ab[pair], d_ba[pair], i_ba[pair]
        # Lane l sweeps the neighbouring points l * slabs, l * slabs + 1, ..., so that the
        # candidates of a lane lie side by side.
        for k in range(3):
            for lane in range(_LANES):
                for slab in range(slabs):
                    lanes[k, slab * _LANES + lane] = a[k, lane * slabs + slab]
        nearest[:] = np.inf
        block[:] = 0
        for j in range(0, b.shape[1], _BLOCK):
            columns[:] = np.inf
            _sweep(lanes, b[:, j : j + _BLOCK], columns, nearest, block, np.int32(j))
            for i in range(j, min(j + _BLOCK, num_b)):
                column = (i - j) * _LANES
                lane = _first_minimum(column_bits[column : column + _LANES])
                _closest(b, i, a, lane * slabs, slabs, far_b, to_a)
        for lane in range(_LANES):
            for slab in range(slabs):
                i = lane * slabs + slab
                if i < num_a:
                    _closest(a, i, b, block[slab * _LANES + lane], _BLOCK, far_a, to_b)


@_jit
def _closest(
    points: NDArray, i: int, others: NDArray, first: int, count: int, d: NDArray, index: NDArray
) -> None:  # pragma: no cover - compiled
    """Write distance and index of the closest to point i among `count` others from `first` on."""
    x, y, z = points[0, i], points[1, i], points[2, i]
    low = x - x + d.dtype.type(np.inf)  # a point that is not finite gets nan
    at = 0
    for j in range(first, first + count):
        squared = _squared(others[0, j], others[1, j], others[2, j], x, y, z)
        at = j if squared < low else at
        low = _lower(low, squared)
    d[i], index[i] = low, at


@_jit
def _coordinates(points: NDArray, out: NDArray) -> None:  # pragma: no cover - compiled
    """Write (N, 3) points as (3, N or more); points that are not finite and padding become inf."""
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        good = np.isfinite(x) and np.isfinite(y) and np.isfinite(z)
        out[0, i] = x if good else np.inf
        out[1, i] = y if good else np.inf
        out[2, i] = z if good else np.inf
    out[:, len(points) :] = np.inf


@_jit
def _squared(x: Any, y: Any, z: Any, p: Any, q: Any, r: Any) -> Any:  # pragma: no cover - compiled
    u, v, w = x - p, y - q, z - r
    return u * u + v * v + w * w


@_jit
def _lower(low: Any, d: Any) -> Any:  # pragma: no cover - compiled
    """The lower of two, `low` where d is nan: one instruction, which min() is not."""
    return d if d < low else low


@_jit
def _first_minimum(values: NDArray) -> Any:  # pragma: no cover - compiled
    """Index of the first minimum of integers, in two loops that vectorise."""
    low = values[0]
    for k in range(len(values)):
        low = min(low, values[k])
    at = np.int32(len(values))
    for k in range(len(values)):
        at = min(at, np.int32(k) if values[k] == low else np.int32(len(values)))
    return at


@_jit
def _sweep(
    points: NDArray, q: NDArray, columns: NDArray, nearest: NDArray, block: NDArray, number: Any
) -> None:  # pragma: no cover - compiled
    """Distances of all lanes' points (3, N) to 8 points (3, 8), with all minima updated."""
    x0, y0, z0 = q[0, 0], q[1, 0], q[2, 0]
    x1, y1, z1 = q[0, 1], q[1, 1], q[2, 1]
    x2, y2, z2 = q[0, 2], q[1, 2], q[2, 2]
    x3, y3, z3 = q[0, 3], q[1, 3], q[2, 3]
    x4, y4, z4 = q[0, 4], q[1, 4], q[2, 4]
    x5, y5, z5 = q[0, 5], q[1, 5], q[2, 5]
    x6, y6, z6 = q[0, 6], q[1, 6], q[2, 6]
    x7, y7, z7 = q[0, 7], q[1, 7], q[2, 7]
    for slab in range(0, points.shape[1], _LANES):
        xs = points[0, slab : slab + _LANES]
        ys = points[1, slab : slab + _LANES]
        zs = points[2, slab : slab + _LANES]
        low, at = nearest[slab : slab + _LANES], block[slab : slab + _LANES]
        for lane in range(_LANES):
            x, y, z = xs[lane], ys[lane], zs[lane]
            d0 = _squared(x, y, z, x0, y0, z0)
            d1 = _squared(x, y, z, x1, y1, z1)
            d2 = _squared(x, y, z, x2, y2, z2)
            d3 = _squared(x, y, z, x3, y3, z3)
            d4 = _squared(x, y, z, x4, y4, z4)
            d5 = _squared(x, y, z, x5, y5, z5)
            d6 = _squared(x, y, z, x6, y6, z6)
            d7 = _squared(x, y, z, x7, y7, z7)
            columns[lane] = _lower(columns[lane], d0)
            columns[lane + _LANES] = _lower(columns[lane + _LANES], d1)
            columns[lane + 2 * _LANES] = _lower(columns[lane + 2 * _LANES], d2)
            columns[lane + 3 * _LANES] = _lower(columns[lane + 3 * _LANES], d3)
            columns[lane + 4 * _LANES] = _lower(columns[lane + 4 * _LANES], d4)
            columns[lane + 5 * _LANES] = _lower(columns[lane + 5 * _LANES], d5)
            columns[lane + 6 * _LANES] = _lower(columns[lane + 6 * _LANES], d6)
            columns[lane + 7 * _LANES] = _lower(columns[lane + 7 * _LANES], d7)
            d0, d2, d4, d6 = _lower(d0, d1), _lower(d2, d3), _lower(d4, d5), _lower(d6, d7)
            d0 = _lower(_lower(d0, d2), _lower(d4, d6))
            at[lane] = number if d0 < low[lane] else at[lane]
            low[lane] = _lower(low[lane], d0)


@_jit
def _gradient_pairs(
    a: NDArray,
    b: NDArray,
    index_a: NDArray,
    index_b: NDArray,
    i_ab: NDArray,
    i_ba: NDArray,
    g_ab: NDArray,
    g_ba: NDArray,
    result: NDArray,
    start: int,
    stop: int,
) -> None:  # pragma: no cover - compiled
    for pair in range(start, stop):
        cloud_a, cloud_b, out = a[index_a[pair]], b[index_b[pair]], result[pair]
        for i in range(len(cloud_a)):
            j, g = i_ab[pair, i], 2 * g_ab[pair, i]
            for k in range(3):
                out[i, k] = g * (cloud_a[i, k] - cloud_b[j, k])
        for j in range(len(cloud_b)):
            i, g = i_ba[pair, j], 2 * g_ba[pair, j]
            for k in range(3):
                out[i, k] += g * (cloud_a[i, k] - cloud_b[j, k])
