"""Which tables of results there are, for terminals, the report and notebooks alike."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from rich.console import RenderableType
from rich.text import Text

from ffd_lightning.analysis.budget import QUALITY, SHARES, error_budget, mesh_quality
from ffd_lightning.analysis.compare import (
    Best,
    best,
    compare_runs,
    compare_with_retrieval,
    group_label,
    mean_intervals,
)
from ffd_lightning.analysis.results import SETTINGS, Results
from ffd_lightning.analysis.runs import (
    decides,
    described_protocol,
    is_mixed,
    load_runs,
    load_samples,
)
from ffd_lightning.analysis.selection import Families, selection_stability, selection_table
from ffd_lightning.analysis.table import Cell, Table, number
from ffd_lightning.analysis.wording import SHAPE_TITLES, scaled_title
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.candidates import CANDIDATES
from ffd_lightning.evaluation.protocols import Metric, ProtocolDescription
from ffd_lightning.palette import REGIME_COLORS, regime_title
from ffd_lightning.run_folder import RunFolder

FOLDED = Metric("folded", QUALITY["folded"][1], factor=QUALITY["folded"][2])
"""Judged beside the protocol's measures, which say nothing of how a mesh is deformed."""

NOTHING = "-"
"""What stands in a table where there is no value."""

_BEST, _LEVEL = "▲", "≈"
_MOST = 12  # settings that are compared: of more, the best
_RETRIEVAL = {"the network": "the network", "retrieval": "what its encoder retrieves"}
_SUBSETS = {"test": "test shapes", "val": "validation shapes"}
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


class Column(NamedTuple):
    """A column of numbers.

    Attributes:
        name: in the table of runs.
        heading: of the column.
        factor: of its numbers where people read them.
        better: 1 where higher is better, -1 where lower is, 0 where neither is.
    """

    name: str
    heading: str
    factor: float = 1.0
    better: int = 0

    def show(self, value: float) -> str:
        """Return a value for people."""
        if pd.isna(value):
            return NOTHING
        shown = self.factor * value
        return f"{shown:.2f}" if 1 <= abs(shown) < 10 else number(shown)


class Ranked(NamedTuple):
    """The settings of runs, ranked by each measure.

    Attributes:
        best: by measure, for each category and, where all settings are in all, their mean.
        compared: by measure, all pairs, as `compare_runs` gives them.
        titles: of the groups that are ranked, by label, for people.
        left_out: settings that are too many to be compared.
        error: why nothing is ranked, "" where something is, or where there is only one setting.
    """

    best: Mapping[str, Sequence[Best]]
    compared: Mapping[str, pd.DataFrame]
    titles: Mapping[str, str]
    left_out: int = 0
    error: str = ""

    def overall(self, measure: str) -> Best | None:
        """Return the ranking that speaks for all runs: of the mean, or the only one."""
        found = self.best.get(measure, ())
        return next((b for b in found if b.over_all), found[0] if len(found) == 1 else None)


def judged(results: Results) -> list[Metric]:
    """Return the measures that settings are ranked by."""
    folded = results.samples.get("folded", pd.Series(dtype=float))
    known = len(folded) > 0 and bool(folded.notna().all())
    return [*results.protocol.metrics, *([FOLDED] if known else [])]


def ranked(results: Results) -> Ranked:
    """Rank the settings of runs; where there is but one, the network and what it retrieves."""
    scored, by = results.scored, results.told_apart_by
    try:
        if (
            by
            and scored.groupby("category")[by].apply(lambda x: len(x.drop_duplicates())).max() > 1
        ):
            return _of_settings(results)
        return _beside_retrieval(results)
    except DataError as error:
        return Ranked({}, {}, {}, error=str(error))


def _of_settings(results: Results) -> Ranked:
    by, measures = results.told_apart_by, judged(results)
    protocol = replace(results.protocol, metrics=tuple(measures))
    scored = results.scored.assign(label=results.scored[by].apply(lambda x: group_label(by, x), 1))
    samples = results.samples.merge(scored[["run", "setup", "label"]], on="run")
    compared = {}
    for measure in measures:
        means = samples.groupby("label", sort=False)[measure.name].mean()
        order = means.sort_values(ascending=not measure.higher_is_better, kind="stable")
        kept = samples[samples["label"].isin(order.index[:_MOST])]
        compared[measure.name] = compare_runs(
            kept, protocol, measure.name, by, settings=results.settings
        )
    found = {measure.name: best(compared[measure.name], measure) for measure in measures}
    titles = {str(row["label"]): results.title(row) for row in scored.to_dict("records")}
    return Ranked(found, compared, titles, max(0, len(titles) - _MOST))


