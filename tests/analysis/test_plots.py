"""Plots over several runs, and figures in files."""

import re
from collections import Counter
from statistics import mean, stdev

import numpy as np
import pandas as pd
import pytest
from analysis.made import PAPER, run_samples
from matplotlib import pyplot
from PIL import Image

from ffd_lightning.analysis.plots import (
    cumulative_curves,
    save_figure,
    selection_histograms,
    template_count_curves,
    to_svg,
)


@pytest.fixture(autouse=True)
def _no_pyplot():
    """No figure may be left in pyplot's hands."""
    yield
    assert pyplot.get_fignums() == []


def samples(*runs, count=7):
    """Made-up samples; a run is (regime, templates)."""
    rng = np.random.default_rng(0)
    return pd.concat(
        run_samples(
            count,
            regime,
            templates=templates,
            template=rng.choice([f"t{k}" for k in range(min(templates, 3))], count),
            chamfer=rng.lognormal(-2, 1, count),
            undeformed_chamfer=rng.lognormal(0, 1, count),
            iou=rng.random(count),
            undeformed_iou=rng.random(count) / 2,
        )
        for regime, templates in runs
    )


def runs(*rows):
    """Made-up runs; a row is (category, regime, templates, seed, score)."""
    table = pd.DataFrame(rows, columns=["category", "regime", "templates", "seed", "chamfer"])
    table["run"] = [f"run{k}" for k in range(len(table))]
    return table.assign(undeformed_chamfer=3 * table["chamfer"])


def height(line, x):
    """What a step line shows at x, between its steps."""
    xs, ys = line.get_xdata(), line.get_ydata()
    if line.get_drawstyle() == "steps-pre":
        return ys[np.flatnonzero(xs >= x)[0]]
    assert line.get_drawstyle() == "steps-post"
    return ys[np.flatnonzero(xs <= x)[-1]]


@pytest.mark.parametrize("measure", ["chamfer", "iou"])
def test_a_curve_is_the_share_of_samples_that_are_better(measure):
    table = samples(("b", 4), ("e", 4))
    (axes,) = cumulative_curves(table, PAPER, measure).axes
    drawn = [line for line in axes.lines if len(line.get_xdata()) > 2]
    assert [line.get_linestyle() for line in drawn] == ["-", ":", "-", ":"]
    columns = [f"{prefix}{measure}" for prefix in ("", "undeformed_")] * 2
    for line, column, regime in zip(drawn, columns, "bbee", strict=True):
        values = 1000 * table.loc[table["regime"] == regime, column].to_numpy()
        for x in np.quantile(values, [0.1, 0.35, 0.6, 0.8]) + 1e-6:
            better = sum(v > x for v in values) if measure == "iou" else sum(v <= x for v in values)
            assert height(line, x) == pytest.approx(better / len(values))


def test_bars_are_the_sorted_counts_of_all_templates():
    table = samples(("b", 8), ("e", 3), count=20)
    panels = [axes for axes in selection_histograms(table).axes if axes.get_visible()]
    for panel, regime, count in zip(panels, "be", (8, 3), strict=True):
        selected = Counter(table.loc[table["regime"] == regime, "template"])
        shares = [n / 20 for n in sorted(selected.values(), reverse=True)]
        heights = [patch.get_height() for patch in panel.patches]
        assert heights == pytest.approx([*shares, *[0] * (count - len(shares))])
        effective = np.exp(-np.dot(shares, np.log(shares)))
        assert f"effective {effective:.1f} of {count}, n = 20" in panel.get_title()
        assert panel.lines[0].get_ydata()[0] == pytest.approx(1 / count)


def test_points_are_means_over_seeds_and_bars_their_deviations():
    scores = {1: [0.3, 0.4, 0.35], 4: [0.2, 0.25, 0.1], 16: [0.15, 0.1, 0.2]}
    table = runs(*(("sofa", "e", t, k, v) for t, vs in scores.items() for k, v in enumerate(vs)))
    figure = template_count_curves(table, PAPER)
    for container, factor in zip(figure.axes[0].containers, (1000, 3000), strict=True):
        line, _, (bars,) = container
        assert line.get_xdata().tolist() == [1, 4, 16]
        assert line.get_ydata() == pytest.approx([factor * mean(v) for v in scores.values()])
        spans = [segment[1, 1] - segment[0, 1] for segment in bars.get_segments()]
        assert spans == pytest.approx([2 * factor * stdev(v) for v in scores.values()])
    assert "standard deviation over seeds" in figure.get_suptitle()
    one = template_count_curves(table[table["seed"] == 0], PAPER)
    assert all(not container.has_yerr for container in one.axes[0].containers)
    assert "one seed" in one.get_suptitle()
    far = table.assign(run="far", category="table", chamfer=10 * table["chamfer"])
    several = template_count_curves(pd.concat([table, far]), PAPER)
    low, high = several.axes[0].get_ylim()
    assert low < 1000 * table.groupby("templates")["chamfer"].mean().min()
    assert high > 1000 * far.groupby("templates")["chamfer"].mean().max(), "nothing is cut off"


def test_figures_are_files_the_same_each_time_that_need_nothing(tmp_path):
    figure = cumulative_curves(samples(("b", 4)), PAPER)
    files = save_figure(figure, tmp_path / "new" / "plot")
    assert [file.name for file in files] == ["plot.png", "plot.pdf"]
    again = save_figure(figure, tmp_path / "again")
    assert [a.read_bytes() == b.read_bytes() for a, b in zip(files, again, strict=True)] == [
        True
    ] * 2
    svg = to_svg(figure)
    assert svg == to_svg(figure)
    assert all(link.startswith(b"#") for link in re.findall(rb'href="([^"]*)', svg))
    assert b"<text" not in svg, "letters are paths"
    picture = Image.fromarray(np.arange(189, dtype=np.uint8).reshape(9, 7, 3))
    (file,) = save_figure(picture, tmp_path / "sheet")
    np.testing.assert_array_equal(np.asarray(Image.open(file)), np.asarray(picture))
