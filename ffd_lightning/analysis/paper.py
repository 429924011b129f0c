"""Our results beside those the paper reports, and in which settings the two experiments differ."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib.resources import files
from pathlib import Path, PurePath
from typing import Any

import pandas as pd
import yaml

from ffd_lightning.analysis.compare import REGIMES, aggregate_seeds, require_columns
from ffd_lightning.analysis.runs import described_protocols
from ffd_lightning.analysis.table import Table
from ffd_lightning.data.categories import PAPER_CATEGORIES
from ffd_lightning.errors import DataError
from ffd_lightning.run_folder import RunFolder

PROTOCOL = "paper"
MEASURES = ("chamfer", "emd", "one_minus_iou")
"""Of the paper's Table 3, each times 1,000: lower is better."""

_METHODS = (*REGIMES, "DN", "PSGN")
_PLACE = files("ffd_lightning.analysis")


def paper_table() -> pd.DataFrame:
    """Return the paper's Table 3.

    Columns: `category` (13, and `mean5`, `mean13` as printed there), `method` (regimes b, w, e, r;
    DN and PSGN are other papers'), and 1,000 x `chamfer`, `emd`, `one_minus_iou`; NaN for "-".

    The printed means of EMD over five categories are not those of its rows: 300 and 292 for e and r
    where the rows give 302 and 300, and 780 for PSGN where they give 569 (its 115 for planes may be
    a slip for 1,150, which gives 776). All other means of the regimes agree with the rows.

    Source: Jack et al. 2018, Table 3.
    """
    with _PLACE.joinpath("paper_table.csv").open(encoding="utf-8") as lines:
        return pd.read_csv(lines).rename(columns=lambda name: name.removesuffix("_x1000"))


def paper_settings(regime: str) -> dict[str, Any]:
    """Return what the paper trained a regime with, by our names of settings, flat."""
    content = yaml.safe_load(_PLACE.joinpath("paper_settings.yaml").read_text(encoding="utf-8"))
    of_regime = content["regimes"].get(regime, {"name": "b, w, e or r"})
    return content["settings"] | {f"regime.{key}": value for key, value in of_regime.items()}


def differences(runs: Iterable[RunFolder]) -> list[str]:
    """Return the settings that runs have otherwise than the paper, with both values.

    What the paper says nothing of is not listed, but for terms that it does not have. Of files the
    names are compared.

    Raises:
        ConfigError: a `config.yaml` that is damaged.
    """
    found: dict[tuple[str, str], dict[str, None]] = {}
    for run in runs:
        own = pd.json_normalize(dict(run.settings)).iloc[0].to_dict()
        paper = paper_settings(str(own.get("regime.name")))
        terms = {k: 0 for k in own if k.startswith("regime.terms.") and k.endswith(".weight")}
        for key, value in (terms | paper).items():
            ours, theirs = _text(own.get(key)), _text(value)
            if ours != theirs:
                found.setdefault((key, theirs), {})[ours] = None
    return [f"{key}: {' or '.join(ours)} (paper: {them})" for (key, them), ours in found.items()]