def _beside_retrieval(results: Results) -> Ranked:
    protocol = results.protocol
    if not all(f"feature_retrieval_{m.name}" in results.samples for m in protocol.metrics):
        return Ranked({}, {}, {})
    compared = {
        m.name: compare_with_retrieval(results.samples, protocol, m.name) for m in protocol.metrics
    }
    found = {m.name: best(compared[m.name], m) for m in protocol.metrics}
    return Ranked(found, compared, _RETRIEVAL)


def best_by_metric(results: Results, ranking: Ranked) -> Table | None:
    """Return who is best by each measure, by how much, and whether that is shown."""
    rows = []
    for measure in judged(results):
        # What speaks for all first, then every category.
        of_measure = sorted(ranking.best.get(measure.name, ()), key=lambda b: not b.over_all)
        for found in of_measure:
            first, second = list(found.means)[:2]
            low, high = (number(measure.factor * end) for end in found.interval)
            rows.append(
                [
                    scaled_title(measure) if measure != FOLDED else "folded surface, %",
                    found.category,
                    f"{ranking.titles[first]}: {number(measure.factor * found.means[first])}",
                    f"{ranking.titles[second]}: {number(measure.factor * found.means[second])}",
                    f"{number(measure.factor * found.ahead)} [{low}, {high}]",
                    _verdict(found),
                    str(found.num_shapes),
                ]
            )
    head = ["metric", "category", "best", "next", "difference", "shown?", "test shapes"]
    note = (
        "Differences are means over the same test shapes, in brackets the 95% interval (bootstrap "
        "over the shapes). Shown: the interval leaves out 0 and Wilcoxon's signed-rank test, "
        "corrected for all pairs of settings (Holm), agrees."
    )
    return Table("Best by each metric", head, rows, heads=4, note=note) if rows else None


def _verdict(found: Best) -> str:
    if not found.shown:
        return "not shown" + (": the ranks disagree" if found.interval[0] > 0 else "")
    if found.seeds == 1:
        return "shown for these trained networks"
    if found.agreement < 1:
        return f"shown for the shapes, but only {found.agreement:.0%} of pairs of seeds agree"
    return "shown, and all pairs of seeds agree"


def pairs(results: Results, ranking: Ranked) -> list[Table]:
    """Return every two settings beside each other, a table per measure; shown differences first."""
    tables = []
    for measure in results.protocol.metrics if results.told_apart_by else ():
        if (compared := ranking.compared.get(measure.name)) is None:
            continue
        compared = compared.sort_values("shown", ascending=False, kind="stable")
        rows = [
            [
                f"{row['a']} - {row['b']}",
                row["category"],
                "{} [{}, {}]".format(
                    *(number(measure.factor * row[x]) for x in ("difference", "low", "high"))
                ),
                "< 0.001" if row["p_corrected"] < 0.001 else f"{row['p_corrected']:.2g}",
                f"{row['agreement']:.0%} of {row['seeds_a']} x {row['seeds_b']}",
                "yes" if row["shown"] else "no",
            ]
            for row in compared.to_dict("records")
        ]
        head = ["pair", "category", "difference", "p (Holm)", "pairs of seeds agree", "shown?"]
        tables.append(Table(f"Pair by pair, {scaled_title(measure)}", head, rows, heads=2))
    return tables


def score_columns(protocol: ProtocolDescription) -> list[Column]:
    """Return the columns of a table of scores."""
    main = protocol.main_metric
    columns = [_of_measure(m, m.name, "") for m in protocol.metrics]
    columns.append(_of_measure(main, f"undeformed_{main.name}", "undeformed "))
    return [*columns, Column("effective_templates", "effective\ntemplates")]


