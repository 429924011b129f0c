"""Nearest neighbours on CUDA, in Triton: every distance once, serving both directions.

`_lay_out` writes the clouds coordinate by coordinate, padded to whole tiles, with points that are
not finite moved to infinity: those of `a` to +inf and those of `b` to -inf, so that no difference
is ever nan. `_sweep` then computes all distances of a pair, tile by tile, and `_find` the indices.
What makes it fast:

- A program is one warp, and a thread owns one column (a point of `b`) of a tile and all its rows
  (points of `a`). The rows' coordinates and minima stay in registers while the columns go by, and
  the columns' minima are taken within the thread: no exchange between threads inside the loop.
- No index is carried along. The sweep keeps, for a column, which tile of rows held its minimum, and
  for a row, which thread did. Both stand for a block of neighbouring points, because thread l
  sweeps the points l * count, l * count + 1, ... `_find` searches that block only.
- The order of non-negative floats is that of their bits read as integers. So a minimum and where it
  was fit one 64-bit integer, a warp reduces them in one instruction, and a Hopper GPU takes the
  least of three in one. The loop of the sweep comes to 8.2 instructions per distance there, 6 of
  them arithmetic.

Gradients are a few gathers: plain torch's. Clouds may have up to 2 million points, the limit of a
launch's grid.
"""

from __future__ import annotations

import torch
import triton
import triton.language as tl
from torch import Tensor

from ffd_lightning.geometry.nearest.torch_backend import gradient

__all__ = ["gradient", "search"]

_LANES = 32  # threads of a warp: columns of a tile
_ROWS = 32  # of a tile; each takes 4 registers of every thread, so 64 do not fit
_PROGRAMS = 8192  # at least so many warps, where the work can be split, fill the largest GPU
_MAX_SPLITS = 64  # bounds the memory of the minima that parts of a pair leave behind
_QUERIES = 32
_CANDIDATES = 32
_POINTS = 256
INF = tl.constexpr(0x7F800000)  # the bits of inf
UNSEEN = tl.constexpr(0x7F800000 << 32)  # inf, in block or at point 0


def search(a: Tensor, b: Tensor, index_a: Tensor, index_b: Tensor) -> tuple[Tensor, ...]:
    """Return squared distances and indices, both ways (float32); see `torch_backend.search`."""
    pairs, num_a, num_b = len(index_a), a.shape[1], b.shape[1]
    row_tiles = triton.cdiv(num_a, _ROWS)
    wanted = triton.cdiv(_PROGRAMS, max(pairs, 1))
    tiles = triton.cdiv(row_tiles, min(row_tiles, _MAX_SPLITS, wanted))
    row_splits = triton.cdiv(row_tiles, tiles)
    # Parts of fewer columns would spend their time on starting and ending.
    column_splits = min(triton.cdiv(num_b, 1024), _MAX_SPLITS, triton.cdiv(wanted, row_splits))
    count = 4 * triton.cdiv(num_b, 4 * _LANES * column_splits)
    width_a, width_b = row_tiles * _ROWS, column_splits * count * _LANES

    with torch.cuda.device_of(a):
        rows = _laid_out(a, width_a, 1, torch.inf)
        columns = _laid_out(b, width_b, 1, -torch.inf)
        swept = _laid_out(b, width_b, count, -torch.inf)
        # For every point and part of the sweep: bits of the least distance, and its block.
        near_a = index_a.new_empty(pairs, column_splits, width_a)
        near_b = index_a.new_empty(pairs, row_splits, width_b)
        _sweep[(pairs, row_splits, column_splits)](
            rows, swept, index_a, index_b, near_a, near_b,
            width_a, width_b, tiles, row_tiles, count,
            ROWS=_ROWS, LANES=_LANES, num_warps=1,
        )  # fmt: skip
        d_ab, i_ab = _found(rows, columns, index_a, index_b, near_a, num_a, 1, count, -torch.inf)
        d_ba, i_ba = _found(swept, rows, index_b, index_a, near_b, num_b, count, _ROWS, torch.inf)
    return d_ab, i_ab, d_ba, i_ba


