"""Which tables of results there are, for terminals, the report and notebooks alike."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from os.path import commonpath
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from rich.console import RenderableType

from ffd_lightning.analysis.budget import QUALITY, SHARES, error_budget, mesh_quality
from ffd_lightning.analysis.compare import Best, best, compare, compare_with, interval, is_mean
from ffd_lightning.analysis.naming import GROUP, SETTING, differing, name_of, setting_text
from ffd_lightning.analysis.results import Results, own_protocol
from ffd_lightning.analysis.selection import selection_stability, selection_table
from ffd_lightning.analysis.table import Cell, Table, number
from ffd_lightning.analysis.wording import SHAPE_TITLES, scaled_title
from ffd_lightning.errors import ConfigError, DataError, UserError
from ffd_lightning.evaluation.candidates import CANDIDATES
from ffd_lightning.evaluation.protocols import Metric
from ffd_lightning.palette import REGIME_COLORS, regime_title
from ffd_lightning.run_folder import RunFolder, decides

FOLDED = Metric("folded", QUALITY["folded"][1], factor=QUALITY["folded"][2])
"""Judged beside the protocol's measures, which say nothing of how a mesh is deformed."""

NOTHING = "-"
"""What is in a table where there is no value."""

_BEST, _LEVEL = "▲", "≈"
_MOST = 12  # settings that are compared: of more, the best
_RETRIEVAL = {"network": "the network", "feature_retrieval": "what its encoder retrieves"}
_Formats = Mapping[str, tuple[str, Callable[[Any], str]]]  # heading and text, by column
_SELECTION: _Formats = {
    "effective_templates": ("effective\ntemplates", "{:.1f}".format),
    "templates_used": ("used\ntemplates", "{:.0f}".format),
    "top1_share": ("top 1\nshare", "{:.0%}".format),
    "top5_share": ("top 5\nshare", "{:.0%}".format),
    "regret": ("regret\ndeformed", number),
    "best_share": ("best selected\ndeformed", "{:.0%}".format),
    "undeformed_regret": ("regret\nas they are", number),
    "undeformed_best_share": ("best selected\nas they are", "{:.0%}".format),
    "family_agreement": ("same family\nselected", "{:.0%}".format),
    "family_chance": ("same family\nby chance", "{:.0%}".format),
    "family_reachable": ("same family\nexists", "{:.0%}".format),
}
_AGREEMENT: _Formats = {
    "num_seeds": ("seeds", str),
    "num_samples": ("test\nsamples", str),
    "adjusted_rand": ("adjusted\nRand index", "{:.2f}".format),
    "same_template": ("same\ntemplate", "{:.0%}".format),
}


class Column(NamedTuple):
    """A column of the table of runs; `better` is 1 for higher, -1 for lower, 0 for neither."""

    name: str
    heading: str
    factor: float = 1.0
    better: int = 0

    def show(self, value: float) -> str:
        """Return a value for people."""
        scaled = self.factor * value
        if pd.isna(value):
            return NOTHING
        return f"{scaled:.2f}" if 1 <= abs(scaled) < 10 else number(scaled)


# --- which setting is best -----------------------------------------------------------------------


