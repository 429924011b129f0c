"""Tables of runs in which no number is cut off, however narrow the terminal is."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import pandas as pd
from rich import box
from rich.console import Console, Group, RenderableType
from rich.constrain import Constrain
from rich.table import Table
from rich.text import Text

from ffd_lightning.analysis.runs import is_mixed
from ffd_lightning.palette import regime_title

_READ_EASILY = 100  # characters in a line of prose
_HEADS = ("category", "regime", "T", "seed")
_RULER = Console(width=10_000)


class Column(NamedTuple):
    """A column of a table: its heading, which may have several lines, and a cell for each row."""

    title: str
    cells: Sequence[str]


class RunHeads(NamedTuple):
    """What tells the rows of a table of runs apart, and what they have in common.

    Attributes:
        columns: of category, regime, number of templates and seed what differs, or the regime where
            nothing does; `run`, the end of the folder's name, where these do not tell all apart.
        common: the rest, in words.
    """

    columns: list[Column]
    common: str

    @classmethod
    def of(cls, runs: pd.DataFrame) -> RunHeads:
        """Tell runs apart, a row each, with columns as `load_runs` gives them."""
        told = runs[["category", "regime", "templates", "seed"]].astype(str)
        told = told.set_axis(list(_HEADS), axis=1)
        told["regime"] = told["regime"].map(regime_title)
        same = [name for name in _HEADS if told[name].nunique() == 1]
        if len(same) == len(_HEADS):
            same.remove("regime")
        columns = [Column(name, told[name].tolist()) for name in _HEADS if name not in same]
        if told.duplicated().any() or is_mixed(runs, ["category", "regime", "templates"]):
            folders = [str(run) for run in runs["run"]]
            parent = os.path.commonpath(folders)
            columns.append(Column("run", [str(Path(run).relative_to(parent)) for run in folders]))
        first = told.iloc[0]
        words = {"T": "T = ", "seed": "seed "}
        return cls(columns, ", ".join(f"{words.get(name, '')}{first[name]}" for name in same))


def titled(
    title: str, tables: Sequence[Table], caption: str = "", width: int | None = None
) -> RenderableType:
    """Return tables below their title and above their caption.

    Args:
        title: one line.
        tables: one, or more where one would be too wide.
        caption: prose.
        width: of the terminal, None for no limit.
    """
    parts: list[RenderableType] = [Text(title, style="bold")]
    for table in tables:
        parts += [table, Text()]
    if caption:
        told = Text(caption, style="dim")
        parts += [Constrain(told, min(width or _READ_EASILY, _READ_EASILY)), Text()]
    return Group(*parts)


def fitted(
    heads: Sequence[Column], columns: Sequence[Column], width: int | None = None
) -> list[Table]:
    """Return tables that share columns out in their order, so that each fits.

    Args:
        heads: words, on the left of every table.
        columns: numbers.
        width: of the terminal, None for no limit.
    """
    shares: list[list[Column]] = [[]]
    for column in columns:
        tried = _table(heads, [*shares[-1], column])
        if shares[-1] and width is not None and _RULER.measure(tried).maximum > width:
            shares.append([])
        shares[-1].append(column)
    return [_table(heads, share) for share in shares]


def _table(heads: Sequence[Column], columns: Sequence[Column]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for head in heads:
        table.add_column(head.title, overflow="fold")
    for column in columns:
        table.add_column(column.title, justify="right", no_wrap=True)
    for row in zip(*(column.cells for column in [*heads, *columns]), strict=True):
        table.add_row(*row)
    return table