def _laid_out(clouds: Tensor, width: int, span: int, away: float) -> Tensor:
    """Return clouds (C, N, 3) as (C, 3, width), ordered by `_point`, missing points at `away`."""
    out = clouds.new_empty(len(clouds), 3, width)
    grid = (len(clouds), triton.cdiv(width, _POINTS))
    _lay_out[grid](
        clouds.contiguous(), out, clouds.shape[1], width, span,
        AWAY=away, LANES=_LANES, POINTS=_POINTS, num_warps=4,
    )  # fmt: skip
    return out


def _found(
    points: Tensor,
    others: Tensor,
    index_points: Tensor,
    index_others: Tensor,
    near: Tensor,
    num: int,
    span: int,
    count: int,
    away: float,
) -> tuple[Tensor, Tensor]:
    """Return distances and indices of the first cloud's `num` points from what the sweep left."""
    pairs, splits, width = near.shape
    d = points.new_empty(pairs, num)
    i = near.new_empty(pairs, num)
    _find[(pairs, triton.cdiv(width, _QUERIES))](
        points, others, index_points, index_others, near, d, i,
        num, width, others.shape[2], splits, span, count // 4,
        AWAY=away, LANES=_LANES, QUERIES=_QUERIES, CANDIDATES=_CANDIDATES, num_warps=1,
    )  # fmt: skip
    return d, i


