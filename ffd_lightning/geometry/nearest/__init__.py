"""Exact nearest neighbours between pairs of clouds, both ways, differentiable.

One function, `nearest_neighbors`, and a module per backend behind it, chosen by device and dtype:

=========  ==========================================================================
`numba`    CPU: every distance once, queries as SIMD lanes
`triton`   CUDA: every distance once, running minima in registers
`torch`    everything else, and the oracle of the tests: plain torch in bounded chunks
=========  ==========================================================================

A backend is a module `<name>_backend`, imported when first used.
"""

import logging
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any, Literal, NamedTuple

import torch
from jaxtyping import Float, Int
from torch import Tensor

log = logging.getLogger(__name__)

Backend = Literal["numba", "triton", "torch"]


class NearestNeighbors(NamedTuple):
    """Nearest neighbours of every point, both ways; distances are squared."""

    a_to_b: Float[Tensor, "*batch num_a"]
    a_to_b_index: Int[Tensor, "*batch num_a"]
    b_to_a: Float[Tensor, "*batch num_b"]
    b_to_a_index: Int[Tensor, "*batch num_b"]


def nearest_neighbors(
    a: Float[Tensor, "*batch_a num_a 3"],
    b: Float[Tensor, "*batch_b num_b 3"],
    backend: Backend | None = None,
) -> NearestNeighbors:
    """Find the nearest point of `b` for every point of `a`, and the other way round.

    Exact: the index attains the smallest squared distance (of equals, either). Batch shapes
    broadcast without copying a cloud, so one query cloud (q, 1, N, 3) is shared by its templates'
    clouds (q, T, N, 3). Gradients flow to both clouds through the indices, once. Nothing of size
    N x M is kept in memory.

    A point that is not finite is nobody's neighbour, its own distance nan. A point without any
    neighbour, for that or because squares overflow, has the distance inf; the index is 0 in both
    cases.

    Args:
        a: (*batch_a, N, 3), float32 or float64 (other floating types work, in plain torch).
        b: (*batch_b, M, 3), same dtype and device; N and M may differ.
        backend: which of the backends to use, chosen by device and dtype when None.

    Raises:
        ValueError: a cloud is empty or not of 3D points, or of whole numbers; or the two differ in
            dtype or device.

    >>> result = nearest_neighbors(torch.zeros(1, 3), torch.tensor([[3.0, 0, 0], [1, 0, 0]]))
    >>> result.a_to_b, result.a_to_b_index, result.b_to_a
    (tensor([1.]), tensor([1]), tensor([9., 1.]))
    """
    if not (torch.is_floating_point(a) and torch.is_floating_point(b)):
        raise ValueError(f"clouds must be of floating point numbers: {a.dtype}, {b.dtype}")
    batch = torch.broadcast_shapes(a.shape[:-2], b.shape[:-2])
    if {a.shape[-1], b.shape[-1]} != {3} or 0 in (*batch, a.shape[-2], b.shape[-2]):
        raise ValueError(f"there is no pair of clouds in {tuple(a.shape)} and {tuple(b.shape)}")
    if a.dtype != b.dtype or a.device != b.device:
        raise ValueError(f"clouds differ: {a.dtype} on {a.device}, {b.dtype} on {b.device}")
    backend = backend or usable_backends(a.device, a.dtype)[0]
    index_a, index_b = (_pair_index(x.shape[:-2], batch, x.device) for x in (a, b))
    clouds_a, clouds_b = a.reshape(-1, *a.shape[-2:]), b.reshape(-1, *b.shape[-2:])
    result = _Nearest.apply(clouds_a, clouds_b, index_a, index_b, backend)
    return NearestNeighbors(*(r.reshape(*batch, -1) for r in result))


def usable_backends(device: torch.device, dtype: torch.dtype) -> list[Backend]:
    """Return the backends that work for such points, the fastest first."""
    if device.type == "cpu" and dtype in (torch.float32, torch.float64):
        return ["numba", "torch"]
    if device.type == "cuda" and dtype == torch.float32 and _triton_works(device):
        return ["triton", "torch"]
    return ["torch"]


@lru_cache
def _triton_works(device: torch.device) -> bool:
    """Try it once: Triton needs a recent GPU and, for its launchers, a C compiler."""
    if find_spec("triton") is None:
        return False
    try:
        point = torch.zeros(1, 1, 3, device=device)
        pair = torch.zeros(1, dtype=torch.int64, device=device)
        found = _module("triton").search(point, point, pair, pair)
        return float(found[0]) == 0
    except Exception as error:  # whatever a compiler or a driver stumbles over
        reason = str(error).strip().split("\n")[0]
        log.warning("nearest neighbours fall back to plain torch, many times slower: %s", reason)
        return False


def _module(backend: Backend) -> ModuleType:
    return import_module(f"{__name__}.{backend}_backend")


def _pair_index(shape: torch.Size, batch: torch.Size, device: torch.device) -> Tensor:
    """Return which cloud of a flattened batch of `shape` each pair of `batch` uses, (pairs,)."""
    clouds = torch.arange(shape.numel(), device=device)
    return clouds.reshape(shape).expand(batch).reshape(-1)


class _Nearest(torch.autograd.Function):
    """Nearest neighbours of pairs (a[index_a[p]], b[index_b[p]]), see `torch_backend`."""

    @staticmethod
    def forward(
        ctx: Any, a: Tensor, b: Tensor, index_a: Tensor, index_b: Tensor, backend: Backend
    ) -> tuple:
        module = _module(backend)
        d_ab, i_ab, d_ba, i_ba = module.search(a.detach(), b.detach(), index_a, index_b)
        ctx.save_for_backward(a, b, index_a, index_b, i_ab, i_ba)
        ctx.mark_non_differentiable(i_ab, i_ba)
        ctx.gradient = module.gradient
        return d_ab, i_ab, d_ba, i_ba

    @staticmethod
    def backward(ctx: Any, g_ab: Tensor, _i: Tensor, g_ba: Tensor, _j: Tensor) -> tuple:
        if torch.is_grad_enabled():  # create_graph=True, which torch's own check may miss
            raise NotImplementedError("distances to nearest neighbours have no second derivatives")
        a, b, index_a, index_b, i_ab, i_ba = (t.detach() for t in ctx.saved_tensors)
        grad_a = grad_b = None
        if ctx.needs_input_grad[0]:
            grad_a = ctx.gradient(a, b, index_a, index_b, i_ab, i_ba, g_ab, g_ba)
        if ctx.needs_input_grad[1]:
            grad_b = ctx.gradient(b, a, index_b, index_a, i_ba, i_ab, g_ba, g_ab)
        return grad_a, grad_b, None, None, None