class Ranked(NamedTuple):
    """The settings of runs, ranked by each measure, by its name.

    Attributes:
        best: for each category and, where all settings are in all, their mean.
        compared: all pairs, as `compare` gives them.
        titles: of the settings, by label.
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
        means = [best for best in found if is_mean(best.category)]
        return means[0] if means else found[0] if len(found) == 1 else None


def judged(results: Results) -> list[Metric]:
    """Return the measures that settings are ranked by."""
    known = "folded" in results.samples and results.samples["folded"].notna().all()
    return [*results.protocol.metrics, *([FOLDED] if known else [])]


def ranked(results: Results) -> Ranked:
    """Rank the settings of runs; where there is but one, the network and what it retrieves."""
    measures, by = judged(results), differing(results.scored)
    several = results.scored.drop_duplicates(GROUP)["category"].value_counts().max() > 1
    compared: dict[str, pd.DataFrame] = {}
    titles: dict[str, str] = _RETRIEVAL
    try:
        if by and several:
            rows = results.scored.to_dict("records")
            titles = {name_of(row, by, long=False): name_of(row, by) for row in rows}
            judge = replace(results, protocol=replace(results.protocol, metrics=tuple(measures)))
            for measure in measures:
                means = results.samples.groupby(by, sort=False)[measure.name].mean()
                order = means.sort_values(ascending=not measure.higher_is_better, kind="stable")
                chosen = results.samples.set_index(by).index.isin(order.index[:_MOST])
                kept = replace(judge, samples=results.samples[chosen])
                compared[measure.name] = compare(kept, measure.name, by)
        else:
            measures = list(results.protocol.metrics)
            if not all(f"feature_retrieval_{m.name}" in results.samples for m in measures):
                return Ranked({}, {}, {})
            for measure in measures:
                compared[measure.name] = compare_with(results, measure.name, "feature_retrieval")
    except DataError as error:
        return Ranked({}, {}, {}, error=str(error))
    found = {measure.name: best(compared[measure.name], measure) for measure in measures}
    return Ranked(found, compared, titles, max(0, len(titles) - _MOST))


def best_by_metric(results: Results, ranking: Ranked) -> Table | None:
    """Return who is best by each measure, by how much, and whether that is shown."""
    rows = []
    for measure in judged(results):
        # What speaks for all first, then every category.
        of_measure = ranking.best.get(measure.name, ())
        for found in sorted(of_measure, key=lambda found: not is_mean(found.category)):
            title = scaled_title(measure) if measure != FOLDED else "folded surface, %"
            means = [
                f"{ranking.titles[label]}: {number(measure.factor * mean)}"
                for label, mean in list(found.means.items())[:2]
            ]
            lead = _difference(found.lead, measure), _verdict(found), str(found.lead["num_samples"])
            rows.append([title, found.category, *means, *lead])
    head = ["metric", "category", "best", "next", "difference", "shown?", "test shapes"]
    note = (
        "Differences are means over the same test shapes, in brackets the 95% interval (bootstrap "
        "over the shapes). Shown: the interval leaves out 0 and Wilcoxon's signed-rank test, "
        "corrected for all pairs of settings (Holm), agrees."
    )
    return Table("Best by each metric", head, rows, heads=4, note=note) if rows else None


def _difference(row: Mapping[str, float], measure: Metric) -> str:
    mean, low, high = (number(measure.factor * row[x]) for x in ("difference", "low", "high"))
    return f"{mean} [{low}, {high}]"


def _verdict(found: Best) -> str:
    if not found.shown:
        return "not shown" + (": the ranks disagree" if found.lead["low"] > 0 else "")
    if found.seeds == 1:
        return "shown for these trained networks"
    if (agreement := found.lead["agreement"]) == 1:
        return "shown, and all pairs of seeds agree"
    return f"shown for the shapes, but only {agreement:.0%} of pairs of seeds agree"


def pairs(results: Results, ranking: Ranked) -> list[Table]:
    """Return every two settings beside each other, a table per measure; shown differences first."""
    tables = []
    for measure in results.protocol.metrics if ranking.titles != _RETRIEVAL else ():
        if (compared := ranking.compared.get(measure.name)) is None:
            continue
        compared = compared.sort_values("shown", ascending=False, kind="stable")
        rows = [
            [
                f"{row['a']} - {row['b']}",
                row["category"],
                _difference(row, measure),
                "< 0.001" if row["p_corrected"] < 0.001 else f"{row['p_corrected']:.2g}",
                f"{row['agreement']:.0%} of {row['seeds_a']} x {row['seeds_b']}",
                "yes" if row["shown"] else "no",
            ]
            for row in compared.to_dict("records")
        ]
        head = ["pair", "category", "difference", "p (Holm)", "pairs of seeds agree", "shown?"]
        tables.append(Table(f"Pair by pair, {scaled_title(measure)}", head, rows, heads=2))
    return tables


# --- numbers -------------------------------------------------------------------------------------


def scores(results: Results, ranking: Ranked | None = None, by: Sequence[str] = GROUP) -> Table:
    """Return the mean scores of runs, a row per setting.

    Args:
        results: of the runs.
        ranking: adds intervals over test shapes, and marks what is level with the best.
        by: columns that make a row; runs that share them are seeds of each other. With `seed` it
            is for those who have just trained the runs: it says how long a step took.
    """
    protocol, main = results.protocol, results.protocol.main_metric
    columns = [
        *(_of_measure(m, m.name) for m in protocol.metrics),
        *(_of_measure(m, f"without_twins_{m.name}", "without\ncopies ") for m in protocol.metrics),
        _of_measure(main, f"undeformed_{main.name}", "undeformed "),
        Column("effective_templates", "effective\ntemplates"),
        *([Column("seconds_per_step", "seconds\nper step")] if "seed" in by else []),
    ]
    notes: dict[str, list[tuple[str, bool]]] = {}
    note = "; ".join(f"{m.title}: {m.definition}" for m in protocol.metrics)
    note = f"Of the selected template, deformed. {note}. {protocol.note}."
    if "twin" in results.samples:
        note += " Without copies: less the test shapes of which training had a near copy."
    if ranking is not None:
        for column, measure in zip(columns, protocol.metrics, strict=False):
            notes[column.name] = _intervals(results, ranking, column, measure)
        level = any(is_level for column in notes.values() for _, is_level in column)
        marks = f", {_LEVEL} what is not shown to be worse" if level else ""
        start = "In brackets the 95% interval over test shapes."
        note = f"{start} {_BEST} marks the best{marks}. {note}"
    shapes = "validation shapes" if protocol.name.endswith("/val") else "test shapes"
    title = f"Scores, protocol {protocol.name}"
    return _numbers(results.scored, columns, by, title, note, shapes, notes)


def _of_measure(measure: Metric, name: str, words: str = "") -> Column:
    factor = "" if measure.factor == 1 else f"\nx {measure.factor:g}"
    better = 1 if measure.higher_is_better else -1
    return Column(name, f"{words}{measure.title} {measure.arrow}{factor}", measure.factor, better)


def _intervals(
    results: Results, ranking: Ranked, column: Column, measure: Metric
) -> list[tuple[str, bool]]:
    """Return the interval of each setting's mean, and whether it is level with the best."""
    by = differing(results.scored)
    level = {best.category: best.level for best in ranking.best.get(measure.name, ())}
    category = results.scored.set_index("run")["category"]
    samples = results.samples.assign(trained_on=results.samples["run"].map(category))
    found = []
    for (trained_on, *_), part in samples.groupby(["trained_on", *SETTING], sort=False):
        values = part.groupby(["category", "id"])[column.name].mean().dropna().to_numpy(float)
        ends = map(column.show, interval([values])) if len(values) > 1 else ()
        text = f"[{', '.join(ends)}]" if len(values) > 1 else ""
        label = name_of(part.iloc[0], by, long=False)
        found.append((text, label in level.get(trained_on, ())))
    return found


