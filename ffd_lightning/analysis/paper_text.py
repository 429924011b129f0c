"""Our results beside the paper's, as text: Markdown, LaTeX, and for terminals."""

from __future__ import annotations

import re

import pandas as pd
from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from ffd_lightning.analysis.paper import MEASURES, in_paper_order
from ffd_lightning.errors import DataError


def to_markdown(table: pd.DataFrame) -> str:
    """Return a comparison as a Markdown table: categories by methods, the caption below it.

    Args:
        table: as `comparison_table` gives it.
    """
    head, rows = _layout(table)
    names = [f"{source} {method}" for source, method in head]
    lines = [["category", *names], ["---", *["---:"] * len(names)], *rows]
    text = "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)
    return re.sub(r"([_*])", r"\\\1", f"{text}\n\n{_caption_of(table)}\n")


def to_latex(table: pd.DataFrame) -> str:
    r"""Return a comparison in LaTeX, for a table and `\usepackage{booktabs}`: tabular, caption.

    Args:
        table: as `comparison_table` gives it.
    """
    head, rows = _layout(table)
    frame = pd.DataFrame(rows, columns=pd.MultiIndex.from_tuples([("", "category"), *head]))
    shape = "l" + "c" * len(head)
    text = frame.to_latex(index=False, escape=True, multicolumn_format="c", column_format=shape)
    return f"{text}\\caption{{{_escape(_caption_of(table))}}}\n"


def stacked(table: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Return a comparison for narrow places: ours above the paper's, a column per method.

    Args:
        table: as `comparison_table` gives it.

    Returns:
        Headings, and rows of as many cells: a category's name where it begins, a source, and a
        cell per method.
    """
    head, _ = _layout(table)
    cells = _cells(table)
    methods = pd.Series([method for _, method in head]).drop_duplicates()
    methods = methods.sort_values(key=in_paper_order)
    categories = table["category"].drop_duplicates().sort_values(key=in_paper_order)
    rows, sources = [], [str(s) for s in dict.fromkeys(table["source"])]
    for category in categories:
        named = [s for s in sources if any((s, m, category) in cells for m in methods)]
        for place, source in enumerate(named):
            values = [cells.get((source, m, category), "-") for m in methods]
            rows.append(["" if place else category, source, *values])
    return ["category", "", *methods], rows


def to_console(table: pd.DataFrame) -> Group:
    """Return a comparison for a terminal, what was measured and what differs below it.

    Args:
        table: as `comparison_table` gives it.
    """
    caption = _caption_of(table)  # raises where it was lost
    head, rows = stacked(table)
    shown = Table(title="Beside the paper's Table 3", title_justify="left")
    for place, heading in enumerate(head):
        shown.add_column(heading, justify="left" if place < 2 else "right", no_wrap=True)
    for place, row in enumerate(rows):
        last = place + 1 == len(rows) or bool(rows[place + 1][0])
        shown.add_row(*map(escape, row), end_section=last)
    if not table.attrs.get("differences"):
        return Group(shown, Text(caption))
    told = [f"- {difference}" for difference in table.attrs["differences"]]
    lines = ["These are two experiments, not one repeated:", *told, table.attrs["compared"]]
    return Group(shown, Text("\n".join([table.attrs["measured"], *lines])))


def _layout(table: pd.DataFrame) -> tuple[list[tuple[str, str]], list[list[str]]]:
    """Return (source, method) of each column, and rows of a category's name and its cells."""
    if table.empty:
        raise DataError("the comparison has no rows")
    cells = _cells(table)
    pairs = table[["source", "method"]].drop_duplicates()
    pairs = pairs.sort_values(["source", "method"], key=in_paper_order)
    head = list(pairs.itertuples(index=False, name=None))
    categories = table["category"].drop_duplicates().sort_values(key=in_paper_order)
    return head, [[c, *(cells.get((*h, c), "-") for h in head)] for c in categories]


def _cells(table: pd.DataFrame) -> dict[tuple[str, str, str], str]:
    """Return the three numbers as text, by source, method and category."""
    return {
        (row["source"], row["method"], row["category"]): "/".join(
            "-" if pd.isna(row[m]) else f"{row[m]:.0f}" for m in MEASURES
        )
        for row in table.to_dict("records")
    }


def _caption_of(table: pd.DataFrame) -> str:
    try:
        return str(table.attrs["caption"])
    except KeyError:
        raise DataError(
            "the comparison has lost its caption, which says in what the experiments differ: take "
            "the table as comparison_table gives it, or copy its attrs"
        ) from None


def _escape(text: str) -> str:
    """Return text as LaTeX prints it."""
    special = {"\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}"}
    return "".join(special.get(c, f"\\{c}" if c in "&%$#_{}" else c) for c in text)