def beside_paper(runs: pd.DataFrame) -> Table:
    """Return our results beside the paper's, for the categories we have.

    Args:
        runs: as `load_runs` gives them; those that are finished, and whose test shapes were
            evaluated under protocol `paper`, count. Their folders are read for their settings.

    Returns:
        Two rows per category, ours and the paper's, a column per method (with T where our runs have
        several): 1,000 x Chamfer / EMD / 1 - IoU, ours as means over seeds. Last the mean over the
        categories that the paper and all of our methods have, where there are two or more; each
        counts the same. The note says in which settings the experiments differ.

    Raises:
        DataError: no finished run of that protocol, or one without its measures.
    """
    require_columns(runs, ["run", "state", "protocol", "category", "regime", "templates", "seed"])
    usable = runs[(runs["state"] == "finished") & (runs["protocol"] == PROTOCOL)]
    tested = [PROTOCOL in described_protocols(RunFolder(Path(run))) for run in usable["run"]]
    usable = usable[tested]
    if usable.empty:
        raise DataError(
            f"no finished run was evaluated under protocol {PROTOCOL}, the paper's: give the "
            f"command that trained one again, with protocol={PROTOCOL}"
        )
    mine = aggregate_seeds(usable, ["chamfer", "emd", "iou"])
    several = mine["templates"].nunique() > 1
    method = mine["regime"] + (" T=" + mine["templates"].astype(str) if several else "")
    scores = {"chamfer": mine["chamfer"], "emd": mine["emd"], "one_minus_iou": 1 - mine["iou"]}
    ours = mine[["category"]].assign(method=method, **{k: 1000 * v for k, v in scores.items()})
    sources = {"ours": ours, "paper": paper_table().dropna(subset=MEASURES, how="all")}
    categories = [*PAPER_CATEGORIES, *sorted(set(ours["category"]) - set(PAPER_CATEGORIES))]
    categories = [name for name in categories if name in set(ours["category"])]
    methods = sorted(
        {m for table in sources.values() for m in table["method"]}, key=lambda m: _place(m)
    )
    cells = {name: _cells(table) for name, table in sources.items()}
    has_all = ours.groupby("category")["method"].nunique() == ours["method"].nunique()
    shared = [name for name in PAPER_CATEGORIES if name in categories and has_all[name]]
    if len(shared) > 1:
        categories.append(mean := f"mean of {len(shared)}")
        for name, table in sources.items():
            part = table[table["category"].isin(shared)].groupby("method")
            means = part[list(MEASURES)].agg(lambda x: x.mean(skipna=False))
            means = means[part.size() == len(shared)].reset_index().assign(category=mean)
            cells[name] |= _cells(means)
    methods = [
        m for m in methods if any((c, m) in own for own in cells.values() for c in categories)
    ]
    rows: list[list[str]] = []
    for category in categories:
        for name, own in cells.items():
            row = [own.get((category, method), "-") for method in methods]
            if set(row) != {"-"}:
                rows.append(["" if rows and name == "paper" else category, name, *row])
    told = "; ".join(differences(RunFolder(Path(run)) for run in usable["run"]))
    over = f" {mean}: {', '.join(shared)}." if len(shared) > 1 else ""
    return Table(
        "Beside the paper's Table 3",
        ["category", "", *methods],
        rows,
        heads=2,
        note="1000 x (Chamfer / EMD / 1 - IoU), lower is better; the paper's as printed in Jack et "
        f"al. 2018, ours means over test shapes and seeds.{over} These are two experiments, not "
        f"one repeated: {told}. Our ground truth's hemisphere is exact (paper: up to 2.3% too "
        "large), and the templates may be others.",
    )


def _cells(table: pd.DataFrame) -> dict[tuple[str, str], str]:
    """Return the three numbers as text, by category and method."""
    return {
        (row["category"], row["method"]): "/".join(
            "-" if pd.isna(row[m]) else f"{row[m]:.0f}" for m in MEASURES
        )
        for row in table.to_dict("records")
    }


def _place(method: str) -> tuple[int, str, int]:
    """Return the place of a method: as in the paper, then by number of templates."""
    name, _, count = method.partition(" T=")
    known = _METHODS.index(name) if name in _METHODS else len(REGIMES) - 0.5
    return int(2 * known), name, int(count or 0)


def _text(value: Any) -> str:
    """Return a value as it is compared and shown: numbers alike, whatever type they were read as.

    >>> _text(10000.0), _text(1e-4), _text([45.0]), _text(None), _text("/somewhere/weights.pt")
    ('10000', '0.0001', '[45]', 'null', 'weights.pt')
    """
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(_text, value))}]"
    if isinstance(value, str):
        return PurePath(value).name if PurePath(value).is_absolute() else value
    if value is None or pd.isna(value):
        return "null"
    return f"{value:.10g}" if not isinstance(value, bool) else str(value).lower()