def _of_measure(measure: Metric, name: str, words: str) -> Column:
    factor = "" if measure.factor == 1 else f"\nx {measure.factor:g}"
    better = 1 if measure.higher_is_better else -1
    heading = f"{words}{measure.title} {measure.arrow}{factor}"
    return Column(name, heading, measure.factor, better)


def part_columns(protocol: ProtocolDescription) -> list[Column]:
    """Return the columns of a table of the parts of an error, see `budget.error_budget`."""
    parts = [Column(s.name, s.name, 1.0, -1 if s is not SHARES[0] else 0) for s in SHARES]
    return [*parts, Column("total", "total"), Column("regret", "regret\n%", 100.0, -1)]


def mesh_columns() -> list[Column]:
    """Return the columns of a table of deformed meshes."""
    # Density tells why a score is high, and is no fault.
    return [
        Column(name, heading + ("\n%" if factor == 100 else ""), factor, -(name != "density"))
        for name, (heading, _, factor) in QUALITY.items()
    ]


def scores(
    runs: pd.DataFrame,
    protocol: ProtocolDescription,
    keys: Sequence[str],
    *,
    shapes: str = "test shapes",
    columns: Sequence[Column] = (),
) -> Table:
    """Return the mean scores of runs, a row per setting.

    Args:
        runs: a row per run.
        protocol: of the scores.
        keys: columns of them that make a setting; runs that share them are seeds of each other.
        shapes: that they were measured on.
        columns: others than the scores.
    """
    note = "; ".join(f"{m.title}: {m.definition}" for m in protocol.metrics)
    note = f"Of the selected template, deformed. {note}. {protocol.note}." if note else ""
    columns = columns or (score_columns(protocol) if protocol.metrics else [])
    return _numbers(runs, columns, keys, f"Scores, protocol {protocol.name}", note, shapes)


def decomposition(
    runs: pd.DataFrame, protocol: ProtocolDescription, keys: Sequence[str]
) -> Table | None:
    """Return what errors are made of, None where no run has its references."""
    meanings = "; ".join(f"{share.name}: {share.meaning}" for share in SHARES)
    note = f"{meanings}; regret: the selection's share of the total."
    title = f"Error budget, {scaled_title(protocol.main_metric)}"
    return _known(runs, part_columns(protocol), keys, title, note)


def deformed_meshes(runs: pd.DataFrame, keys: Sequence[str]) -> Table | None:
    """Return what deformed meshes are like, None where that was not measured."""
    note = "; ".join(f"{v[0]}: {v[1]}" for k, v in QUALITY.items() if k in runs)
    return _known(runs, mesh_columns(), keys, "Deformed meshes", f"{note}.")


def _known(
    runs: pd.DataFrame, columns: Sequence[Column], keys: Sequence[str], title: str, note: str
) -> Table | None:
    columns = [c for c in columns if c.name in runs and runs[c.name].notna().any()]
    if not columns:
        return None
    return _numbers(runs[runs[columns[0].name].notna()], columns, keys, title, note, "")


def _numbers(
    runs: pd.DataFrame,
    columns: Sequence[Column],
    keys: Sequence[str],
    title: str,
    note: str,
    shapes: str,
) -> Table:
    """Return means over seeds, with deviations; the best of each category is marked."""
    columns = [c for c in columns if c.name in runs and runs[c.name].notna().any()]
    extra = ["num_samples"] if shapes and "num_samples" in runs else []
    names = [*(column.name for column in columns), *extra]
    grouped = runs.groupby(list(keys), sort=False, dropna=False)
    means, spread = grouped[names].mean(), grouped[names].std(ddof=1).add_suffix("_std")
    table = means.join(spread).join(grouped.size().rename("seeds")).reset_index()
    several = bool(table["seeds"].max() > 1)
    shown, common = _told_apart(table, keys)
    over = ", mean ± standard deviation over seeds" if several else ""
    alike = bool(extra) and table["num_samples"].nunique() == 1
    count = f", {table['num_samples'].iloc[0]:.0f} {shapes}" if alike else ""
    heads = [
        ["T" if name == "templates" else name, *(_key(name, x) for x in table[name])]
        for name in shown
    ]
    body = [["seeds", *map(str, table["seeds"])]] if several else []
    body += [[c.heading, *_cells(table, c)] for c in columns]
    if extra and not alike:
        body.append([shapes.replace(" ", "\n"), *(f"{x:.0f}" for x in table["num_samples"])])
    head, *rows = map(list, zip(*heads, *body, strict=True))
    title = f"{title}: {common}{count}{over}" if common or count else f"{title}{over}"
    return Table(title.replace(": , ", ": "), head, rows, len(heads), note)


