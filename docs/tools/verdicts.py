"""Simulate comparisons whose truth is known, and print the tables of docs/evaluation.md.

    python docs/tools/verdicts.py              some minutes

Trainings are made of kept scores (docs/findings/data): shapes are drawn with what each regime makes
of them, and with what is left beside effects of shapes and runs. Runs differ by a normal variable
whose deviation is that of the regime's seeds.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parent))
from claims import read

from ffd_lightning.analysis.table import Table
from ffd_lightning.analysis.uncertainty import LEVEL, MARGIN, Pair, difference, holm

DATA = Path(__file__).parents[1] / "findings" / "data"
STUDY = "paper_table"  # with three seeds
REGIMES = ("b", "w", "e", "r", "posterior")
MEASURES = ("chamfer", "emd", "iou")

Array = NDArray[np.float64]
Rule = Callable[[Sequence[Pair], np.random.Generator], tuple[float, float]]
"""Returns the interval of the mean difference between groups of runs, of pairs by category."""


@dataclass(frozen=True)
class Kept:
    """What made trainings are drawn from: the regimes of a study in a category, by one measure.

    Attributes:
        measure: its name.
        shapes: (n, regimes) of each shape the mean over seeds, less that of the regime.
        rest: (n, regimes, 3) what is left beside effects of shapes and runs.
        seeds: (regimes,) standard deviation of the runs' means.
        above: what lies between the mean score and the metric's floor.
    """

    measure: str
    shapes: Array
    rest: Array
    seeds: Array
    above: float

    @classmethod
    def of(cls, samples: pd.DataFrame, measure: str) -> Kept:
        """Take the scores of one category apart."""
        table = samples.pivot_table(measure, "id", ["regime", "seed"])
        scores = np.stack([table[regime].to_numpy() for regime in REGIMES], 1)
        shapes, runs = scores.mean(2), scores.mean(0)
        rest = scores - shapes[:, :, None] - runs + runs.mean(1, keepdims=True)
        floor = samples[f"floor_{measure}"].mean()
        above = float(abs(scores.mean() - floor))
        return cls(measure, shapes - shapes.mean(0), rest, runs.std(1, ddof=1), above)

    def draw(
        self, rng: np.random.Generator, shapes: int, seeds: int, groups: int = 2
    ) -> list[pd.DataFrame]:
        """Return scores of groups of trainings without a true difference, (shapes, seeds) each."""
        rows, found = rng.integers(len(self.shapes), size=shapes), []
        for k in rng.permutation(len(REGIMES))[:groups]:
            some = self.rest[rows[:, None], k, rng.integers(3, size=(shapes, seeds))]
            rest = some * 1.5**0.5  # of three numbers that add up to 0, two are free
            runs = rng.normal(0, self.seeds[k], seeds)
            found.append(pd.DataFrame(self.shapes[rows, k, None] + rest + runs))
        return found


def kept(measures: Sequence[str] = MEASURES) -> list[Kept]:
    """Return all categories of the study by all measures."""
    return [
        Kept.of(samples, measure)
        for _, samples in read(DATA, STUDY).samples.groupby("category")
        for measure in measures
    ]


def draw_pairs(
    known: Sequence[Kept], rng: np.random.Generator, shapes: int, seeds: int, categories: int = 1
) -> list[Pair]:
    """Return two groups of trainings in some categories, in units of what is above the floor."""
    chosen = [known[int(k)] for k in rng.integers(len(known), size=categories)]
    pairs: list[Pair] = []
    for place, category in enumerate(chosen):
        a, b = (
            x.add_prefix(f"{place}-") / category.above for x in category.draw(rng, shapes, seeds)
        )
        pairs.append((a, b))
    return pairs


# --- rules ---------------------------------------------------------------------------------------


def mixed_model(pairs: Sequence[Pair], _: np.random.Generator) -> tuple[float, float]:
    """Return the interval that `compare` gives."""
    return difference(pairs)[0].interval


def bootstrap(
    pairs: Sequence[Pair], rng: np.random.Generator, runs_too: bool
) -> tuple[float, float]:
    """Return the interval of a bootstrap of shapes, common to both groups, and of runs of each."""
    total = np.zeros(500)
    for pair in pairs:
        shapes = _weights(len(pair[0]), rng)
        for sign, scores in zip((1, -1), pair, strict=True):
            seeds = scores.shape[1]
            runs = _weights(seeds, rng) if runs_too else np.full((1, seeds), 1 / seeds)
            total += sign * ((shapes @ scores.to_numpy()) * runs).sum(1) / len(pairs)
    low, high = np.quantile(total, [LEVEL / 2, 1 - LEVEL / 2])
    return float(low), float(high)


def _weights(count: int, rng: np.random.Generator) -> Array:
    return rng.multinomial(count, np.full(count, 1 / count), 500) / count


RULES: dict[str, Rule] = {
    "mixed model": mixed_model,
    "bootstrap of seeds and shapes": partial(bootstrap, runs_too=True),
    "bootstrap of shapes": partial(bootstrap, runs_too=False),
}


# --- what is found -------------------------------------------------------------------------------


def coverage(
    known: Sequence[Kept],
    rule: Rule,
    shapes: int,
    seeds: int,
    categories: int = 1,
    trials: int = 1000,
) -> float:
    """Return how often a rule's interval holds the truth; else it would tell equals apart."""
    rng = np.random.default_rng(0)
    held = 0
    for _ in range(trials):
        low, high = rule(draw_pairs(known, rng, shapes, seeds, categories), rng)
        held += low <= 0 <= high
    return held / trials


