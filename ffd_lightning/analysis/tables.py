"""Tables of results for people."""

from __future__ import annotations

import pandas as pd
from rich.table import Table

_CAPTION = (
    "Chamfer: squared, mean over points, both directions added, x 1000, models with bounding-box "
    "diagonal 1; mean over the test models. undeformed: the selected template as it is; best: the "
    "template nearest to the truth, undeformed, chosen knowing it."
)


def summary_table(runs: pd.DataFrame) -> Table:
    """Return one row per run: quality, template selection, speed.

    Args:
        runs: as `load_runs` gives them.
    """
    table = Table(title="Results", caption=_CAPTION, caption_justify="left")
    for name in ("category", "regime", "T", "seed"):
        table.add_column(name)
    for name in (
        "deformed\nChamfer",
        "undeformed\nChamfer",
        "best\nundeformed",
        "effective\ntemplates",
        "entropy\n(nats)",
        "seconds\nper step",
        "test\nmodels",
    ):
        table.add_column(name, justify="right")
    for row in runs.to_dict("records"):
        head = [str(row[k]) for k in ("category", "regime", "templates", "seed")]
        if row["state"] != "finished":
            table.add_row(*head, f"[red]{row['state']}[/red]", str(row["reason"])[:60])
            continue
        table.add_row(
            *head,
            f"{1000 * row['chamfer']:.2f}",
            f"{1000 * row['undeformed_chamfer']:.2f}",
            f"{1000 * row['best_undeformed_chamfer']:.2f}",
            f"{row['effective_templates']:.1f}",
            f"{row['entropy']:.2f}",
            f"{row['seconds_per_step']:.2f}",
            f"{row['num_samples']:.0f}",
        )
    return table
