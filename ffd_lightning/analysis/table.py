"""One table, for terminals, pages, notebooks, documents and papers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd
from markupsafe import Markup, escape
from rich import box
from rich.console import Console, Group, JustifyMethod, RenderableType
from rich.constrain import Constrain
from rich.table import Table as RichTable
from rich.text import Text

_READ_EASILY = 100  # characters in a line of prose
_RULER = Console(width=10_000)
_NUMBER = re.compile(r"$|-$|[-+<~]?\d[\d.,]*(e-?\d+)?%?($|[ \n/\u2013\[])")  # begins as one


class Cell(str):
    """A cell with more than its text: a sign after it, a coloured square before it."""

    mark: str
    color: str

    def __new__(cls, text: str, mark: str = "", color: str = "") -> Cell:
        """Make a cell."""
        self = super().__new__(cls, text)
        self.mark, self.color = mark, color
        return self


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        title: what it is.
        columns: headings; what follows a line break is the unit.
        rows: as many cells each.
        heads: so many columns, from the left, say what a row is about.
        note: prose below it.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    heads: int = 1
    note: str = ""

    def rich(self, width: int | None = None) -> RenderableType:
        """Return it for a terminal: in several parts where it would be wider than `width`."""
        shares: list[list[int]] = [[]]
        for k in range(self.heads, len(self.columns)):
            tried = self._part([*shares[-1], k])
            if shares[-1] and width is not None and _RULER.measure(tried).maximum > width:
                shares.append([])
            shares[-1].append(k)
        parts: list[RenderableType] = [Text(self.title, style="bold")]
        for share in shares:
            parts += [self._part(share), Text()]
        if self.note:
            note = Text(self.note, style="dim")
            parts += [Constrain(note, min(width or _READ_EASILY, _READ_EASILY)), Text()]
        return Group(*parts)

    def _part(self, columns: Sequence[int]) -> RichTable:
        """Return the heads and some other columns."""
        table = RichTable(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
        columns = [*range(self.heads), *columns]
        for k in columns:
            number, heading = self._is_number(k), Text(self.columns[k])
            side: JustifyMethod = "right" if number else "left"
            table.add_column(heading, justify=side, no_wrap=number, overflow="fold")
        for row in self.rows:
            table.add_row(*(Text(_marked(row[k])) for k in columns))
        return table

    def html(self) -> Markup:
        """Return it as HTML that scrolls within itself where it is wider than its place."""
        kinds = [' class="number"' if self._is_number(k) else "" for k in range(len(self.columns))]
        head = "".join(
            f'<th scope="col"{kind}>{_heading(name)}</th>'
            for name, kind in zip(self.columns, kinds, strict=True)
        )
        rows = [
            "".join(f"<td{kind}>{_html(cell)}</td>" for cell, kind in zip(row, kinds, strict=True))
            for row in self.rows
        ]
        body = "".join(f"<tr>{row}</tr>\n" for row in rows)
        note = f'<p class="note">{escape(self.note)}</p>\n' if self.note else ""
        return Markup(
            f'<div class="scroll" role="region" tabindex="0" aria-label="{escape(self.title)}">\n'
            f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>\n</div>\n{note}"
        )

    def _repr_html_(self) -> str:
        return f"<p><b>{escape(self.title)}</b></p>\n{self.html()}"

    def markdown(self) -> str:
        """Return it as Markdown, without its title."""
        lines = [[" ".join(name.split()) for name in self.columns]]
        lines += [["---"] * self.heads + ["---:"] * (len(self.columns) - self.heads)]
        lines += [[_marked(cell).replace("|", "/") for cell in row] for row in self.rows]
        text = "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
        return f"{text}\n\n{self.note}\n" if self.note else f"{text}\n"

    def csv(self) -> str:
        """Return it as CSV, without marks."""
        return str(self.frame().to_csv(index=False, lineterminator="\n"))

    def frame(self) -> pd.DataFrame:
        """Return its texts, for `to_latex`, say."""
        names = [" ".join(name.split()) for name in self.columns]
        return pd.DataFrame([list(map(str, row)) for row in self.rows], columns=names)

    def _is_number(self, column: int) -> bool:
        """Tell whether a column is set as numbers: all its cells begin as numbers do."""
        cells = [row[column] for row in self.rows]
        return bool(cells) and all(_NUMBER.match(cell) for cell in cells)


def number(value: float) -> str:
    """Return a number for a table: one place after the point, more where it is small.

    >>> number(1234.56), number(1.0), number(0.00345)
    ('1234.6', '1.00', '0.00345')
    """
    if abs(value) < 1:
        return f"{value + 0.0:.3g}"  # no -0
    return f"{value:.1f}" if abs(value) >= 10 else f"{value:.2f}"


def _marked(cell: str) -> str:
    mark = getattr(cell, "mark", "")
    return f"{cell} {mark}" if mark else cell


def _heading(text: str) -> Markup:
    """Return a heading that may be broken into lines where words end, its unit below it."""
    name, _, unit = text.partition("\n")
    broken = re.sub(r"([._/])", r"\1<wbr>", str(escape(name)))
    return Markup(broken + (f' <span class="unit">{escape(unit)}</span>' if unit else ""))


def _html(cell: str) -> Markup:
    """Return what is within a cell's tags."""
    if not isinstance(cell, Cell):
        return escape(cell)
    square = f'<span class="swatch" style="background:{escape(cell.color)}"></span>'
    mark = f' <b class="mark">{escape(cell.mark)}</b>'
    return Markup(f"{square if cell.color else ''}{escape(str(cell))}{mark if cell.mark else ''}")