def decomposition(results: Results, by: Sequence[str] = GROUP) -> Table | None:
    """Return what errors are made of, None where no run has its references."""
    try:
        parts = error_budget(results.samples, results.protocol)
    except DataError:  # there are none, or more is better
        return None
    # The floor tells nothing of a network.
    columns = [Column(s.name, s.name, better=0 if s is SHARES[0] else -1) for s in SHARES]
    columns += [Column("total", "total"), Column("regret", "regret\n%", 100.0, -1)]
    note = "; ".join(f"{share.name}: {share.meaning}" for share in SHARES)
    note += "; regret: the selection's share of the total."
    title = f"Error budget, {scaled_title(results.protocol.main_metric)}"
    runs = results.scored[["run", *GROUP, "seed"]].join(parts, on="run", how="inner")
    return _numbers(runs, columns, by, title, note)


def deformed_meshes(results: Results, by: Sequence[str] = GROUP) -> Table | None:
    """Return what deformed meshes are like, None where that was not measured."""
    samples = results.samples
    try:  # of what has its references, as the error's parts
        quality = error_budget(samples, results.protocol)
    except DataError:
        quality = mesh_quality(samples)
    columns = [
        # Density tells why a score is high, and is no fault.
        Column(name, heading + ("\n%" if factor == 100 else ""), factor, -(name != "density"))
        for name, (heading, _, factor) in QUALITY.items()
        if name in quality and quality[name].notna().any()
    ]
    if not columns:
        return None
    runs = results.scored[["run", *GROUP, "seed"]].join(quality, on="run")
    runs = runs[runs[columns[0].name].notna()]
    note = "; ".join(f"{v[0]}: {v[1]}" for k, v in QUALITY.items() if k in quality)
    return _numbers(runs, columns, by, "Deformed meshes", f"{note}.")