def _cells(table: pd.DataFrame, column: Column) -> list[Cell]:
    cells = []
    marked = _best_rows(table, column)
    for place, row in enumerate(table.to_dict("records")):
        deviation = row[f"{column.name}_std"]
        text = column.show(row[column.name])
        if not pd.isna(deviation):
            text += f" ± {column.show(deviation)}"
        cells.append(Cell(text, mark=_BEST if place in marked else ""))
    return cells


def _best_rows(table: pd.DataFrame, column: Column) -> set[int]:
    """Return the rows that hold the best of their category; none where all are the same."""
    values = column.better * table[column.name]
    groups = values.groupby(table["category"] if "category" in table else [0] * len(table))
    found: set[int] = set()
    for _, part in groups:
        if column.better and part.nunique() > 1:
            found |= set(part.index[part == part.max()])
    return found


def with_intervals(table: Table, results: Results, ranking: Ranked) -> Table:
    """Return a table of scores with intervals over test shapes, and what is level with the best."""
    keys, by = results.keys, results.told_apart_by
    samples = results.samples.drop(columns=["category"]).merge(
        results.scored[["run", "setup", "category"]], on="run"
    )
    groups = results.scored[keys].drop_duplicates().to_dict("records")
    rows = [list(row) for row in table.rows]
    for measure in results.protocol.metrics:
        column = _of_measure(measure, measure.name, "")
        place = list(table.columns).index(column.heading)
        ends = mean_intervals(samples, measure.name, keys)
        for row, group in zip(rows, groups, strict=True):
            label = group_label(by, [group[name] for name in by])
            found = [
                b for b in ranking.best.get(measure.name, ()) if b.category == group["category"]
            ]
            cell, span = row[place], ends.get(tuple(group[name] for name in keys))
            note = "[{}, {}]".format(*map(column.show, span)) if span else ""
            mark = getattr(cell, "mark", "") or (
                _LEVEL if found and label in found[0].level else ""
            )
            row[place] = Cell(str(cell), note, mark)
    told = f"In brackets the 95% interval over test shapes. {_BEST} marks the best"
    if any(getattr(cell, "mark", "") == _LEVEL for row in rows for cell in row):
        told += f", {_LEVEL} what is not shown to be worse"
    return replace(table, rows=rows, note=f"{told}. {table.note}")


def references(runs: pd.DataFrame, protocol: ProtocolDescription) -> Table | None:
    """Return what scores may be held against, means over categories; None where there is nothing.

    Of runs that have their own it is the range.
    """
    rows, told = [], []
    for shape in CANDIDATES:
        names = [f"{shape}_{m.name}" for m in protocol.metrics]
        if shape and any(name in runs and runs[name].notna().any() for name in names):
            cells = []
            for name, measure in zip(names, protocol.metrics, strict=True):
                values = runs.get(name, pd.Series(float("nan"), runs.index))
                ends = values.groupby(runs["category"]).agg(["min", "max"]).mean()
                low, high = (number(measure.factor * end) for end in ends)
                missing = values.isna().all()
                cells.append(NOTHING if missing else low if low == high else f"{low}\u2013{high}")
            rows.append([SHAPE_TITLES[shape], *cells])
            told.append(f"{SHAPE_TITLES[shape]}: {CANDIDATES[shape]}")
    head = ["", *(_of_measure(m, m.name, "").heading for m in protocol.metrics)]
    note = f"{'; '.join(told)}."
    return (
        Table("References: what scores may be held against", head, rows, note=note)
        if rows
        else None
    )


