"""What sections of the page are made of; `macros.html` says how it looks."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ffd_lightning.analysis.plots import to_svg
from ffd_lightning.analysis.wording import number

NOTHING = "-"
"""What stands in a table where there is no value."""


class Cell(str):
    """A cell with more than its text.

    Attributes:
        note: in small letters below the text.
        best: it is the best of its column.
        level: it is not shown to be worse than the best.
        color: of the regime that it names.
        span: how many columns it takes.
    """

    note: str
    best: bool
    level: bool
    color: str
    span: int

    def __new__(
        cls,
        text: str,
        note: str = "",
        best: bool = False,
        level: bool = False,
        color: str = "",
        span: int = 1,
    ) -> Cell:
        """Make a cell."""
        self = super().__new__(cls, text)
        self.note, self.best, self.level = note, best, level
        self.color, self.span = color, span
        return self


@dataclass(frozen=True)
class Table:
    """A table that scrolls within itself where it is wider than the page.

    Attributes:
        label: what it is, for those who do not see it.
        headings: of the columns; what follows a line break is set as the unit.
        rows: as many cells each.
        below: more rows, set apart; the first cell of a shorter one spans the columns it lacks.
        text: headings of columns that may wrap.
        groups: what stands above the headings: words and over how many columns, "" for nothing.
    """

    label: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    below: Sequence[Sequence[str]] = ()
    text: Sequence[str] = ()
    groups: Sequence[tuple[str, int]] = ()

    @property
    def kinds(self) -> list[str]:
        """The class of each column: columns whose cells all begin as numbers do are "number"."""
        numeric = [
            bool(self.rows) and all(_is_number(row[k]) for row in self.rows)
            for k in range(len(self.headings))
        ]
        return [
            "number" if right else "text" if heading in self.text else ""
            for heading, right in zip(self.headings, numeric, strict=True)
        ]


class Statement(NamedTuple):
    """A sentence: what is claimed of whom, by how much, and how sure it is."""

    who: str
    how_much: str
    sure: str
    shown: bool


class Plot(NamedTuple):
    """A figure; as an image of its own, since names inside of it recur in others."""

    source: str
    alt: str
    caption: str


def statements(lines: Iterable[str]) -> list[Statement]:
    """Take sentences apart: "w beats b: Chamfer lower by 3 (9 shapes)", say.

    Those that show no difference are known by their first words.
    """
    result = []
    for line in lines:
        claim, bracket, sure = line.rpartition(" (") if line.endswith(")") else (line, "", "")
        who, colon, how_much = claim.partition(": ")
        result.append(
            Statement(
                who, colon + how_much, bracket.strip() + sure, not who.startswith("no difference")
            )
        )
    return result


def plot(figure: Figure, alt: str, caption: str) -> Plot:
    """Return a figure with its description and caption."""
    return Plot(data_uri(to_svg(figure), "image/svg+xml"), alt, caption)


def data_uri(content: bytes, kind: str) -> str:
    """Return bytes as an address that holds them."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def cell(value: object) -> str:
    """Return a value as people read it.

    >>> cell(0.00345), cell(12.0), cell(None), cell([3, 3, 3])
    ('0.00345', '12', '-', '3, 3, 3')
    """
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(cell(part) for part in value)
    if value is None or value is pd.NA or (isinstance(value, float) and np.isnan(value)):
        return NOTHING
    if isinstance(value, float):
        return f"{value:.0f}" if value.is_integer() and abs(value) < 1e9 else number(value)
    return str(value)


def _is_number(text: str) -> bool:
    return re.fullmatch(r"|-|[<~]?[-+]?[\d.,]+(e-?\d+)?%?( ± \S+)?", text) is not None
