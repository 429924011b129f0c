"""Comparisons of settings, test shape by test shape, and what they decide."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd

from ffd_lightning.analysis.naming import SETTING, name_of, own_names, place
from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.uncertainty import LEVEL, MARGIN, Pair, difference, holm
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import Metric

_MEAN = "mean of "  # so many categories

_Compared = tuple[Pair, float]
"""Scores of two groups of runs in one category, and the metric's floor there."""


def compare(
    results: Results,
    measure: str,
    by: str | Sequence[str] = "regime",
    held: Sequence[str] | None = None,
    paired: bool = False,
) -> pd.DataFrame:
    """Compare groups of runs with each other on the very same test shapes.

    Runs of a group are seeds of the same settings. Only images that all compared runs were tested
    on count; several images of a shape are averaged. The interval is about other trainings and
    other shapes (`uncertainty.difference`), unless a group has one training: such a comparison is
    about these networks, and decides nothing. Categories count the same.

    Args:
        results: of the runs.
        measure: a column of the samples: a measure of the protocol, of any shape
            (`undeformed_chamfer`).
        by: columns, constant within a run, that tell the groups apart: `regime`, `seed`, say.
        held: columns that are the same in a comparison: there is one for each of their values. By
            default regime, templates and variant, as far as they are not named in `by`; what the
            variant does not say must then be the same, too.
        paired: whether groups are other scores of the same trainings, so that these differ in what
            is measured alone.

    Returns:
        A row per category and pair, and per pair one for the `mean of <k>` categories that have
        it. Columns: `category`; what is held; `a`, `b`, `measure`; `mean_a`, `mean_b`, of both on
        the shapes they share; `difference`, the mean of a - b in the measure's own unit, and its
        95% interval `low`, `high`; `above`, how far the nearer of both means is from the metric's
        floor (NaN where no references were scored), from 0 where it is no metric's; `num_samples`,
        shapes; `seeds_a`, `seeds_b`; `trainings`, whether the interval is about other trainings,
        too; and what `decide` adds.

    Raises:
        DataError: there is nothing that can be compared; the message says why.
    """
    names = [by] if isinstance(by, str) else list(by)
    alone = held is None and set(names) <= {"regime", "templates"}
    held = [name for name in SETTING if name not in names] if held is None else list(held)
    results.check_scored()
    require_columns(results.samples, [measure, *names, *held])
    without = results.samples.loc[results.samples[measure].isna(), "run"]
    if len(without):
        raise DataError(
            f"{without.iloc[0]} has samples without {measure}: ffd evaluate the run again "
            "(evaluation.references=true for what a network must beat)"
        )
    settings = results.deciding if alone else pd.DataFrame()
    settings = settings.loc[:, settings.nunique() > 1]
    floors = _floors(results, measure)
    needed = ["run", "seed", "category", "id", "view", measure, *names, *held]
    samples = results.samples[list(dict.fromkeys(needed))]  # selecting rows of all is slow
    found: list[tuple[tuple[Any, ...], list[_Compared]]] = []
    strata: dict[tuple[Any, ...], list[_Compared]] = {}
    for (category, *common), part in samples.groupby(["category", *held], sort=False):
        if alone:
            _check_settings(settings.loc[part["run"].unique()], names)
        floor = float(floors[part.index].mean())
        for a, b, pair in _pairs(part, measure, names, str(category)):
            found.append(((category, *common, a, b), [(pair, floor)]))
            strata.setdefault((*common, a, b), []).append((pair, floor))
    if not found:
        raise DataError(
            f"nothing to compare: all runs of a category have the same {' and '.join(names)}"
        )
    found += [((f"{_MEAN}{len(p)}", *heads), p) for heads, p in strata.items() if len(p) > 1]
    columns = ["category", *held, "a", "b"]
    rows = [dict(zip(columns, heads, strict=True)) | _numbers(p, paired) for heads, p in found]
    table = pd.DataFrame(rows)
    table.insert(len(columns), "measure", measure)
    return decide(table)


