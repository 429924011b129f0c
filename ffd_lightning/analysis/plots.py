"""Figures over several runs, as matplotlib `Figure` objects.

Nothing here touches pyplot, so that figures can be made on any machine and in any thread. Each is
drawn for a width of about 400 pixels: text stays readable on a telephone. What a measure is, its
points and unit, is for captions (`wording.measure_note`).
"""

from __future__ import annotations

import io

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from ffd_lightning.analysis.budget import SHARES, error_budget
from ffd_lightning.analysis.compare import check_seeds
from ffd_lightning.analysis.plot_layout import (
    DASHES,
    STYLE,
    add_legend,
    colors_of,
    label_axes,
    panels_of,
    run_labels,
    series_of,
)
from ffd_lightning.analysis.wording import scaled_title
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import Metric, ProtocolDescription
from ffd_lightning.metrics.selection import effective_templates
from ffd_lightning.palette import regime_title

_WIDTH = 4.2  # inches
_MANY_TICKS = 50  # times as much at the right end: ticks at 1, 2 and 5 would run into each other
_BUDGET = ("#BBBBBB", "#56B4E9", "#E69F00", "#882255")  # of the parts of an error: no regime's


def cumulative_curves(
    samples: pd.DataFrame, protocol: ProtocolDescription, measure: str = "chamfer"
) -> Figure:
    """Draw the share of test samples that are better than a score, as the paper's figures 5 and 6.

    Solid is the selected template deformed, dotted the same template as it is. One panel per
    category, one colour per setting: runs that differ in their seed alone share it. Distances are
    on a logarithmic axis. A curve further up is better, whichever way the measure goes.

    Args:
        samples: as `load_samples` gives them.
        protocol: that they were measured under, as `find_protocol` gives it.
        measure: of the protocol.

    Raises:
        ConfigError: the protocol has no such measure.
        DataError: the samples lack the measure, or hold values that are not finite.
    """
    chosen = protocol.metric(measure)
    with matplotlib.rc_context(STYLE):
        series, colors = series_of(samples)
        categories = series["category"].unique()
        title = f"Cumulative {chosen.title} of the test images"
        figure, panels = panels_of(len(categories), 2, _WIDTH, 2.7, title)
        for category, panel in zip(categories, panels, strict=True):
            for run in series.index[series["category"] == category]:
                of_run = samples[samples["run"] == run]
                for prefix, _, dash in DASHES:
                    if (name := prefix + measure) in of_run or not prefix:
                        panel.ecdf(
                            chosen.factor * _finite(of_run, name, run),
                            complementary=chosen.higher_is_better,
                            color=colors[series.loc[run, "series"]],
                            linestyle=dash,
                            linewidth=1.3,
                        )
            if len(categories) > 1:
                panel.set_title(category)
            if not chosen.higher_is_better:
                panel.set_xscale("log")
                low, high = panel.get_xlim()
                steps = (1, 2, 5) if high < _MANY_TICKS * low else (1, 3)
                panel.xaxis.set_major_locator(LogLocator(subs=steps))
                panel.xaxis.set_major_formatter("{x:g}")
                panel.xaxis.set_minor_formatter(NullFormatter())
            panel.set_ylim(0, 1.02)
        add_legend(figure, colors)
        word = "above" if chosen.higher_is_better else "below"
        label_axes(figure, panels, scaled_title(chosen), f"share of test images {word}")
    return figure