def selection(results: Results, families: Families) -> Table:
    """Return how each run selects its templates."""
    main = results.protocol.main_metric
    table = selection_table(results.samples, results.protocol, families, main.name)
    columns = {k: v for k, v in _SELECTION.items() if k in table and table[k].notna().any()}
    table = table.merge(results.table[["run", "setup"]], on="run")
    keys, same = _told_apart(table, [*results.keys, "seed"])
    rows = [
        [*(_key(key, row[key]) for key in keys), *(_chosen(row[k], k, main) for k in columns)]
        for row in table.to_dict("records")
    ]
    note = (
        "Effective templates: exp(entropy) of the shares. Regret: how much worse "
        f"{scaled_title(main)} is than with the best of the network's own templates; best "
        "selected: how often that one is the selected one; both also of the templates as they are. "
        "Same family: how often the selected template is of the query's structural family, how "
        "often it would be if the same templates were dealt out at random, and how often there is "
        "one of it."
    )
    head = [*map(_heading, keys)] + list(columns.values())
    return Table(f"Template selection{same and f': {same}'}", head, rows, len(keys), note)


def _chosen(value: float, column: str, measure: Metric) -> str:
    if pd.isna(value):
        return NOTHING
    if "regret" in column:
        return number(measure.factor * value)
    if "share" in column or "family" in column:
        return f"{value:.0%}"
    return f"{value:.0f}" if column == "templates_used" else f"{value:.1f}"


def seeds_agree(samples: pd.DataFrame) -> Table | None:
    """Return how alike the seeds of a setting select, None where each has one.

    Raises:
        DataError: seeds that cannot be held against each other.
    """
    table = selection_stability(samples)
    table = table[table["num_pairs"] > 0]
    if table.empty:
        return None
    keys, same = _told_apart(table, SETTINGS)
    rows = [
        [
            *(_key(key, row[key]) for key in keys),
            *(str(row[key]) for key in ("num_seeds", "num_samples")),
            f"{row['adjusted_rand']:.2f}",
            f"{row['same_template']:.0%}",
        ]
        for row in table.to_dict("records")
    ]
    head = [*map(_heading, keys)]
    head += ["seeds", "test\nsamples", "adjusted\nRand index", "same\ntemplate"]
    note = (
        "Means over pairs of seeds, on the samples that both have. Adjusted Rand index: how alike "
        "they group the samples by their template, 1 for the same groups, 0 for chance. Same "
        "template: share of samples for which both select the very same."
    )
    return Table(f"Agreement of seeds{same and f': {same}'}", head, rows, len(keys), note)


def differing_settings(results: Results) -> tuple[Table | None, list[str]]:
    """Return the settings in which runs differ, a row per run, and those that all share."""
    kept = [key for key in results.settings if decides(key) or key == "seed"]
    shown = results.settings[kept].map(_value)
    different = [key for key in kept if shown[key].nunique() > 1]
    names = [results.name(str(run)) for run in shown.index]
    shared = [f"{key}={shown[key].iloc[0]}" for key in sorted(set(kept) - set(different))]
    if not different:
        return None, shared
    if len(different) > len(names):  # a row per setting, so that the table is not too wide
        head, rows = ["setting", *names], [[key, *shown[key]] for key in different]
    else:
        head = ["run", *different]
        values = shown[different].to_numpy().tolist()
        rows = [[name, *row] for name, row in zip(names, values, strict=True)]
    return Table("Settings that differ", head, rows), shared


def without_results(results: Results) -> Table | None:
    """Return the runs that are not in the results and why, None where all are."""
    rows = [
        [results.name(row["run"]), row["state"], str(row["reason"])]
        for row in results.unscored.to_dict("records")
    ]
    rows += [[name, "damaged", why] for name, why in results.damaged.items()]
    head = ["run", "state", "reason"]
    return Table("Runs without results", head, rows, heads=3) if rows else None


def with_parts(
    runs: pd.DataFrame, samples: pd.DataFrame, protocol: ProtocolDescription
) -> pd.DataFrame:
    """Return runs with the parts of their errors and what their deformed meshes are like."""
    try:
        told = error_budget(samples, protocol)
    except DataError:  # no run has its references, or more is better
        told = mesh_quality(samples)
    return runs.drop(columns=told.columns, errors="ignore").join(told, on="run")


