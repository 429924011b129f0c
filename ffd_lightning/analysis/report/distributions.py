"""Sections: how scores are distributed, and how templates are selected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import pandas as pd

from ffd_lightning.analysis import plots
from ffd_lightning.analysis.budget import SHARES, error_budget
from ffd_lightning.analysis.report.elements import NOTHING, Plot, Table, cell, plot
from ffd_lightning.analysis.report.sweep import SETTINGS, Sweep, named, plain, told_apart, varying
from ffd_lightning.analysis.report.templates import Heat, heat_maps
from ffd_lightning.analysis.selection import (
    Families,
    run_families,
    selection_stability,
    selection_table,
)
from ffd_lightning.analysis.wording import measure_title, number
from ffd_lightning.errors import DataError
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


@dataclass(frozen=True)
class Curves:
    """How scores are distributed, and what the number of templates does to them."""

    key: ClassVar[str] = "curves"
    title: ClassVar[str] = "Distribution of scores"

    plots: Sequence[Plot]


@dataclass(frozen=True)
class Budget:
    """Where errors come from."""

    key: ClassVar[str] = "budget"
    title: ClassVar[str] = "Error budget"

    plots: Sequence[Plot]
    note: str


@dataclass(frozen=True)
class Selection:
    """Which templates are selected.

    Attributes:
        heats: how the settings of each category select.
        highest: the greatest share, which all bars are drawn to.
        table: a row per run.
        same: the settings that all rows have.
        measure: of the regret.
        no_families: why there is nothing of the templates' families, "" where there is no reason.
        seeds, same_of_seeds: how alike seeds select, and the settings that all rows of it have;
            None where there is one seed.
        not_held: why seeds cannot be held against each other, "" where they can.
    """

    key: ClassVar[str] = "selection"
    title: ClassVar[str] = "Template selection"

    heats: Sequence[Heat]
    highest: float
    table: Table
    same: str
    measure: Measure
    no_families: str
    seeds: Table | None
    same_of_seeds: str
    not_held: str


def curves(sweep: Sweep) -> Curves | None:
    """Return the curves of scores, None without any."""
    if sweep.samples.empty:
        return None
    protocol, main = sweep.protocol, sweep.protocol.main_measure
    others = [m for m in protocol.measures if m.higher_is_better != main.higher_is_better]
    shown = [main, *others[:1]]
    found = []
    if sweep.scored["templates"].nunique() > 1 and "setup" not in sweep.keys:
        for measure in shown:
            title = f"{measure_title(measure.name)} against T"
            figure = plots.template_count_curves(sweep.scored, protocol, measure.name)
            found.append(plot(figure, title, f"{title}."))
    for category, samples in sweep.samples.groupby("category", sort=False):
        for measure in shown:
            title = measure_title(measure.name)
            found.append(
                plot(
                    plots.cumulative_curves(samples, protocol, measure.name),
                    f"Cumulative {title} curves of {category}. {_medians(sweep, samples, measure)}",
                    f"{title} of the selected template on category {category}: deformed (solid) "
                    "and as it is (dotted). Further up is better.",
                )
            )
    return Curves(found)


def budget(sweep: Sweep) -> Budget | None:
    """Return what the runs' errors are made of, None where no run has its references."""
    if sweep.samples.empty:
        return None
    try:
        error_budget(sweep.samples, sweep.protocol)
    except DataError:
        return None
    title = measure_title(sweep.protocol.main_measure.name)
    told = f"What the {title} of each run is made of."
    bars = plot(plots.budget_bars(sweep.samples, sweep.protocol), told, told)
    shares = "; ".join(f"{share.name}: {share.meaning}" for share in SHARES)
    return Budget([bars], shares)


def _medians(sweep: Sweep, samples: pd.DataFrame, measure: Measure) -> str:
    """Return what a cumulative curve says, for those who do not see it."""
    medians = samples.groupby("run", sort=False)[measure.name].median()
    values = (
        f"{sweep.labels[str(run)]} {number(measure.factor * m)}" for run, m in medians.items()
    )
    return f"Medians of the deformed templates: {'; '.join(values)}."


def selection(sweep: Sweep) -> Selection | None:
    """Return which templates are selected: shares, metrics, agreement between seeds."""
    if sweep.samples.empty:
        return None
    main = sweep.protocol.main_measure
    families: Families = {}
    no_families = ""
    try:
        families = run_families(sweep.runs)
    except DataError as error:
        no_families = str(error)
    table = selection_table(sweep.samples, sweep.protocol, families, main.name)
    columns = {k: v for k, v in _SELECTION.items() if k in table and table[k].notna().any()}
    table = table.merge(sweep.table[["run", "setup"]], on="run")
    keys, same = told_apart(table, [*sweep.keys, "seed"])
    rows = [
        [*(named(key, row[key]) for key in keys), *(_cell(row[k], k, main) for k in columns)]
        for row in table.to_dict("records")
    ]
    seeds, same_of_seeds, not_held = None, "", ""
    if varying(sweep.scored, ["seed"]):
        try:
            seeds, same_of_seeds = _stability(sweep)
        except DataError as error:
            not_held = str(error)
    heats = heat_maps(sweep)
    return Selection(
        heats,
        max(float(bar.value or 0) for heat in heats for s in heat.settings for bar in s.bars),
        Table("Template selection", [*map(plain, keys), *columns.values()], rows),
        same,
        main,
        no_families,
        seeds,
        same_of_seeds,
        not_held,
    )


def _cell(value: float, column: str, measure: Measure) -> str:
    if pd.isna(value):
        return NOTHING
    if "regret" in column:
        return number(measure.factor * value)
    if "share" in column or "family" in column:
        return f"{value:.0%}"
    return f"{value:.0f}" if column == "templates_used" else f"{value:.1f}"


def _stability(sweep: Sweep) -> tuple[Table | None, str]:
    """Return how alike the seeds of a setting select, and the settings that all rows have."""
    table = selection_stability(sweep.samples)
    table = table[table["num_pairs"] > 0]
    if table.empty:
        return None, ""
    keys, same = told_apart(table, SETTINGS)
    rows = [
        [
            *(named(key, row[key]) for key in keys),
            *(cell(row[key]) for key in ("num_seeds", "num_samples")),
            f"{row['adjusted_rand']:.2f}",
            f"{row['same_template']:.0%}",
        ]
        for row in table.to_dict("records")
    ]
    head = [*map(plain, keys), "seeds", "test\nsamples", "adjusted\nRand index", "same\ntemplate"]
    return Table("Agreement of seeds", head, rows), same
