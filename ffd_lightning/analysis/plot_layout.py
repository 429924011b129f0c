"""How figures over several runs look: style, panels and legends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D

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
