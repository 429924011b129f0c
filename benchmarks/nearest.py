"""Nearest neighbours at the paper's configuration, against the libraries people use for them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from typing import Any

import numpy as np
import torch
from torch import Tensor

from benchmarks.timing import Row, absent, compete, seconds_of
from ffd_lightning.geometry.nearest import nearest_neighbors, usable_backends

QUERIES, TEMPLATES, POINTS = 32, 30, 1024
FLOP_PER_DISTANCE = 8  # three differences, three products, two sums

Search = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]  # indices a to b and b to a


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


def peers(device: torch.device) -> tuple[dict[str, Search], dict[str, str]]:
    """Return the searches that work here, and why the others do not."""
    found: dict[str, Search] = {"torch.cdist": _cdist, "torch, matrix form": _matrix_form}
    missing = {}
    if device.type == "cpu":
        found["scipy cKDTree, threads"] = _scipy
    needed = {
        "pykdtree": ("pykdtree.kdtree", _pykdtree, "cpu"),
        "point-cloud-utils": ("point_cloud_utils", _point_cloud_utils, "cpu"),
        "faiss IndexFlatL2": ("faiss", _faiss, "cpu"),
        "KeOps": ("pykeops.torch", _keops, ""),
        "pytorch3d": ("pytorch3d.ops", _pytorch3d, ""),
    }
    for name, (module, search, only) in needed.items():
        if only and device.type != only:
            continue
        try:
            import_module(module)
            found[name] = search
        except Exception as error:
            missing[name] = f"{type(error).__name__}: {str(error).splitlines()[0]}"[:80]
    found["torch.compile of cdist"] = torch.compile(_cdist_chunk)
    return found, missing


def measure(device: torch.device, quick: bool) -> list[Row]:
    """Compare forward passes of 960 pairs, and our backward pass with our forward pass."""
    rows = []
    rounds = 3 if quick else 7
    for dtype in (torch.float32, torch.float64):
        pairs = QUERIES * TEMPLATES
        name = f"nearest, {pairs} x {POINTS} points, {str(dtype)[6:]}, {device.type}"
        a, b = clouds(QUERIES, TEMPLATES, POINTS, device, dtype)
        backends = usable_backends(device, dtype)
        candidates = {f"ffd_lightning {backend}": _ours(a, b, backend) for backend in backends}
        ours = f"ffd_lightning {backends[0]}"
        candidates[ours]()  # what cannot run here is an error, not a row
        searches, missing = peers(device)
        part = 1 if quick else 4  # of the queries: the slow ones take seconds for all
        share = {}
        for peer, search in searches.items():
            candidates[peer] = _peer(search, a[:part], b[:part])
            share[peer] = part / QUERIES
        candidates["ffd_lightning torch"] = _ours(a[:part], b[:part], "torch")
        share["ffd_lightning torch"] = part / QUERIES
        _check(searches, a[:1, :2], b[:1])
        found = compete(name, ours, candidates, rounds, share)
        found += absent(name, missing)
        _add_floor(found, name, device, dtype, pairs)
        rows += found
        rows += _backward(name, a, b, rounds)
        if quick:
            break
    return rows


def _add_floor(
    rows: list[Row], section: str, device: torch.device, dtype: torch.dtype, pairs: int
) -> None:
    size = 2048
    x = torch.rand(size, size, device=device, dtype=dtype)
    rate = 2 * size**3 / min(seconds_of(lambda: x @ x) for _ in range(5))
    seconds = FLOP_PER_DISTANCE * pairs * POINTS**2 / rate
    ours = min(r.seconds for r in rows if r.ratio == 1)  # type: ignore[type-var]
    note = f"every distance once at {rate / 1e9:.0f} GFLOP/s, the rate of a matrix product here"
    rows.insert(0, Row(section, "floor", seconds, seconds, seconds / ours, note))


def _backward(section: str, a: Tensor, b: Tensor, rounds: int) -> list[Row]:
    """Time the backward pass alone, as a share of the forward one."""
    leaf = a.clone().requires_grad_()
    result = nearest_neighbors(leaf, b)
    ones = torch.ones_like(result.a_to_b), torch.ones_like(result.b_to_a)

    def backward() -> None:
        torch.autograd.grad((result.a_to_b, result.b_to_a), leaf, ones, retain_graph=True)

    forward = _ours(a, b, None)
    found = compete(
        f"{section}, backward", "forward", {"forward": forward, "backward": backward}, rounds
    )
    return [row for row in found if row.name == "backward"]


def _ours(a: Tensor, b: Tensor, backend: Any) -> Callable[[], object]:
    return lambda: nearest_neighbors(a, b, backend)


def _peer(search: Search, a: Tensor, b: Tensor) -> Callable[[], object]:
    flat_a, flat_b = a.flatten(0, 1), b.expand_as(a).flatten(0, 1)
    return lambda: search(flat_a, flat_b)


def _check(searches: dict[str, Search], a: Tensor, b: Tensor) -> None:
    """Make sure that the peers find the same neighbours, or the comparison means nothing."""
    expected = nearest_neighbors(a, b).a_to_b[0]
    for name, search in searches.items():
        try:
            index, _ = search(a[0], b.expand_as(a)[0])
        except Exception:
            continue  # `compete` will say so
        other = b.expand_as(a)[0].gather(1, index.long()[..., None].expand(-1, -1, 3))
        found = (a[0] - other).square().sum(-1)
        # The matrix form loses digits: it may pick a neighbour that is only nearly the nearest.
        if not torch.allclose(found, expected, rtol=1e-2, atol=1e-5):
            raise AssertionError(f"{name} finds other neighbours")


# --- peers: clouds (pairs, N, 3) to indices (pairs, N) both ways ---------------------------------


def _cdist_chunk(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    d = (a[:, :, None] - b[:, None]).square().sum(-1)
    return d.argmin(2), d.argmin(1)


def _cdist(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    d = torch.cdist(a, b, compute_mode="donot_use_mm_for_euclid_dist")
    return d.min(2).indices, d.min(1).indices


def _matrix_form(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    d = torch.baddbmm(
        a.square().sum(-1)[:, :, None] + b.square().sum(-1)[:, None], a, b.mT, alpha=-2
    )
    return d.min(2).indices, d.min(1).indices


def _each(query: Callable[[Any, Any], Any], a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    """Run a numpy search pair by pair, both ways."""
    ways = [
        np.stack([query(p, q) for p, q in zip(x.numpy(), y.numpy(), strict=True)])
        for x, y in ((a, b), (b, a))
    ]
    return torch.from_numpy(ways[0].astype(np.int64)), torch.from_numpy(ways[1].astype(np.int64))


def _scipy(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    from scipy.spatial import cKDTree

    def both(pair: tuple[Any, Any]) -> tuple[Any, Any]:
        trees = [cKDTree(points) for points in pair]
        return trees[1].query(pair[0])[1], trees[0].query(pair[1])[1]

    with ThreadPoolExecutor(torch.get_num_threads()) as pool:
        found = list(pool.map(both, zip(a.numpy(), b.numpy(), strict=True)))
    return tuple(torch.from_numpy(np.stack(way)) for way in zip(*found, strict=True))  # type: ignore[return-value]


def _pykdtree(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    from pykdtree.kdtree import KDTree

    return _each(lambda p, q: KDTree(q).query(p)[1], a, b)


def _point_cloud_utils(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    import point_cloud_utils

    return _each(lambda p, q: point_cloud_utils.k_nearest_neighbors(p, q, 1)[1].reshape(-1), a, b)


def _faiss(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    import faiss

    def query(p: Any, q: Any) -> Any:
        index = faiss.IndexFlatL2(3)
        index.add(q.astype(np.float32))
        return index.search(p.astype(np.float32), 1)[1][:, 0]

    return _each(query, a, b)


def _keops(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    import pykeops
    from pykeops.torch import LazyTensor

    pykeops.set_verbose(False)
    d = ((LazyTensor(a[:, :, None]) - LazyTensor(b[:, None])) ** 2).sum(-1)
    return d.argmin(dim=2)[..., 0], d.argmin(dim=1)[..., 0]


def _pytorch3d(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    from pytorch3d.ops import knn_points

    return knn_points(a, b).idx[..., 0], knn_points(b, a).idx[..., 0]


# --- scaling ------------------------------------------------------------------------------------


def scaling(device: torch.device, quick: bool) -> dict[str, dict[str, list[tuple[int, float]]]]:
    """Return seconds by N (one pair), by T (32 queries) and by queries (30 templates)."""
    dtype = torch.float32
    searches, _ = peers(device)
    few = ("torch.cdist", "scipy cKDTree, threads", "pykdtree")
    searches = {name: searches[name] for name in few if name in searches}
    backends = [b for b in usable_backends(device, dtype) if b != "torch"]
    sizes = [2**k for k in range(6, 12 if quick else 17)]
    counts = [1, 2, 4, 8, 16, 30]
    batches = [1, 4, 16] if quick else [1, 2, 4, 8, 16, 32, 64]
    axes: dict[str, list[tuple[int, tuple[int, int, int]]]] = {
        "points per cloud N (1 pair)": [(n, (1, 1, n)) for n in sizes],
        f"templates T ({QUERIES} queries)": [(t, (QUERIES, t, POINTS)) for t in counts],
        f"queries ({TEMPLATES} templates)": [(q, (q, TEMPLATES, POINTS)) for q in batches],
    }
    result: dict[str, dict[str, list[tuple[int, float]]]] = {}
    for axis, places in axes.items():
        curves = result.setdefault(axis, {})
        for value, shape in places:
            a, b = clouds(*shape, device, dtype)
            candidates: dict[str, Callable[[], object]] = {
                f"ffd_lightning {backend}": _ours(a, b, backend) for backend in backends
            }
            for name, search in searches.items():
                if name == "torch.cdist" and shape[0] * shape[1] * shape[2] ** 2 > 2**28:
                    continue  # a matrix of gigabytes
                candidates[name] = _peer(search, a, b)
            ours = f"ffd_lightning {backends[0]}"
            for row in compete(axis, ours, candidates, 2 if quick else 3):
                if row.seconds is not None:
                    curves.setdefault(row.name, []).append((value, row.seconds))
    return result
