"""Sections: how scores are distributed, and how templates are selected."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning.analysis import plots
from ffd_lightning.analysis.plots import measure_title, to_svg
from ffd_lightning.analysis.report import fragments as html
from ffd_lightning.analysis.report.sweep import SETTINGS, Sweep, plain, told_apart, varying
from ffd_lightning.analysis.selection import run_families, selection_stability, selection_table
from ffd_lightning.analysis.tables import number
from ffd_lightning.errors import DataError, UserError
from ffd_lightning.evaluation.protocols import Measure

_SELECTION = {
    "effective_templates": "effective\ntemplates",
    "templates_used": "used\ntemplates",
    "top1_share": "top 1\nshare",
    "top5_share": "top 5\nshare",
    "regret": "regret\ndeformed",
    "best_share": "best selected\ndeformed",
    "undeformed_regret": "regret\nas they are",
    "undeformed_best_share": "best selected\nas they are",
    "family_agreement": "same family\nselected",
    "family_chance": "same family\nby chance",
    "family_reachable": "same family\nexists",
}


def curves(sweep: Sweep) -> str:
    """Return how scores are distributed, and what the number of templates does to them."""
    if sweep.samples.empty:
        return ""
    measures, protocol = sweep.protocol.measures, sweep.protocol.name
    main = sweep.main_measure
    shown = [main, *[m for m in measures if m.higher_is_better != main.higher_is_better][:1]]
    figures = []
    if sweep.scored["templates"].nunique() > 1 and "setup" not in sweep.keys:
        for measure in shown:
            figure = plots.template_count_curves(sweep.scored, measure.name)
            title = measure_title(measure.name)
            figures.append(html.plot(to_svg(figure), f"{title} against T", f"{title} against T."))
    for category, samples in sweep.samples.groupby("category", sort=False):
        for measure in shown:
            figure = plots.cumulative_curves(samples, measure.name, protocol)
            title = measure_title(measure.name)
            figures.append(
                html.plot(
                    to_svg(figure),
                    f"Cumulative {title} curves of {category}. {_medians(sweep, samples, measure)}",
                    f"{title} of the selected template on category {category}: deformed (solid) "
                    "and as it is (dotted). Further up is better.",
                )
            )
    return html.section("curves", "Distribution of scores", html.plots(figures))


def _medians(sweep: Sweep, samples: pd.DataFrame, measure: Measure) -> str:
    """Return what a cumulative curve says, for those who do not see it."""
    medians = samples.groupby("run", sort=False)[measure.name].median()
    values = (
        f"{sweep.labels[str(run)]} {number(measure.factor * m)}" for run, m in medians.items()
    )
    return f"Medians of the deformed templates: {'; '.join(values)}."


def selection(sweep: Sweep, data_root: Path | None = None) -> str:
    """Return which templates are selected: histograms, metrics, agreement between seeds.

    Args:
        sweep: the runs.
        data_root: where their prepared data is, which knows the templates' families.
    """
    if sweep.samples.empty:
        return ""
    main = sweep.main_measure
    try:
        families = run_families(sweep.runs, data_root)
    except (UserError, OSError, OmegaConfBaseException):
        families = {}  # told with the examples, which need that data too
    table = selection_table(sweep.samples, families, main.name, sweep.protocol.name)
    columns = {k: v for k, v in _SELECTION.items() if k in table and table[k].notna().any()}
    table = table.merge(sweep.table[["run", "setup"]], on="run")
    keys, same = told_apart(table, [*sweep.keys, "seed"])
    rows = [
        [*(str(row[key]) for key in keys), *(_cell(row[k], k, main) for k in columns)]
        for row in table.to_dict("records")
    ]
    title = measure_title(main.name)
    told = (
        "Effective templates: exp(entropy) of the shares. Regret: how much worse "
        f"{title} is than with the best of the network's own templates"
        + (f", x {main.factor:g}" if main.factor != 1 else "")
        + "; best selected: how often that one is the selected one; both also of the templates as "
        "they are. Same family: how often the selected template is of the query's structural "
        "family, how often it would be if the same templates were dealt out at random, and how "
        "often there is one of it."
    )
    figures = []
    for category, samples in sweep.samples.groupby("category", sort=False):
        of_category = table[table["run"].isin(samples["run"])]
        effective = "; ".join(
            f"{sweep.labels[run]} {value:.1f}"
            for run, value in zip(
                of_category["run"], of_category["effective_templates"], strict=True
            )
        )
        figures.append(
            html.plot(
                to_svg(plots.selection_histograms(samples)),
                f"Selection histograms of {category}. Effective templates: {effective}.",
                f"How often each template was selected on category {category}. Dotted: all alike.",
            )
        )
    return html.section(
        "selection",
        "Template selection",
        html.plots(figures),
        html.paragraph(f"How templates were selected over the test samples of each run{same}."),
        html.table("Template selection", [*map(plain, keys), *columns.values()], rows),
        html.paragraph(told, "note"),
        _stability(sweep) if varying(sweep.scored, ["seed"]) else "",
    )


def _cell(value: float, column: str, measure: Measure) -> str:
    if pd.isna(value):
        return html.NOTHING
    if "regret" in column:
        return number(measure.factor * value)
    if "share" in column or "family" in column:
        return f"{value:.0%}"
    return f"{value:.0f}" if column == "templates_used" else f"{value:.1f}"


def _stability(sweep: Sweep) -> str:
    """Return how alike the seeds of a setting select."""
    try:
        table = selection_stability(sweep.samples)
    except DataError as error:
        return html.paragraph(f"Seeds are not held against each other: {error}", "note")
    told = (
        "Means over pairs of seeds, on the samples that both have{}. Adjusted Rand index: how "
        "alike they group the samples by their template, 1 for the same groups, 0 for chance. Same "
        "template: share of samples for which both select the very same."
    )
    table = table[table["num_pairs"] > 0]
    if table.empty:
        return ""
    keys, same = told_apart(table, SETTINGS)
    rows = [
        [
            *(str(row[key]) for key in keys),
            *(html.cell(row[key]) for key in ("num_seeds", "num_samples")),
            f"{row['adjusted_rand']:.2f}",
            f"{row['same_template']:.0%}",
        ]
        for row in table.to_dict("records")
    ]
    head = [*map(plain, keys), "seeds", "test\nsamples", "adjusted\nRand index", "same\ntemplate"]
    return f"<h3>Agreement of seeds</h3>{html.paragraph(told.format(same))}" + html.table(
        "Agreement of seeds", head, rows
    )
