"""Tables of results for people."""

from __future__ import annotations

import pandas as pd
from rich.table import Table

from ffd_lightning.app.config import ProtocolKind
from ffd_lightning.evaluation.protocols import PROTOCOLS, EvaluationProtocol

_OTHERS = {
    "undeformed": ("undeformed", "that template as it is"),
    "best_undeformed": (
        "best\nundeformed",
        "the template nearest to the truth as it is, chosen knowing it",
    ),
    "feature_retrieval": (
        "retrieved",
        "the training shape whose image looks most alike to the encoder",
    ),
}  # what stands beside the model: heading, and what it is


def summary_tables(runs: pd.DataFrame) -> list[Table]:
    """Return a table per protocol, with a row per run: quality, template selection, speed.

    Args:
        runs: as `load_runs` gives them.
    """
    return [
        _summary_table(part, PROTOCOLS[ProtocolKind(name)])
        for name, part in runs.groupby("protocol", sort=False)
    ]


def _summary_table(runs: pd.DataFrame, protocol: EvaluationProtocol) -> Table:
    first = protocol.measures[0]
    others = {k: v for k, v in _OTHERS.items() if f"{k}_{first.name}" in runs}
    told = "; ".join(
        ["the selected template deformed, means over the test models"]
        + [f"{title}: {what}" for title, what in others.values()]
        + [f"{m.name}: {m.definition}" for m in protocol.measures]
    ).replace("\n", " ")
    factors = {m.factor for m in protocol.measures} - {1.0}
    table = Table(
        title=f"Results, protocol {protocol.name}",
        caption=f"{told}. {protocol.note}." + "".join(f" All x {f:g}." for f in factors),
        caption_justify="left",
    )
    for name in ("category", "regime", "T", "seed"):
        table.add_column(name)
    for title in (
        *(f"{m.name} {m.arrow}" for m in protocol.measures),
        *(f"{title}\n{first.name}" for title, _ in others.values()),
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
            *(number(m.factor * row[m.name]) for m in protocol.measures),
            *(number(first.factor * row[f"{k}_{first.name}"]) for k in others),
            f"{row['effective_templates']:.1f}",
            f"{row['seconds_per_step']:.2f}",
            f"{row['num_samples']:.0f}",
        )
    return table


def number(value: float) -> str:
    """Return a number for a table: one place after the point, more where it is small.

    >>> number(1234.56), number(0.00345)
    ('1234.6', '0.00345')
    """
    return f"{value:.1f}" if abs(value) >= 10 else f"{value + 0.0:.3g}"  # no -0
