"""Earth mover's distance between clouds of equal size, exact."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from ffd_lightning.metrics.clouds import Points, as_given, as_pairs
from ffd_lightning.parallel import available_cores, in_threads


def earth_movers_distance(
    pred_points: Points, target_points: Points, workers: int | None = None
) -> Any:
    r"""Return the mean distance between points that the best one-to-one assignment pairs.

    .. math:: \min_{\pi} \frac{1}{N} \sum_i \| a_i - b_{\pi(i)} \|

    Exact, by POT's network simplex; every result is checked against the solver's dual solution,
    which proves it optimal to 1e-9 of the largest distance. Time grows with about N^2.5, memory
    with N^2: 1,024 points take 0.2 s, 16,384 take 80 s and 11 GB per worker. The same mesh sampled
    twice does not give 0: in the paper's protocol (1,024 points, hemisphere of radius 3.2)
    ShapeNet's meshes against themselves gave 0.187 in the mean, 0.153 with points drawn without
    replacement.

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

    Source: the paper's equation 2; its section 5.1 reports the sum divided by N. Solver: Bonneel et
    al. 2011 in POT (Flamary et al. 2021).

    >>> earth_movers_distance(np.zeros((1, 3)), np.array([[3.0, 0, 4]]))
    5.0
    """
    pred, target, batch = as_pairs(pred_points, target_points)
    if pred.shape[-2] != target.shape[-2]:
        raise ValueError(
            "the earth mover's distance needs clouds of equal size, got "
            f"{pred.shape[-2]} and {target.shape[-2]} points"
        )
    if workers is not None and workers < 1:
        raise ValueError(f"workers must be 1 or more, got {workers}")
    a, b = (
        x.cpu().double().expand(*batch, *x.shape[-2:]).reshape(-1, *x.shape[-2:]).numpy()
        for x in (pred, target)
    )

    def solve(k: int) -> float:
        return _mean_distance(a[k], b[k])

    pairs, threads = range(len(a)), min(workers or available_cores(), len(a))
    found = in_threads(solve, pairs, threads) if threads > 1 else ((k, solve(k)) for k in pairs)
    values = torch.tensor([value for _, value in sorted(found)], dtype=torch.float64)
    return as_given(values.reshape(batch).to(pred.device), pred_points, target_points)


def _mean_distance(pred: NDArray[np.float64], target: NDArray[np.float64]) -> float:
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
