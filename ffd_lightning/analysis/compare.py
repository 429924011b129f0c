"""Means over seeds, intervals, and comparisons of runs test shape by test shape."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from ffd_lightning.analysis.runs import decides, different_settings, without_seed
from ffd_lightning.analysis.table import number
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.candidates import CANDIDATES
from ffd_lightning.evaluation.protocols import Metric, ProtocolDescription
from ffd_lightning.run_folder import RunFolder

REGIMES = ("b", "w", "e", "r")  # in the paper's order
RESAMPLES = 10_000
LEVEL = 0.05
"""Differences are shown at 95%."""

_HELD = ("regime", "templates")  # what is the same in a comparison unless it is what is compared
_SEEDS_SHARE = ("category", "regime", "templates")
_MEAN = "mean of "  # so many categories

Array = NDArray[np.float64]


def interval(strata: Sequence[Array]) -> tuple[float, float]:
    """Return the 95% interval of a mean over test shapes, the mean of the means of strata.

    A bootstrap, bias-corrected and accelerated (Efron 1987): differences of squared distances have
    one long tail, on which plain percentiles end too early. Each stratum is resampled in itself.

    Args:
        strata: values of shapes, (n,) each.
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


def aggregate_seeds(
    runs: pd.DataFrame, measures: Sequence[str], keys: Sequence[str] = _SEEDS_SHARE
) -> pd.DataFrame:
    """Return means and deviations over seeds; categories and protocols are never mixed.

    Args:
        runs: as `load_runs` gives them; those that are not finished are passed over.
        measures: columns of numbers.
        keys: columns that seeds of each other have in common.

    Returns:
        A row per value of the keys and protocol, in the order of the runs. Columns: those,
        `num_seeds`, and for each measure its mean under its own name and under `<measure>_std` the
        standard deviation (divided by n - 1; NaN for one seed).

    Raises:
        DataError: no finished run, a run without a measure, or two that differ in more than their
            seed, in settings that no column names.
    """
    keys = [*keys, "protocol"]
    require_columns(runs, ["run", "state", "seed", *keys])
    finished = runs[runs["state"] == "finished"]
    if finished.empty:
        raise DataError("no run is finished: train one first")
    for measure in measures:
        values = finished.get(measure, pd.Series(np.nan, finished.index))
        without = finished.loc[values.isna(), "run"]
        if len(without):
            raise DataError(
                f"the summary of {without.iloc[0]} has no {measure}: give the command that trained "
                "it again, which evaluates it anew (what a model must beat is scored with "
                "evaluation.references=true)"
            )
    rows = []
    for values, part in finished.groupby(keys, sort=False):
        check_seeds(part)
        row: dict[str, Any] = dict(zip(keys, values, strict=True)) | {"num_seeds": len(part)}
        for measure in measures:
            row |= {measure: part[measure].mean(), f"{measure}_std": part[measure].std(ddof=1)}
        rows.append(row)
    return pd.DataFrame(rows)


