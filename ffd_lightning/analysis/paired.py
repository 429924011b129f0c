"""The statistics of a paired comparison: bootstrap interval, signed ranks, correction for many."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

RESAMPLES = 10_000
LEVEL = 0.05
"""Differences are shown at 95%."""

_CHUNK = 1 << 18  # picks of a resampling that are held at once: 8 MB, and they stay in the cache
_EXACT = 13  # shapes up to which all signs are gone through

Array = NDArray[np.float64]


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p values corrected for their number, by Holm's step-down method (1979).

    >>> [round(p, 3) for p in holm([0.04, 0.01, 0.5])]
    [0.08, 0.03, 0.5]
    """
    p = np.asarray(p_values, float)
    order = np.argsort(p, kind="stable")
    steps = np.maximum.accumulate((len(p) - np.arange(len(p))) * p[order])
    corrected = np.empty_like(p)
    corrected[order] = np.minimum(steps, 1)
    return [float(x) for x in corrected]


@dataclass(frozen=True)
class Comparison:
    """Two groups, over one category or several.

    Attributes:
        category: its name.
        held: values of the settings that both have.
        a, b: names of the groups.
        differences: a - b of each test shape, (n,), a category each.
        resampled: means of those over resampled shapes, (RESAMPLES,).
        of_runs: differences of the means of single runs, all pairs.
        seeds: runs in a and in b.
        means: of a and of b, over shapes and categories.
    """

    category: str
    held: tuple[Any, ...]
    a: str
    b: str
    differences: list[Array]
    resampled: Array
    of_runs: Array
    seeds: tuple[int, int]
    means: tuple[float, float] = (float("nan"), float("nan"))

    @cached_property
    def difference(self) -> float:
        """Mean over shapes, and over categories."""
        return float(np.mean([d.mean() for d in self.differences]))

    @property
    def num_samples(self) -> int:
        """Test shapes, over all categories."""
        return sum(len(d) for d in self.differences)

    @property
    def agreement(self) -> float:
        """Share of pairs of runs whose difference has the same sign."""
        return float(np.mean(np.sign(self.of_runs) == np.sign(self.difference)))

    @cached_property
    def z(self) -> float:
        """The signed-rank test's z-score, positive where a has the greater ranks."""
        scores = [rank_score(d) for d in self.differences]
        return float(sum(scores) / np.sqrt(len(scores)))

    @property
    def p(self) -> float:
        """Two-sided p value."""
        return float(2 * stats.norm.sf(abs(self.z)))

    @cached_property
    def interval(self) -> tuple[float, float]:
        """The difference's interval, see `interval_of_mean`; categories are strata."""
        return interval_of_mean(self.differences, self.resampled)

    def shown(self, p: float) -> bool:
        """Tell whether mean and ranks both show a difference, in one direction.

        Args:
            p: the comparison's own, corrected for the number of comparisons.
        """
        sign = 1 if self.difference > 0 else -1
        return min(sign * x for x in self.interval) > 0 and p < LEVEL and sign * self.z > 0

    @property
    def trained_again(self) -> bool:
        """Tell whether both groups have several seeds, and all their pairs agree."""
        return min(self.seeds) > 1 and self.agreement == 1


def interval_of_mean(strata: Sequence[Array], resampled: Array) -> tuple[float, float]:
    """Return the bias-corrected and accelerated interval of a mean (Efron 1987).

    Args:
        strata: values of the test shapes, (n,) each; the mean is that of their means.
        resampled: that mean over resampled shapes, (RESAMPLES,), see `resampled_means`.

    Returns:
        Both ends, at 95%.
    """
    estimate = float(np.mean([v.mean() for v in strata]))
    # Of each shape on the mean, but for a factor that cancels out.
    influence = np.concatenate([(v - v.mean()) / len(v) for v in strata])
    spread = float((influence**2).sum())
    tiny = 1e-12 * max(float(np.abs(v).max()) for v in strata)
    if spread == 0 or np.sqrt(spread) <= tiny:
        return estimate, estimate
    below = np.mean(resampled < estimate - tiny)
    equal = np.mean(np.abs(resampled - estimate) <= tiny)
    bias = stats.norm.ppf(below + equal / 2)
    acceleration = (influence**3).sum() / (6 * spread**1.5)
    wanted = bias + stats.norm.ppf([LEVEL / 2, 1 - LEVEL / 2])
    levels = stats.norm.cdf(bias + wanted / (1 - acceleration * wanted))
    low, high = np.quantile(resampled, levels)
    return float(low), float(high)


def rank_score(differences: Array) -> float:
    """Return z of Wilcoxon's signed-rank test, 0 where all differences are."""
    ranks = stats.rankdata(np.abs(differences)) * (differences != 0)
    total = float((np.sign(differences) * ranks).sum())
    n = len(differences)
    if n <= _EXACT:  # with ties too, for which scipy's exact way is slow and not in all versions
        signs = 1 - 2 * ((np.arange(2**n)[:, None] >> np.arange(n)) & 1)
        p = float(np.mean(np.abs(signs @ ranks) >= abs(total) - 1e-9))
    elif not total:
        p = 1.0
    else:
        p = float(stats.wilcoxon(differences, zero_method="pratt").pvalue)
    return float(np.sign(total) * stats.norm.isf(max(p, 1e-300) / 2))


def resampled_means(differences: Array, seed: str) -> Array:
    """Return means over resampled rows: (n, P) to (RESAMPLES, P), the same rows for all columns."""
    n = len(differences)
    rng = np.random.default_rng(zlib.crc32(seed.encode()))
    result = np.empty((RESAMPLES, differences.shape[1]))
    at_once = max(1, _CHUNK // n)
    for start in range(0, RESAMPLES, at_once):
        count = min(at_once, RESAMPLES - start)
        picks = rng.integers(n, size=(count, n)) + n * np.arange(count)[:, None]
        times = np.bincount(picks.ravel(), minlength=count * n).reshape(count, n)
        result[start : start + count] = times.astype(float) @ differences / n
    return result
