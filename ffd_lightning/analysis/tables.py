"""Which tables of results there are, for terminals, the report and notebooks alike."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import pandas as pd
from rich.console import RenderableType

from ffd_lightning.analysis.budget import SHARES, error_budget
from ffd_lightning.analysis.compare import compare, decide, is_mean, leads
from ffd_lightning.analysis.naming import GROUP, differing, name_of, setting_labels
from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.selection import selection_stability, selection_table
from ffd_lightning.analysis.table import Cell, Table, number
from ffd_lightning.analysis.uncertainty import MARGIN
from ffd_lightning.errors import DataError, UserError
from ffd_lightning.evaluation.candidates import CANDIDATES
from ffd_lightning.evaluation.protocols import Metric
from ffd_lightning.palette import REGIME_COLORS, regime_title
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.terminal import counted

_NOTHING = "-"  # where there is no value
_MOST = 12  # settings that are compared: of more, the best


class Column(NamedTuple):
    """A column of numbers; `better` is 1 for higher, -1 for lower, 0 for neither."""

    name: str
    heading: str
    factor: float = 1.0
    better: int = 0
    places: str = ""

    def show(self, value: float) -> str:
        """Return a value for people."""
        if pd.isna(value):
            return _NOTHING
        value *= self.factor
        return format(value, self.places) if self.places else number(value)


# --- which setting is best -----------------------------------------------------------------------


def best(results: Results) -> pd.DataFrame:
    """Return which setting is best by each metric of the protocol, and by how much.

    Returns:
        A row per metric and category, that of the mean over categories first where all settings are
        in all: columns of `compare`, of the best setting `a` against the next, `b`. `measure` is
        the metric's name. Of more than 12 settings, the best 12 of a category are compared.

    Raises:
        DataError: there is nothing to compare; the message says why.
    """
    by = differing(results.scored) or ["regime"]
    titles = {name_of(x, by, long=False): name_of(x, by) for x in results.scored.to_dict("records")}
    rows: list[dict[str, Any]] = []
    for metric in results.protocol.metrics:
        found: dict[str, dict[str, Any]] = {}
        for part in _best_few(results.samples, by, metric):
            compared = compare(replace(results, samples=part), metric.name, by, held=())
            found |= {row["category"]: row for row in leads(compared, metric)}
        rows += sorted(found.values(), key=lambda row: not is_mean(row["category"]))
    if not rows:
        raise DataError("nothing to compare: each category has one setting")
    table = pd.DataFrame(rows).replace({"a": titles, "b": titles})
    # The best beats all if it beats the second, so p needs no correction for the others (Gutmann &
    # Maymin 1987). But of several, the second is the one that happens to be closest.
    table["p_equal"] = (table["p_equal"] * (len(titles) - 1)).clip(upper=1)
    return decide(table)


def _best_few(samples: pd.DataFrame, by: list[str], metric: Metric) -> Iterator[pd.DataFrame]:
    """Yield samples to compare: all, or those of the best settings that all categories have.

    Then of each category those of its own best settings.
    """
    means = samples.groupby([*by, "category"], sort=False)[metric.name].mean().unstack()
    if len(means) <= _MOST:
        yield samples
        return
    means *= 1 if metric.higher_is_better else -1
    setting = pd.MultiIndex.from_frame(samples[by]) if len(by) > 1 else pd.Index(samples[by[0]])
    everywhere = means.mean(axis=1, skipna=False)
    for category, means_there in {"": everywhere, **means}.items():
        best_few = means_there.dropna().nlargest(_MOST).index
        if len(best_few) > 1:
            there = samples["category"] == category if category else True
            yield samples[setting.isin(best_few) & there]


def best_by_metric(results: Results, found: pd.DataFrame) -> Table:
    """Return what `best` has found, and what that decides."""
    rows = []
    for row in found.to_dict("records"):
        metric = results.protocol.metric(row["measure"])
        mean, low, high = (number(metric.factor * row[x]) for x in ("difference", "low", "high"))
        rows.append(
            [
                metric.scaled_title,
                row["category"],
                *(f"{row[x]}: {number(metric.factor * row[f'mean_{x}'])}" for x in "ab"),
                f"{mean} [{low}, {high}]",
                verdict(row),
                str(row["num_samples"]),
            ]
        )
    head = ["metric", "category", "best", "next", "best - next", "verdict", "test shapes"]
    note = (
        "Differences are means over the same test shapes, in brackets the 95% interval over "
        "trainings and shapes, over shapes alone where a setting has one training. Better: there "
        "is a difference, by a t test that is corrected for the rows of the table (Holm). About "
        f"equal: it is less than {MARGIN:.0%} of what lies between the score and the metric's "
        f"floor. Of more than {_MOST} settings the best of a category are compared."
    )
    return Table("Best by each metric", head, rows, heads=4, note=note)


def verdict(row: Mapping[Any, Any]) -> str:
    """Return what a comparison of the best with the next decides, a row of `best`."""
    if not row["trainings"]:
        return "not decided: a setting with one training"
    words = ["better"] * row["differs"] + [f"about equal (within {MARGIN:.0%})"] * row["equal"]
    return ", but ".join(words) or "not decided"


# --- numbers -------------------------------------------------------------------------------------


def scores(results: Results, by: Sequence[str] = GROUP) -> Table:
    """Return the mean scores of runs, a row per setting.

    Runs that share the columns `by` are seeds of each other. With `seed` it is for those who have
    just trained the runs: it says how long a step took.
    """
    protocol, main = results.protocol, results.protocol.main_metric
    columns = [
        *(_of_metric(m, m.name) for m in protocol.metrics),
        *(_of_metric(m, f"without_twins_{m.name}", "without\ncopies ") for m in protocol.metrics),
        _of_metric(main, f"undeformed_{main.name}", "undeformed "),
        Column("effective_templates", "effective\ntemplates"),
        *([Column("seconds_per_step", "seconds\nper step")] if "seed" in by else []),
    ]
    note = "; ".join(f"{m.title}: {m.definition}" for m in protocol.metrics)
    note = f"Of the selected template, deformed; the best is marked. {note}. {protocol.note}."
    if "twin" in results.samples:
        note += " Without copies: less the test shapes of which training had a near copy."
    shapes = "validation shape" if protocol.name.endswith("/val") else "test shape"
    return _numbers(results.scored, columns, by, f"Scores, protocol {protocol.name}", note, shapes)


def _of_metric(metric: Metric, name: str, words: str = "") -> Column:
    factor = "" if metric.factor == 1 else f"\nx {metric.factor:g}"
    better = 1 if metric.higher_is_better else -1
    return Column(name, f"{words}{metric.title} {metric.arrow}{factor}", metric.factor, better)


def decomposition(results: Results, by: Sequence[str] = GROUP) -> Table | None:
    """Return what errors are made of, None where no run has its references."""
    try:
        parts = error_budget(results.samples, results.protocol)
    except DataError:  # there are none, or more is better
        return None
    # The floor tells nothing of a network.
    columns = [Column(name, name, better=0 if name == "floor" else -1) for name in SHARES]
    columns += [Column("total", "total"), Column("regret", "regret\n%", 100.0, -1)]
    note = "; ".join(f"{name}: {meaning}" for name, meaning in SHARES.items())
    note += "; regret: the selection's share of the total."
    title = f"Error budget, {results.protocol.main_metric.scaled_title}"
    runs = results.scored[["run", *GROUP, "seed"]].join(parts, on="run", how="inner")
    return _numbers(runs, columns, by, title, note)


def deformed_meshes(results: Results, by: Sequence[str] = GROUP) -> Table | None:
    """Return what deformed meshes are like, None where that was not measured."""
    columns = [
        Column("folded", "folded\n%", 100.0, -1),
        Column("stretch_95", "stretch", 1.0, -1),
        Column("bending", "bending", 1.0, -1),
    ]
    if "folded" not in results.scored:
        return None
    note = (
        "Folded: share of the surface turned inside out; stretch: factor by which edges become "
        "longer or shorter, 95th percentile; bending: squared second differences of the offsets."
    )
    return _numbers(results.scored, columns, by, "Deformed meshes", note)


def selection(results: Results) -> Table:
    """Return how each run selects its templates."""
    main = results.protocol.main_metric
    columns = [
        Column("effective_templates", "effective\ntemplates", places=".1f"),
        Column("templates_used", "used\ntemplates", places=".0f"),
        Column("top1_share", "top 1\nshare", places=".0%"),
        Column("regret", "regret", main.factor),
        Column("best_share", "best\nselected", places=".0%"),
    ]
    note = (
        "Effective templates: exp(entropy) of the shares. Regret: how much worse "
        f"{main.scaled_title} is than with the best of the network's own templates; best selected: "
        "how often that one is the selected one."
    )
    by = [*GROUP, "seed"]
    return _numbers(selection_table(results), columns, by, "Template selection", note)


def seeds_agree(results: Results) -> Table | None:
    """Return how alike the seeds of a setting select, None where each has one."""
    table = selection_stability(results)
    table = table[table["num_pairs"] > 0]
    if table.empty:
        return None
    columns = [
        Column("num_seeds", "seeds", places=".0f"),
        Column("adjusted_rand", "adjusted\nRand index", places=".2f"),
        Column("same_template", "same\ntemplate", places=".0%"),
    ]
    note = (
        "Means over pairs of seeds, on the samples that both have. Adjusted Rand index: how alike "
        "they group the samples by their template, 1 for the same groups, 0 for chance. Same "
        "template: share of samples for which both select the very same."
    )
    return _numbers(table, columns, GROUP, "Agreement of seeds", note, "test sample")


def _numbers(
    runs: pd.DataFrame,
    columns: Sequence[Column],
    by: Sequence[str],
    title: str,
    note: str,
    shapes: str = "",
) -> Table:
    """Return means over seeds, with deviations; the best of each category is marked.

    Columns that no run has are left out. `shapes` is what `num_samples` counts, one of them, if
    it is to be said. Rows are headed by what differs of `by`, the regime where nothing does; what
    all share is in the title.
    """
    columns = [c for c in columns if c.name in runs and runs[c.name].notna().any()]
    names = [*(column.name for column in columns), *(["num_samples"] if shapes else [])]
    grouped = runs.groupby(list(by), sort=False, dropna=False)
    table = grouped[names].mean().join(grouped[names].std(ddof=1).add_suffix("_std"))
    table = table.join(grouped.size().rename("seeds")).reset_index()
    heads = differing(table, by) or ["regime"]
    body: list[Sequence[str]] = []
    for name in heads:
        cells = list(map(str, table[name]))
        if name == "regime":
            cells = [Cell(regime_title(x), color=REGIME_COLORS.get(x, "")) for x in cells]
        body.append(["T" if name == "templates" else name, *cells])
    if table["seeds"].max() > 1:
        body.append(["seeds", *map(str, table["seeds"])])
        title += ", mean ± standard deviation over seeds"
    body += [[column.heading, *_cells(table, column)] for column in columns]
    common = [name_of(table.iloc[0], [name for name in by if name not in heads])]
    if shapes:
        counts = [f"{count:.0f}" for count in table["num_samples"]]
        if len(set(counts)) > 1:
            body.append([f"{shapes}s".replace(" ", "\n"), *counts])
        else:
            common.append(counted(table["num_samples"].iloc[0], shapes))
    title = ": ".join(filter(None, [title, ", ".join(filter(None, common))]))
    head, *rows = map(list, zip(*body, strict=True))
    return Table(title, head, rows, len(heads), note)


def _cells(table: pd.DataFrame, column: Column) -> list[Cell]:
    values, of_category = table[column.name], table["category"]
    shown, extreme = values.map(column.show), "max" if column.better > 0 else "min"
    best = values.groupby(of_category).transform(extreme).map(column.show)
    differ = shown.groupby(of_category).transform("nunique") > 1
    # Scores that read the same are marked alike.
    marked = (shown == best) & differ & (column.better != 0)
    cells = []
    for text, deviation, mark in zip(shown, table[f"{column.name}_std"], marked, strict=True):
        text += "" if pd.isna(deviation) else f" ± {column.show(deviation)}"
        cells.append(Cell(text, mark="▲" if mark else ""))
    return cells


def references(results: Results) -> Table | None:
    """Return what scores may be held against, means over categories, the range of several runs."""
    runs, metrics = results.scored, results.protocol.metrics
    rows = []
    for shape, meaning in list(CANDIDATES.items())[1:]:
        values = runs.reindex(columns=[f"{shape}_{m.name}" for m in metrics])
        if values.isna().all(axis=None):
            continue
        ends = values.groupby(runs["category"]).agg(["min", "max"]).mean()
        cells = []
        for name, metric in zip(values, metrics, strict=True):
            both = dict.fromkeys(number(x) for x in metric.factor * ends[name])
            cells.append("\u2013".join(both) if values[name].notna().any() else _NOTHING)
        rows.append([meaning, *cells])
    head = ["", *(_of_metric(m, m.name).heading for m in metrics)]
    return Table("References: what scores may be held against", head, rows) if rows else None


# --- settings, and runs without results ----------------------------------------------------------


def differing_settings(results: Results) -> tuple[Table | None, list[str]]:
    """Return in what settings differ, beside category and seed, and what all of them share."""
    values = results.deciding
    different = [key for key in values if values[key].nunique() > 1]
    shared = [
        f"{key}={values[key].iloc[0]}" for key in sorted(set(values) - {*different, "category"})
    ]
    if not different:
        return None, shared
    runs, _ = setting_labels(results.runs[results.runs["state"] != "damaged"])
    values = values.loc[runs.index, different].groupby(runs["label"], sort=False).first()
    values, first = values.rename_axis(None), "run"
    if len(different) > len(values):  # a row per setting, so that the table is not too wide
        values, first = values.T, "setting"
    rows = [list(row) for row in values.itertuples(name=None)]
    return Table("Settings that differ", [first, *values], rows), shared


def without_results(results: Results) -> Table | None:
    """Return the runs that have no scores and why, None where all have."""
    head = ["run", "state", "reason"]
    rows = results.unscored[head].astype(str).to_numpy().tolist()
    return Table("Runs without results", head, rows, heads=3) if rows else None


def summary_tables(runs: Sequence[RunFolder], width: int | None = None) -> list[RenderableType]:
    """Return what is printed when trainings have ended: results, with a row per run.

    Tables that are wider than `width`, if that is given, are split.
    """
    try:
        results = Results.of(runs)
    except UserError as error:  # all of them are damaged
        return [str(error)]
    found, by = [without_results(results)], [*GROUP, "seed"]
    if len(results.samples):
        numbers = [decomposition(results, by), deformed_meshes(results, by)]
        found = [scores(results, by), references(results), *numbers, *found]
    return [table.rich(width) for table in found if table is not None]
