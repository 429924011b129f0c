"""How well runs transfer part labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ffd_lightning.analysis.compare import interval, require_columns
from ffd_lightning.analysis.runs import load_samples
from ffd_lightning.analysis.selection import Families
from ffd_lightning.analysis.table import Cell, Table
from ffd_lightning.analysis.wording import SHAPE_TITLES
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.candidates import CANDIDATES
from ffd_lightning.run_folder import RunFolder

PROTOCOL = "parts"
FEWEST = 6
"""Models below which no interval is given: so few show nothing."""

PART = "part_iou_"
"""What names of measures of single parts begin with."""

_RUN = ["run", "category", "regime", "templates", "seed"]


def label_samples(runs: Sequence[RunFolder]) -> pd.DataFrame:
    """Read the samples of runs under protocol parts, as `load_samples` does.

    Raises:
        DataError: a finished run was not evaluated under it, or none at all is there.
    """
    without = [
        r for r in runs if r.finished and not (r.evaluation(PROTOCOL) / "samples.csv").exists()
    ]
    if without:
        raise DataError(
            f"{len(without)} of {len(runs)} runs have not been evaluated under protocol "
            f"{PROTOCOL}, the first of them: ffd evaluate run={without[0].path} "
            f"protocol={PROTOCOL}"
        )
    return load_samples(runs, PROTOCOL)


def part_columns(samples: pd.DataFrame) -> list[str]:
    """Return the names of the measures of single parts, `part_iou_<part>`, the commonest first."""
    columns = [name for name in samples if name.startswith(PART)]
    return sorted(columns, key=lambda name: -int(samples[name].notna().sum()))


def transfer_table(
    samples: pd.DataFrame, measures: str | Sequence[str] = "part_iou"
) -> pd.DataFrame:
    """Return how well the labels of each shape fit the truth, beside those of the shape.

    Intervals are 95% bootstraps over the test shapes (see `compare.compare_runs`): of these trained
    networks, not of other seeds. Several images of a shape are averaged. Measures of a single part
    are over the shapes that have the part; fewer than 6 shapes have no interval (NaN).

    Args:
        samples: as `label_samples` gives them.
        measures: names of measures of the protocol, or `part_columns`.

    Returns:
        A row per run, category of shapes, measure and shape. Columns: `run`, `category`, `regime`,
        `templates`, `seed`, `measure`, `shape` (a key of `CANDIDATES`, "" for the model),
        `num_samples` (models), `mean` with its interval `low`, `high`, and `gain` with `gain_low`,
        `gain_high`: the model's less this shape's, model by model (NaN for the model itself).
        Shares, from 0 to 1. Shapes that were not scored (`evaluation.references=false`) have no
        rows.

    Raises:
        DataError: a measure is missing.
    """
    rows = []
    for measure in [measures] if isinstance(measures, str) else measures:
        require_columns(samples, [*_RUN, "id", measure])
        for values, part in samples.groupby(_RUN, sort=False):
            first = {**dict(zip(_RUN, values, strict=True)), "measure": measure}
            rows += [first | row for row in _of_shapes(part, measure)]
    return pd.DataFrame(rows)


def _of_shapes(part: pd.DataFrame, measure: str) -> list[dict[str, Any]]:
    """Return a row per shape, of one run, category and measure."""
    columns = {shape: f"{shape}_{measure}" if shape else measure for shape in CANDIDATES}
    columns = {shape: name for shape, name in columns.items() if name in part}
    models = part.groupby("id")[list(columns.values())].mean().dropna(axis=1, how="all").dropna()
    if models.empty:
        return []
    shapes = [shape for shape, name in columns.items() if name in models]
    scores = models.to_numpy(float)
    values = np.concatenate([scores, scores[:, :1] - scores], axis=1)
    spans = _intervals([values])
    rows = []
    for k, shape in enumerate(shapes):
        gain = (np.nan,) * 3
        if shape:
            other = k + len(shapes)
            gain = (float(values[:, other].mean()), *spans[other])
        numbers = {"num_samples": len(models), "mean": float(values[:, k].mean())}
        span = dict(
            zip(("low", "high", "gain", "gain_low", "gain_high"), (*spans[k], *gain), strict=True)
        )
        rows.append({"shape": shape, **numbers, **span})
    return rows


def family_table(
    samples: pd.DataFrame, families: Families, measure: str = "part_iou"
) -> pd.DataFrame:
    """Return how well labels are transferred from templates of the query's family, and of others.

    Args:
        samples: as `label_samples` gives them.
        families: as `selection.run_families` reads them; runs that are not in it have no rows.
        measure: a measure of the protocol.

    Returns:
        Three rows per run and category, by column `family`: "same", where the selected template is
        of the query's structural family, "other", and "same - other", their difference. Columns:
        `run`, `category`, `regime`, `templates`, `seed`, `family`, `num_samples` (models), `mean`
        with its 95% interval `low`, `high`, and `gain`, `gain_low`, `gain_high`: the deformed
        template's less that of the same template as it is. Shapes whose family is not known are
        left out; a group without shapes is NaN.
    """
    require_columns(samples, [*_RUN, "id", "family", "template", measure, f"undeformed_{measure}"])
    rows = []
    for values, part in samples.groupby(_RUN, sort=False):
        run, category = values[:2]
        known = part[part["family"].fillna("") != ""]
        of_template = families.get(str(run), {})
        if known.empty or not any(of_template.values()):
            continue
        same = known["template"].map(of_template) == category + "/" + known["family"]
        groups = [_with_gain(known[mask], measure) for mask in (same, ~same)]
        first = dict(zip(_RUN, values, strict=True))
        # Twice the groups, one of them negated: the mean over both strata is their difference.
        for name, strata in (
            ("same", groups[:1]),
            ("other", groups[1:]),
            ("same - other", [2 * groups[0], -2 * groups[1]]),
        ):
            rows.append({**first, "family": name, **_group(strata)})
    return pd.DataFrame(rows)


def _with_gain(part: pd.DataFrame, measure: str) -> NDArray[np.float64]:
    """Return a measure of the model, and that less its template's as it is, per model: (n, 2)."""
    models = part.groupby("id")[[measure, f"undeformed_{measure}"]].mean().to_numpy(float)
    return np.stack([models[:, 0], models[:, 0] - models[:, 1]], axis=1)


