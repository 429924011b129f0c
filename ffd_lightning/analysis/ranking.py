"""Which group of runs is best by a measure, by how much, and whether that is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from ffd_lightning.analysis.paired import interval_of_mean, resampled_means
from ffd_lightning.evaluation.protocols import Measure


@dataclass(frozen=True)
class Ranking:
    """Groups of runs by one measure, on the test shapes that all of them share.

    Attributes:
        category: its name; `mean of <k>` over several.
        measure: that orders them.
        means: of each group, by its label, the best first.
        seeds: of each group.
        ahead: by how much the best is better than the second, in the measure's own unit.
        interval: of that, 95%.
        shown: mean and ranks both show it.
        agreement: share of pairs of runs, one of each group, that have this order.
        num_shapes: test shapes.
        level: groups that are not shown to be worse than the best.
    """

    category: str
    measure: Measure
    means: dict[str, float]
    seeds: dict[str, int]
    ahead: float
    interval: tuple[float, float]
    shown: bool
    agreement: float
    num_shapes: int
    level: frozenset[str]

    @property
    def best(self) -> str:
        """The best group's label."""
        return next(iter(self.means))

    @property
    def second(self) -> str:
        """The label of the next."""
        return list(self.means)[1]

    @property
    def over_all(self) -> bool:
        """Whether it is a mean over categories."""
        return self.category.startswith("mean of ")

    @property
    def trained_again(self) -> bool:
        """Whether the best and the second were both trained with several seeds."""
        return min(self.seeds[self.best], self.seeds[self.second]) > 1


def rankings(compared: pd.DataFrame, measure: Measure) -> list[Ranking]:
    """Rank the groups of each category, and of the mean of those that have all groups.

    Args:
        compared: all pairs of groups by this measure, as `compare_runs` gives them, with nothing
            held but what all runs share.
        measure: the measure.
    """
    parts = [part for _, part in compared.groupby("category", sort=False)]
    count = len(set(compared["a"]) | set(compared["b"]))
    return [
        _ranking(part, measure)
        for part in parts
        if not str(part["category"].iloc[0]).startswith("mean of ")
        or len(part) == count * (count - 1) // 2
    ]


def _ranking(pairs: pd.DataFrame, measure: Measure) -> Ranking:
    """Rank the groups of one category."""
    means = dict(zip(pairs["a"], pairs["mean_a"], strict=True))
    means |= dict(zip(pairs["b"], pairs["mean_b"], strict=True))
    seeds = dict(zip(pairs["a"], pairs["seeds_a"], strict=True))
    seeds |= dict(zip(pairs["b"], pairs["seeds_b"], strict=True))
    sign = 1 if measure.higher_is_better else -1
    order = sorted(means, key=lambda label: -sign * means[label])
    of_best = pairs[(pairs["a"] == order[0]) | (pairs["b"] == order[0])]
    (first,) = of_best[(of_best["a"] == order[1]) | (of_best["b"] == order[1])].to_dict("records")
    turn = sign if first["a"] == order[0] else -sign
    low, high = sorted(turn * float(first[end]) for end in ("low", "high"))
    level = of_best.loc[~of_best["shown"], ["a", "b"]].to_numpy().ravel()
    return Ranking(
        str(first["category"]),
        measure,
        {label: float(means[label]) for label in order},
        {label: int(seeds[label]) for label in order},
        turn * float(first["difference"]),
        (low, high),
        bool(first["shown"]),
        float(first["agreement"]),
        int(first["num_samples"]),
        frozenset(map(str, level)) - {order[0]},
    )


def mean_intervals(
    samples: pd.DataFrame, measure: str, keys: Sequence[str]
) -> dict[tuple[object, ...], tuple[float, float]]:
    """Return the 95% interval over test shapes of the mean of each group of runs.

    Scores of a group's runs, and of the images of a shape, are averaged first: the interval says
    how far the mean would differ on other test shapes, not what another training would give.

    Args:
        samples: as `load_samples` gives them, with the columns `keys`.
        measure: a column of theirs.
        keys: columns that tell the groups apart.
    """
    result = {}
    for values, part in samples.groupby(list(keys), sort=False):
        scores = part.groupby(["category", "id"])[measure].mean().dropna().to_numpy(float)
        if len(scores) > 1:
            resampled = resampled_means(scores[:, None], measure)[:, 0]
            result[tuple(values)] = interval_of_mean([scores], resampled)
    return result