def compare_runs(
    samples: pd.DataFrame,
    protocol: ProtocolDescription,
    measure: str,
    by: str | Sequence[str] = "regime",
    *,
    settings: pd.DataFrame | None = None,
) -> pd.DataFrame:
    """Compare groups of runs with each other on the very same test shapes.

    Runs of a group are seeds of the same settings: their scores are averaged, as are those of
    several images of a shape. Only images that all compared runs were tested on count. What is
    measured is how sure the difference between *these trained networks* is, over models that might
    have been tested on; how much another training would differ shows only in several seeds, and
    `agreement` says whether they speak with one voice.

    See `interval` and `rank_score`; categories are strata, each counts the same. `p` asks about
    ranks and is corrected for the number of comparisons, the interval is about the mean and is not:
    a difference is called shown where both show it, in one direction. Fewer than 6 shapes never
    show one.

    Args:
        samples: as `load_samples` gives them.
        protocol: that they were measured under, as `find_protocol` gives it.
        measure: a column of the samples: a measure of the protocol, of any shape
            (`undeformed_chamfer`).
        by: what tells the groups: `regime`, `templates`, `seed`, `run`, any other column that is
            constant within a run, or several of them. Regime and number of templates are held equal
            unless named here: there is a comparison for each of their values. With a column
            `setup`, of what seeds of each other have in common, nothing is held and runs may differ
            in anything.
        settings: as `load_settings` gives them, to make sure that runs differ in nothing else (then
            `by` may name any setting, such as `regime.min_weight`).

    Returns:
        A row per category and pair, and per pair one for the `mean of <k>` categories that have
        it. Columns: `category`; of `regime` and `templates` what is held; `a`, `b`, `measure`;
        `mean_a`, `mean_b`, of both on the shapes they share; `difference`, the mean of a - b in
        the measure's own unit, and its interval `low`, `high`;
        `p`, and `p_corrected` for all rows together (Holm); `num_samples`, shapes; `seeds_a`,
        `seeds_b`; `agreement`, the share of pairs of seeds, one of each group, whose difference has
        this sign (of several categories, their mean); `shown`, whether mean and ranks both show
        it; `statement`, a sentence.

    Raises:
        DataError: no groups to compare, fewer than two shapes in common, a measure that is missing,
            or runs that differ in other settings too.
    """
    names = [by] if isinstance(by, str) else list(by)
    judged = measure_of(measure, protocol)
    samples = _with_settings(samples, names, settings)
    require_columns(samples, ["run", "category", "id", "view", "seed", *_HELD, measure, *names])
    _check_values(samples, measure)
    held = [name for name in _HELD if name not in names and "setup" not in names]
    found: list[_Pair] = []
    for values, part in samples.groupby(["category", *held], sort=False):
        category, *rest = values
        if settings is not None:
            _check_settings(part, names, settings)
        found += _pairs(part, measure, names, str(category), tuple(rest))
    if not found:
        raise DataError(
            f"nothing to compare: all runs of a category have the same {' and '.join(names)}"
        )
    found += _over_categories(found)
    rows = []
    for pair in found:
        low, high = interval(pair.differences)
        z = rank_score(pair.differences)
        difference = float(np.mean([d.mean() for d in pair.differences]))
        sign = 1 if difference > 0 else -1
        rows.append(
            {
                "category": pair.category,
                **dict(zip(held, pair.held, strict=True)),
                "a": pair.a,
                "b": pair.b,
                "measure": measure,
                "mean_a": pair.means[0],
                "mean_b": pair.means[1],
                "difference": difference,
                "low": low,
                "high": high,
                "p": float(2 * stats.norm.sf(abs(z))),
                "num_samples": sum(map(len, pair.differences)),
                "seeds_a": pair.seeds[0],
                "seeds_b": pair.seeds[1],
                "agreement": float(np.mean(np.sign(pair.of_runs) == np.sign(difference))),
                "shown": min(sign * low, sign * high) > 0 and sign * z > 0,
            }
        )
    table = pd.DataFrame(rows)
    table.insert(table.columns.get_loc("p") + 1, "p_corrected", holm(table["p"]))
    table["shown"] &= table["p_corrected"] < LEVEL
    table["statement"] = [
        _statement(row, held, judged, len(table)) for row in table.to_dict("records")
    ]
    return table


class Best(NamedTuple):
    """Groups of runs ranked by one measure, on the test shapes that all of them share.

    Attributes:
        category: its name; `mean of <k>` over several.
        means: of each group, by its label, the best first.
        ahead: by how much the best is better than the second, in the measure's own unit.
        interval: of that, 95%.
        shown: mean and ranks both show it.
        seeds: the fewest trainings of the best and the second.
        agreement: share of pairs of runs, one of each group, that have this order.
        num_shapes: test shapes.
        level: groups that are not shown to be worse than the best.
    """

    category: str
    means: dict[str, float]
    ahead: float
    interval: tuple[float, float]
    shown: bool
    seeds: int
    agreement: float
    num_shapes: int
    level: frozenset[str]

    @property
    def over_all(self) -> bool:
        """Whether it is a mean over categories."""
        return self.category.startswith(_MEAN)


def best(compared: pd.DataFrame, measure: Metric) -> list[Best]:
    """Rank the groups of each category, and of the mean of those that have all groups.

    Args:
        compared: all pairs of groups by this measure, as `compare_runs` gives them, with nothing
            held but what all runs share.
        measure: the measure.
    """
    count = len(set(compared["a"]) | set(compared["b"]))
    return [
        _best(part, measure)
        for category, part in compared.groupby("category", sort=False)
        if not str(category).startswith(_MEAN) or len(part) == count * (count - 1) // 2
    ]


