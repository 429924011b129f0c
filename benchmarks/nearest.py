"""Nearest neighbours at the paper's configuration, against the libraries people use for them."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import torch
from torch import Tensor

from benchmarks.timing import Row, compete
from ffd_lightning.geometry.nearest import nearest_neighbors, usable_backends

QUERIES, TEMPLATES, POINTS = 32, 30, 1024
_PART = 4  # of the queries: slow searches take seconds for all

Search = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]
"""Of clouds (pairs, N, 3): indices (pairs, N) from each to the other."""


def clouds(
    queries: int, templates: int, points: int, device: torch.device, dtype: torch.dtype
) -> tuple[Tensor, Tensor]:
    """Return points of ellipsoids, (q, T, N, 3) for the templates and (q, 1, N, 3) for queries.

    Surfaces, like the real thing: trees are faster on them than on points that fill a volume.
    """
    generator = torch.Generator().manual_seed(0)

    def draw(*batch: int) -> Tensor:
        points_ = torch.randn(*batch, points, 3, generator=generator)
        axes = 0.3 + 0.2 * torch.rand(*batch, 1, 3, generator=generator)
        return (torch.nn.functional.normalize(points_, dim=-1) * axes).to(device, dtype)

    return draw(queries, templates), draw(queries, 1)


def measure(device: torch.device, quick: bool) -> list[Row]:
    """Compare forward passes of 960 pairs, and our backward pass with our forward pass."""
    rows = []
    for dtype in (torch.float32, torch.float64):
        kind = f"{str(dtype)[6:]}, {device.type}"
        name = f"nearest, {QUERIES * TEMPLATES} x {POINTS} points, {kind}"
        a, b = clouds(QUERIES, TEMPLATES, POINTS, device, dtype)
        backends = usable_backends(device, dtype)
        candidates = {f"ffd_lightning {x}": (_ours(a, b, x), 1.0) for x in backends}
        few, part = (a[:_PART], b[:_PART]), min(1, _PART / QUERIES)
        candidates["ffd_lightning torch"] = _ours(*few, "torch"), part
        for peer, search in peers(device).items():
            check(peer, search, a[:1, :2], b[:1])
            candidates[peer] = _peer(search, *few), part
        rounds = 3 if quick else 7
        rows += compete(name, candidates, rounds)
        rows += _backward(name, a, b, rounds)
        if quick:
            break
    return rows


def _backward(section: str, a: Tensor, b: Tensor, rounds: int) -> list[Row]:
    """Time the backward pass alone, as a share of the forward one."""
    leaf = a.clone().requires_grad_()
    result = nearest_neighbors(leaf, b)
    ones = torch.ones_like(result.a_to_b), torch.ones_like(result.b_to_a)

    def backward() -> None:
        torch.autograd.grad((result.a_to_b, result.b_to_a), leaf, ones, retain_graph=True)

    both = {"forward": (_ours(a, b, None), 1.0), "backward": (backward, 1.0)}
    return compete(f"{section}, backward", both, rounds)[1:]


def _ours(a: Tensor, b: Tensor, backend: Any) -> Callable[[], object]:
    return lambda: nearest_neighbors(a, b, backend)


def _peer(search: Search, a: Tensor, b: Tensor) -> Callable[[], object]:
    flat_a, flat_b = a.flatten(0, 1), b.expand_as(a).flatten(0, 1)
    return lambda: search(flat_a, flat_b)


def check(name: str, search: Search, a: Tensor, b: Tensor) -> None:
    """Make sure that a peer finds the same neighbours, or the comparison means nothing.

    Raises:
        AssertionError: it finds others.
    """
    try:
        index, _ = search(a[0], b.expand_as(a)[0])
    except Exception:
        return  # `compete` will say so
    other = b.expand_as(a)[0].gather(1, index.long()[..., None].expand(-1, -1, 3))
    found = (a[0] - other).square().sum(-1)
    if not torch.allclose(found, nearest_neighbors(a, b).a_to_b[0], rtol=1e-2, atol=1e-5):
        raise AssertionError(f"{name} finds other neighbours")


def peers(device: torch.device) -> dict[str, Search]:
    """Return the searches of other libraries."""
    found: dict[str, Search] = {
        "torch.cdist": _cdist,
        "torch.compile of the differences": torch.compile(_differences),
    }
    if device.type == "cpu":
        found |= {"scipy cKDTree, threads": _scipy, "pykdtree": _pykdtree}
    return found


def _differences(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    d = (a[:, :, None] - b[:, None]).square().sum(-1)
    return d.argmin(2), d.argmin(1)


def _cdist(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    d = torch.cdist(a, b, compute_mode="donot_use_mm_for_euclid_dist")
    return d.argmin(2), d.argmin(1)


def _scipy(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    from scipy.spatial import cKDTree

    with ThreadPoolExecutor(torch.get_num_threads()) as pool:
        return _each(lambda p, q: cKDTree(q).query(p)[1], a, b, pool.map)


def _pykdtree(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    from pykdtree.kdtree import KDTree

    return _each(lambda p, q: KDTree(q).query(p)[1], a, b, map)


def _each(
    query: Callable[[Any, Any], Any], a: Tensor, b: Tensor, over: Callable[..., Any]
) -> tuple[Tensor, Tensor]:
    """Run a numpy search pair by pair, both ways."""
    ways = [np.stack(list(over(query, x.numpy(), y.numpy()))) for x, y in ((a, b), (b, a))]
    return torch.from_numpy(ways[0].astype(np.int64)), torch.from_numpy(ways[1].astype(np.int64))


def scaling(device: torch.device, quick: bool) -> dict[str, dict[str, list[tuple[int, float]]]]:
    """Return seconds by N (one pair), by T (32 queries) and by queries (30 templates)."""
    sizes = [2**k for k in range(6, 12 if quick else 17)]
    counts = [1, 2, 4, 8, 16, 30]
    batches = [1, 4, 16] if quick else [1, 2, 4, 8, 16, 32, 64]
    axes: dict[str, list[tuple[int, tuple[int, int, int]]]] = {
        "points per cloud N (1 pair)": [(n, (1, 1, n)) for n in sizes],
        f"templates T ({QUERIES} queries)": [(t, (QUERIES, t, POINTS)) for t in counts],
        f"queries ({TEMPLATES} templates)": [(q, (q, TEMPLATES, POINTS)) for q in batches],
    }
    backends = [b for b in usable_backends(device, torch.float32) if b != "torch"]
    searches = {k: v for k, v in peers(device).items() if not k.startswith("torch.compile")}
    result: dict[str, dict[str, list[tuple[int, float]]]] = {}
    for axis, places in axes.items():
        curves = result.setdefault(axis, {})
        for value, shape in places:
            a, b = clouds(*shape, device, torch.float32)
            candidates = {f"ffd_lightning {x}": (_ours(a, b, x), 1.0) for x in backends}
            for name, search in searches.items():
                if name != "torch.cdist" or shape[0] * shape[1] * shape[2] ** 2 <= 2**28:
                    candidates[name] = _peer(search, a, b), 1.0  # else a matrix of gigabytes
            for row in compete(axis, candidates, 2 if quick else 3):
                if row.seconds is not None:
                    curves.setdefault(row.name, []).append((value, row.seconds))
    return result