def decide(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table of comparisons with what they decide, corrected for their number (Holm).

    Args:
        table: rows of `compare`, of one table or of several put together.

    Returns:
        The same with `p_corrected`, of there being no difference, NaN where a group has one
        training; `differs`, whether there is one; and `equal`, whether it is less than `MARGIN` of
        `above`. Of all rows of a table without differences, one is said to differ in at most 5% of
        tables; the same holds for equality.
    """
    corrected = np.array(holm(table["p"].tolist()))
    equal = np.array(holm(table["p_equal"].tolist())) < LEVEL
    return table.assign(p_corrected=corrected, differs=corrected < LEVEL, equal=equal)


def _floors(results: Results, measure: str) -> pd.Series:
    """Return what the metric of a measure gives the truths themselves, NaN where nobody knows.

    The metric of `undeformed_chamfer` is chamfer. What is no metric, as folding, counts from 0.
    """
    names = [metric.name for metric in results.protocol.metrics]
    metric = max((n for n in names if f"_{measure}".endswith(f"_{n}")), key=len, default=None)
    samples = results.samples
    unknown = pd.Series(np.nan if metric else 0.0, samples.index)
    return samples.get(f"floor_{metric}", unknown)


def _pairs(
    part: pd.DataFrame, measure: str, names: list[str], category: str
) -> list[tuple[str, str, Pair]]:
    """Return all pairs of groups in one category, over the images that all runs have."""
    runs = part.drop_duplicates("run")
    groups: dict[str, list[str]] = {}
    for values, group in sorted(runs.groupby(names), key=lambda g: list(map(place, g[0]))):
        label = name_of(dict(zip(names, values, strict=True)), names, long=False)
        groups[label] = group.sort_values("seed")["run"].tolist()
    if len(groups) < 2:
        return []
    part = part.assign(id=own_names(part["id"], category))
    images = part.pivot(index=["id", "view"], columns="run", values=measure).dropna()
    shapes = images.groupby(level="id").mean()
    if len(shapes) < 2:
        raise DataError(
            f"{' and '.join(runs['run'])} share {len(shapes)} test shapes of {category}, 2 at "
            "least are needed: compare runs with the same data and split"
        )
    pairs = combinations(groups, 2)
    return [(a, b, (shapes[groups[a]], shapes[groups[b]])) for b, a in pairs]


def _numbers(compared: Sequence[_Compared], paired: bool) -> dict[str, Any]:
    """Return what a comparison finds, a - b, over categories that count the same."""
    pairs = [pair for pair, _ in compared]
    means = np.mean([(a.mean(axis=None), b.mean(axis=None)) for a, b in pairs], 0)
    above = float(np.abs(means - np.mean([floor for _, floor in compared])).min())
    margin = MARGIN * np.nan_to_num(above)  # nothing is about equal where the floor is unknown
    if paired:  # of each training the difference, beside nothing
        pairs = [(a - b.to_numpy(), 0 * b) for a, b in pairs]
    found, trainings = difference(pairs)
    low, high = found.interval
    return {
        "mean_a": float(means[0]),
        "mean_b": float(means[1]),
        "difference": found.mean,
        "low": low,
        "high": high,
        "above": above,
        "p": found.p_differs() if trainings else np.nan,
        "p_equal": found.p_equal(margin) if trainings else np.nan,
        "num_samples": sum(len(a) for a, _ in pairs),
        "seeds_a": min(a.shape[1] for a, _ in pairs),
        "seeds_b": min(b.shape[1] for _, b in pairs),
        "trainings": trainings,
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
    rows = compare(replace(results, samples=both), measure, "scored", paired=True)
    of_network = [x if x["a"] == "network" else turned(x) for x in rows.to_dict("records")]
    return pd.DataFrame(of_network)


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
    # Of a category alone and of several together, test shapes are the same.
    free = [key for key in settings if str(key).split(".")[0] in ("category", *names)]
    for key in settings.columns.drop(free):
        if len(values := sorted(settings[key].unique())) > 1:
            raise DataError(
                f"runs differ in {key} ({', '.join(values)}) as well as in "
                f"{' and '.join(names)}: leave some of them out"
            )