def _best(pairs: pd.DataFrame, measure: Metric) -> Best:
    """Rank the groups of one category."""
    means = dict(zip(pairs["a"], pairs["mean_a"], strict=True))
    means |= dict(zip(pairs["b"], pairs["mean_b"], strict=True))
    sign = 1 if measure.higher_is_better else -1
    order = sorted(means, key=lambda label: -sign * means[label])
    of_best = pairs[(pairs["a"] == order[0]) | (pairs["b"] == order[0])]
    (first,) = of_best[(of_best["a"] == order[1]) | (of_best["b"] == order[1])].to_dict("records")
    turn = sign if first["a"] == order[0] else -sign
    low, high = sorted(turn * float(first[end]) for end in ("low", "high"))
    level = of_best.loc[~of_best["shown"], ["a", "b"]].to_numpy().ravel()
    return Best(
        str(first["category"]),
        {label: float(means[label]) for label in order},
        turn * float(first["difference"]),
        (low, high),
        bool(first["shown"]),
        min(int(first["seeds_a"]), int(first["seeds_b"])),
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
            result[tuple(values)] = interval([scores])
    return result


def group_label(names: Sequence[str], values: Sequence[Any]) -> str:
    """Return what a group is called: "w T=16"."""
    short = {"regime": "", "run": "", "setup": "", "shape": "", "templates": "T=", "seed": "seed "}
    return " ".join(f"{short.get(n, f'{n}=')}{v}" for n, v in zip(names, values, strict=True))


def _statement(row: dict[Any, Any], held: Sequence[str], judged: Metric, count: int) -> str:
    """Say in a sentence what a comparison shows.

    One group "beats" another only where both were trained several times, and every pair of their
    runs agrees: of a single training, only its scores can be said to be better.
    """
    a, b = row["a"], row["b"]
    where = ("the " if row["category"].startswith(_MEAN) else "") + row["category"]
    if held:
        where += f" ({group_label(held, [row[name] for name in held])})"
    shape = row["measure"].removesuffix(judged.name).replace("_", " ")
    chance = "p < 0.001" if row["p_corrected"] < 0.001 else f"p = {row['p_corrected']:.2g}"
    seeds = "one training each: another seed may give another order"
    if max(row["seeds_a"], row["seeds_b"]) > 1:
        agree = f"{row['agreement']:.0%} of their pairs agree"
        seeds = f"{row['seeds_a']} and {row['seeds_b']} seeds, {agree}"
    corrected = f", Holm over {count} comparisons" if count > 1 else ""
    facts = f"({row['num_samples']} shapes, {chance}{corrected}; {seeds})"
    sign = 1
    if not row["shown"]:
        told = f"no difference shown between {a} and {b} on {where}: "
        size = f"{shape}{judged.title} {a} - {b} = "
    else:
        sign = 1 if row["difference"] > 0 else -1
        winner, loser = (a, b) if (sign > 0) == judged.higher_is_better else (b, a)
        again = min(row["seeds_a"], row["seeds_b"]) > 1 and row["agreement"] == 1
        told = f"{winner} {'beats' if again else 'scores better than'} {loser} on {where}: "
        size = f"{shape}{judged.title} {'higher' if judged.higher_is_better else 'lower'} by "
    low, high = sorted(sign * judged.factor * row[end] for end in ("low", "high"))
    unit = "" if judged.factor == 1 else f" x {judged.factor:g}"
    mean = number(sign * judged.factor * row["difference"])
    return f"{told}{size}{mean} [{number(low)}, {number(high)}]{unit} {facts}"


def compare_with_retrieval(
    samples: pd.DataFrame, protocol: ProtocolDescription, measure: str
) -> pd.DataFrame:
    """Compare runs with the training shapes that their own encoders retrieve for the same images.

    Args:
        samples: as `load_samples` gives them.
        protocol: that they were measured under.
        measure: of the protocol.

    Returns:
        As `compare_runs` gives it: `a` is the network, `b` what is retrieved, for each category,
        regime and number of templates.

    Raises:
        DataError: the evaluations have no references; or see `compare_runs`.
    """
    column = f"feature_retrieval_{measure}"
    require_columns(samples, [column])
    _check_values(samples, column)
    retrieved = samples.assign(**{measure: samples[column]}, run=samples["run"] + ", retrieved")
    named = {"the network": samples, "retrieval": retrieved}
    both = pd.concat([part.assign(shape=name) for name, part in named.items()], ignore_index=True)
    return compare_runs(both, protocol, measure, by="shape")


def measure_of(column: str, protocol: ProtocolDescription) -> Metric:
    """Return the measure of a protocol that a column of samples holds, of whatever shape.

    Raises:
        DataError: no such column.

    >>> iou = Metric("iou", "of voxels", higher_is_better=True)
    >>> measure_of("best_undeformed_iou", ProtocolDescription("mine", "", (iou,))) is iou
    True
    """
    for measure in protocol.metrics:
        if column in [f"{shape}_{measure.name}".removeprefix("_") for shape in CANDIDATES]:
            return measure
    raise DataError(
        f"{column} is no measure of protocol {protocol.name}: it has "
        f"{', '.join(m.name for m in protocol.metrics)}; for another shape with its name before "
        "it: undeformed_..."
    )


def require_columns(table: pd.DataFrame, columns: Iterable[str]) -> None:
    """Raise a DataError that names the columns a table lacks."""
    missing = [c for c in columns if c not in table]
    if missing:
        raise DataError(f"the table has no column {', '.join(missing)}: it has {', '.join(table)}")


def check_seeds(part: pd.DataFrame) -> None:
    """Raise a DataError if runs of a group differ in more than their seed, or do not differ in it.

    Args:
        part: rows of runs that count as seeds of each other; `run`, `seed` and, where it is known,
            `setting`.
    """
    known = [name for name in ("run", "seed", "setting") if name in part]
    runs = part[known].drop_duplicates()
    if "setting" in runs and runs["setting"].nunique() > 1:
        first, second = runs.drop_duplicates("setting")["run"].iloc[:2]
        try:
            keys = different_settings(RunFolder(Path(first)), RunFolder(Path(second)))
        except ConfigError:  # their folders are elsewhere
            keys = ["settings"]
        raise DataError(
            f"{first} and {second} differ in {', '.join(keys)}, not in the seed alone, and are not "
            "averaged: leave one out or compare them by that"
        )
    twice = runs[runs["seed"].duplicated(keep=False)]
    if len(twice):
        first, second = twice["run"].iloc[:2]
        raise DataError(
            f"{first} and {second} have the same category, regime, templates and seed, so another "
            "setting differs (see load_settings): leave one out or compare them by it"
        )


class _Pair(NamedTuple):
    """Two groups of runs, over one category or several.

    Attributes:
        category: its name.
        held: values of the settings that both have.
        a, b: names of the groups.
        differences: a - b of each test shape, (n,), a category each.
        of_runs: differences of the means of single runs, all pairs.
        seeds: runs in a and in b.
        means: of a and of b, over shapes and categories.
    """

    category: str
    held: tuple[Any, ...]
    a: str
    b: str
    differences: list[Array]
    of_runs: Array
    seeds: tuple[int, int]
    means: tuple[float, float]


def _pairs(
    part: pd.DataFrame, measure: str, names: list[str], category: str, held: tuple[Any, ...]
) -> list[_Pair]:
    """Compare all pairs of groups in one category, over the images that all runs have."""
    own = ["run", "seed", *names, *({"setting"} & set(part))]
    runs = part[list(dict.fromkeys(own))].drop_duplicates()
    if runs["run"].duplicated().any():
        raise DataError(f"{' and '.join(names)} must not change within a run")
    groups: dict[str, list[str]] = {}
    for values, group in sorted(runs.groupby(names), key=lambda g: [_order(v) for v in g[0]]):
        check_seeds(group)
        groups[group_label(names, values)] = group.sort_values("seed")["run"].tolist()
    if len(groups) < 2:
        return []
    # Trained together with other categories, a shape is called <category>/<id>.
    part = part.assign(id=part["id"].str.removeprefix(f"{category}/"))
    images = part.pivot(index=["id", "view"], columns="run", values=measure).dropna()
    models = images.groupby(level="id").mean()
    if len(models) < 2:
        raise DataError(
            f"{' and '.join(runs['run'])} share {len(models)} test shapes of {category}, 2 at "
            "least are needed: compare runs with the same data and split"
        )
    scores = {label: models[group].to_numpy().mean(1) for label, group in groups.items()}
    of_run = models.mean()
    return [
        _Pair(
            category,
            held,
            a,
            b,
            [scores[a] - scores[b]],
            np.subtract.outer(of_run[groups[a]].to_numpy(), of_run[groups[b]].to_numpy()).ravel(),
            (len(groups[a]), len(groups[b])),
            (float(scores[a].mean()), float(scores[b].mean())),
        )
        for b, a in combinations(groups, 2)
    ]


def _over_categories(found: list[_Pair]) -> list[_Pair]:
    """Return the comparisons over all categories of those that several have."""
    same: dict[tuple[Any, ...], list[_Pair]] = {}
    for pair in found:
        same.setdefault((pair.held, pair.a, pair.b), []).append(pair)
    return [
        _Pair(
            f"{_MEAN}{len(parts)}",
            held,
            a,
            b,
            [d for pair in parts for d in pair.differences],
            _of_runs(parts),
            (min(pair.seeds[0] for pair in parts), min(pair.seeds[1] for pair in parts)),
            (
                float(np.mean([pair.means[0] for pair in parts])),
                float(np.mean([pair.means[1] for pair in parts])),
            ),
        )
        for (held, a, b), parts in same.items()
        if len(parts) > 1
    ]


def _of_runs(parts: list[_Pair]) -> Array:
    """Return how much pairs of runs differ in the mean over categories."""
    if len({pair.seeds for pair in parts}) > 1:  # no pairs that go together
        return np.concatenate([pair.of_runs for pair in parts])
    return np.asarray(np.mean([pair.of_runs for pair in parts], 0))


def _order(value: Any) -> tuple[int, float, str]:
    """Put regimes in the paper's order, numbers by size, anything else by name."""
    if value in REGIMES:
        return 0, REGIMES.index(value), ""
    if isinstance(value, (int, float, np.number)):
        return 1, float(value), ""
    return 2, 0.0, str(value)


def _with_settings(
    samples: pd.DataFrame, names: list[str], settings: pd.DataFrame | None
) -> pd.DataFrame:
    """Add those settings to samples that are to be compared."""
    if settings is None:
        return samples
    missing = set(samples["run"]) - set(settings.index)
    if missing:
        raise DataError(f"no settings of {min(missing)}: load_settings of all runs is needed")
    new = [n for n in names if n not in samples and n in settings]
    return samples.assign(**{n: samples["run"].map(settings[n].map(_plain)) for n in new})


def _plain(value: Any) -> Any:
    """Return a setting as something that can be compared: lists as text."""
    return value if isinstance(value, (int, float)) and not pd.isna(value) else str(value)


def _check_values(samples: pd.DataFrame, measure: str) -> None:
    without = samples.loc[samples[measure].isna(), "run"]
    if len(without):
        raise DataError(
            f"{without.iloc[0]} has samples without {measure}: ffd evaluate "
            f"run={without.iloc[0]} (references=true for what a model must beat)"
        )
    twice = samples.duplicated(["run", "id", "view"])
    if twice.any():
        raise DataError(f"samples of {samples.loc[twice, 'run'].iloc[0]} are there twice")


def _check_settings(part: pd.DataFrame, names: list[str], settings: pd.DataFrame) -> None:
    """Raise a DataError if runs differ in more than what is compared (and their seed)."""
    if {"run", "setup"} & set(names):
        return
    runs = part[["run", *names]].drop_duplicates().set_index("run")
    # Of a category alone and of several together, test shapes are the same.
    keys = [k for k in settings if decides(k) and not k.startswith("category.")]
    seeds = settings.get("seed", pd.Series(index=settings.index))[runs.index]
    for key in keys:
        values = settings.loc[runs.index, key].map(_plain).astype(str)
        values = values.combine(seeds, without_seed)
        allowed = key in names or key.split(".")[0] in names
        per_group = [group for _, group in values.groupby([runs[n] for n in names])]
        for group in per_group if allowed else [values]:
            if group.nunique() > 1:
                raise DataError(
                    f"runs differ in {key} ({', '.join(sorted(group.unique()))}) as well as in "
                    f"{' and '.join(names)}: name it in by too, or leave some of them out"
                )
