"""Differences with their intervals, as dots and lines."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import matplotlib
from matplotlib.figure import Figure

from ffd_lightning.analysis.plots import STYLE


class Row(NamedTuple):
    """A number with its interval; `sure` is drawn full, anything else hollow."""

    label: str
    color: str
    mean: float
    low: float
    high: float
    sure: bool = True


def forest(panels: Mapping[str, Sequence[Row]], room: float = 0) -> Figure:
    """Draw a panel for each title, rows from the top; all have the labels of the first.

    Args:
        panels: by title.
        room: how far from 0 a difference counts as none, shaded.
    """
    height = 0.9 + 0.26 * max(map(len, panels.values()))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(8.4, height), layout="constrained")
        axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for panel, (title, rows) in zip(axes, panels.items(), strict=True):
            if room:
                panel.axvspan(-room, room, color="#e8e8e8", lw=0)
            panel.axvline(0, color="black", lw=0.8)
            for place, row in enumerate(rows):
                panel.plot([row.low, row.high], [place, place], color=row.color, lw=1.8)
                face = row.color if row.sure else "white"
                panel.plot(row.mean, place, "o", color=row.color, mfc=face, ms=6)
            panel.set_title(title)
            panel.set_yticks(range(len(rows)), [row.label for row in rows])
            panel.grid(axis="y", visible=False)
        axes[0].invert_yaxis()
    return figure
