"""How well runs transfer part labels, in tables for people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rich.table import Table

from ffd_lightning.analysis.labels import PART, family_table, part_columns, transfer_table
from ffd_lightning.analysis.selection import Families
from ffd_lightning.analysis.wording import SHAPE_TITLES
from ffd_lightning.evaluation.references import SHAPES


def label_tables(samples: pd.DataFrame, families: Families, folder: Path) -> list[Table]:
    """Return a table of shapes, one of single parts, and one of families where they are known.

    Args:
        samples: as `label_samples` gives them.
        families: as `run_families` reads them.
        folder: that the runs are in; they are named as seen from it.
    """
    parts = transfer_table(samples, part_columns(samples))
    tables = [_shapes_table(transfer_table(samples), folder), _parts_table(parts, folder)]
    of_families = family_table(samples, families)
    return tables if of_families.empty else [*tables, _families_table(of_families, folder)]


def _heading(shape: str) -> str:
    return SHAPE_TITLES[shape].replace(" ", "\n")


def _shapes_table(table: pd.DataFrame, folder: Path) -> Table:
    shapes = [s for s in SHAPES if s in set(table["shape"])]
    shown = _table(
        "Part IoU x 100 of labels transferred to the test shapes",
        "Mean over the parts in the truth or transferred, then over test shapes. Below: how much "
        "more the model (selected template, deformed) has, with 95% interval.",
        ("run", "category"),
        ("models", *map(_heading, shapes)),
    )
    for (run, category), part in table.groupby(["run", "category"], sort=False):
        found = part.set_index("shape").to_dict("index")
        cells = []
        for row in (found.get(shape) for shape in shapes):
            if row is None:
                text = ""
            elif np.isnan(row["gain"]):
                text = _mean(row, interval=True)
            else:
                gain = _span(row["gain"], row["gain_low"], row["gain_high"], "+")
                text = f"{_mean(row)}\n{gain}"
            cells.append(text.replace(" [", "\n["))
        shown.add_row(_below(run, folder), category, f"{found['']['num_samples']}", *cells)
    return shown


def _parts_table(table: pd.DataFrame, folder: Path) -> Table:
    shapes = [s for s in SHAPES if s in set(table["shape"])]
    shown = _table(
        "IoU x 100 of single parts",
        "Means over the test models that have the part, of the model's with 95% interval.",
        ("run", "category", "part"),
        ("models", *map(_heading, shapes)),
    )
    keys = ["run", "category", "measure"]
    for values, part in table.sort_values("run", kind="stable").groupby(keys, sort=False):
        run, category, measure = values
        found = part.set_index("shape").to_dict("index")
        cells = [_mean(found[s], interval=not s) if s in found else "" for s in shapes]
        name, count = str(measure).removeprefix(PART), f"{found['']['num_samples']}"
        shown.add_row(_below(run, folder), category, name, count, *cells)
    return shown


def _families_table(table: pd.DataFrame, folder: Path) -> Table:
    shown = _table(
        "Part IoU x 100 by the selected template's structural family",
        "Gain: over the same template as it is. 95% intervals over test shapes.",
        ("run", "category", "template's family"),
        ("models", "part IoU", "gain"),
    )
    for row in table.to_dict("records"):
        gain = _span(row["gain"], row["gain_low"], row["gain_high"], "+")
        head = (_below(row["run"], folder), row["category"], row["family"])
        shown.add_row(*head, f"{row['num_samples']}", _mean(row, interval=True), gain)
    return shown


def _table(title: str, caption: str, words: Sequence[str], numbers: Sequence[str]) -> Table:
    table = Table(title=title, caption=caption, caption_justify="left")
    for name in words:
        table.add_column(name)
    for name in numbers:
        table.add_column(name, justify="right")
    return table


def _mean(row: Mapping[Any, Any], interval: bool = False) -> str:
    return _span(row["mean"], row["low"], row["high"]) if interval else f"{100 * row['mean']:.1f}"


def _span(mean: float, low: float, high: float, sign: str = "") -> str:
    if np.isnan(mean):
        return ""
    text = f"{100 * mean:{sign}.1f}"
    return text if np.isnan(low) else f"{text} [{100 * low:.1f}, {100 * high:.1f}]"


def _below(run: object, folder: Path) -> str:
    return str(Path(str(run)).relative_to(folder))
