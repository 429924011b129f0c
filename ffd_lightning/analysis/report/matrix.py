"""Section: one table of all numbers of all settings, and of what they may be held against."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import pandas as pd

from ffd_lightning.analysis.budget import QUALITY, SHARES, error_budget, mesh_quality
from ffd_lightning.analysis.ranking import mean_intervals
from ffd_lightning.analysis.report.elements import NOTHING, Cell, Table, cell
from ffd_lightning.analysis.report.standing import Standing
from ffd_lightning.analysis.report.sweep import Sweep, plain, told_apart
from ffd_lightning.analysis.sentences import group_label
from ffd_lightning.analysis.wording import SHAPE_TITLES, measure_title, number
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import Measure, ProtocolDescription
from ffd_lightning.evaluation.references import SHAPES
from ffd_lightning.palette import REGIME_COLORS, regime_title

_REFERENCES = [shape for shape in SHAPES if shape]  # what stands below the settings


class Column(NamedTuple):
    """A column of numbers.

    Attributes:
        name: in the table of runs.
        heading: of the column.
        factor: of its numbers where people read them.
        better: 1 where higher is better, -1 where lower is, 0 where neither is.
        group: words above this and its neighbours.
    """

    name: str
    heading: str
    factor: float = 1.0
    better: int = 0
    group: str = ""

    def show(self, value: float) -> str:
        """Return a value for people."""
        if pd.isna(value):
            return NOTHING
        shown = self.factor * value
        return f"{shown:.2f}" if 1 <= abs(shown) < 10 else number(shown)


@dataclass(frozen=True)
class Matrix:
    """The table.

    Attributes:
        protocol: of the scores.
        table: of them; None where no run has any.
        note: what a number is the mean of.
        factors: what numbers are multiplied by, where it is the same for all measures.
        lacking: how many runs have no results.
        columns: headings and what they mean.
        marked: the best of columns are marked; `level`: so is what is not shown to be worse.
    """

    key: ClassVar[str] = "matrix"
    title: ClassVar[str] = "All numbers"

    protocol: ProtocolDescription
    table: Table | None = None
    note: str = ""
    factors: str = ""
    lacking: int = 0
    columns: Sequence[tuple[str, str]] = ()
    marked: bool = False
    level: bool = False


def matrix(sweep: Sweep, standing: Standing) -> Matrix:
    """Return all numbers of all settings: means over seeds, with deviations and intervals."""
    if sweep.scored.empty:
        return Matrix(sweep.protocol)
    runs, columns = _numbers(sweep)
    grouped = runs.groupby(sweep.keys, sort=False)
    names = [column.name for column in columns]
    means = grouped[[*names, "num_samples"]].mean().join(grouped.size().rename("num_seeds"))
    means = means.join(grouped[names].std(ddof=1).add_suffix("_std")).reset_index()
    several = bool(means["num_seeds"].max() > 1)
    shown, same = told_apart(means if several else runs, sweep.keys + ["seed"] * (not several))
    if not several:
        means["seed"] = runs["seed"].to_numpy()  # a row per run, in the same order
    alike = runs["num_samples"].nunique() == 1  # then the top of the page has it
    cells = [_column(sweep, standing, means, column) for column in columns]
    rows = [
        [
            *(_key_cell(row, key) for key in shown),
            *([str(row["num_seeds"])] if several else []),
            *(column[place] for column in cells),
            *([] if alike else [cell(row["num_samples"])]),
        ]
        for place, row in enumerate(means.to_dict("records"))
    ]
    keys = [*map(plain, shown), *(["seeds"] if several else [])]
    head = [*keys, *(c.heading for c in columns), *([] if alike else ["test\nshapes"])]
    over = ", mean ± standard deviation over seeds" if several else ""
    return Matrix(
        sweep.protocol,
        Table("All numbers", head, rows, _below(sweep, len(head), len(keys)),
              groups=_groups(columns, len(keys))),
        f"means over the test shapes of a run{over}{same}",
        _factors(sweep.protocol),
        len(sweep.unscored) + len(sweep.damaged),
        _meanings(sweep.protocol, columns),
        any(isinstance(c, Cell) and c.best for row in rows for c in row),
        any(isinstance(c, Cell) and c.level for row in rows for c in row),
    )  # fmt: skip


def _numbers(sweep: Sweep) -> tuple[pd.DataFrame, list[Column]]:
    """Return a row per run with all its numbers, and the columns that are shown."""
    protocol, main, runs = sweep.protocol, sweep.protocol.main_measure, sweep.scored
    columns = [_measure_column(m, m.name, "", protocol) for m in protocol.measures]
    columns += [_measure_column(main, f"undeformed_{main.name}", "undeformed ", protocol)]
    columns += [Column("effective_templates", "effective\ntemplates")]
    try:
        told = error_budget(sweep.samples, protocol)
    except DataError:  # no run has its references, or more is better
        told = mesh_quality(sweep.samples)
    runs = runs.join(told, on="run")
    group = f"parts of {measure_title(main.name)}"
    columns += [Column(s.name, s.name, 1.0, -1, group) for s in SHARES[1:]]
    columns += [Column("regret", "regret\n%", 100.0, -1, group)]
    for name, (heading, _, factor) in QUALITY.items():
        unit = "\n%" if factor == 100 else ""
        better = 0 if name == "density" else -1  # which tells why a score is high, not a fault
        columns.append(Column(name, heading + unit, factor, better, "deformed mesh"))
    known = [c for c in columns if c.name in runs and bool(runs[c.name].notna().any())]
    return runs, known


def _measure_column(
    measure: Measure, name: str, words: str, protocol: ProtocolDescription
) -> Column:
    factor = "" if _factors(protocol) or measure.factor == 1 else f"\nx {measure.factor:g}"
    title = f"{words}{measure_title(measure.name)} {measure.arrow}"
    better = 1 if measure.higher_is_better else -1
    return Column(name, title.replace(" ", "\n", 1) if words else title + factor,
                  measure.factor, better)  # fmt: skip


def _factors(protocol: ProtocolDescription) -> str:
    """Return what all measures are multiplied by, "" where they differ."""
    factors = {m.factor for m in protocol.measures}
    return f"x {factors.pop():g}" if len(factors) == 1 and factors != {1.0} else ""


def _column(sweep: Sweep, standing: Standing, means: pd.DataFrame, column: Column) -> list[Cell]:
    """Return the cells of a column: the best of each category is marked."""
    measured = column.name in {m.name for m in sweep.protocol.measures}
    samples = sweep.samples.drop(columns=["category"]).merge(
        sweep.scored[["run", "setup", "category"]], on="run"
    )
    intervals = mean_intervals(samples, column.name, sweep.keys) if measured else {}
    best = _best(means, column)
    cells = []
    for place, row in enumerate(means.to_dict("records")):
        deviation = row[f"{column.name}_std"]
        spread = "" if pd.isna(deviation) else f"± {column.show(deviation)}"
        ends = intervals.get(tuple(row[key] for key in sweep.keys))
        interval = "" if ends is None else "[{}, {}]".format(*map(column.show, ends))
        text, note = column.show(row[column.name]), spread
        if measured:
            text, note = f"{text} {spread}".rstrip(), interval
        level = place not in best and _is_level(sweep, standing, column, row)
        cells.append(Cell(text, note, place in best, level))
    return cells


def _best(means: pd.DataFrame, column: Column) -> set[int]:
    """Return the rows that hold the best of their category; none where all are the same."""
    if not column.better:
        return set()
    values = column.better * means[column.name]
    found: set[int] = set()
    for _, part in values.groupby(means["category"]):
        if part.nunique() > 1:
            found |= set(part.index[part == part.max()])
    return found


def _is_level(sweep: Sweep, standing: Standing, column: Column, row: Mapping[Any, Any]) -> bool:
    """Tell whether a setting is not shown to be worse than the best of its category."""
    by = sweep.told_apart_by
    ranking = standing.of_category(column.name, str(row["category"]))
    return (
        bool(by) and ranking is not None and group_label(by, [row[k] for k in by]) in ranking.level
    )


def _key_cell(row: Mapping[Any, Any], key: str) -> Cell:
    if key != "regime":
        return Cell(str(row[key]))
    return Cell(regime_title(row[key]), color=REGIME_COLORS.get(row[key], ""))


def _below(sweep: Sweep, width: int, keys: int) -> list[list[Cell]]:
    """Return a row for each reference: its mean, or the range of runs that have their own."""
    measures, rows = sweep.protocol.measures, []
    for shape in _REFERENCES:
        names = [f"{shape}_{m.name}" for m in measures]
        if names[0] in sweep.scored:
            cells = [_span(sweep, n, m.factor) for n, m in zip(names, measures, strict=True)]
            meaning = Cell(SHAPES[shape], span=width - keys - len(cells))
            rows.append([Cell(SHAPE_TITLES[shape]), *[Cell("")] * (keys - 1), *cells, meaning])
    return rows


def _span(sweep: Sweep, name: str, factor: float) -> Cell:
    values = sweep.scored.groupby("category")[name]
    low, high = (number(factor * ends.mean()) for ends in (values.min(), values.max()))
    return Cell(low if low == high else f"{low}\u2013{high}")


def _groups(columns: Sequence[Column], keys: int) -> list[tuple[str, int]]:
    """Return what stands above the headings, and over how many of them."""
    found: list[tuple[str, int]] = [("", keys)]
    for column in columns:
        words, count = found[-1]
        if words == column.group:
            found[-1] = words, count + 1
        else:
            found.append((column.group, 1))
    return found if any(words for words, _ in found) else []


def _meanings(protocol: ProtocolDescription, columns: Sequence[Column]) -> list[tuple[str, str]]:
    """Return what the columns are, for people."""
    known = {column.name for column in columns}
    told: list[tuple[str, str]] = [(measure_title(m.name), m.definition) for m in protocol.measures]
    if "effective_templates" in known:
        told.append(
            ("effective templates", "exp(entropy) of how often each is selected, from 1 to T")
        )
    told += [(s.name, s.meaning) for s in SHARES if s.name in known]
    if "regret" in known:
        told.append(("regret", "the selection's part of the whole"))
    return told + [(v[0], v[1].removesuffix(", %")) for k, v in QUALITY.items() if k in known]