def _numbers(
    runs: pd.DataFrame,
    columns: Sequence[Column],
    by: Sequence[str],
    title: str,
    note: str,
    shapes: str = "",
    notes: Mapping[str, Sequence[tuple[str, bool]]] | None = None,
) -> Table:
    """Return means over seeds, with deviations; the best of each category is marked.

    Columns that no run has are left out. `shapes` is what `num_samples` counts, if it is to be
    said; `notes` are of a column: what is below each cell, and whether it is level with the best.
    """
    columns = [c for c in columns if c.name in runs and runs[c.name].notna().any()]
    names = [*(column.name for column in columns), *(["num_samples"] if shapes else [])]
    grouped = runs.groupby(list(by), sort=False, dropna=False)
    table = grouped[names].mean().join(grouped[names].std(ddof=1).add_suffix("_std"))
    table = table.join(grouped.size().rename("seeds")).reset_index()
    body, common = [], ""
    if table["seeds"].max() > 1:
        body.append(["seeds", *map(str, table["seeds"])])
        title += ", mean ± standard deviation over seeds"
    for column in columns:
        below = (notes or {}).get(column.name) or [("", False)] * len(table)
        body.append([column.heading, *_cells(table, column, below)])
    if shapes:
        counts = [f"{count:.0f}" for count in table["num_samples"]]
        if len(set(counts)) > 1:
            body.append([shapes.replace(" ", "\n"), *counts])
        else:
            common = f"{counts[0]} {shapes}"
    return _table(title, table, by, body, note, common)


def _cells(table: pd.DataFrame, column: Column, below: Sequence[tuple[str, bool]]) -> list[Cell]:
    values = column.better * table[column.name]
    of_category = values.groupby(table["category"])
    is_best = (values == of_category.transform("max")) & (of_category.transform("nunique") > 1)
    cells = []
    for row, marked, (note, level) in zip(table.to_dict("records"), is_best, below, strict=True):
        deviation = row[f"{column.name}_std"]
        text = column.show(row[column.name])
        text += "" if pd.isna(deviation) else f" ± {column.show(deviation)}"
        mark = _BEST if marked and column.better else _LEVEL if level else ""
        cells.append(Cell(text, note, mark))
    return cells


def references(results: Results) -> Table | None:
    """Return what scores may be held against, means over categories, the range of several runs."""
    runs, measures = results.scored, results.protocol.metrics
    rows, meanings = [], []
    for shape in list(CANDIDATES)[1:]:
        values = runs.reindex(columns=[f"{shape}_{m.name}" for m in measures])
        if values.isna().all(axis=None):
            continue
        ends = values.groupby(runs["category"]).agg(["min", "max"]).mean()
        cells = []
        for name, measure in zip(values, measures, strict=True):
            both = dict.fromkeys(number(x) for x in measure.factor * ends[name])
            cells.append("\u2013".join(both) if values[name].notna().any() else NOTHING)
        rows.append([SHAPE_TITLES[shape], *cells])
        meanings.append(f"{SHAPE_TITLES[shape]}: {CANDIDATES[shape]}")
    head = ["", *(_of_measure(m, m.name).heading for m in measures)]
    title, note = "References: what scores may be held against", f"{'; '.join(meanings)}."
    return Table(title, head, rows, note=note) if rows else None


def selection(results: Results) -> Table:
    """Return how each run selects its templates."""
    main = results.protocol.main_metric
    table = selection_table(results)
    table = table.assign(**table.filter(like="regret").mul(main.factor))
    note = (
        "Effective templates: exp(entropy) of the shares. Regret: how much worse "
        f"{scaled_title(main)} is than with the best of the network's own templates; best "
        "selected: how often that one is the selected one; both also of the templates as they are. "
        "Same family: how often the selected template is of the query's structural family, how "
        "often it would be if the same templates were dealt out at random, and how often there is "
        "one of it."
    )
    body = _formatted(table, _SELECTION)
    return _table("Template selection", table, [*GROUP, "seed"], body, note)


