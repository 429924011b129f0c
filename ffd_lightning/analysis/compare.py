"""Means over seeds, and comparisons of runs sample by sample."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ffd_lightning.analysis.paired import Comparison, holm, resampled_means
from ffd_lightning.analysis.runs import decides, different_settings, without_seed
from ffd_lightning.analysis.sentences import group_label, statement
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.protocols import Measure, ProtocolDescription
from ffd_lightning.evaluation.references import SHAPES
from ffd_lightning.run_folder import RunFolder

REGIMES = ("b", "w", "e", "r")  # in the paper's order

_HELD = ("regime", "templates")  # what is the same in a comparison unless it is what is compared
_SEEDS_SHARE = ("category", "regime", "templates")


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

    The interval is a bootstrap over the shapes (10,000 resamples, fixed seed), bias-corrected and
    accelerated (Efron 1987): differences of squared distances have one long tail, on which plain
    percentiles end too early. Over several categories shapes are resampled within each and each
    category counts the same. `p` is Wilcoxon's signed-rank test, with zeros ranked as Pratt does
    since runs often choose the very same shape; of several categories, the sum of its z-scores
    over the root of their number (Stouffer). It asks about ranks and is corrected for the number of
    comparisons, the interval is about the mean and is not: a difference is called shown where
    both show it, in one direction. Fewer than 6 shapes never show one.

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
    found: list[Comparison] = []
    for values, part in samples.groupby(["category", *held], sort=False):
        category, *rest = values
        if settings is not None:
            _check_settings(part, names, settings)
        found += _compare(part, measure, names, str(category), tuple(rest))
    if not found:
        raise DataError(
            f"nothing to compare: all runs of a category have the same {' and '.join(names)}"
        )
    found += _over_categories(found)
    corrected = holm([c.p for c in found])
    rows = [
        {
            "category": c.category,
            **dict(zip(held, c.held, strict=True)),
            "a": c.a,
            "b": c.b,
            "measure": measure,
            "mean_a": c.means[0],
            "mean_b": c.means[1],
            "difference": c.difference,
            "low": c.interval[0],
            "high": c.interval[1],
            "p": c.p,
            "p_corrected": p,
            "num_samples": c.num_samples,
            "seeds_a": c.seeds[0],
            "seeds_b": c.seeds[1],
            "agreement": c.agreement,
            "shown": c.shown(p),
            "statement": statement(c, held, judged, measure, p, len(found)),
        }
        for c, p in zip(found, corrected, strict=True)
    ]
    return pd.DataFrame(rows)


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


def measure_of(column: str, protocol: ProtocolDescription) -> Measure:
    """Return the measure of a protocol that a column of samples holds, of whatever shape.

    Raises:
        DataError: no such column.

    >>> iou = Measure("iou", "of voxels", higher_is_better=True)
    >>> measure_of("best_undeformed_iou", ProtocolDescription("mine", "", (iou,))) is iou
    True
    """
    for measure in protocol.measures:
        if column in [f"{shape}_{measure.name}".removeprefix("_") for shape in SHAPES]:
            return measure
    raise DataError(
        f"{column} is no measure of protocol {protocol.name}: it has "
        f"{', '.join(m.name for m in protocol.measures)}; for another shape with its name before "
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


def _compare(
    part: pd.DataFrame, measure: str, names: list[str], category: str, held: tuple[Any, ...]
) -> list[Comparison]:
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
    pairs = [(later, base) for base, later in combinations(groups, 2)]
    differences = np.stack([scores[a] - scores[b] for a, b in pairs], 1)
    resampled = resampled_means(differences, category)
    of_run = models.mean()
    return [
        Comparison(
            category,
            held,
            a,
            b,
            [differences[:, k]],
            resampled[:, k],
            np.subtract.outer(of_run[groups[a]].to_numpy(), of_run[groups[b]].to_numpy()).ravel(),
            (len(groups[a]), len(groups[b])),
            (float(scores[a].mean()), float(scores[b].mean())),
        )
        for k, (a, b) in enumerate(pairs)
    ]


def _over_categories(found: list[Comparison]) -> list[Comparison]:
    """Return the comparisons over all categories of those that several have."""
    same: dict[tuple[Any, ...], list[Comparison]] = {}
    for c in found:
        same.setdefault((c.held, c.a, c.b), []).append(c)
    return [
        Comparison(
            f"mean of {len(parts)}",
            held,
            a,
            b,
            [d for c in parts for d in c.differences],
            np.mean([c.resampled for c in parts], 0),
            _of_runs(parts),
            (min(c.seeds[0] for c in parts), min(c.seeds[1] for c in parts)),
            (
                float(np.mean([c.means[0] for c in parts])),
                float(np.mean([c.means[1] for c in parts])),
            ),
        )
        for (held, a, b), parts in same.items()
        if len(parts) > 1
    ]


def _of_runs(parts: list[Comparison]) -> NDArray[np.float64]:
    """Return how much pairs of runs differ in the mean over categories."""
    if len({c.seeds for c in parts}) > 1:  # no pairs that go together
        return np.concatenate([c.of_runs for c in parts])
    return np.asarray(np.mean([c.of_runs for c in parts], 0))


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
