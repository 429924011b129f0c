"""How sure a mean difference is, for other trainings and other test shapes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

LEVEL = 0.05
"""Verdicts are wrong in at most this share of tables; intervals are of 95%."""

MARGIN = 0.1
"""Scores are about equal within this share of what lies between them and the metric's floor."""

Array = NDArray[np.float64]
Pair = tuple[pd.DataFrame, pd.DataFrame]
"""Scores of two groups of runs in one category: a row per shape, a column per run."""


class Estimate(NamedTuple):
    """A mean, its standard error, and the degrees of freedom of that."""

    mean: float
    error: float
    df: float

    @classmethod
    def of(cls, mean: float, variance: float, parts: Iterable[tuple[float, float]]) -> Estimate:
        """Return it for a variance put together from `parts`, (variance, degrees of freedom) each.

        Degrees of freedom are Satterthwaite's (1946).
        """
        uncertain = sum(part**2 / df for part, df in parts)
        return cls(mean, variance**0.5, max(1.0, variance**2 / uncertain) if uncertain else np.inf)

    @classmethod
    def over_strata(cls, strata: Sequence[Array]) -> Estimate:
        """Return the mean of the means of strata, (n,) each, n > 1, that were drawn alone."""
        parts = [(x.var(ddof=1) / len(x) / len(strata) ** 2, len(x) - 1) for x in strata]
        mean = float(np.mean([x.mean() for x in strata]))
        return cls.of(mean, sum(variance for variance, _ in parts), parts)

    @property
    def interval(self) -> tuple[float, float]:
        """The 95% interval."""
        half = self.error * stats.t.isf(LEVEL / 2, self.df)
        return self.mean - half, self.mean + half

    def p_differs(self) -> float:
        """Return p of there being no difference (t test, two-sided)."""
        return 2 * self._beyond(abs(self.mean))

    def p_equal(self, margin: float) -> float:
        """Return p of the difference being `margin` or more (two one-sided t tests)."""
        return self._beyond(margin - abs(self.mean))

    def _beyond(self, distance: float) -> float:
        if self.error == 0:
            return 0.5 if distance == 0 else float(distance < 0)
        return float(stats.t.sf(distance / self.error, self.df))


def difference(pairs: Sequence[Pair]) -> tuple[Estimate, bool]:
    """Estimate the mean difference a - b between groups of runs, over categories that count alike.

    Runs and shapes are random effects, crossed; each run belongs to one group. This is the analysis
    of variance by which readers and cases are compared in radiology (Obuchowski & Rockette 1995,
    Hillis 2014): the variance of the runs' means, plus that of the mean difference over shapes,
    less what both contain. A run that was trained on several categories counts once. Where a group
    has one run for each category, the categories are the sample.

    Args:
        pairs: one for each category; both groups have the same shapes, two or more.

    Returns:
        The estimate, and whether it covers other trainings. It does not where a group has one
        training in all: then it is about these networks, and other shapes alone.
    """
    scores = [(a.to_numpy(float), b.to_numpy(float)) for a, b in pairs]
    differences = [a.mean(1) - b.mean(1) for a, b in scores]
    over_shapes = Estimate.over_strata(differences)
    trained = [x for side in zip(*pairs, strict=True) for x in _trainings(side)]
    if all(len(of_runs) > 1 for of_runs, _ in trained):
        seeds = [(len(x) * x.var(ddof=1), len(x) - 1) for x, _ in trained]
        shapes = over_shapes.error**2
        in_both = sum(_rest(x) for pair in scores for x in pair) / len(pairs) ** 2
        variance = max(sum(v for v, _ in seeds) + max(shapes - in_both, 0), shapes)
        parts = [*seeds, (shapes, over_shapes.df)]
        return Estimate.of(over_shapes.mean, variance, parts), True
    if len(pairs) > 1 and all(count == 1 for _, count in trained):
        return Estimate.over_strata([np.array([d.mean() for d in differences])]), True
    return over_shapes, False


def _trainings(categories: Sequence[pd.DataFrame]) -> Iterator[tuple[Array, int]]:
    """Give what each run adds to a group's mean over categories, and in how many categories.

    Together are runs of the same categories, seeds of each other.
    """
    added, places = defaultdict[str, float](float), defaultdict[str, tuple[int, ...]](tuple)
    for place, scores in enumerate(categories):
        means = scores.to_numpy(float).mean(0) / scores.shape[1] / len(categories)
        for run, mean in zip(scores.columns, means, strict=True):
            added[run] += mean
            places[run] += (place,)
    for where in set(places.values()):
        yield np.array([added[run] for run in added if places[run] == where]), len(where)


def _rest(scores: Array) -> float:
    """Return the variance of a group's mean from what is left beside effects of runs and shapes."""
    shapes, runs = scores.shape
    left = scores - scores.mean(0) - scores.mean(1, keepdims=True) + scores.mean()
    return float((left**2).sum() / ((shapes - 1) * (runs - 1)) / (shapes * runs))


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p values corrected for their number, by Holm's step-down method (1979).

    NaN, where nothing was tested, stays NaN and does not count.

    >>> [round(p, 3) for p in holm([0.04, 0.01, 0.5])]
    [0.08, 0.03, 0.5]
    """
    p = np.asarray(p_values, float)
    order = np.argsort(p, kind="stable")  # NaN last
    count = np.count_nonzero(~np.isnan(p))
    steps = np.maximum.accumulate((count - np.arange(len(p))) * p[order])
    corrected = np.empty_like(p)
    corrected[order] = np.minimum(steps, 1)
    return [float(x) for x in corrected]
