"""Nearest neighbours in plain torch: any device, any floating type, memory bounded by chunks."""

import torch
from torch import Tensor

_CHUNK_DISTANCES = 1 << 24


def search(a: Tensor, b: Tensor, index_a: Tensor, index_b: Tensor) -> tuple[Tensor, ...]:
    """Return what every backend's `search` returns, for P pairs of clouds.

    Args:
        a: (A, N, 3).
        b: (B, M, 3).
        index_a: which of `a` each pair is of, (P,).
        index_b: which of `b`, (P,).

    Returns:
        Squared distances a to b (P, N), their indices, b to a (P, M), their indices; what points
        that are not finite get, `nearest_neighbors` says.
    """
    num_a, num_b = a.shape[1], b.shape[1]
    rows = max(1, min(num_a, _CHUNK_DISTANCES // num_b))
    pairs = max(1, _CHUNK_DISTANCES // (rows * num_b))
    parts = []
    for p in range(0, len(index_a), pairs):
        cloud_a, cloud_b = a[index_a[p : p + pairs]], b[index_b[p : p + pairs]]
        nearest_b = []
        d_ba = torch.full(cloud_b.shape[:2], torch.inf, dtype=a.dtype, device=a.device)
        i_ba = torch.zeros(cloud_b.shape[:2], dtype=torch.int64, device=a.device)
        for r in range(0, num_a, rows):
            difference = cloud_a[:, r : r + rows, None] - cloud_b[:, None]
            squared = difference.square_().sum(-1).nan_to_num_(torch.inf, torch.inf)
            nearest_b.append(squared.min(2))
            high = squared.min(1)
            closer = high.values < d_ba
            d_ba = torch.where(closer, high.values, d_ba)
            i_ba = torch.where(closer, high.indices + r, i_ba)
        d_ab, i_ab = (torch.cat(column, 1) for column in zip(*nearest_b, strict=True))
        parts.append((d_ab, i_ab, d_ba, i_ba))
    d_ab, i_ab, d_ba, i_ba = (torch.cat(column) for column in zip(*parts, strict=True))
    return (
        d_ab.where(a.isfinite().all(-1)[index_a], torch.nan),
        i_ab.where(d_ab < torch.inf, 0),
        d_ba.where(b.isfinite().all(-1)[index_b], torch.nan),
        i_ba.where(d_ba < torch.inf, 0),
    )


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
    """Return what every backend's `gradient` returns: that with respect to `a`, (A, N, 3).

    Args are those of `search`, the indices i_ab (P, N) and i_ba (P, M) that it found, and the
    gradients g_ab and g_ba of the squared distances, of the same shapes.
    """
    pair_a, pair_b = a[index_a], b[index_b]
    to_b = i_ab[..., None].expand(-1, -1, 3)
    to_a = i_ba[..., None].expand(-1, -1, 3)
    forth = 2 * g_ab[..., None] * (pair_a - pair_b.gather(1, to_b))
    back = 2 * g_ba[..., None] * (pair_a.gather(1, to_a) - pair_b)
    return torch.zeros_like(a).index_add_(0, index_a, forth.scatter_add(1, to_a, back))