def any_of_ten(known: Sequence[Kept], shapes: int, seeds: int, trials: int = 1000) -> float:
    """Return how often one of ten pairs of equal regimes is told apart, after Holm's correction."""
    rng, wrong = np.random.default_rng(0), 0
    for _ in range(trials):
        groups = known[rng.integers(len(known))].draw(rng, shapes, seeds, len(REGIMES))
        p = [difference([pair])[0].p_differs() for pair in combinations(groups, 2)]
        wrong += min(holm(p)) < LEVEL
    return wrong / trials


def decided(
    known: Sequence[Kept], shapes: int, seeds: int, shifts: Sequence[float], trials: int = 1000
) -> Array:
    """Return how often regimes are told apart, and called about equal, (shifts, 2).

    Args:
        known: what trainings are drawn from.
        shapes: in one category.
        seeds: of each regime.
        shifts: true differences, as shares of what is above the floor.
        trials: simulated comparisons.
    """
    rng, found = np.random.default_rng(0), []
    for _ in range(trials):
        estimate, _ = difference(draw_pairs(known, rng, shapes, seeds))
        shifted = [estimate._replace(mean=estimate.mean + shift) for shift in shifts]
        found.append([(x.p_differs() < LEVEL, x.p_equal(MARGIN) < LEVEL) for x in shifted])
    return np.mean(found, 0)


def rules_table() -> Table:
    """Return how often each rule's 95% interval holds the truth."""
    known, rows = kept(), []
    for seeds, categories in ((2, 1), (3, 1), (5, 1), (3, 3), (1, 13)):
        for shapes in (50, 150):
            cells = [f"{coverage(known, r, shapes, seeds, categories):.1%}" for r in RULES.values()]
            rows.append([str(seeds), str(categories), str(shapes), *cells])
    return Table("", ["seeds", "categories", "shapes", *RULES], rows, heads=3)


def wrong_table() -> Table:
    """Return how often equal regimes are told apart, and regimes 10% apart are called equal."""
    known, rows = kept(), []
    for seeds in (2, 3, 5):
        wrong = f"{any_of_ten(known, 100, seeds):.1%}"
        rows.append([str(seeds), wrong, f"{decided(known, 100, seeds, [MARGIN])[0, 1]:.1%}"])
    return Table("", ["seeds", "one of ten pairs told apart", "10% apart called equal"], rows)


def power_table(shapes: int = 100) -> Table:
    """Return how often a true difference is found, and none is called equal."""
    rows = []
    for measure in MEASURES:
        known = kept([measure])
        for seeds in (2, 3, 5, 10):
            found = decided(known, shapes, seeds, [0.05, 0.1, 0.2, 0.0])
            cells = [*found[:3, 0], found[3, 1]]
            rows.append([measure, str(seeds), *(f"{x:.0%}" for x in cells)])
    heads = ["measure", "seeds", "5% apart", "10%", "20%", "equal called equal"]
    return Table("", heads, rows, heads=2)


def main() -> None:
    """Print all tables."""
    for make in (rules_table, wrong_table, power_table, partial(power_table, shapes=1000)):
        print(make().markdown(), flush=True)


if __name__ == "__main__":
    main()
