"""Sections: the table of scores, and what can be said of differences."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar

import pandas as pd

from ffd_lightning.analysis.compare import aggregate_seeds, compare_runs, compare_with_retrieval
from ffd_lightning.analysis.report.elements import NOTHING, Statement, Table, cell, statements
from ffd_lightning.analysis.report.sweep import Sweep, plain, told_apart, varying
from ffd_lightning.analysis.wording import measure_title, number
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import Measure, ProtocolDescription
from ffd_lightning.evaluation.references import SHAPES

_SAME_FOR_ALL = {
    "medoid": "central shape",
    "retrieval": "nearest shape",
    "floor": "truth again",
}  # references that no network has a part in
_BESIDE = {
    "undeformed": "undeformed",
    "best_undeformed": "best undeformed",
    "feature_retrieval": "retrieved",
}  # what stands beside the model: prefix of its columns, heading
_COMPARED = {"regime": "Regimes", "templates": "Numbers of templates", "setup": "Runs"}
_RETRIEVAL = "The network and what its encoder retrieves among the training shapes"
_MANY_SETUPS = 8
_MANY = 12  # comparisons that are shown unasked


@dataclass(frozen=True)
class Results:
    """The table of scores, with what they mean.

    Attributes:
        protocol: of the scores.
        table: of them; None where no run has any.
        note: what a number is the mean of.
        lacking: how many runs have no results.
        beside, below: names of the references beside the model and below all, and what they are.
        several_categories: what is below is a mean over categories.
    """

    key: ClassVar[str] = "results"
    title: ClassVar[str] = "Results"

    protocol: ProtocolDescription
    table: Table | None = None
    note: str = ""
    lacking: int = 0
    beside: Sequence[tuple[str, str]] = ()
    below: Sequence[tuple[str, str]] = ()
    several_categories: bool = False


@dataclass(frozen=True)
class Block:
    """What a measure says of the differences between groups of runs.

    Attributes:
        title: what is compared, by what.
        first: of several measures; the others are shown when they are asked for.
        error: why nothing is compared, "" where it is.
        shown: sentences.
        folded, summary: more of them, and what is said in their place.
    """

    title: str
    first: bool = True
    error: str = ""
    shown: Sequence[Statement] = ()
    folded: Sequence[Statement] = ()
    summary: str = ""


@dataclass(frozen=True)
class Comparison:
    """What can be said of differences; not of groups of runs where there are `too_many`."""

    key: ClassVar[str] = "comparison"
    title: ClassVar[str] = "What differs"

    blocks: Sequence[Block] = field(default_factory=list)
    too_many: bool = False


def results(sweep: Sweep) -> Results:
    """Return the table of scores, with what they mean."""
    scored, protocol = sweep.scored, sweep.protocol
    if scored.empty:
        return Results(protocol)
    first = protocol.measures[0]
    beside = {k: title for k, title in _BESIDE.items() if f"{k}_{first.name}" in scored}
    columns = {m.name: (_heading(m), m.factor) for m in protocol.measures}
    for key, title in beside.items():
        columns[f"{key}_{first.name}"] = f"{title}\n{_title(first)}", first.factor
    columns["effective_templates"] = "effective\ntemplates", 1.0
    head, rows, note = _result_rows(sweep, {name: factor for name, (_, factor) in columns.items()})
    head += [title for title, _ in columns.values()] + ["test\nsamples"]
    below = [
        [
            title,
            *(number(m.factor * _mean(scored, f"{shape}_{m.name}")) for m in protocol.measures),
            *[""] * (len(beside) + 2),
        ]
        for shape, title in _SAME_FOR_ALL.items()
        if f"{shape}_{first.name}" in scored
    ]
    return Results(
        protocol,
        Table("Results", head, rows, below),
        note,
        len(sweep.unscored) + len(sweep.damaged),
        [(title, SHAPES[shape]) for shape, title in beside.items()],
        [(title, SHAPES[shape]) for shape, title in _SAME_FOR_ALL.items()],
        scored["category"].nunique() > 1,
    )


def _result_rows(sweep: Sweep, factors: dict[str, float]) -> tuple[list[str], list[list[str]], str]:
    """Return headings of the settings, rows, and what a number is: over seeds where there are."""
    scored = sweep.scored
    if scored.groupby(sweep.keys).size().max() > 1:
        names = [name for name in factors if scored[name].notna().all()]
        means = aggregate_seeds(scored, [*names, "num_samples"], sweep.keys)
        keys, same = told_apart(means, sweep.keys)
        rows = [
            [
                *(str(row[key]) for key in (*keys, "num_seeds")),
                *(_over_seeds(row, name, factor) for name, factor in factors.items()),
                cell(row["num_samples"]),
            ]
            for row in means.to_dict("records")
        ]
        over = "means over the test samples of a run, then mean ± standard deviation over seeds"
        return [*map(plain, keys), "seeds"], rows, over + same
    keys, same = told_apart(scored, [*sweep.keys, "seed"])
    rows = [
        [
            *(str(row[key]) for key in keys),
            *(_scaled(row[name], factor) for name, factor in factors.items()),
            cell(row["num_samples"]),
        ]
        for row in scored.to_dict("records")
    ]
    return [*map(plain, keys)], rows, f"means over the test samples of each run{same}"


def _over_seeds(row: dict[Any, Any], name: str, factor: float) -> str:
    deviation = row.get(f"{name}_std", float("nan"))
    spread = "" if pd.isna(deviation) else f" ± {number(factor * deviation)}"
    return _scaled(row.get(name), factor) + spread


def comparisons(sweep: Sweep) -> Comparison | None:
    """Return what can be said of differences: of regimes, of numbers of templates, of retrieval.

    Where runs differ in other settings too, all that they differ in is compared at once. None where
    there is nothing to compare.
    """
    scored, protocol = sweep.scored, sweep.protocol
    if scored.empty:
        return None
    compared = varying(scored, ["setup"] if "setup" in sweep.keys else ["regime", "templates"])
    too_many = compared == ["setup"] and scored["setup"].nunique() > _MANY_SETUPS
    samples = sweep.samples.merge(scored[["run", "setup"]], on="run")
    blocks: list[Block] = []
    for by in () if too_many else compared:
        compare = partial(compare_runs, samples, protocol, by=by, settings=sweep.settings)
        blocks += _blocks(_COMPARED[by], protocol, compare)
    if any(f"feature_retrieval_{m.name}" in samples for m in protocol.measures):
        if "setup" in sweep.keys:  # what tells runs apart is all that they differ in
            samples = samples.assign(regime=samples["setup"])
        blocks += _blocks(_RETRIEVAL, protocol, partial(compare_with_retrieval, samples, protocol))
    return Comparison(blocks, too_many) if blocks or too_many else None


def _blocks(
    title: str, protocol: ProtocolDescription, compare: Callable[[str], pd.DataFrame]
) -> list[Block]:
    """Return a block for each measure, up to one that cannot be compared."""
    blocks: list[Block] = []
    for measure in protocol.measures:
        try:
            table = compare(measure.name)
        except DataError as error:
            return [*blocks, Block(title, error=str(error))]
        blocks.append(_block(f"{title}, by {measure_title(measure.name)}", not blocks, table))
    return blocks


def _block(title: str, first: bool, table: pd.DataFrame) -> Block:
    """Show all sentences; of many those over all categories, and the rest when it is asked for."""
    if len(table) <= _MANY:
        return Block(title, first, shown=statements(table["statement"]))
    over_all = table["category"].str.startswith("mean of ")
    rest = table.loc[~over_all, "statement"]
    shown = rest.str.contains(" beats ", regex=False).sum()
    where = " within categories" if over_all.any() else ""
    return Block(
        title,
        first,
        shown=statements(table.loc[over_all, "statement"]),
        folded=statements(rest),
        summary=f"{len(rest)} comparisons{where}, {shown} of them show a difference",
    )


def _title(measure: Measure) -> str:
    return f"{measure_title(measure.name)} {measure.arrow}"


def _heading(measure: Measure) -> str:
    return _title(measure) + ("" if measure.factor == 1 else f"\nx {measure.factor:g}")


def _scaled(value: Any, factor: float) -> str:
    return NOTHING if value is None or pd.isna(value) else number(factor * value)


def _mean(scored: pd.DataFrame, name: str) -> float:
    """Return the mean over categories of the mean over runs."""
    return float(scored.groupby("category")[name].mean().mean())