def selection_histograms(samples: pd.DataFrame) -> Figure:
    """Draw how often each template was selected, the most selected first, a panel per run.

    All T templates are on the axis, also those that are never selected. The dotted line is where
    all would be selected alike. Above each panel: exp(entropy) of the shares, and the samples.

    Args:
        samples: as `load_samples` gives them.

    Raises:
        DataError: a run selects more templates than it has.
    """
    with matplotlib.rc_context(STYLE):
        labels, (series, colors) = run_labels(samples, titled=True), series_of(samples)
        title = "How often each template is selected"
        figure, panels = panels_of(len(labels), 2, _WIDTH, 1.5, title)
        for (run, label), panel in zip(labels.items(), panels, strict=True):
            of_run = samples[samples["run"] == run]
            share = _shares(of_run, run)
            ranks = np.arange(1, len(share) + 1)
            panel.bar(ranks, share, width=0.85, color=colors[series.loc[run, "series"]])
            panel.axhline(1 / len(share), color="#444444", linestyle=":", linewidth=1)
            effective = f"{effective_templates(share):.1f} of {len(share)}"
            panel.set_title(f"{label}\neffective {effective}, n = {len(of_run)}", fontsize=8.5)
            panel.set_xlim(0.4, len(share) + 0.6)
            panel.set_xticks(sorted({1, (1 + len(share)) // 2, len(share)}))
            panel.grid(axis="x", visible=False)
        top = max(panel.dataLim.y1 for panel in panels)
        for panel in panels:
            panel.set_ylim(0, 1.05 * top)
        figure.supylabel("share of test images", fontsize=8.5)
        figure.supxlabel("template, most selected first", fontsize=8.5)
    return figure


def template_count_curves(
    runs: pd.DataFrame, protocol: ProtocolDescription, measure: str = "chamfer"
) -> Figure:
    """Draw a measure against the number of templates T, error bars over seeds.

    Solid is the selected template deformed, dotted the same template as it is. One panel per
    category, one colour per regime. A point is the mean over seeds of the mean over test shapes,
    its bar the standard deviation over seeds (none where there is one seed).

    Args:
        runs: as `load_runs` gives them; those of other protocols, and those without the measure,
            are left out.
        protocol: as `find_protocol` gives it.
        measure: of the protocol.

    Raises:
        ConfigError: the protocol has no such measure.
        DataError: no run with the measure, only one T, or runs that differ in more than their seed.
    """
    chosen = protocol.metric(measure)
    table = runs[runs["protocol"] == protocol.name]
    table = table[table[measure].notna()] if measure in table else table[:0]
    if table.empty:
        raise DataError(
            f"no finished run has {measure}: evaluate one (ffd evaluate run=DIR "
            f"protocol={protocol.name})"
        )
    if table["templates"].nunique() < 2:
        raise DataError(
            f"all runs have T = {table['templates'].iloc[0]}: a curve against the number of "
            "templates needs two or more (templates=t1,t4,t16)"
        )
    for _, seeds in table.groupby(["category", "regime", "templates"]):
        check_seeds(seeds)
    with matplotlib.rc_context(STYLE):
        colors = colors_of(list(dict.fromkeys(table["regime"])))
        categories = table["category"].unique()
        several = table.groupby(["category", "regime", "templates"]).size().max() > 1
        seeds = "mean ± standard deviation over seeds" if several else "one seed"
        title = f"{chosen.title} by number of templates, {seeds}"
        figure, panels = panels_of(len(categories), 2, _WIDTH, 2.7, title)
        for category, panel in zip(categories, panels, strict=True):
            of_category = table[table["category"] == category]
            for regime, part in of_category.groupby("regime", sort=False):
                _count_lines(panel, part, chosen, colors[str(regime)])
            counts = sorted(of_category["templates"].unique())
            panel.set_xscale("log", base=2)
            panel.set_xticks(counts, [str(count) for count in counts])
            panel.minorticks_off()
            panel.set_ylim(bottom=0)
            if len(categories) > 1:
                panel.set_title(category)
        add_legend(figure, {regime_title(name): color for name, color in colors.items()})
        label_axes(figure, panels, "number of templates T", scaled_title(chosen))
    return figure


def budget_bars(samples: pd.DataFrame, protocol: ProtocolDescription) -> Figure:
    """Draw what each run's error is made of as one stacked bar, see `budget.error_budget`.

    A part below zero, where a choice by Chamfer distance is better by another measure, goes to the
    left; a line is then where the parts come to.

    Args:
        samples: as `load_samples` gives them.
        protocol: that they were measured under; its main measure is a distance.

    Raises:
        DataError: no run has the references, or more is better.
    """
    table, labels = error_budget(samples, protocol), run_labels(samples, titled=True)
    with matplotlib.rc_context(STYLE):
        title = f"What the {protocol.main_metric.title} is made of"
        figure, (panel,) = panels_of(1, 1, 1.4 * _WIDTH, 0.34 * len(table), title)
        table = table.loc[[run for run in labels if run in table.index]]
        places, right = np.arange(len(table)), np.zeros(len(table))
        left = np.zeros(len(table))
        for share, color in zip(SHARES, _BUDGET, strict=True):
            width = table[share.name].to_numpy()
            start = np.where(width < 0, left, right)
            panel.barh(places, width, left=start, color=color, label=share.name, height=0.7)
            left, right = left + width.clip(max=0), right + width.clip(min=0)
        for place, total in zip(places, table["total"], strict=True):
            panel.text(right[place], float(place), f" {total:.1f}", va="center", fontsize=8)
            if left[place] < 0:
                panel.vlines(total, place - 0.35, place + 0.35, color="black", linewidth=1.5)
        panel.set_yticks(places, [labels[str(run)] for run in table.index])
        panel.invert_yaxis()
        panel.set_xlim(1.12 * left.min(), 1.12 * right.max())
        panel.grid(axis="y", visible=False)
        figure.legend(loc="outside lower center", ncols=len(SHARES), frameon=False)
        panel.set_xlabel(scaled_title(protocol.main_metric))
    return figure


def to_svg(figure: Figure) -> bytes:
    """Return a figure as SVG, the same bytes each time; letters are paths, so no font is needed."""
    buffer = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


def _finite(samples: pd.DataFrame, name: str, run: str) -> NDArray[np.float64]:
    """Return a column of a run's samples.

    Raises:
        DataError: it is not there, or not all finite.
    """
    if name not in samples:
        raise DataError(
            f"the samples hold no {name}: they have {', '.join(samples)}; evaluate the runs under "
            "a protocol that measures it (ffd evaluate run=DIR protocol=NAME)"
        )
    values = samples[name].to_numpy(float)
    wrong = int((~np.isfinite(values)).sum())
    if wrong:
        raise DataError(
            f"{run}: {wrong} of {len(values)} values of {name} are not finite: evaluate the run "
            "again (ffd evaluate run=DIR restart=true)"
        )
    return values


def _shares(samples: pd.DataFrame, run: str) -> NDArray[np.float64]:
    """Return the share of each of a run's T templates, falling, (T,)."""
    count = int(samples["templates"].iloc[0])
    counts = samples["template"].value_counts().to_numpy()
    if len(counts) > count:
        raise DataError(f"{run} has {count} templates, but its samples select {len(counts)}")
    return np.pad(counts, (0, count - len(counts))) / counts.sum()


def _count_lines(panel: Axes, runs: pd.DataFrame, measure: Metric, color: str) -> None:
    """Draw one regime's lines into a panel."""
    for prefix, _, dash in DASHES:
        if (name := prefix + measure.name) not in runs:
            continue
        over_seeds = (measure.factor * runs.set_index("templates")[name]).groupby(level=0)
        mean, deviation = over_seeds.mean(), over_seeds.std().fillna(0.0)
        bars = panel.errorbar(
            mean.index,
            mean,
            yerr=deviation if (deviation > 0).any() else None,
            color=color,
            linestyle=dash,
            linewidth=1.3,
            marker="o",
            markersize=3.5,
            markerfacecolor=color if dash == "-" else "white",  # a lone point has no line
            capsize=2.5,
        )
        for line in bars[2]:
            line.set_linewidth(0.9)
