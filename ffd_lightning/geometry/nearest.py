"""Exact nearest neighbours between pairs of clouds, both ways, differentiable.

One function, `nearest_neighbors`, chooses by device: a numba kernel on the CPU (torch's own `cdist`
is 20 times slower there), chunked torch everywhere else.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any, NamedTuple

import numba
import numpy as np
import torch
from jaxtyping import Float, Int
from numpy.typing import NDArray
from torch import Tensor

_LANES = 64
_CHUNK_DISTANCES = 1 << 24


class NearestNeighbors(NamedTuple):
    """Nearest neighbours of every point, both ways; distances are squared."""

    a_to_b: Float[Tensor, "*batch num_a"]
    a_to_b_index: Int[Tensor, "*batch num_a"]
    b_to_a: Float[Tensor, "*batch num_b"]
    b_to_a_index: Int[Tensor, "*batch num_b"]


def nearest_neighbors(
    a: Float[Tensor, "*batch_a num_a 3"], b: Float[Tensor, "*batch_b num_b 3"]
) -> NearestNeighbors:
    """Find the nearest point of `b` for every point of `a`, and the other way round.

    Exact: the index attains the smallest squared distance (of equals, either). Batch shapes
    broadcast without copying a cloud, so one query cloud (q, 1, N, 3) is shared by its templates'
    clouds (q, T, N, 3). Gradients flow to both clouds through the indices, once.

    Args:
        a: (*batch_a, N, 3), float32 or float64.
        b: (*batch_b, M, 3), same dtype and device; N and M may differ.

    Returns:
        Squared distances a->b (*batch, N), indices into b, squared distances b->a (*batch, M),
        indices into a. A point that is not finite gets the distance nan or inf and index 0.

    Raises:
        ValueError: an empty cloud, other than 3 coordinates, different dtypes or devices.

    >>> result = nearest_neighbors(torch.zeros(1, 3), torch.tensor([[3.0, 0, 0], [1, 0, 0]]))
    >>> result.a_to_b, result.a_to_b_index, result.b_to_a
    (tensor([1.]), tensor([1]), tensor([9., 1.]))
    """
    if a.shape[-1] != 3 or b.shape[-1] != 3:
        raise ValueError(f"points must have 3 coordinates, got {a.shape[-1]} and {b.shape[-1]}")
    if a.shape[-2] == 0 or b.shape[-2] == 0:
        raise ValueError(f"clouds must not be empty, got {a.shape[-2]} and {b.shape[-2]} points")
    if a.dtype != b.dtype or a.device != b.device:
        raise ValueError(f"clouds differ: {a.dtype} on {a.device}, {b.dtype} on {b.device}")
    batch = torch.broadcast_shapes(a.shape[:-2], b.shape[:-2])
    index_a, index_b = _pair_index(a.shape[:-2], batch), _pair_index(b.shape[:-2], batch)
    clouds_a, clouds_b = a.reshape(-1, *a.shape[-2:]), b.reshape(-1, *b.shape[-2:])
    result = _Nearest.apply(clouds_a, clouds_b, index_a, index_b)
    return NearestNeighbors(*(r.reshape(*batch, -1) for r in result))


def _pair_index(shape: torch.Size, batch: torch.Size) -> Tensor:
    """Return which cloud of a flattened batch of `shape` each pair of `batch` uses, (pairs,)."""
    return torch.arange(max(shape.numel(), 1)).reshape(shape).expand(batch).reshape(-1)


class _Nearest(torch.autograd.Function):
    """Nearest neighbours of pairs (a[index_a[p]], b[index_b[p]])."""

    @staticmethod
    def forward(ctx: Any, a: Tensor, b: Tensor, index_a: Tensor, index_b: Tensor) -> tuple:
        search = _search_numba if _on_cpu(a) else _search_torch
        d_ab, i_ab, d_ba, i_ba = search(a.detach(), b.detach(), index_a, index_b)
        ctx.save_for_backward(a, b, index_a, index_b, i_ab, i_ba)
        ctx.mark_non_differentiable(i_ab, i_ba)
        return d_ab, i_ab, d_ba, i_ba

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, g_ab: Tensor, _i: Tensor, g_ba: Tensor, _j: Tensor) -> tuple:
        a, b, index_a, index_b, i_ab, i_ba = ctx.saved_tensors
        gradient = _gradient_numba if _on_cpu(a) else _gradient_torch
        grad_a, grad_b = gradient(a, b, index_a, index_b, i_ab, i_ba, g_ab, g_ba)
        return grad_a, grad_b, None, None


def _on_cpu(points: Tensor) -> bool:
    return points.device.type == "cpu" and points.dtype in (torch.float32, torch.float64)


# --- any device: plain torch -------------------------------------------------------------------


def _search_torch(a: Tensor, b: Tensor, index_a: Tensor, index_b: Tensor) -> tuple[Tensor, ...]:
    """Search by explicit differences, in chunks of pairs and rows that bound the memory."""
    num_a, num_b = a.shape[1], b.shape[1]
    rows = max(1, min(num_a, _CHUNK_DISTANCES // num_b))
    pairs = max(1, _CHUNK_DISTANCES // (rows * num_b))
    parts = []
    for p in range(0, len(index_a), pairs):
        cloud_a = a[index_a[p : p + pairs].to(a.device)]
        cloud_b = b[index_b[p : p + pairs].to(a.device)]
        d_ab, i_ab = [], []
        d_ba = torch.full(cloud_b.shape[:2], torch.inf, dtype=a.dtype, device=a.device)
        i_ba = torch.zeros(cloud_b.shape[:2], dtype=torch.int64, device=a.device)
        for r in range(0, num_a, rows):
            difference = cloud_a[:, r : r + rows, None] - cloud_b[:, None]
            squared = difference.square_().sum(-1)
            low = squared.min(2)
            d_ab.append(low.values)
            i_ab.append(low.indices)
            high = squared.min(1)
            closer = high.values < d_ba
            d_ba = torch.where(closer, high.values, d_ba)
            i_ba = torch.where(closer, high.indices + r, i_ba)
        parts.append((torch.cat(d_ab, 1), torch.cat(i_ab, 1), d_ba, i_ba))
    return tuple(torch.cat(column) for column in zip(*parts, strict=True))


def _gradient_torch(
    a: Tensor,
    b: Tensor,
    index_a: Tensor,
    index_b: Tensor,
    i_ab: Tensor,
    i_ba: Tensor,
    g_ab: Tensor,
    g_ba: Tensor,
) -> tuple[Tensor, Tensor]:
    """Gradients to both clouds, (A, N, 3) and (B, M, 3)."""
    index_a, index_b = index_a.to(a.device), index_b.to(a.device)
    pair_a, pair_b = a[index_a], b[index_b]
    to_b = i_ab[..., None].expand(-1, -1, 3)
    to_a = i_ba[..., None].expand(-1, -1, 3)
    forth = 2 * g_ab[..., None] * (pair_a - pair_b.gather(1, to_b))
    back = 2 * g_ba[..., None] * (pair_b - pair_a.gather(1, to_a))
    pair_grad_a = forth.scatter_add(1, to_a, -back)
    pair_grad_b = back.scatter_add(1, to_b, -forth)
    grad_a = torch.zeros_like(a).index_add_(0, index_a, pair_grad_a)
    grad_b = torch.zeros_like(b).index_add_(0, index_b, pair_grad_b)
    return grad_a, grad_b


# --- CPU: numba --------------------------------------------------------------------------------


@lru_cache(maxsize=4)
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="nearest")


def _run(function: Callable[..., None], count: int, *arguments: Any) -> None:
    """Call function(*arguments, start, stop) over slices of range(count), one per torch thread.

    Threads with the GIL released rather than numba's own: those abort when two callers overlap or
    a process forks after using them.
    """
    threads = max(1, min(torch.get_num_threads(), count))
    if threads == 1:
        function(*arguments, 0, count)
        return
    edges = np.linspace(0, count, threads + 1).astype(int)
    submit = _pool(threads).submit
    jobs = [
        submit(function, *arguments, int(start), int(stop))
        for start, stop in itertools.pairwise(edges)
    ]
    for job in jobs:
        job.result()


def _search_numba(a: Tensor, b: Tensor, index_a: Tensor, index_b: Tensor) -> tuple[Tensor, ...]:
    pairs = len(index_a)
    d_ab, d_ba = a.new_empty(pairs, a.shape[1]), a.new_empty(pairs, b.shape[1])
    i_ab = torch.empty(d_ab.shape, dtype=torch.int64)
    i_ba = torch.empty(d_ba.shape, dtype=torch.int64)
    # Coordinates apart: neighbouring queries fill the lanes of one vector register.
    lanes_a = a.mT.contiguous().numpy()
    lanes_b = b.mT.contiguous().numpy()
    ia, ib = index_a.numpy(), index_b.numpy()
    _run(_search_pairs, pairs, lanes_a, lanes_b, ia, ib, d_ab.numpy(), i_ab.numpy())
    _run(_search_pairs, pairs, lanes_b, lanes_a, ib, ia, d_ba.numpy(), i_ba.numpy())
    return d_ab, i_ab, d_ba, i_ba


@numba.njit(nogil=True, cache=True)
def _search_pairs(
    queries: NDArray,
    targets: NDArray,
    query_index: NDArray,
    target_index: NDArray,
    distance: NDArray,
    index: NDArray,
    start: int,
    stop: int,
) -> None:  # pragma: no cover - compiled
    """One-way search: (Q, 3, N) queries among (R, 3, M) targets for pairs start..stop."""
    num_queries, num_targets = queries.shape[2], targets.shape[2]
    best = np.empty(_LANES, queries.dtype)
    found = np.empty(_LANES, np.int32)
    x = np.empty(_LANES, queries.dtype)
    y = np.empty(_LANES, queries.dtype)
    z = np.empty(_LANES, queries.dtype)
    for pair in range(start, stop):
        query, target = queries[query_index[pair]], targets[target_index[pair]]
        for block in range(0, num_queries, _LANES):
            width = min(_LANES, num_queries - block)
            for lane in range(_LANES):
                source = block + min(lane, width - 1)
                x[lane], y[lane], z[lane] = query[0, source], query[1, source], query[2, source]
                best[lane] = np.inf
                found[lane] = 0
            whole = num_targets - num_targets % 4
            for j in range(0, whole, 4):
                x0, y0, z0 = target[0, j], target[1, j], target[2, j]
                x1, y1, z1 = target[0, j + 1], target[1, j + 1], target[2, j + 1]
                x2, y2, z2 = target[0, j + 2], target[1, j + 2], target[2, j + 2]
                x3, y3, z3 = target[0, j + 3], target[1, j + 3], target[2, j + 3]
                for lane in range(_LANES):
                    u, v, w = x[lane] - x0, y[lane] - y0, z[lane] - z0
                    d0 = u * u + v * v + w * w
                    u, v, w = x[lane] - x1, y[lane] - y1, z[lane] - z1
                    d1 = u * u + v * v + w * w
                    u, v, w = x[lane] - x2, y[lane] - y2, z[lane] - z2
                    d2 = u * u + v * v + w * w
                    u, v, w = x[lane] - x3, y[lane] - y3, z[lane] - z3
                    d3 = u * u + v * v + w * w
                    low, at = best[lane], found[lane]
                    at = np.int32(j) if d0 < low else at
                    low = d0 if d0 < low else low
                    at = np.int32(j + 1) if d1 < low else at
                    low = d1 if d1 < low else low
                    at = np.int32(j + 2) if d2 < low else at
                    low = d2 if d2 < low else low
                    at = np.int32(j + 3) if d3 < low else at
                    low = d3 if d3 < low else low
                    best[lane], found[lane] = low, at
            for j in range(whole, num_targets):
                for lane in range(_LANES):
                    u = x[lane] - target[0, j]
                    v = y[lane] - target[1, j]
                    w = z[lane] - target[2, j]
                    d0 = u * u + v * v + w * w
                    found[lane] = np.int32(j) if d0 < best[lane] else found[lane]
                    best[lane] = d0 if d0 < best[lane] else best[lane]
            for lane in range(width):
                distance[pair, block + lane] = best[lane]
                index[pair, block + lane] = found[lane]


def _gradient_numba(
    a: Tensor,
    b: Tensor,
    index_a: Tensor,
    index_b: Tensor,
    i_ab: Tensor,
    i_ba: Tensor,
    g_ab: Tensor,
    g_ba: Tensor,
) -> tuple[Tensor, Tensor]:
    pair_grad_a = a.new_empty(len(index_a), *a.shape[1:])
    pair_grad_b = b.new_empty(len(index_b), *b.shape[1:])
    arrays = (a.detach(), b.detach(), index_a, index_b, i_ab, i_ba, g_ab, g_ba)
    _run(
        _gradient_pairs,
        len(index_a),
        *(t.contiguous().numpy() for t in arrays),
        pair_grad_a.numpy(),
        pair_grad_b.numpy(),
    )
    # Sum the pairs that share a cloud; in a fixed order, so that runs repeat to the last bit.
    grad_a = torch.zeros_like(a).index_add_(0, index_a, pair_grad_a)
    grad_b = torch.zeros_like(b).index_add_(0, index_b, pair_grad_b)
    return grad_a, grad_b


@numba.njit(nogil=True, cache=True)
def _gradient_pairs(
    a: NDArray,
    b: NDArray,
    index_a: NDArray,
    index_b: NDArray,
    i_ab: NDArray,
    i_ba: NDArray,
    g_ab: NDArray,
    g_ba: NDArray,
    grad_a: NDArray,
    grad_b: NDArray,
    start: int,
    stop: int,
) -> None:  # pragma: no cover - compiled
    for pair in range(start, stop):
        cloud_a, cloud_b = a[index_a[pair]], b[index_b[pair]]
        grad_a[pair] = 0
        grad_b[pair] = 0
        for i in range(cloud_a.shape[0]):
            j = i_ab[pair, i]
            for k in range(3):
                step = 2 * g_ab[pair, i] * (cloud_a[i, k] - cloud_b[j, k])
                grad_a[pair, i, k] += step
                grad_b[pair, j, k] -= step
        for j in range(cloud_b.shape[0]):
            i = i_ba[pair, j]
            for k in range(3):
                step = 2 * g_ba[pair, j] * (cloud_b[j, k] - cloud_a[i, k])
                grad_b[pair, j, k] += step
                grad_a[pair, i, k] -= step
