"""Sections: the table of scores, and what can be said of differences."""

from __future__ import annotations

from typing import Any

import pandas as pd

from ffd_lightning.analysis.compare import aggregate_seeds, compare_runs
from ffd_lightning.analysis.plots import measure_title
from ffd_lightning.analysis.report import fragments as html
from ffd_lightning.analysis.report.sweep import Sweep, plain, told_apart, varying
from ffd_lightning.analysis.tables import number
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import Measure
from ffd_lightning.evaluation.references import SHAPES

_SAME_FOR_ALL = {
    "medoid": "central shape",
    "retrieval": "nearest shape",
    "floor": "truth again",
}  # references that no network has a part in
_BESIDE = {
    "undeformed": "undeformed",
    "best_undeformed": "best undeformed",
    "feature_retrieval": "retrieved",
}  # what stands beside the model: prefix of its columns, heading
_COMPARED = {"regime": "Regimes", "templates": "Numbers of templates", "setup": "Runs"}
_MANY_SETUPS = 8
_MANY = 12  # comparisons that are shown unasked


def results(sweep: Sweep) -> str:
    """Return the table of scores, with what they mean."""
    scored, protocol = sweep.scored, sweep.protocol
    if scored.empty:
        return html.section(
            "results", "Results", html.paragraph("No run has results yet: see the end of the page.")
        )
    first = protocol.measures[0]
    beside = {k: title for k, title in _BESIDE.items() if f"{k}_{first.name}" in scored}
    columns = {m.name: (_heading(m), m.factor) for m in protocol.measures}
    for key, title in beside.items():
        columns[f"{key}_{first.name}"] = f"{title}\n{_title(first)}", first.factor
    columns["effective_templates"] = "effective\ntemplates", 1.0
    lacking = len(sweep.unscored) + len(sweep.damaged)
    without = f" {lacking} more runs have no results (end of the page)." if lacking else ""
    head, rows, note = _result_rows(sweep, {name: factor for name, (_, factor) in columns.items()})
    head += [title for title, _ in columns.values()] + ["test\nsamples"]
    below = [
        [
            title,
            *(number(m.factor * _mean(scored, f"{shape}_{m.name}")) for m in protocol.measures),
            *[""] * (len(beside) + 2),
        ]
        for shape, title in _SAME_FOR_ALL.items()
        if f"{shape}_{first.name}" in scored
    ]
    told = [f"{title.capitalize()}: {SHAPES[k]}." for k, title in beside.items()]
    told.append("Effective templates: exp(entropy) of how often each was selected, from 1 to T.")
    if below:
        over = ", means over categories" if scored["category"].nunique() > 1 else ""
        what = ", ".join(f"{title} ({SHAPES[shape]})" for shape, title in _SAME_FOR_ALL.items())
        told.append(f"Below the line, what no network has a part in{over}: {what}.")
    return html.section(
        "results",
        "Results",
        html.paragraph(
            f"The selected template, deformed: {note}. Arrows point to what is better.{without}"
        ),
        html.table("Results", head, rows, below),
        html.paragraph(f"{definitions(sweep)} {' '.join(told)}", "note"),
    )


def definitions(sweep: Sweep) -> str:
    """Return the protocol's measures in words, with their units."""
    protocol = sweep.protocol
    measures = "; ".join(f"{measure_title(m.name)}: {m.definition}" for m in protocol.measures)
    return f"Protocol {protocol.name}: {protocol.note}. {measures}."


def _result_rows(sweep: Sweep, factors: dict[str, float]) -> tuple[list[str], list[list[str]], str]:
    """Return headings of the settings, rows, and what a number is: over seeds where there are."""
    scored = sweep.scored
    if scored.groupby(sweep.keys).size().max() > 1:
        names = [name for name in factors if scored[name].notna().all()]
        means = aggregate_seeds(scored, [*names, "num_samples"], sweep.keys)
        keys, same = told_apart(means, sweep.keys)
        rows = [
            [
                *(str(row[key]) for key in (*keys, "num_seeds")),
                *(_over_seeds(row, name, factor) for name, factor in factors.items()),
                html.cell(row["num_samples"]),
            ]
            for row in means.to_dict("records")
        ]
        over = "means over the test samples of a run, then mean ± standard deviation over seeds"
        return [*map(plain, keys), "seeds"], rows, over + same
    keys, same = told_apart(scored, [*sweep.keys, "seed"])
    rows = [
        [
            *(str(row[key]) for key in keys),
            *(_scaled(row[name], factor) for name, factor in factors.items()),
            html.cell(row["num_samples"]),
        ]
        for row in scored.to_dict("records")
    ]
    return [*map(plain, keys)], rows, f"means over the test samples of each run{same}"


def _over_seeds(row: dict[Any, Any], name: str, factor: float) -> str:
    deviation = row.get(f"{name}_std", float("nan"))
    spread = "" if pd.isna(deviation) else f" ± {number(factor * deviation)}"
    return _scaled(row.get(name), factor) + spread


def comparisons(sweep: Sweep) -> str:
    """Return what can be said of differences between regimes, and between numbers of templates.

    Where runs differ in other settings too, all that they differ in is compared at once.
    """
    scored, parts = sweep.scored, []
    if scored.empty:
        return ""
    compared = varying(scored, ["setup"] if "setup" in sweep.keys else ["regime", "templates"])
    if compared == ["setup"] and scored["setup"].nunique() > _MANY_SETUPS:
        told = "Too many settings to hold each against each other: see the tables."
        return html.section("comparison", "What differs", html.paragraph(told))
    samples = sweep.samples.merge(scored[["run", "setup"]], on="run")
    for by in compared:
        word = _COMPARED[by]
        for k, measure in enumerate(sweep.protocol.measures):
            try:
                table = compare_runs(
                    samples,
                    measure.name,
                    by,
                    protocol=sweep.protocol.name,
                    settings=sweep.settings,
                )
            except DataError as error:
                parts.append(html.paragraph(f"{word} are not compared: {error}", "note"))
                break
            statements = _statements(table)
            title = f"{word}, by {measure_title(measure.name)}"
            parts.append(
                html.details(title, statements) if k else f"<h3>{title}</h3>\n{statements}"
            )
    if not parts:
        return ""
    told = (
        "Runs are compared on the same test models: the mean difference, its 95% interval "
        "(bootstrap over models), and p of Wilcoxon's signed-rank test, corrected for the number "
        "of comparisons (Holm)."
    )
    return html.section("comparison", "What differs", html.paragraph(told), *parts)


def _statements(table: pd.DataFrame) -> str:
    """Return sentences; of many those over all categories, and the rest when it is asked for."""
    over_all = table["category"].str.startswith("mean of ")
    if len(table) <= _MANY:
        return html.statements(table["statement"])
    rest = table.loc[~over_all, "statement"]
    shown = rest.str.contains(" beats ", regex=False).sum()
    where = " within categories" if over_all.any() else ""
    summary = f"{len(rest)} comparisons{where}, {shown} of them show a difference"
    return html.statements(table.loc[over_all, "statement"]) + html.details(
        summary, html.statements(rest)
    )


def _title(measure: Measure) -> str:
    return f"{measure_title(measure.name)} {measure.arrow}"


def _heading(measure: Measure) -> str:
    return _title(measure) + ("" if measure.factor == 1 else f"\nx {measure.factor:g}")


def _scaled(value: Any, factor: float) -> str:
    return html.NOTHING if value is None or pd.isna(value) else number(factor * value)


def _mean(scored: pd.DataFrame, name: str) -> float:
    """Return the mean over categories of the mean over runs."""
    return float(scored.groupby("category")[name].mean().mean())
