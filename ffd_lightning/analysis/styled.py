"""Tables for notebooks: with a caption, numbers in their formats, and no empty columns."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Literal

import pandas as pd
from pandas.io.formats.style import Styler

_STYLES = [
    {"selector": "caption", "props": "caption-side: top; text-align: left; padding: 0.4em 0"},
    {"selector": "th, td", "props": "padding: 0.2em 0.7em"},
    {"selector": "th", "props": "text-align: left; font-weight: 600"},
    {"selector": "th.col_heading", "props": "text-align: right; white-space: pre-line"},
    {"selector": "td", "props": "text-align: right"},
]


def styled(
    table: pd.DataFrame,
    caption: str,
    formats: Mapping[str, str],
    best: Mapping[str, Literal["min", "max"]] | None = None,
) -> Styler:
    """Return a table as people read it, of the columns that `formats` names and that have values.

    Args:
        table: its index heads the rows.
        caption: above it: what it shows, and in which unit.
        formats: of each column, as of `str.format`; missing values are dashes.
        best: columns whose least or greatest value is bold.

    >>> table = pd.DataFrame({"Chamfer": [0.0413], "EMD": [float("nan")]}, index=["e, entropy"])
    >>> print(styled(table, "x 1000", {"Chamfer": "{:.3f}", "EMD": "{:.1f}"}).to_string().strip())
    Chamfer
    e, entropy 0.041
    """
    names = [name for name in formats if name in table and table[name].notna().any()]
    result = table[names].style.format({n: formats[n] for n in names}, na_rep="\N{EN DASH}")
    for name, which in (best or {}).items():
        if name in names and len(table) > 1:
            highlight = result.highlight_min if which == "min" else result.highlight_max
            result = highlight(subset=[name], props="font-weight: bold")
    # The name of its elements would be drawn anew each time.
    own = re.sub(r"\W+", "-", f"{caption} {' '.join(map(str, names))}".lower())[:60]
    return result.set_caption(caption).set_table_styles(_STYLES).set_uuid(own)
