"""Draws what a minute of training is worth: scores against seconds, a line a recipe."""

from __future__ import annotations

from itertools import cycle

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter

from ffd_lightning.analysis.wording import scaled_title
from ffd_lightning.evaluation.protocols import PaperProtocol
from ffd_lightning.palette import COLORS

_MEASURES = PaperProtocol().metrics


def draw(table: pd.DataFrame) -> Figure:
    """Draw each measure against seconds: a line through the means over seeds, a dot for each.

    Args:
        table: a row a run: recipe, category, seed, seconds asked for and taken, scores.
    """
    figure = Figure(figsize=(13, 5), layout="constrained")
    axes = figure.subplots(1, len(_MEASURES))
    for axis, shown in zip(axes, _MEASURES, strict=True):
        recipes = table.groupby("recipe", sort=False)
        for (recipe, runs), color in zip(recipes, cycle(COLORS), strict=False):
            values = shown.factor * runs[shown.name]
            axis.plot(runs["seconds"], values, "o", ms=4, color=color, alpha=0.6)
            means = runs.assign(value=values).groupby("asked_seconds")[["seconds", "value"]].mean()
            axis.plot(means["seconds"], means["value"], color=color, label=str(recipe))
        axis.set_xscale("log")
        axis.xaxis.set_major_locator(FixedLocator(sorted(table["asked_seconds"].unique())))
        axis.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.set_title(f"{scaled_title(shown)} {shown.arrow}", fontsize=10)
        axis.set_xlabel("seconds of training")
        axis.grid(alpha=0.3)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=9, frameon=False)
    first, seeds = table.iloc[0], table["seed"].nunique()
    figure.suptitle(
        f"{first['category']}: {first['num_samples']:.0f} validation shapes, protocol paper, "
        f"{seeds} seed{'s' * (seeds > 1)}; each dot is a run of its own",
        fontsize=10,
    )
    return figure
