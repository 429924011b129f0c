"""How figures over several runs look: labels, colours, panels and legends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os.path import commonpath, relpath
from typing import Any, Literal

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D

from ffd_lightning.palette import COLORS, REGIME_COLORS, regime_title

_WORDS = {"category": "{}", "regime": "{}", "templates": "T = {}", "seed": "seed {}"}
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


def run_labels(table: pd.DataFrame, titled: bool = False) -> dict[str, str]:
    """Return a label for each run, made of what differs between the runs.

    Args:
        table: of runs or samples, with columns `run`, `category`, `regime`, `templates`, `seed`.
        titled: with the regimes' long names.
    """
    settings = _settings(table)
    shown = [name for name in settings if name in _WORDS and settings[name].nunique() > 1]
    return _labels(settings, shown or ["regime", "templates"], regime_title if titled else str)


def _settings(table: pd.DataFrame) -> pd.DataFrame:
    """Return a row per run (index): category, regime, templates, seed and setting, in order."""
    groups = table.groupby("run", sort=False)
    settings = groups[["regime", "templates", "seed"]].first()
    names = groups["category"].unique()
    one = names.map(lambda found: str(found[0]) if len(found) == 1 else f"{len(found)} categories")
    settings.insert(0, "category", one)
    order = {"category": list(one), "regime": [*REGIME_COLORS, *settings["regime"]]}
    settings = settings.sort_values(
        list(settings),
        kind="stable",
        key=lambda part: part.map(order[part.name].index) if part.name in order else part,
    )
    # Last, and no label: equal for runs that differ in their seed alone.
    return settings.assign(setting=groups["setting"].first() if "setting" in table else "")


def _labels(
    settings: pd.DataFrame, shown: Sequence[str], title: Callable[[str], str] = str
) -> dict[str, str]:
    """Return a label for each run: the settings `shown`, or its folder where that is not enough.

    `title` makes a regime's name what is shown of it.
    """
    told = settings.assign(regime=settings["regime"].map(title))
    labels = {
        str(run): ", ".join(_WORDS[name].format(row[name]) for name in shown)
        for run, row in told.iterrows()
    }
    rows, full = settings.reset_index(), dict(labels)
    named = ["category", "regime", "templates"]
    mixed = rows.groupby(named, dropna=False)["setting"].transform("nunique") > 1
    for keys, part in ((list(_WORDS), rows), (named, rows[mixed])):
        for _, runs in part.groupby(keys, dropna=False)["run"]:
            if len(runs) > 1:
                root = commonpath(list(runs))
                full |= {run: f"{labels[run]}, {relpath(run, root)}" for run in runs}
    return full


def series_of(table: pd.DataFrame) -> tuple[pd.DataFrame, dict[str, str]]:
    """Return a row per run (index) with `category` and `series`, and the colour of each series.

    A series is what differs in its seed alone, with its regime's long name. A regime has its own
    colour, lighter for fewer templates; of one regime, numbers of templates have colours in order.
    """
    settings = _settings(table)
    shown = [name for name in ("regime", "templates") if settings[name].nunique() > 1]
    settings["series"] = pd.Series(_labels(settings, shown or ["regime"], regime_title))
    firsts = settings.drop_duplicates("series").set_index("series")[["regime", "templates"]]
    if shown == ["templates"]:
        return settings, _scale(list(firsts.sort_values("templates", kind="stable").index))
    colors = colors_of(list(dict.fromkeys(firsts["regime"])))
    counts = {name: sorted(part["templates"]) for name, part in firsts.groupby("regime")}
    result = {}
    for name, regime, templates in firsts.itertuples():
        among = counts[regime]
        result[str(name)] = _lighter(colors[regime], among.index(templates), len(among))
    return settings, result


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


def _lighter(color: str, place: int, count: int) -> str:
    """Return a colour mixed with white: the last of `count` places is the colour itself."""
    share = 0.6 * (count - 1 - place) / max(count - 1, 1)
    mixed = (1 - share) * np.array(matplotlib.colors.to_rgb(color)) + share
    return matplotlib.colors.to_hex(tuple(mixed))


def panels_of(
    count: int, columns: int, width: float, height: float, title: str
) -> tuple[Figure, list[Axes]]:
    """Return a titled figure of `count` panels that share their axes' labels; one is wider."""
    columns = min(columns, count)
    rows = -(-count // columns)
    layout = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.06)
    figure = Figure(figsize=(width, 1.05 + rows * height), layout=layout, facecolor="white")
    figure.suptitle(title, fontsize=10.5, wrap=True)
    axes = figure.subplots(rows, columns, squeeze=False, sharey=True)
    for unused in axes.flat[count:]:
        unused.set_visible(False)
    return figure, list(axes.flat[:count])


def label_axes(figure: Figure, panels: Sequence[Axes], x: str, y: str) -> None:
    """Write what is along the axes: below the lowest of two columns' panels, once on the left."""
    for panel in panels[-2:]:
        panel.set_xlabel(x)
    figure.supylabel(y, fontsize=8.5)


def add_legend(figure: Figure, colors: dict[str, str]) -> None:
    """Name colours, and what solid and dotted lines are, below a figure's panels."""
    handles = [Line2D([], [], color=color, label=name) for name, color in colors.items()]
    handles += [
        Line2D([], [], color="#444444", linestyle=dash, label=name) for _, name, dash in DASHES
    ]
    longest = max(len(str(handle.get_label())) for handle in handles)
    columns = min(len(handles), max(1, 60 // (longest + 7)))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False)
