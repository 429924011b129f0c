"""Section: what can be said of differences, pair by pair."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar

import pandas as pd

from ffd_lightning.analysis.compare import compare_runs, compare_with_retrieval
from ffd_lightning.analysis.report.elements import Statement, statements
from ffd_lightning.analysis.report.sweep import Sweep
from ffd_lightning.analysis.wording import measure_title
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import ProtocolDescription

_COMPARED = {"regime": "Regimes", "templates": "Numbers of templates", "setup": "Runs"}
_RETRIEVAL = "The network and what its encoder retrieves among the training shapes"
_MANY_SETUPS = 8
_MANY = 12  # comparisons that are shown at once


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
    title: ClassVar[str] = "Pair by pair"

    blocks: Sequence[Block] = field(default_factory=list)
    too_many: bool = False


def comparisons(sweep: Sweep) -> Comparison | None:
    """Return what can be said of differences: of regimes, of numbers of templates, of retrieval.

    Where runs differ in other settings too, all that they differ in is compared at once. None where
    there is nothing to compare.
    """
    scored, protocol = sweep.scored, sweep.protocol
    if scored.empty:
        return None
    compared = sweep.told_apart_by
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
    shown = table.loc[~over_all, "shown"].sum()
    where = " within categories" if over_all.any() else ""
    return Block(
        title,
        first,
        shown=statements(table.loc[over_all, "statement"]),
        folded=statements(rest),
        summary=f"{len(rest)} comparisons{where}, {shown} of them show a difference",
    )
