"""Tables of results for people."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import RenderableType
from rich.text import Text

from ffd_lightning.analysis.budget import QUALITY, SHARES, error_budget, mesh_quality
from ffd_lightning.analysis.runs import described_protocol, load_runs, load_samples
from ffd_lightning.analysis.table_layout import Column, RunHeads, fitted, titled
from ffd_lightning.analysis.wording import SHAPE_TITLES, number, scaled_title
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import ProtocolDescription
from ffd_lightning.evaluation.references import SHAPES
from ffd_lightning.run_folder import RunFolder

_REFERENCES = (
    "undeformed",
    "best_undeformed",
    "feature_retrieval",
    "retrieval",
    "medoid",
    "floor",
)  # what a score is to be compared with
_SHAPES = {"test": "test shapes", "val": "validation shapes"}


def summary_tables(runs: Sequence[RunFolder], width: int | None = None) -> list[RenderableType]:
    """Return tables with a row per run: results, references, error budget, deformed meshes.

    Each run is shown under the protocol that its training ended with. What all runs have in common
    is in the title. Runs without results have a table of their own.

    Args:
        runs: their folders.
        width: of the terminal, None for no limit; tables that are wider are split.
    """
    by_path = {str(run.path): run for run in runs}
    table = load_runs(runs)
    finished = table[table["state"] == "finished"]
    shown: list[RenderableType] = []
    protocols = [
        described_protocol(by_path[run], name) or ProtocolDescription(name)
        for run, name in zip(finished["run"], finished["protocol"], strict=True)
    ]
    for protocol in dict.fromkeys(protocols):
        part = finished[[each == protocol for each in protocols]]
        own = [by_path[path] for path in part["run"]]
        shown.append(_results(part, protocol, _evaluated_on(own), width))
        if (references := _references(part, protocol, width)) is not None:
            shown.append(references)
        shown += _error_tables(part, protocol, width)
    failed = table[table["state"] != "finished"]
    return [*shown, _failures(failed)] if len(failed) else shown


def _evaluated_on(runs: Iterable[RunFolder]) -> str:
    subsets = {(run.status.get("evaluation") or {}).get("subset", "test") for run in runs}
    return _SHAPES.get(subsets.pop(), "shapes") if len(subsets) == 1 else "shapes"


def _results(
    runs: pd.DataFrame, protocol: ProtocolDescription, shapes: str, width: int | None
) -> RenderableType:
    heads = RunHeads.of(runs)
    columns = [
        Column(f"{m.title} {m.arrow}", _numbers(runs, m.name, m.factor)) for m in protocol.measures
    ]
    effective = _values(runs, "effective_templates")
    columns.append(Column("effective\ntemplates", [f"{value:.1f}" for value in effective]))
    columns.append(Column("seconds\nper step", [f"{x:.2f}" for x in runs["seconds_per_step"]]))
    counts = [f"{count:.0f}" for count in _values(runs, "num_samples")]
    told = heads.common
    if len(set(counts)) == 1:
        told = f"{told}, {counts[0]} {shapes}".removeprefix(", ")
    else:
        columns.append(Column(shapes.replace(" ", "\n"), counts))
    title = f"Results under protocol {protocol.name}"
    return titled(
        _joined(title, told), fitted(heads.columns, columns, width), _caption(protocol), width
    )


def _caption(protocol: ProtocolDescription) -> str:
    if not protocol.measures:
        return ""
    meanings = "; ".join(f"{m.title}: {m.definition}" for m in protocol.measures)
    return (
        "Means over the shapes, of the selected template, deformed. "
        f"{meanings}. {protocol.note}.{protocol.factors}"
    )


def _references(
    runs: pd.DataFrame, protocol: ProtocolDescription, width: int | None
) -> RenderableType | None:
    """Return what the main measure is to be compared with; None where nothing was scored."""
    if not protocol.measures:
        return None
    main = protocol.main_measure
    there = [key for key in _REFERENCES if f"{key}_{main.name}" in runs]
    if not there:
        return None
    heads = RunHeads.of(runs)
    columns, same = [Column("deformed", _numbers(runs, main.name, main.factor))], []
    for key in there:
        cells = _numbers(runs, f"{key}_{main.name}", main.factor)
        if len(cells) > 1 and len(set(cells)) == 1:
            same.append(f"{SHAPE_TITLES[key]} {cells[0]}")
        else:
            columns.append(Column(SHAPE_TITLES[key].replace(" ", "\n"), cells))
    caption = "; ".join(f"{SHAPE_TITLES[key]}: {SHAPES[key]}" for key in there)
    caption = f"The same for all runs: {', '.join(same)}. {caption}." if same else f"{caption}."
    title = _joined(f"References, {scaled_title(main)}", heads.common)
    tables = fitted(heads.columns, columns, width)
    return titled(title, tables, caption, width)


def _error_tables(
    runs: pd.DataFrame, protocol: ProtocolDescription, width: int | None
) -> list[RenderableType]:
    """Return what the runs' errors are made of and what their meshes are like, if it is known."""
    known: list[pd.DataFrame] = []
    damaged: list[RenderableType] = []
    for run in map(RunFolder, map(Path, runs["run"])):
        if (run.evaluation(protocol.name) / "samples.csv").is_file():
            try:
                known.append(load_samples([run], protocol.name))
            except DataError as error:
                damaged.append(Text(f"{error}\n", style="red"))
    shown: list[RenderableType] = []
    if known:
        samples = pd.concat(known)
        with suppress(DataError):  # without references, or where more is better
            shown.append(_budget(runs, error_budget(samples, protocol), protocol, width))
        shown += _meshes(runs, mesh_quality(samples), width)
    return [*shown, *damaged]


