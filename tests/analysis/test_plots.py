import re
from collections import Counter
from statistics import mean, stdev
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from matplotlib import pyplot
from matplotlib.colors import to_hex, to_rgb

from ffd_lightning.analysis.plot_layout import run_labels
from ffd_lightning.analysis.plots import (
    cumulative_curves,
    selection_histograms,
    template_count_curves,
    to_svg,
)
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.protocols import PaperProtocol, ProtocolDescription
from ffd_lightning.palette import REGIME_COLORS

PAPER = ProtocolDescription.of(PaperProtocol())


@pytest.fixture(autouse=True)
def _no_pyplot():
    """No figure may be left in pyplot's hands."""
    yield
    assert pyplot.get_fignums() == []


def samples(*runs, count=7):
    """Made-up samples; a run is (category, regime, templates, seed)."""
    rng = np.random.default_rng(0)
    return pd.concat(
        pd.DataFrame(
            {
                "run": "/".join(map(str, run)),
                "regime": run[1],
                "templates": run[2],
                "seed": run[3],
                "id": [f"m{k}" for k in range(count)],
                "category": run[0],
                "template": rng.choice([f"t{k}" for k in range(min(run[2], 3))], count),
                "chamfer": rng.lognormal(-2, 1, count),
                "undeformed_chamfer": rng.lognormal(0, 1, count),
                "iou": rng.random(count),
                "undeformed_iou": rng.random(count) / 2,
            }
        )
        for run in runs
    )


def runs(*rows):
    """Made-up runs of the paper's protocol; a row is (category, regime, templates, seed, score)."""
    names = ["category", "regime", "templates", "seed", "chamfer"]
    table = pd.DataFrame(rows, columns=names)
    table["run"] = [f"run{k}" for k in range(len(table))]
    table["undeformed_chamfer"] = 3 * table["chamfer"]
    return table.assign(state="finished", protocol="paper")


def visible(figure):
    return [axes for axes in figure.axes if axes.get_visible()]


def words(figure):
    texts = [text for axes in visible(figure) for text in (axes.get_title(), axes.get_xlabel())]
    return "|".join([figure.get_suptitle(), figure.get_supylabel(), *texts])


def legend(figure):
    return {text.get_text(): line for text, line in zip(*_legend_parts(figure), strict=True)}


def _legend_parts(figure):
    return figure.legends[0].get_texts(), figure.legends[0].get_lines()


def height(line, x):
    """What a step line shows at x, between its steps."""
    xs, ys = line.get_xdata(), line.get_ydata()
    if line.get_drawstyle() == "steps-pre":
        return ys[np.flatnonzero(xs >= x)[0]]
    assert line.get_drawstyle() == "steps-post"
    return ys[np.flatnonzero(xs <= x)[-1]]


@pytest.mark.parametrize("measure", ["chamfer", "iou"])
def test_a_curve_is_the_share_of_samples_that_are_better(measure):
    table = samples(("sofa", "b", 4, 0), ("sofa", "e", 4, 0))
    (axes,) = cumulative_curves(table, PAPER, measure).axes
    drawn = [line for line in axes.lines if len(line.get_xdata()) > 2]
    assert [line.get_linestyle() for line in drawn] == ["-", ":", "-", ":"]
    columns = [f"{prefix}{measure}" for prefix in ("", "undeformed_")] * 2
    for line, column, regime in zip(drawn, columns, "bbee", strict=True):
        values = 1000 * table.loc[table["regime"] == regime, column].to_numpy()
        for x in np.quantile(values, [0.1, 0.35, 0.6, 0.8]) + 1e-6:
            better = sum(v > x for v in values) if measure == "iou" else sum(v <= x for v in values)
            assert height(line, x) == pytest.approx(better / len(values))


def test_seeds_share_a_colour_and_regimes_keep_theirs():
    both = cumulative_curves(
        samples(("sofa", "b", 4, 0), ("sofa", "w", 4, 0), ("sofa", "w", 4, 1)), PAPER
    )
    colors = [to_hex(line.get_color()) for line in both.axes[0].lines]
    assert colors[2:4] == colors[4:6] != colors[:2]
    assert list(legend(both)) == ["b, base", "w, log-weighted", "deformed", "undeformed"]
    assert colors[0] == REGIME_COLORS["b"].lower()
    alone = cumulative_curves(samples(("sofa", "w", 4, 0)), PAPER)
    assert to_hex(alone.axes[0].lines[0].get_color()) == colors[2]


def test_numbers_of_templates_are_ordered_by_size():
    table = samples(*(("sofa", "e", count, 0) for count in (1, 16, 2)))
    assert list(legend(cumulative_curves(table, PAPER)))[:3] == ["T = 1", "T = 2", "T = 16"]


def test_regimes_keep_their_colours_lighter_for_fewer_templates():
    table = samples(("sofa", "e", 8, 0), ("sofa", "b", 1, 0), ("sofa", "e", 2, 0))
    lines = legend(cumulative_curves(table, PAPER))
    assert list(lines)[:3] == ["b, base, T = 1", "e, entropy, T = 2", "e, entropy, T = 8"]
    base, light, full = (np.array(to_rgb(line.get_color())) for line in list(lines.values())[:3])
    assert to_hex(base) == REGIME_COLORS["b"].lower()
    assert to_hex(full) == REGIME_COLORS["e"].lower()
    assert (light > full).all()


