"""Figures over several runs, as matplotlib `Figure` objects.

Nothing here touches pyplot, so that figures can be made on any machine and in any thread. Each is
drawn for a width of about 400 pixels: text stays readable on a telephone. What a measure is, its
points and unit, is for captions.
"""

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import wrap
from typing import Any, Literal

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter
from PIL import Image

from ffd_lightning.analysis.naming import colors_of, run_labels, setting_labels
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import ProtocolDescription
from ffd_lightning.files import write_bytes_atomic
from ffd_lightning.imaging.grid import png
from ffd_lightning.metrics.selection import effective_templates
from ffd_lightning.palette import regime_title

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
_DPI = 200
_FORMATS: dict[str, Any] = {
    ".png": {"Software": None},
    ".pdf": {"CreationDate": None},
    ".svg": {"Date": None, "Creator": None},
}  # metadata that would change from day to day
_DASHES: tuple[tuple[str, str, Literal["-", ":"]], ...] = (
    ("", "deformed", "-"),
    ("undeformed_", "undeformed", ":"),
)  # prefix of the columns, name, line style
_WIDTH = 4.2  # inches
_MANY_TICKS = 50  # times as much at the right end: ticks at 1, 2 and 5 would run into each other


@contextmanager
def _styled(count: int, height: float, title: str) -> Iterator[tuple[Figure, list[Axes]]]:
    """Give a titled figure of `count` panels of a height in inches, two in a row; one is wider."""
    rows, columns = -(-count // 2), min(2, count)
    layout = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.06)
    with matplotlib.rc_context(STYLE):
        size = _WIDTH, 1.05 + rows * height
        figure = Figure(figsize=size, layout=layout, facecolor="white")
        figure.suptitle(title, fontsize=10.5, wrap=True)
        axes = figure.subplots(rows, columns, squeeze=False, sharey=True)
        for unused in axes.flat[count:]:
            unused.set_visible(False)
        yield figure, list(axes.flat[:count])


