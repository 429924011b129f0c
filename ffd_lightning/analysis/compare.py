"""Intervals, and comparisons of settings test shape by test shape."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from ffd_lightning.analysis.naming import SETTING, name_of, place
from ffd_lightning.analysis.results import Results, deciding_settings
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import Metric

RESAMPLES = 10_000
LEVEL = 0.05
"""Differences are shown at 95%."""

_MEAN = "mean of "  # so many categories

Array = NDArray[np.float64]
_Pair = tuple[pd.DataFrame, pd.DataFrame]
"""Scores of two groups of runs in one category: a row per shape, a column per run."""


def interval(strata: Sequence[Array]) -> tuple[float, float]:
    """Return the 95% interval of a mean over test shapes, the mean of the means of strata.

    A bootstrap, bias-corrected and accelerated (Efron 1987): differences of squared distances have
    one long tail, on which plain percentiles end too early. Each stratum, (n,), is resampled alone.
    """
    if all(np.ptp(values) <= 1e-12 * np.abs(values).max() for values in strata):
        return (mean := _mean_of(*strata)), mean
    found = stats.bootstrap(
        strata,
        _mean_of,
        n_resamples=RESAMPLES,
        batch=max(1, 500_000 // max(map(len, strata))),
        confidence_level=1 - LEVEL,
        rng=np.random.default_rng(0),
    )
    return float(found.confidence_interval.low), float(found.confidence_interval.high)


def _mean_of(*strata: Array, axis: int = -1) -> Any:
    return np.mean([values.mean(axis=axis) for values in strata], axis=0)


def rank_score(strata: Sequence[Array]) -> float:
    """Return z of Wilcoxon's signed-rank test, positive where the greater ranks are.

    Zeros are ranked as Pratt does, since runs often choose the very same shape. Of several strata,
    the sum of their z-scores over the root of their number (Stouffer).
    """
    scores = []
    for values in strata:
        ranks = stats.rankdata(np.abs(values)) * np.sign(values)
        p = stats.wilcoxon(values, zero_method="pratt").pvalue if ranks.sum() else 1.0
        scores.append(np.sign(ranks.sum()) * stats.norm.isf(max(p, 1e-300) / 2))
    return float(np.sum(scores) / np.sqrt(len(scores)))


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


def compare(
    results: Results,
    measure: str,
    by: str | Sequence[str] = "regime",
    held: Sequence[str] | None = None,
) -> pd.DataFrame:
    """Compare groups of runs with each other on the very same test shapes.

    Runs of a group are seeds of the same settings: their scores are averaged, as are those of
    several images of a shape. Only images that all compared runs were tested on count. What is
    measured is how sure the difference between *these trained networks* is, over shapes that might
    have been tested on; how much another training would differ shows only in several seeds.

    Categories are strata, each counts the same. `p` asks about ranks and is corrected for the
    number of comparisons, the interval is about the mean and is not: a difference is called shown
    where both show it, in one direction. Fewer than 6 shapes never show one.

    Args:
        results: of the runs.
        measure: a column of the samples: a measure of the protocol, of any shape
            (`undeformed_chamfer`).
        by: columns, constant within a run, that tell the groups apart: `regime`, `seed`, say.
        held: columns that are the same in a comparison: there is one for each of their values. By
            default regime, templates and variant, as far as they are not named in `by`.

    Returns:
        A row per category and pair, and per pair one for the `mean of <k>` categories that have
        it. Columns: `category`; what is held; `a`, `b`, `measure`; `mean_a`, `mean_b`, of both on
        the shapes they share; `difference`, the mean of a - b in the measure's own unit, and its
        interval `low`, `high`; `p`, and `p_corrected` for all rows together (Holm); `num_samples`,
        shapes; `seeds_a`, `seeds_b`; `agreement`, the share of pairs of seeds, one of each group,
        whose difference has this sign; `shown`.

    Raises:
        DataError: there is nothing that can be compared; the message says why.
    """
    names = [by] if isinstance(by, str) else list(by)
    held = [name for name in SETTING if name not in names] if held is None else list(held)
    results.check_scored()
    require_columns(results.samples, [measure, *names, *held])
    without = results.samples.loc[results.samples[measure].isna(), "run"]
    if len(without):
        raise DataError(
            f"{without.iloc[0]} has samples without {measure}: ffd evaluate "
            f"run={without.iloc[0]} (references=true for what a network must beat)"
        )
    alone = set(names) <= {"regime", "templates"}
    settings = deciding_settings(results.settings) if alone else pd.DataFrame()
    found: list[tuple[tuple[Any, ...], list[_Pair]]] = []
    strata: dict[tuple[Any, ...], list[_Pair]] = {}
    for (category, *common), part in results.samples.groupby(["category", *held], sort=False):
        if alone:
            _check_settings(settings.loc[part["run"].unique()], names)
        for a, b, pair in _pairs(part, measure, names, str(category)):
            found.append(((category, *common, a, b), [pair]))
            strata.setdefault((*common, a, b), []).append(pair)
    if not found:
        raise DataError(
            f"nothing to compare: all runs of a category have the same {' and '.join(names)}"
        )
    found += [((f"{_MEAN}{len(p)}", *heads), p) for heads, p in strata.items() if len(p) > 1]
    columns = ["category", *held, "a", "b"]
    rows = [dict(zip(columns, heads, strict=True)) | _numbers(pairs) for heads, pairs in found]
    table = pd.DataFrame(rows)
    table.insert(len(columns), "measure", measure)
    table.insert(table.columns.get_loc("p") + 1, "p_corrected", holm(table["p"]))
    table["shown"] &= table["p_corrected"] < LEVEL
    return table


def _pairs(
    part: pd.DataFrame, measure: str, names: list[str], category: str
) -> list[tuple[str, str, _Pair]]:
    """Return all pairs of groups in one category, over the images that all runs have."""
    runs = part[list(dict.fromkeys(["run", "seed", *names]))].drop_duplicates()
    groups: dict[str, list[str]] = {}
    for values, group in sorted(runs.groupby(names), key=lambda g: list(map(place, g[0]))):
        label = name_of(dict(zip(names, values, strict=True)), names, long=False)
        groups[label] = group.sort_values("seed")["run"].tolist()
    if len(groups) < 2:
        return []
    # Trained together with other categories, a shape is called <category>/<id>.
    part = part.assign(id=part["id"].str.removeprefix(f"{category}/"))
    images = part.pivot(index=["id", "view"], columns="run", values=measure).dropna()
    shapes = images.groupby(level="id").mean()
    if len(shapes) < 2:
        raise DataError(
            f"{' and '.join(runs['run'])} share {len(shapes)} test shapes of {category}, 2 at "
            "least are needed: compare runs with the same data and split"
        )
    pairs = combinations(groups, 2)
    return [(a, b, (shapes[groups[a]], shapes[groups[b]])) for b, a in pairs]


def _numbers(pairs: Sequence[_Pair]) -> dict[str, Any]:
    """Return what a comparison finds, a - b, over categories that count the same."""
    scores = [(a.to_numpy().mean(1), b.to_numpy().mean(1)) for a, b in pairs]
    differences = [a - b for a, b in scores]
    mean_a, mean_b = np.mean([(a.mean(), b.mean()) for a, b in scores], 0).tolist()
    of_runs = [np.subtract.outer(a.mean().to_numpy(), b.mean().to_numpy()) for a, b in pairs]
    if len({of_run.shape for of_run in of_runs}) == 1:  # else no runs that go together
        of_runs = [np.mean(of_runs, 0)]
    low, high = interval(differences)
    z = rank_score(differences)
    difference = float(np.mean([d.mean() for d in differences]))
    sign = 1 if difference > 0 else -1
    same_sign = np.concatenate([np.sign(x).ravel() for x in of_runs]) == np.sign(difference)
    return {
        "mean_a": mean_a,
        "mean_b": mean_b,
        "difference": difference,
        "low": low,
        "high": high,
        "p": float(2 * stats.norm.sf(abs(z))),
        "num_samples": sum(map(len, differences)),
        "seeds_a": min(a.shape[1] for a, _ in pairs),
        "seeds_b": min(b.shape[1] for _, b in pairs),
        "agreement": float(np.mean(same_sign)),
        "shown": min(sign * low, sign * high) > 0 and sign * z > 0,
    }


def is_mean(category: object) -> bool:
    """Tell whether a row of `compare` is over several categories."""
    return str(category).startswith(_MEAN)


def turned(row: dict[Any, Any]) -> dict[Any, Any]:
    """Return a row of `compare` as the difference b - a."""
    pairs = [("a", "b"), ("mean_a", "mean_b"), ("seeds_a", "seeds_b")]
    swapped = {one: row[other] for pair in pairs for one, other in (pair, pair[::-1])}
    ends = {"difference": -row["difference"], "low": -row["high"], "high": -row["low"]}
    return row | swapped | ends


def compare_with(results: Results, measure: str, shape: str) -> pd.DataFrame:
    """Compare each setting, as `compare` does, with another shape scored for the same images.

    `a` is the network, `b` the shape, one of `candidates.CANDIDATES`; a DataError where it was not
    scored.
    """
    samples, column = results.samples, f"{shape}_{measure}"
    require_columns(samples, [column])
    new = {"run": samples["run"] + f", {shape}", "scored": shape, measure: samples[column]}
    both = pd.concat([samples.assign(scored="network"), samples.assign(**new)], ignore_index=True)
    rows = compare(replace(results, samples=both), measure, "scored").to_dict("records")
    return pd.DataFrame([row if row["a"] == "network" else turned(row) for row in rows])


def leads(compared: pd.DataFrame, measure: Metric) -> list[dict[str, Any]]:
    """Return the best group against the second, of each category and the mean of all that have all.

    They are rows of `compare`: `a` is the best. `compared` are all pairs of groups by this measure,
    as `compare` gives them with nothing held.
    """
    count = len(set(compared["a"]) | set(compared["b"]))
    found = []
    for category, pairs in compared.groupby("category", sort=False):
        if is_mean(category) and len(pairs) < count * (count - 1) // 2:
            continue
        means = dict(zip(pairs["a"], pairs["mean_a"], strict=True))
        means |= dict(zip(pairs["b"], pairs["mean_b"], strict=True))
        order = sorted(means, key=means.__getitem__, reverse=measure.higher_is_better)
        (row,) = pairs[pairs["a"].isin(order[:2]) & pairs["b"].isin(order[:2])].to_dict("records")
        found.append(row if row["a"] == order[0] else turned(row))
    return found


def require_columns(table: pd.DataFrame, columns: Iterable[str]) -> None:
    """Raise a DataError that names the columns a table lacks."""
    missing = [c for c in columns if c not in table]
    if missing:
        raise DataError(f"the table has no column {', '.join(missing)}: it has {', '.join(table)}")


def _check_settings(settings: pd.DataFrame, names: list[str]) -> None:
    """Raise a DataError if runs differ in more than what is compared (and their seed)."""
    for key, values in settings.items():
        # Of a category alone and of several together, test shapes are the same.
        if str(key).split(".")[0] not in ("category", *names) and values.nunique() > 1:
            raise DataError(
                f"runs differ in {key} ({', '.join(sorted(values.unique()))}) as well as in "
                f"{' and '.join(names)}: leave some of them out"
            )