def seeds_agree(results: Results) -> Table | None:
    """Return how alike the seeds of a setting select, None where each has one."""
    table = selection_stability(results)
    table = table[table["num_pairs"] > 0]
    if table.empty:
        return None
    note = (
        "Means over pairs of seeds, on the samples that both have. Adjusted Rand index: how alike "
        "they group the samples by their template, 1 for the same groups, 0 for chance. Same "
        "template: share of samples for which both select the very same."
    )
    return _table("Agreement of seeds", table, GROUP, _formatted(table, _AGREEMENT), note)


def _formatted(table: pd.DataFrame, columns: _Formats) -> list[list[str]]:
    """Return heading and cells of the columns that have values."""
    return [
        [heading, *(NOTHING if pd.isna(value) else text(value) for value in table[name])]
        for name, (heading, text) in columns.items()
        if name in table and table[name].notna().any()
    ]


def _table(
    title: str,
    table: pd.DataFrame,
    by: Sequence[str],
    body: Sequence[Sequence[str]],
    note: str,
    common: str = "",
) -> Table:
    """Return a table headed by what differs of `by`, the regime where nothing does.

    What all rows share, and what else they have in `common`, is in its title. The other columns
    are `body`, a heading and cells each.
    """
    kept = differing(table, by) or ["regime"]
    heads: list[Sequence[str]] = []
    for name in kept:
        cells = list(map(str, table[name]))
        if name == "regime":
            cells = [Cell(regime_title(x), color=REGIME_COLORS.get(x, "")) for x in cells]
        heads.append(["T" if name == "templates" else name, *cells])
    head, *rows = map(list, zip(*heads, *body, strict=True))
    shared = name_of(table.iloc[0], [name for name in by if name not in kept])
    title = ": ".join(filter(None, [title, ", ".join(filter(None, [shared, common]))]))
    return Table(title, head, rows, len(heads), note)


# --- settings, and runs without results ----------------------------------------------------------


def differing_settings(results: Results) -> tuple[Table | None, list[str]]:
    """Return the settings in which runs differ, a row per run, and those that all share."""
    kept = [key for key in results.settings if decides(key)]
    values = results.settings[kept].map(setting_text)
    different = [key for key in kept if values[key].nunique() > 1]
    shared = [f"{key}={values[key].iloc[0]}" for key in sorted(set(kept) - set(different))]
    if not different:
        return None, shared
    values, first = values[different], "run"
    if len(different) > len(values):  # a row per setting, so that the table is not too wide
        values, first = values.T, "setting"
    rows = [list(row) for row in values.itertuples(name=None)]
    return Table("Settings that differ", [first, *values], rows), shared


def without_results(*results: Results) -> Table | None:
    """Return the runs that have no scores and why, None where all have."""
    head = ["run", "state", "reason"]
    rows = [row for each in results for row in each.unscored[head].astype(str).to_numpy().tolist()]
    return Table("Runs without results", head, rows, heads=3) if rows else None


def summary_tables(runs: Sequence[RunFolder], width: int | None = None) -> list[RenderableType]:
    """Return what is printed when trainings have ended: results, with a row per run.

    Each run is shown under the protocol that its training ended with. Tables that are wider than
    `width`, if that is given, are split.
    """
    groups: dict[str, list[RunFolder]] = {}
    for run in runs:
        try:
            name = own_protocol(run)
        except ConfigError:
            name = "paper"
        groups.setdefault(name, []).append(run)
    folder, by = Path(commonpath([run.path for run in runs])), [*GROUP, "seed"]
    found: list[Table | None] = []
    read = []
    for name, part in groups.items():
        try:
            results = Results.of(part, name, folder)
        except UserError as error:  # all of them are damaged
            found.append(Table(str(error), [], []))
            continue
        read.append(results)
        if len(results.samples):
            found += [scores(results, by=by), references(results)]
            found += [decomposition(results, by), deformed_meshes(results, by)]
    found.append(without_results(*read))
    return [table.rich(width) for table in found if table is not None]