def _label(
    figure: Figure, panels: Sequence[Axes], x: str, y: str, colors: Mapping[str, str]
) -> None:
    """Write what is along the axes, and below the panels what colours, solid and dotted mean."""
    for panel in panels[-2:]:
        panel.set_xlabel(x)
    if len(panels) == 1:  # the middle of the figure is further down, by the lines below
        panels[0].set_ylabel(y)
    else:
        figure.supylabel(y, fontsize=8.5)
    labels = {"\n".join(wrap(name, 50)): color for name, color in colors.items()}
    handles = [Line2D([], [], color=color, label=name) for name, color in labels.items()]
    handles += [
        Line2D([], [], color="#444444", linestyle=dash, label=name) for _, name, dash in _DASHES
    ]
    longest = max(len(str(handle.get_label())) for handle in handles)
    columns = min(len(handles), max(1, 60 // (longest + 7)))
    lines = sum(name.count("\n") for name in labels) + -(-len(handles) // columns)
    figure.set_figheight(figure.get_figheight() + 0.17 * max(0, lines - 4))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False)


def _ticks(axis: Axis, steps: Sequence[float]) -> None:
    """Write numbers along a logarithmic axis, at these multiples of powers of ten."""
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def cumulative_curves(
    samples: pd.DataFrame,
    protocol: ProtocolDescription,
    measure: str = "chamfer",
    among: pd.DataFrame | None = None,
) -> Figure:
    """Draw the share of test samples that are better than a score, as the paper's figures 5 and 6.

    Solid is the selected template deformed, dotted the same template as it is. One panel per
    category, one colour per setting: runs that differ in their seed alone share it. Distances are
    on a logarithmic axis. A curve further up is better, whichever way the measure goes.

    Args:
        samples: of `Results`.
        protocol: that they were measured under.
        measure: of the protocol.
        among: samples of several figures: a setting has one name and colour in all.

    Raises:
        ConfigError, DataError: the protocol, or the samples, lack the measure.
    """
    metric = protocol.metric(measure)
    if measure not in samples:
        raise DataError(
            f"the samples hold no {measure}: they have {', '.join(samples)}; evaluate the runs "
            "under a protocol that measures it (ffd evaluate run=DIR protocol=NAME)"
        )
    runs, colors = setting_labels(samples)
    if among is not None:
        every, colors = setting_labels(among)
        runs["label"] = every["label"].reindex(runs.index)
        colors = {name: colors[name] for name in dict.fromkeys(runs["label"])}
    categories = runs["category"].unique()
    title = f"Cumulative {metric.title} of the test images"
    with _styled(len(categories), 2.7, title) as (figure, panels):
        for category, panel in zip(categories, panels, strict=True):
            for run, label in runs.loc[runs["category"] == category, "label"].items():
                of_run = samples[samples["run"] == run]
                for prefix, _, dash in _DASHES:
                    if prefix + measure in of_run:
                        panel.ecdf(
                            metric.factor * of_run[prefix + measure].to_numpy(float),
                            complementary=metric.higher_is_better,
                            color=colors[label],
                            linestyle=dash,
                            linewidth=1.3,
                        )
            if len(categories) > 1:
                panel.set_title(category)
            if not metric.higher_is_better:
                panel.set_xscale("log")
                low, high = panel.get_xlim()
                _ticks(panel.xaxis, (1, 2, 5) if high < _MANY_TICKS * low else (1, 3))
            panel.set_ylim(0, 1.02)
        words = f"share of test images {'above' if metric.higher_is_better else 'below'}"
        _label(figure, panels, metric.scaled_title, words, colors)
    return figure


def selection_histograms(samples: pd.DataFrame) -> Figure:
    """Draw how often each template was selected, the most selected first, a panel per run.

    All T templates are on the axis, also those that are never selected. The dotted line is where
    all would be selected alike. Above each panel: exp(entropy) of the shares, and how many
    `samples`, those of `Results`, there are.
    """
    labels, (runs, colors) = run_labels(samples), setting_labels(samples)
    labels = {run: "\n".join(wrap(label, 26)) for run, label in labels.items()}
    height = 1.5 + 0.15 * max(label.count("\n") for label in labels.values())
    title = "How often each template is selected"
    with _styled(len(labels), height, title) as (figure, panels):
        for (run, label), panel in zip(labels.items(), panels, strict=True):
            of_run = samples[samples["run"] == run]
            count, counts = int(of_run["templates"].iloc[0]), of_run["template"].value_counts()
            share = np.pad(counts / counts.sum(), (0, count - len(counts)))
            panel.bar(np.arange(count) + 1, share, 0.85, color=colors[runs.loc[run, "label"]])
            panel.axhline(1 / count, color="#444444", linestyle=":", linewidth=1)
            effective = f"{effective_templates(share):.1f} of {count}"
            panel.set_title(f"{label}\neffective {effective}, n = {len(of_run)}", fontsize=8.5)
            panel.set_xlim(0.4, count + 0.6)
            panel.set_xticks(sorted({1, (1 + count) // 2, count}))
            panel.grid(axis="x", visible=False)
        panels[0].set_ylim(0, 1.05 * max(panel.dataLim.y1 for panel in panels))  # they share it
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
        runs: `Results.scored`; those without the measure are left out.
        protocol: of their scores.
        measure: of the protocol.

    Raises:
        ConfigError: the protocol has no such measure.
        DataError: no run with the measure, or only one T.
    """
    metric = protocol.metric(measure)
    table = runs[runs[measure].notna()] if measure in runs else runs[:0]
    if table["templates"].nunique() < 2:
        raise DataError(
            f"{len(table)} runs with {measure}, T = {sorted(set(table['templates']))}: a curve "
            "against the number of templates needs two or more (templates=t1,t4,t16)"
        )
    colors = colors_of(list(dict.fromkeys(table["regime"])))
    categories = table["category"].unique()
    several = table.groupby(["category", "regime", "templates"]).size().max() > 1
    seeds = "mean ± standard deviation over seeds" if several else "one seed"
    title = f"{metric.title} by number of templates, {seeds}"
    with _styled(len(categories), 2.7, title) as (figure, panels):
        for category, panel in zip(categories, panels, strict=True):
            of_category = table[table["category"] == category]
            for regime, part in of_category.groupby("regime", sort=False):
                for prefix, _, dash in _DASHES:
                    if prefix + measure in part:
                        values = metric.factor * part.set_index("templates")[prefix + measure]
                        _over_seeds(panel, values, colors[str(regime)], dash)
            counts = sorted(of_category["templates"].unique())
            panel.set_xscale("log", base=2)
            panel.set_xticks(counts, [str(count) for count in counts])
            panel.minorticks_off()
            if len(categories) > 1:
                panel.set_title(category)
        # Of all, as they share it: when all is drawn, or it cuts.
        if metric.higher_is_better:
            panels[0].set_ylim(bottom=0)
        else:  # templates as they are can be ten times as far as deformed ones
            panels[0].set_yscale("log")
            _ticks(panels[0].yaxis, (1, 2, 5))
        titled = {regime_title(name): color for name, color in colors.items()}
        _label(figure, panels, "number of templates T", metric.scaled_title, titled)
    return figure


def _over_seeds(panel: Axes, values: pd.Series, color: str, dash: str) -> None:
    """Draw means of values that share an index, with their deviations."""
    groups = values.groupby(level=0)
    mean, deviation = groups.mean(), groups.std().fillna(0.0)
    panel.errorbar(
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
        elinewidth=0.9,
    )


def to_svg(figure: Figure) -> bytes:
    """Return a figure as SVG, the same bytes each time; letters are paths, so no font is needed."""
    return _to_bytes(figure, ".svg")


def save_figure(figure: Figure | Image.Image, path: Path) -> list[Path]:
    """Write a plot as PNG at 200 dpi and as PDF, or a picture as PNG, the same bytes each time.

    Endings of `path` are replaced. Returns the files.
    """
    if isinstance(figure, Image.Image):
        contents = {".png": png(figure, dpi=(_DPI, _DPI))}
    else:
        contents = {ending: _to_bytes(figure, ending) for ending in (".png", ".pdf")}
    for ending, content in contents.items():
        write_bytes_atomic(path.with_suffix(ending), content)
    return [path.with_suffix(ending) for ending in contents]


def _to_bytes(figure: Figure, ending: str) -> bytes:
    buffer = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(buffer, format=ending[1:], dpi=_DPI, metadata=_FORMATS[ending])
    return buffer.getvalue()