def _budget(
    runs: pd.DataFrame, budget: pd.DataFrame, protocol: ProtocolDescription, width: int | None
) -> RenderableType:
    heads, budget = _told(runs, budget)
    parts = [*(share.name for share in SHARES), "total"]
    errors = [Column(name, [number(value) for value in budget[name]]) for name in parts]
    errors.append(Column("regret", [f"{value:.0%}" for value in budget["regret"]]))
    title = _joined(f"Error budget, {scaled_title(protocol.main_measure)}", heads.common)
    meanings = "; ".join(f"{share.name}: {share.meaning}" for share in SHARES)
    caption = f"{meanings}; regret: the selection's share of the total."
    return titled(title, fitted(heads.columns, errors, width), caption, width)


def _meshes(runs: pd.DataFrame, quality: pd.DataFrame, width: int | None) -> list[RenderableType]:
    heads, quality = _told(runs, quality)
    measured = [key for key in quality if quality[key].notna().any()]
    if not measured:
        return []
    meshes = [Column(QUALITY[key][0], _numbers(quality, key, QUALITY[key][2])) for key in measured]
    meanings = "; ".join(": ".join(QUALITY[key][:2]) for key in measured)
    title = _joined("Deformed meshes", heads.common)
    return [titled(title, fitted(heads.columns, meshes, width), f"{meanings}.", width)]


def _told(runs: pd.DataFrame, numbers: pd.DataFrame) -> tuple[RunHeads, pd.DataFrame]:
    """Return what tells the runs of some numbers apart, and the numbers in the runs' order."""
    there = runs[runs["run"].isin(numbers.index)]
    return RunHeads.of(there), numbers.loc[there["run"]]


def _failures(runs: pd.DataFrame) -> RenderableType:
    heads = RunHeads.of(runs)
    told = [Column("state", runs["state"].tolist()), Column("reason", runs["reason"].tolist())]
    title = _joined("Runs without results", heads.common)
    return titled(title, fitted([*heads.columns, *told], []))


def _joined(title: str, common: str) -> str:
    return f"{title}: {common}" if common else title


def _values(table: pd.DataFrame, name: str) -> Sequence[Any]:
    return table[name].tolist() if name in table else [float("nan")] * len(table)


def _numbers(table: pd.DataFrame, name: str, factor: float) -> list[str]:
    """Return a column for people; what was not measured is left empty."""
    return ["" if pd.isna(x) else number(factor * x) for x in _values(table, name)]