def _group(strata: list[NDArray[np.float64]]) -> dict[str, Any]:
    """Return the numbers of a row of `family_table`, from groups of shapes, (n, 2) each."""
    row: dict[str, Any] = {"num_samples": sum(len(group) for group in strata)}
    empty = any(len(group) == 0 for group in strata)
    means = [np.nan] * 2 if empty else np.mean([g.mean(0) for g in strata], axis=0).tolist()
    spans = _intervals(strata)
    for name, mean, (low, high), prefix in zip(
        ("mean", "gain"), means, spans, ("", "gain_"), strict=True
    ):
        row |= {name: mean, f"{prefix}low": low, f"{prefix}high": high}
    return row


def _intervals(strata: list[NDArray[np.float64]]) -> list[tuple[float, float]]:
    """Return the 95% interval of each column's mean, the mean over strata (n, P) of shapes."""
    columns = strata[0].shape[1]
    if min(len(values) for values in strata) < FEWEST:
        return [(np.nan, np.nan)] * columns
    return [interval([values[:, k] for values in strata]) for k in range(columns)]


def label_tables(samples: pd.DataFrame, families: Families, folder: Path) -> list[Table]:
    """Return a table of shapes, one of single parts, and one of families where they are known.

    Args:
        samples: as `label_samples` gives them.
        families: as `run_families` reads them.
        folder: that the runs are in; they are named as seen from it.
    """
    tables = [
        _shapes_table(
            transfer_table(samples, measures),
            folder,
            title,
            f"Means over {over}; of the model (selected template, deformed) with 95% interval; "
            "below the others: how much more the model has.",
        )
        for measures, title, over in (
            ("part_iou", "Part IoU x 100 of transferred labels", "parts, then over test shapes"),
            (part_columns(samples), "IoU x 100 of single parts", "the test shapes that have it"),
        )
    ]
    rows = [
        [
            str(Path(row["run"]).relative_to(folder)),
            row["category"],
            row["family"],
            str(row["num_samples"]),
            _span(row, "mean", "low", "high"),
            _span(row, "gain", "gain_low", "gain_high", "+"),
        ]
        for row in family_table(samples, families).to_dict("records")
    ]
    head = ["run", "category", "template's family", "shapes", "part IoU", "gain"]
    note = "Gain: over the same template as it is. 95% intervals over test shapes."
    title = "Part IoU x 100 by the selected template's structural family"
    return [*tables, Table(title, head, rows, 3, note)] if rows else tables


def _shapes_table(table: pd.DataFrame, folder: Path, title: str, note: str) -> Table:
    """Return a row per run, category and measure, a column per shape."""
    shapes = [s for s in CANDIDATES if s in set(table["shape"])]
    several = table["measure"].nunique() > 1
    rows = []
    for values, part in table.groupby(["run", "category", "measure"], sort=False):
        run, category, measure = map(str, values)
        found = part.set_index("shape").to_dict("index")
        cells = [_shape_cell(found.get(shape), shape) for shape in shapes]
        head = [str(Path(run).relative_to(folder)), category]
        head += [measure.removeprefix(PART)] if several else []
        rows.append([*head, str(found[""]["num_samples"]), *cells])
    heads = ["run", "category", *(["part"] if several else [])]
    titles = [SHAPE_TITLES[shape].replace(" ", "\n") for shape in shapes]
    return Table(title, [*heads, "shapes", *titles], rows, len(heads), note)


def _shape_cell(row: Mapping[Any, Any] | None, shape: str) -> str:
    if row is None:
        return "-"
    if not shape:
        return Cell(f"{100 * row['mean']:.1f}", _interval(row, "low", "high"))
    gain = _span(row, "gain", "gain_low", "gain_high", "+")
    return Cell(f"{100 * row['mean']:.1f}", gain)


def _span(row: Mapping[Any, Any], mean: str, low: str, high: str, sign: str = "") -> str:
    if np.isnan(row[mean]):
        return "-"
    return f"{100 * row[mean]:{sign}.1f} {_interval(row, low, high)}".rstrip()


def _interval(row: Mapping[Any, Any], low: str, high: str) -> str:
    return "" if np.isnan(row[low]) else f"[{100 * row[low]:.1f}, {100 * row[high]:.1f}]"
