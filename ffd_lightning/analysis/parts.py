"""How well runs transfer part labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ffd_lightning.analysis.compare import interval, require_columns
from ffd_lightning.analysis.results import Families, Results
from ffd_lightning.analysis.table import Cell, Table
from ffd_lightning.analysis.wording import SHAPE_TITLES
from ffd_lightning.evaluation.candidates import CANDIDATES

PROTOCOL = "parts"
FEWEST = 6
"""Shapes below which no interval is given: so few show nothing."""

PART = "part_iou_"
"""What names of measures of single parts begin with."""

_RUN = ["run", "category", "regime", "templates", "seed"]


def part_columns(samples: pd.DataFrame) -> list[str]:
    """Return the names of the measures of single parts, `part_iou_<part>`, the commonest first."""
    columns = [name for name in samples if name.startswith(PART)]
    return sorted(columns, key=lambda name: -int(samples[name].notna().sum()))


def transfer_table(
    samples: pd.DataFrame, measures: str | Sequence[str] = "part_iou"
) -> pd.DataFrame:
    """Return how well the labels of each shape fit the truth, beside those of the network.

    Intervals are 95% bootstraps over the test shapes (see `compare.compare`): of these trained
    networks, not of other seeds. Several images of a shape are averaged. Measures of a single part
    are over the shapes that have the part; fewer than 6 shapes have no interval (NaN).

    Args:
        samples: of `Results` under protocol parts.
        measures: names of measures of the protocol, or `part_columns`.

    Returns:
        A row per run, category of shapes, measure and shape. Columns: `run`, `category`, `regime`,
        `templates`, `seed`, `measure`, `shape` (a key of `references.CANDIDATES`, "" for the
        network), `num_samples` (test shapes), `mean` with its interval `low`, `high`, and `gain`
        with `gain_low`, `gain_high`: the network's less this shape's, one by one (NaN for the
        network itself). Shares, from 0 to 1. What was not scored (`evaluation.references=false`)
        has no rows.

    Raises:
        DataError: a measure is missing.
    """
    rows = []
    for measure in [measures] if isinstance(measures, str) else measures:
        require_columns(samples, [measure])
        columns = {shape: f"{shape}_{measure}" if shape else measure for shape in CANDIDATES}
        columns = {shape: name for shape, name in columns.items() if name in samples}
        for values, part in samples.groupby(_RUN, sort=False):
            scores = part.groupby("id")[list(columns.values())].mean()
            scores = scores.dropna(axis=1, how="all").dropna()
            own = scores[measure] if measure in scores else scores[:0]
            for shape, name in columns.items():
                if len(own) and name in scores:
                    row = {**dict(zip(_RUN, values, strict=True)), "measure": measure}
                    row |= {"shape": shape, "num_samples": len(own)}
                    row |= _mean([scores[name].to_numpy(float)])
                    gain = _mean([(own - scores[name]).to_numpy(float)] if shape else [], "gain_")
                    rows.append(row | gain)
    return pd.DataFrame(rows)


def family_table(
    samples: pd.DataFrame, families: Families, measure: str = "part_iou"
) -> pd.DataFrame:
    """Return how well labels are transferred from templates of the query's family, and of others.

    Args:
        samples: of `Results` under protocol parts.
        families: of `Results`; runs that are not in it have no rows.
        measure: a measure of the protocol.

    Returns:
        Three rows per run and category, by column `family`: "same", where the selected template is
        of the query's structural family, "other", and "same - other", their difference. Columns:
        `run`, `category`, `regime`, `templates`, `seed`, `family`, `num_samples` (test shapes),
        `mean` with its 95% interval `low`, `high`, and `gain`, `gain_low`, `gain_high`: the
        deformed template's less that of the same template as it is. Shapes whose family is not
        known are left out; a group without shapes is NaN.
    """
    require_columns(samples, ["family", "template", measure, f"undeformed_{measure}"])
    rows = []
    for values, part in samples.groupby(_RUN, sort=False):
        run, category = values[:2]
        known = part[part["family"].fillna("") != ""]
        if known.empty or not families.get(run):
            continue
        same = known["template"].map(families[run]) == category + "/" + known["family"]
        scores, gains = [], []
        for mask in (same, ~same):
            means = known[mask].groupby("id")[[measure, f"undeformed_{measure}"]].mean()
            scores.append(means[measure].to_numpy(float))
            gains.append((means[measure] - means[f"undeformed_{measure}"]).to_numpy(float))
        first = dict(zip(_RUN, values, strict=True))
        # Twice the groups, one of them negated: the mean over both strata is their difference.
        for name, weights in (("same", (1,)), ("other", (0, 1)), ("same - other", (2, -2))):
            strata, of_gain = (
                [w * x for w, x in zip(weights, groups, strict=False) if w]
                for groups in (scores, gains)
            )
            row = {**first, "family": name, "num_samples": sum(map(len, strata))}
            rows.append(row | _mean(strata) | _mean(of_gain, "gain_"))
    return pd.DataFrame(rows)


def _mean(strata: Sequence[NDArray[np.float64]], prefix: str = "") -> dict[str, float]:
    """Return a mean over strata of shapes, (n,) each, with its interval."""
    counts = [len(values) for values in strata]
    mean = float(np.mean([x.mean() for x in strata])) if all(counts) and counts else np.nan
    low, high = interval(strata) if min(counts, default=0) >= FEWEST else (np.nan, np.nan)
    return {prefix.rstrip("_") or "mean": mean, f"{prefix}low": low, f"{prefix}high": high}


def label_tables(results: Results) -> list[Table]:
    """Return a table of shapes, one of single parts, and one of families where they are known.

    Args:
        results: under protocol parts.
    """
    results.check_scored()
    samples, tables = results.samples, []
    for measures, title, over in (
        ("part_iou", "Part IoU x 100 of transferred labels", "parts, then over test shapes"),
        (part_columns(samples), "IoU x 100 of single parts", "the test shapes that have it"),
    ):
        table = transfer_table(samples, measures)
        shapes = [shape for shape in CANDIDATES if shape in set(table["shape"])]
        rows = []
        for values, part in table.groupby(["run", "category", "measure"], sort=False):
            by_shape = part.set_index("shape").to_dict("index")
            heads = [*map(str, values[:2]), str(values[2]).removeprefix(PART)]
            cells = [_cell(by_shape.get(shape), shape) for shape in shapes]
            rows.append([*heads, str(by_shape[""]["num_samples"]), *cells])
        titles = [SHAPE_TITLES[shape].replace(" ", "\n") for shape in shapes]
        note = (
            f"Means over {over}; of the network (selected template, deformed) with 95% interval; "
            "below the others: how much more the network has."
        )
        tables.append(Table(title, ["run", "category", "part", "shapes", *titles], rows, 3, note))
    rows = [
        [
            *(row[name] for name in ("run", "category", "family")),
            str(row["num_samples"]),
            f"{_number(row, 'mean')} {_span(row)}".rstrip(),
            f"{_number(row, 'gain', '+')} {_span(row, 'gain_')}".rstrip(),
        ]
        for row in family_table(samples, results.families).to_dict("records")
    ]
    head = ["run", "category", "template's family", "shapes", "part IoU", "gain"]
    note = "Gain: over the same template as it is. 95% intervals over test shapes."
    title = "Part IoU x 100 by the selected template's structural family"
    return [*tables, Table(title, head, rows, 3, note)] if rows else tables


def _cell(row: Mapping[Any, Any] | None, shape: str) -> str:
    if row is None:
        return "-"
    gain = f"{_number(row, 'gain', '+')} {_span(row, 'gain_')}".rstrip()
    return Cell(_number(row, "mean"), gain if shape else _span(row))


def _number(row: Mapping[Any, Any], name: str, sign: str = "") -> str:
    return "-" if np.isnan(row[name]) else f"{100 * row[name]:{sign}.1f}"


def _span(row: Mapping[Any, Any], prefix: str = "") -> str:
    low, high = (row[f"{prefix}{end}"] for end in ("low", "high"))
    return "" if np.isnan(low) else f"[{100 * low:.1f}, {100 * high:.1f}]"