def test_a_panel_for_each_category():
    figure = cumulative_curves(samples(("sofa", "b", 4, 0), ("table", "b", 4, 0)), PAPER)
    assert [axes.get_title() for axes in visible(figure)] == ["sofa", "table"]
    assert [len(axes.lines) for axes in visible(figure)] == [2, 2]


def test_bars_are_the_sorted_counts_of_all_templates():
    table = samples(("sofa", "b", 8, 0), ("sofa", "e", 3, 0), count=20)
    panels = visible(selection_histograms(table))
    for panel, regime, count in zip(panels, "be", (8, 3), strict=True):
        selected = Counter(table.loc[table["regime"] == regime, "template"])
        expected = sorted(selected.values(), reverse=True) + [0] * (count - len(selected))
        heights = [patch.get_height() for patch in panel.patches]
        assert heights == pytest.approx([n / 20 for n in expected])
        assert panel.get_xlim()[1] > count
        shares = [n / 20 for n in expected if n]
        effective = np.exp(-sum(s * np.log(s) for s in shares))
        assert f"effective {effective:.1f} of {count}, n = 20" in panel.get_title()
        assert panel.lines[0].get_ydata()[0] == pytest.approx(1 / count)


def test_points_are_means_over_seeds_and_bars_their_deviations():
    scores = {1: [0.3, 0.4, 0.35], 4: [0.2, 0.25, 0.1], 16: [0.15, 0.1, 0.2]}
    table = runs(*(("sofa", "e", t, k, v) for t, vs in scores.items() for k, v in enumerate(vs)))
    (axes,) = template_count_curves(table, PAPER).axes
    for container, factor in zip(axes.containers, (1000, 3000), strict=True):
        line, _, (bars,) = container
        assert line.get_xdata().tolist() == [1, 4, 16]
        assert line.get_ydata() == pytest.approx([factor * mean(v) for v in scores.values()])
        spans = [segment[1, 1] - segment[0, 1] for segment in bars.get_segments()]
        assert spans == pytest.approx([2 * factor * stdev(v) for v in scores.values()])
    assert "standard deviation over seeds" in words(template_count_curves(table, PAPER))


def test_one_seed_has_no_bars():
    table = runs(("sofa", "e", 1, 0, 0.3), ("sofa", "e", 4, 0, 0.2), ("sofa", "b", 1, 0, 0.4))
    figure = template_count_curves(table, PAPER)
    assert all(not container.has_yerr for container in figure.axes[0].containers)
    assert len(figure.axes[0].containers) == 4
    assert "one seed" in words(figure)


def test_labels_say_what_differs():
    table = runs(("sofa", "b", 4, 0, 1.0), ("sofa", "e", 4, 0, 1.0), ("sofa", "e", 4, 1, 1.0))
    assert list(run_labels(table).values()) == ["b, seed 0", "e, seed 0", "e, seed 1"]
    assert next(iter(run_labels(table, titled=True).values())) == "b, base, seed 0"
    mixed = runs(*(("sofa", regime, 4, 0, 1.0) for regime in ("mine", "e", "w", "b")))
    assert list(run_labels(mixed).values()) == ["b", "w", "e", "mine"]
    alike = runs(("sofa", "b", 4, 0, 1.0), ("sofa", "b", 4, 0, 1.0))
    alike["run"] = ["runs/slow/b", "runs/fast/b"]
    assert list(run_labels(alike).values()) == ["b, T = 4, slow/b", "b, T = 4, fast/b"]


def test_pictures_are_the_same_bytes_each_time_and_need_nothing():
    table = samples(("sofa", "b", 4, 0), ("sofa", "e", 4, 0))
    first = to_svg(cumulative_curves(table, PAPER))
    assert to_svg(cumulative_curves(table, PAPER)) == first
    root = ElementTree.fromstring(first)
    links = [v for e in root.iter() for k, v in e.attrib.items() if k.endswith("href")]
    assert all(link.startswith("#") for link in links)
    assert not root.findall(".//{http://www.w3.org/2000/svg}text"), "letters are paths"
    assert not re.search(rb"20\d\d-\d\d-\d\d", first), "no date"


def changed(**columns):
    return samples(("sofa", "b", 4, 0)).assign(**columns)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (
            lambda: cumulative_curves(changed(), PAPER, "fscore"),
            ConfigError,
            "choose one of chamfer, emd",
        ),
        (
            lambda: cumulative_curves(changed(), PAPER, "emd"),
            DataError,
            "hold no emd: they have run",
        ),
        (
            lambda: cumulative_curves(changed(chamfer=[1.0] * 6 + [np.nan]), PAPER),
            DataError,
            "1 of 7 values of chamfer are not finite",
        ),
        (
            lambda: selection_histograms(changed(template=list("abcdefg"))),
            DataError,
            "has 4 templates, but its samples select 7",
        ),
        (
            lambda: template_count_curves(runs(("sofa", "b", 4, 0, 0.1)), PAPER),
            DataError,
            "all runs have T = 4",
        ),
        (
            lambda: template_count_curves(
                runs(("sofa", "b", 4, 0, 0.1), ("sofa", "b", 1, 0, 0.1)).assign(
                    protocol=["paper", "modern"]
                ),
                PAPER,
            ),
            DataError,
            "all runs have T = 4",
        ),
        (lambda: template_count_curves(runs(), PAPER, "iou"), DataError, "no finished run has iou"),
    ],
)
def test_what_cannot_be_drawn_is_said(make, error, message):
    with pytest.raises(error, match=message):
        make()