@triton.jit
def _point(position: tl.tensor, span: tl.tensor, LANES: tl.constexpr) -> tl.tensor:
    """Which point is at a position: `span` tiles in a row give each lane `span` neighbours."""
    tile = position // LANES
    return (tile // span * LANES + position % LANES) * span + tile % span


@triton.jit
def _lay_out(
    clouds: tl.tensor,
    out: tl.tensor,
    num: tl.tensor,
    width: tl.tensor,
    span: tl.tensor,
    AWAY: tl.constexpr,
    LANES: tl.constexpr,
    POINTS: tl.constexpr,
) -> None:
    cloud = tl.program_id(0).to(tl.int64)
    position = tl.program_id(1) * POINTS + tl.arange(0, POINTS)
    point = _point(position, span, LANES)
    source = clouds + cloud * num * 3 + point * 3
    x = tl.load(source, mask=point < num, other=float("inf"))
    y = tl.load(source + 1, mask=point < num, other=float("inf"))
    z = tl.load(source + 2, mask=point < num, other=float("inf"))
    finite = (x - x) + (y - y) + (z - z) == 0
    target = out + cloud * width * 3 + position
    tl.store(target, tl.where(finite, x, AWAY), mask=position < width)
    tl.store(target + width, tl.where(finite, y, AWAY), mask=position < width)
    tl.store(target + 2 * width, tl.where(finite, z, AWAY), mask=position < width)


@triton.jit
def _squared(
    x: tl.tensor, y: tl.tensor, z: tl.tensor, p: tl.tensor, q: tl.tensor, r: tl.tensor
) -> tl.tensor:
    u, v, w = x - p, y - q, z - r
    return tl.fma(w, w, tl.fma(v, v, u * u))


@triton.jit
def _noted(bits: tl.tensor, block: tl.tensor) -> tl.tensor:
    """A distance's bits and the block it was seen in, ordered by distance."""
    return bits.to(tl.int64) << 32 | block


@triton.jit
def _least(bits: tl.tensor, numbers: tl.tensor) -> tl.tensor:
    """The least of each row of distances' bits, and the least number of a column that has it."""
    low = tl.min(bits, 1)
    return low, tl.min(tl.where(bits == low[:, None], numbers[None], INF), 1)


@triton.jit
def _sweep(
    rows: tl.tensor,
    columns: tl.tensor,
    index_a: tl.tensor,
    index_b: tl.tensor,
    near_a: tl.tensor,
    near_b: tl.tensor,
    width_a: tl.tensor,
    width_b: tl.tensor,
    tiles: tl.tensor,
    row_tiles: tl.tensor,
    count: tl.tensor,
    ROWS: tl.constexpr,
    LANES: tl.constexpr,
) -> None:
    """Sweep `tiles` tiles of rows over `count` tiles of columns, an even number, of a pair."""
    pair = tl.program_id(0).to(tl.int64)
    split_a, split_b = tl.program_id(1), tl.program_id(2)
    lane = tl.arange(0, LANES)
    rows += tl.load(index_a + pair) * 3 * width_a
    columns += tl.load(index_b + pair) * 3 * width_b + split_b * count * LANES + lane
    near_a += (pair * tl.num_programs(2) + split_b) * width_a
    near_b += (pair * tl.num_programs(1) + split_a) * width_b + split_b * count * LANES + lane
    first = split_a * tiles
    for tile in range(first, tl.minimum(first + tiles, row_tiles)):
        row = tile * ROWS + tl.arange(0, ROWS)
        x = tl.load(rows + row)[:, None]
        y = tl.load(rows + width_a + row)[:, None]
        z = tl.load(rows + 2 * width_a + row)[:, None]
        least = tl.full([ROWS, LANES], INF, tl.int32)
        begun = tl.full([LANES], tile, tl.int32) > first  # the interpreter wants no scalar mask
        for step in range(0, count * LANES, 2 * LANES):
            here, near = columns + step, near_b + step
            near_even = tl.load(near, mask=begun, other=UNSEEN)
            near_odd = tl.load(near + LANES, mask=begun, other=UNSEEN)
            p, q, r = tl.load(here), tl.load(here + width_b), tl.load(here + 2 * width_b)
            even = _squared(x, y, z, p[None], q[None], r[None]).to(tl.int32, bitcast=True)
            here += LANES
            p, q, r = tl.load(here), tl.load(here + width_b), tl.load(here + 2 * width_b)
            odd = _squared(x, y, z, p[None], q[None], r[None]).to(tl.int32, bitcast=True)
            least = tl.minimum(least, tl.minimum(even, odd))
            tl.store(near, tl.minimum(near_even, _noted(tl.min(even, 0), tile)))
            tl.store(near + LANES, tl.minimum(near_odd, _noted(tl.min(odd, 0), tile)))
        low, at = _least(least, lane)
        tl.store(near_a + row, _noted(low, split_b * LANES + at))


@triton.jit
def _find(
    points: tl.tensor,
    others: tl.tensor,
    index_points: tl.tensor,
    index_others: tl.tensor,
    near: tl.tensor,
    d: tl.tensor,
    i: tl.tensor,
    num: tl.tensor,
    width: tl.tensor,
    others_width: tl.tensor,
    splits: tl.tensor,
    span: tl.tensor,
    fours: tl.tensor,
    AWAY: tl.constexpr,
    LANES: tl.constexpr,
    QUERIES: tl.constexpr,
    CANDIDATES: tl.constexpr,
) -> None:
    """Take the best of the sweep's parts and search its block, 4 * `fours` points."""
    count = fours * 4  # lets the compiler see that four coordinates can be loaded at once
    pair = tl.program_id(0).to(tl.int64)
    query = tl.program_id(1) * QUERIES + tl.arange(0, QUERIES)
    inside = query < width
    best = tl.full([QUERIES], UNSEEN, tl.int64)
    for split in range(splits):
        part = near + (pair * splits + split) * width
        best = tl.minimum(best, tl.load(part + query, mask=inside, other=UNSEEN))
    first = best.to(tl.int32) * count

    points += tl.load(index_points + pair) * 3 * width + query
    x = tl.load(points, mask=inside, other=0.0)
    y = tl.load(points + width, mask=inside, other=0.0)
    z = tl.load(points + 2 * width, mask=inside, other=0.0)
    others += tl.load(index_others + pair) * 3 * others_width
    candidate = tl.arange(0, CANDIDATES)
    best = tl.full([QUERIES], UNSEEN, tl.int64)
    for start in range(0, count, CANDIDATES):
        there = others + (first + start)[:, None] + candidate[None]
        mask = (start + candidate < count)[None]
        p = tl.load(there, mask=mask, other=AWAY)
        q = tl.load(there + others_width, mask=mask, other=AWAY)
        r = tl.load(there + 2 * others_width, mask=mask, other=AWAY)
        squared = _squared(x[:, None], y[:, None], z[:, None], p, q, r)
        low, at = _least(squared.to(tl.int32, bitcast=True), candidate)
        best = tl.minimum(best, _noted(low, first + start + at))

    point = _point(query, span, LANES)
    wanted = point < num
    low = (best >> 32).to(tl.int32).to(tl.float32, bitcast=True)
    low += (x - x) + (y - y) + (z - z)  # nan where the point itself is not finite
    tl.store(d + pair * num + point, low, mask=wanted)
    tl.store(i + pair * num + point, best & 0x7FFFFFFF, mask=wanted)