def summary_tables(runs: Sequence[RunFolder], width: int | None = None) -> list[RenderableType]:
    """Return what is printed when trainings have ended: results, with a row per run.

    Each run is shown under the protocol that its training ended with. What all runs have in common
    is in the title. Runs without results have a table of their own.

    Args:
        runs: their folders.
        width: of the terminal, None for no limit; tables that are wider are split.
    """
    by_path = {str(run.path): run for run in runs}
    table = load_runs(runs)
    keys = [*SETTINGS, "seed"]
    if table.duplicated(keys).any() or is_mixed(table, SETTINGS):
        parent = os.path.commonpath(list(table["run"]))
        table["folder"] = [str(Path(run).relative_to(parent)) for run in table["run"]]
        keys.append("folder")
    finished = table[table["state"] == "finished"]
    shown: list[RenderableType] = []
    protocols = [
        described_protocol(by_path[run], name) or ProtocolDescription(name)
        for run, name in zip(finished["run"], finished["protocol"], strict=True)
    ]
    for protocol in dict.fromkeys(protocols):
        part = finished[[each == protocol for each in protocols]]
        columns = [*(score_columns(protocol) if protocol.metrics else [])]
        columns += [Column("effective_templates", "effective\ntemplates")] * (not columns)
        columns += [Column("seconds_per_step", "seconds\nper step")]
        subset = _subset(by_path[path] for path in part["run"])
        found = [scores(part, protocol, keys, shapes=subset, columns=columns)]
        if protocol.metrics:
            known, damaged = _samples(part["run"], protocol)
            told = with_parts(part, pd.concat(known), protocol) if known else part
            found += [
                t
                for t in (
                    references(part, protocol),
                    decomposition(told, protocol, keys),
                    deformed_meshes(told, keys),
                )
                if t is not None
            ]
            shown += [t.rich(width) for t in found] + damaged
        else:
            shown += [t.rich(width) for t in found]
    failed = table[table["state"] != "finished"]
    if len(failed):
        names, common = _told_apart(failed, keys)
        rows = failed[[*names, "state", "reason"]].astype(str).to_numpy().tolist()
        head = [*names, "state", "reason"]
        title = f"Runs without results{common and f': {common}'}"
        shown.append(Table(title, head, rows, len(head)).rich(width))
    return shown


def _samples(
    runs: Iterable[str], protocol: ProtocolDescription
) -> tuple[list[pd.DataFrame], list[RenderableType]]:
    """Return the samples of runs, and a line for each whose are damaged."""
    known: list[pd.DataFrame] = []
    damaged: list[RenderableType] = []
    for run in map(RunFolder, map(Path, runs)):
        if (run.evaluation(protocol.name) / "samples.csv").is_file():
            try:
                known.append(load_samples([run], protocol.name))
            except DataError as error:
                damaged.append(Text(f"{error}\n", style="red"))
    return known, damaged


def _subset(runs: Iterable[RunFolder]) -> str:
    subsets = {(run.status.get("evaluation") or {}).get("subset", "test") for run in runs}
    return _SUBSETS.get(subsets.pop(), "shapes") if len(subsets) == 1 else "shapes"


def _told_apart(table: pd.DataFrame, names: Sequence[str]) -> tuple[list[str], str]:
    """Return the columns that differ, the regime where none does, and what all rows share."""
    shown = [name for name in names if table[name].nunique() > 1] or ["regime"]
    form = {"templates": "T = {}", "seed": "seed {}", "regime": "{}"}
    same = [
        form.get(name, "{}").format(_key(name, table[name].iloc[0]))
        for name in names
        if name not in shown
    ]
    return shown, ", ".join(same)


def _heading(name: str) -> str:
    return "T" if name == "templates" else name


def _key(name: str, value: object) -> Cell:
    """Return a value of what tells runs apart."""
    if name != "regime":
        return Cell(str(value))
    return Cell(regime_title(str(value)), color=REGIME_COLORS.get(str(value), ""))


def _value(value: object) -> str:
    """Return a setting's value as people read it.

    >>> _value(0.00345), _value(12.0), _value(None), _value([3, 3, 3])
    ('0.00345', '12', '-', '3, 3, 3')
    """
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(_value(part) for part in value)
    if value is None or value is pd.NA or (isinstance(value, float) and np.isnan(value)):
        return NOTHING
    if isinstance(value, float):
        return f"{value:.0f}" if value.is_integer() and abs(value) < 1e9 else number(value)
    return str(value)
