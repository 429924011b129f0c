"""Tables of results for people."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from rich.table import Table

from ffd_lightning.analysis.budget import BUDGET_CAPTION, QUALITY, SHARES, error_budget
from ffd_lightning.analysis.runs import find_protocol, load_runs, load_samples
from ffd_lightning.analysis.wording import measure_title, number
from ffd_lightning.errors import UserError
from ffd_lightning.evaluation.protocols import ProtocolDescription
from ffd_lightning.run_folder import RunFolder

_OTHERS = {
    "undeformed": ("undeformed", "that template as it is"),
    "best_undeformed": (
        "best\nundeformed",
        "the template nearest to the truth as it is, an oracle",
    ),
    "feature_retrieval": (
        "retrieved",
        "the training shape whose image looks most alike to the encoder",
    ),
}  # what stands beside the model: heading, and what it is


def summary_tables(runs: Sequence[RunFolder]) -> list[Table]:
    """Return a table per protocol, with a row per run: quality, template selection, speed.

    Each run is shown under the protocol that its training ended with.
    """
    by_path = {str(run.path): run for run in runs}
    tables = []
    for name, part in load_runs(runs).groupby("protocol", sort=False):
        try:
            protocol = find_protocol([by_path[path] for path in part["run"]], str(name))
        except UserError:  # none has come to its end
            protocol = ProtocolDescription(str(name))
        tables.append(_summary_table(part, protocol))
        if (budget := _budget_table(part, protocol)) is not None:
            tables.append(budget)
    return tables


def _budget_table(runs: pd.DataFrame, protocol: ProtocolDescription) -> Table | None:
    """Return what the runs' errors are made of, and what their meshes are like; None if unknown."""
    try:
        samples = load_samples([RunFolder(Path(run)) for run in runs["run"]], protocol.name)
        budget = error_budget(samples, protocol)
    except UserError:
        return None
    table = Table(
        title=f"Error budget, {measure_title(protocol.main_measure.name)}",
        caption=BUDGET_CAPTION,
        caption_justify="left",
    )
    for name in ("category", "regime", "T", "seed"):
        table.add_column(name)
    for title in (*(share.name for share in SHARES), "total", "regret"):
        table.add_column(title, justify="right")
    for column in QUALITY:
        table.add_column(QUALITY[column][0], justify="right")
    heads = runs.set_index("run")[["category", "regime", "templates", "seed"]]
    for run, row in budget.iterrows():
        parts = [number(row[name]) for name in (*(share.name for share in SHARES), "total")]
        quality = [number(QUALITY[k][2] * row[k]) if pd.notna(row.get(k)) else "" for k in QUALITY]
        head = [str(value) for value in heads.loc[run]]
        table.add_row(*head, *parts, f"{row['regret']:.0%}", *quality)
    return table


def _summary_table(runs: pd.DataFrame, protocol: ProtocolDescription) -> Table:
    first = protocol.measures[:1]
    others = [(k, *told) for k, told in _OTHERS.items() for m in first if f"{k}_{m.name}" in runs]
    table = Table(
        title=f"Results, protocol {protocol.name}",
        caption=_caption(protocol, others) if first else None,
        caption_justify="left",
    )
    for name in ("category", "regime", "T", "seed"):
        table.add_column(name)
    columns = [(f"{m.name} {m.arrow}", m.name, m.factor) for m in protocol.measures]
    columns += [
        (f"{title}\n{m.name}", f"{k}_{m.name}", m.factor) for k, title, _ in others for m in first
    ]
    for title in (
        *(title for title, _, _ in columns),
        "effective\ntemplates",
        "seconds\nper step",
        "test\nmodels",
    ):
        table.add_column(title, justify="right")
    for row in runs.to_dict("records"):
        head = [str(row[k]) for k in ("category", "regime", "templates", "seed")]
        if row["state"] != "finished":
            table.add_row(*head, f"[red]{row['state']}[/red]", str(row["reason"])[:60])
            continue
        table.add_row(
            *head,
            *(number(factor * row[name]) for _, name, factor in columns),
            f"{row.get('effective_templates', float('nan')):.1f}",
            f"{row['seconds_per_step']:.2f}",
            f"{row.get('num_samples', float('nan')):.0f}",
        )
    return table


def _caption(protocol: ProtocolDescription, others: Sequence[tuple[str, str, str]]) -> str:
    told = "; ".join(
        ["the selected template deformed, means over the test shapes"]
        + [f"{title}: {what}" for _, title, what in others]
        + [f"{m.name}: {m.definition}" for m in protocol.measures]
    ).replace("\n", " ")
    return f"{told}. {protocol.note}.{protocol.factors}"
