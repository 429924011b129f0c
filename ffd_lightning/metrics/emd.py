"""Earth mover's distance between clouds of equal size: exact, and bounds for large clouds."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from torch import Tensor

from ffd_lightning.metrics.base import MeanOverPairs, Points, as_clouds, as_given


def earth_movers_distance(
    pred_points: Points, target_points: Points, workers: int | None = None
) -> Any:
    r"""Return the mean distance between points that the best one-to-one assignment pairs.

    .. math:: \min_{\pi} \frac{1}{N} \sum_i \| a_i - b_{\pi(i)} \|

    Exact, by POT's network simplex; every result is checked against the solver's dual solution,
    which proves it optimal to 1e-9 of the largest distance. Time grows with about N^2.5, memory
    with N^2: 1,024 points take 0.2 s, 16,384 take 80 s and 11 GB per worker (see
    `approximate_emd`). The same mesh sampled twice does not give 0: in the paper's
    protocol (1,024 points, hemisphere of radius 3.2) ShapeNet's meshes against themselves gave
    0.187 in the mean, 0.153 with points drawn without replacement.

    Args:
        pred_points: (*batch_a, N, 3).
        target_points: (*batch_b, N, 3); batch shapes broadcast.
        workers: threads, each with a pair of its own; all cores when None. The result does not
            depend on it.

    Returns:
        One value per pair, (*batch,), float64, in the unit of the points (distances are not
        squared). On the device of the prediction, without a gradient.

    Raises:
        ValueError: clouds of different size, empty, not finite, of other than 3 coordinates, in
            batches that do not go together, or so far apart that distances overflow.
        RuntimeError: the solver found no proven optimum.

    Source: the paper's section 4.1 reports this sum divided by N. Solver: Bonneel et al. 2011 in
    POT (Flamary et al. 2021).

    >>> earth_movers_distance(np.zeros((1, 3)), np.array([[3.0, 0, 4]]))
    5.0
    """
    values = _over_pairs(_exact, pred_points, target_points, workers)
    return as_given(values, pred_points, target_points)


class EarthMoversDistance(MeanOverPairs):
    """Mean over pairs of `earth_movers_distance`, in the unit of the points.

    Args:
        workers: see `earth_movers_distance`.
        **kwargs: those of `torchmetrics.Metric`.
    """

    def __init__(self, workers: int | None = None, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.workers = workers

    def score(self, pred: Points, target: Points) -> Tensor:
        """Return the distance of every pair, (*batch,)."""
        return _over_pairs(_exact, pred, target, self.workers)


class AssignmentBound(NamedTuple):
    """Bounds of an earth mover's distance; both are proven, neither is the distance itself."""

    upper: Any
    """Mean distance under the assignment that was found, (*batch,)."""
    lower: Any
    """What no assignment can be below, (*batch,)."""


def approximate_emd(
    pred_points: Points,
    target_points: Points,
    tolerance: float = 1e-3,
    workers: int | None = None,
) -> AssignmentBound:
    """Enclose the earth mover's distance of clouds too large for the exact one.

    An auction with falling steps: points of the prediction bid for points of the target. `upper`
    is the cost of a real one-to-one assignment, `lower` that of a solution of the dual problem,
    both computed afresh at the end, so the bounds hold whatever the auction did. Memory grows with
    N; 16,384 points take a tenth of the exact solver's time.

    Args:
        pred_points: (*batch_a, N, 3).
        target_points: (*batch_b, N, 3); batch shapes broadcast.
        tolerance: upper - lower is at most this share of `upper` (but not below 1e-9 of the
            clouds' common extent).
        workers: threads, each with a pair of its own; all cores when None.

    Returns:
        Bounds, each (*batch,), float64, in the unit of the points.

    Raises:
        ValueError: a tolerance that is not in (0, 1), or clouds that `earth_movers_distance`
            refuses.

    Source: Bertsekas 1988, "The auction algorithm".

    >>> cloud = np.random.default_rng(0).random((50, 3))
    >>> bound = approximate_emd(cloud, cloud + [0.01, 0, 0])
    >>> bool(bound.lower <= 0.01 + 1e-12 and bound.upper >= 0.01 - 1e-12)
    True
    """
    from ffd_lightning.metrics.auction import assignment_bounds  # numba takes a while

    if not 0 < tolerance < 1:
        raise ValueError(f"tolerance must be in (0, 1), got {tolerance}")
    values = _over_pairs(
        lambda pred, target: assignment_bounds(pred, target, tolerance),
        pred_points,
        target_points,
        workers,
    )
    return AssignmentBound(*(as_given(v, pred_points, target_points) for v in values.unbind(-1)))


def _over_pairs(
    function: Callable[[NDArray, NDArray], Any],
    pred_points: Points,
    target_points: Points,
    workers: int | None,
) -> Tensor:
    """Apply a function of two (N, 3) float64 arrays to all pairs, in threads: (*batch, ...)."""
    pred, target = as_clouds(pred_points, "pred_points"), as_clouds(target_points, "target_points")
    if pred.shape[-2] != target.shape[-2]:
        raise ValueError(
            "the earth mover's distance needs clouds of equal size, got "
            f"{pred.shape[-2]} and {target.shape[-2]} points"
        )
    if workers is not None and workers < 1:
        raise ValueError(f"workers must be 1 or more, got {workers}")
    shapes = f"{tuple(pred.shape)} and {tuple(target.shape)}"
    try:
        batch = torch.broadcast_shapes(pred.shape[:-2], target.shape[:-2])
    except RuntimeError as error:
        raise ValueError(f"the batches of {shapes} do not go together") from error
    if 0 in batch:
        raise ValueError(f"there is no pair in {shapes}")
    clouds = [
        x.detach().cpu().double().expand(*batch, *x.shape[-2:]).reshape(-1, *x.shape[-2:]).numpy()
        for x in (pred, target)
    ]
    threads = min(workers or _cores(), batch.numel())
    with ThreadPoolExecutor(threads, thread_name_prefix="emd") as pool:
        values = torch.tensor(list(pool.map(function, *clouds)), dtype=torch.float64)
    return values.reshape((*batch, *values.shape[1:])).to(pred.device)


def _cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _exact(pred: NDArray[np.float64], target: NDArray[np.float64]) -> float:
    """Return the mean distance of two clouds (N, 3) under the optimal assignment."""
    import ot  # takes 0.2 s

    cost = cdist(pred, target)
    largest = float(cost.max())
    if not math.isfinite(largest):
        raise ValueError("the clouds are too far apart: their distances overflow")
    if largest == 0:
        return 0.0
    num = len(cost)
    # POT compares against constants that suppose costs around 1: raw costs around 1e-12 gave
    # results off by half without a warning. Weights of 1 keep the flow in whole numbers.
    plan, log = ot.emd(
        np.ones(num), np.ones(num), cost / largest, numItermax=10**6 + 1000 * num, log=True
    )
    partner = plan.argmax(axis=1)
    distances = cost[np.arange(num), partner]
    # Any dual solution bounds the optimum from below; where it is slightly infeasible, shift it.
    excess = (cost / largest - log["u"][:, None] - log["v"]).min()
    lower = (log["u"].sum() + log["v"].sum()) / num + min(excess, 0)
    gap = distances.mean() / largest - lower
    if not gap <= 1e-9 or len(np.unique(partner)) < num:
        raise RuntimeError(f"no optimal assignment found: {log['warning'] or f'gap {gap:.1e}'}")
    # An exact sum: the order of the points does not matter.
    return math.fsum(distances) / num
