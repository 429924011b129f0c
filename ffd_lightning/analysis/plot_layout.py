"""How figures over several runs look: labels, colours, panels and legends."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from os.path import commonpath, relpath
from typing import Any, Literal

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ffd_lightning.analysis.wording import measure_title
from ffd_lightning.evaluation.protocols import Measure, ProtocolDescription
from ffd_lightning.palette import COLORS, REGIME_COLORS

STYLE: Any = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.labelsize": 8.5,
    "legend.fontsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "svg.hashsalt": "ffd_lightning",  # else the names of clip paths are drawn anew each time
    "svg.fonttype": "path",
    "pdf.fonttype": 42,  # letters stay letters, which others' programs can edit
}
DASHES: tuple[tuple[str, str, Literal["-", ":"]], ...] = (
    ("", "deformed", "-"),
    ("undeformed_", "undeformed", ":"),
)  # prefix of the columns, name, line style


def run_labels(table: pd.DataFrame) -> dict[str, str]:
    """Return a short label for each run, made of what differs between the runs.

    Args:
        table: of runs or samples, with columns `run`, `category`, `regime`, `templates`, `seed`.
    """
    settings = _settings(table)
    shown = [name for name in settings if settings[name].nunique() > 1]
    return _labels(settings, shown or ["regime", "templates"])


def _settings(table: pd.DataFrame) -> pd.DataFrame:
    """Return a row per run (index): category, regime, templates, seed."""
    groups = table.groupby("run", sort=False)
    settings = groups[["regime", "templates", "seed"]].first()
    names = groups["category"].unique()
    one = names.map(lambda found: str(found[0]) if len(found) == 1 else f"{len(found)} categories")
    settings.insert(0, "category", one)
    return settings


def _labels(settings: pd.DataFrame, shown: Sequence[str]) -> dict[str, str]:
    """Return a label for each run: the settings `shown`, or its folder where that is not enough."""
    form = {"category": "{}", "regime": "{}", "templates": "T = {}", "seed": "seed {}"}
    labels = {
        str(run): ", ".join(form[name].format(row[name]) for name in shown)
        for run, row in settings.iterrows()
    }
    alike = settings.reset_index().groupby(list(settings), dropna=False)["run"]
    for _, runs in alike:
        if len(runs) > 1:
            root = commonpath(list(runs))
            labels |= {run: f"{labels[run]}, {relpath(run, root)}" for run in runs}
    return labels


def series_of(table: pd.DataFrame) -> tuple[pd.DataFrame, dict[str, str]]:
    """Return a row per run (index) with `category` and `series`, and the colour of each series."""
    settings = _settings(table)
    shown = [name for name in ("regime", "templates") if settings[name].nunique() > 1]
    settings["series"] = pd.Series(_labels(settings, shown or ["regime"]))
    names = list(dict.fromkeys(settings["series"]))
    if shown == ["templates"]:
        # Ordered by number, in colours that have an order.
        names = list(dict.fromkeys(settings.sort_values("templates", kind="stable")["series"]))
        return settings, _scale(names)
    return settings, colors_of(names)


def colors_of(names: Sequence[str]) -> dict[str, str]:
    """Return a colour for each name; a regime's own where all are regimes."""
    if set(names) <= set(REGIME_COLORS):
        return {name: REGIME_COLORS[name] for name in names}
    if len(names) > len(COLORS):
        return _scale(names)
    return dict(zip(names, COLORS, strict=False))


def _scale(names: Sequence[str]) -> dict[str, str]:
    """Return colours from dark to light; the lightest of viridis would be lost on white."""
    places = np.linspace(0, 0.85, len(names))
    colors = matplotlib.colormaps["viridis"](places)
    return {n: matplotlib.colors.to_hex(c) for n, c in zip(names, colors, strict=True)}


def panels_of(count: int, columns: int, width: float, height: float) -> tuple[Figure, list[Axes]]:
    """Return a figure of `count` panels that share their axes' labels; one panel is wider."""
    columns = min(columns, count)
    rows = -(-count // columns)
    figure = Figure(figsize=(width, 0.75 + rows * height), layout="constrained", facecolor="white")
    axes = figure.subplots(rows, columns, squeeze=False, sharey=True)
    for unused in axes.flat[count:]:
        unused.set_visible(False)
    return figure, list(axes.flat[:count])


def add_legend(figure: Figure, colors: dict[str, str], title: str | None = None) -> None:
    """Name colours, and what solid and dotted lines are, above a figure's panels."""
    handles = [Line2D([], [], color=color, label=name) for name, color in colors.items()]
    handles += [
        Line2D([], [], color="#444444", linestyle=dash, label=name) for _, name, dash in DASHES
    ]
    longest = max(len(str(handle.get_label())) for handle in handles)
    columns = min(len(handles), max(1, 54 // (longest + 7)))
    figure.legend(
        handles=handles, loc="outside upper center", ncols=columns, frameon=False, title=title
    )


def axis_label(measure: Measure, protocol: ProtocolDescription, width: int = 56) -> str:
    """Return a measure with its factor, definition and units, over several lines."""
    factor = "" if measure.factor == 1 else f" x {measure.factor:g}"
    told = f"{measure.definition}; {protocol.note}; protocol {protocol.name}"
    return f"{measure_title(measure.name)}{factor}\n" + "\n".join(textwrap.wrap(told, width))
