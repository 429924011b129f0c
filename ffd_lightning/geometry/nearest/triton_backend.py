"""Nearest neighbours on CUDA, in Triton.

A program holds some points of one cloud and goes through the other, tile by tile. What it has seen
nearest is kept apart for each column of a tile, so that threads exchange nothing before the end.
Gradients are a few gathers: plain torch's.
"""

import torch
import triton
import triton.language as tl
from torch import Tensor

from ffd_lightning.geometry.nearest.torch_backend import gradient

__all__ = ["gradient", "search"]

_ROWS, _COLUMNS = 64, 32  # of a tile of distances


def search(a: Tensor, b: Tensor, index_a: Tensor, index_b: Tensor) -> tuple[Tensor, ...]:
    """Return squared distances and indices, both ways (float32); see `torch_backend.search`."""
    return (*_nearest(a, b, index_a, index_b), *_nearest(b, a, index_b, index_a))


def _nearest(a: Tensor, b: Tensor, index_a: Tensor, index_b: Tensor) -> tuple[Tensor, Tensor]:
    pairs, num_a, num_b = len(index_a), a.shape[1], b.shape[1]
    d, i = a.new_empty(pairs, num_a), index_a.new_empty(pairs, num_a)
    clouds = a.mT.contiguous(), b.mT.contiguous()
    with torch.cuda.device_of(a):
        _sweep[(pairs, triton.cdiv(num_a, _ROWS))](
            *clouds, index_a, index_b, d, i, num_a, num_b, ROWS=_ROWS, COLUMNS=_COLUMNS
        )
    return d, i


@triton.jit
def _sweep(
    a: tl.tensor,
    b: tl.tensor,
    index_a: tl.tensor,
    index_b: tl.tensor,
    d: tl.tensor,
    i: tl.tensor,
    num_a: tl.tensor,
    num_b: tl.tensor,
    ROWS: tl.constexpr,
    COLUMNS: tl.constexpr,
) -> None:
    """Find what of `b` is nearest to ROWS points of `a`, of one pair of clouds (C, 3, N)."""
    pair = tl.program_id(0).to(tl.int64)
    row = tl.program_id(1) * ROWS + tl.arange(0, ROWS)
    inside = row < num_a
    a += tl.load(index_a + pair) * 3 * num_a + row
    b += tl.load(index_b + pair) * 3 * num_b
    x = tl.load(a, mask=inside, other=0.0)
    y = tl.load(a + num_a, mask=inside, other=0.0)
    z = tl.load(a + 2 * num_a, mask=inside, other=0.0)
    lane = tl.arange(0, COLUMNS)
    least = tl.full([ROWS, COLUMNS], float("inf"), tl.float32)
    tile = tl.zeros([ROWS, COLUMNS], tl.int32)
    for start in range(0, num_b, COLUMNS):
        point, there = b + start + lane, start + lane < num_b
        p = tl.load(point, mask=there, other=float("inf"))
        q = tl.load(point + num_b, mask=there, other=float("inf"))
        r = tl.load(point + 2 * num_b, mask=there, other=float("inf"))
        u, v, w = x[:, None] - p[None], y[:, None] - q[None], z[:, None] - r[None]
        squared = tl.fma(w, w, tl.fma(v, v, u * u))
        closer = squared < least  # never of nan
        least, tile = tl.where(closer, squared, least), tl.where(closer, start, tile)
    low = tl.min(least, 1)
    first = tl.min(tl.where(least == low[:, None], tile + lane[None], num_b), 1)
    low += (x - x) + (y - y) + (z - z)  # nan where the point itself is not finite
    tl.store(d + pair * num_a + row, low, mask=inside)
    tl.store(i + pair * num_a + row, first, mask=inside)
