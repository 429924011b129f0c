"""Which templates runs select: how evenly, how well, of the right kind, and the same again?"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import combinations

import numpy as np
import pandas as pd

from ffd_lightning.analysis.compare import check_seeds, measure_of, require_columns
from ffd_lightning.analysis.runs import select
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import ProtocolDescription
from ffd_lightning.metrics.selection import (
    adjusted_rand,
    chance_agreement,
    effective_templates,
    selection_entropy,
    top_share,
)
from ffd_lightning.run_folder import RunFolder

_GROUP = ["category", "regime", "templates"]

Families = Mapping[str, Mapping[str, str]]
"""Of each run (its path), `<category>/<structural family>` of every template it could select."""


def selection_table(
    samples: pd.DataFrame,
    protocol: ProtocolDescription,
    families: Families | None = None,
    measure: str = "chamfer",
) -> pd.DataFrame:
    """Return how each run selects its templates.

    Args:
        samples: as `load_samples` gives them.
        protocol: that they were measured under, as `find_protocol` gives it.
        families: as `run_families` reads them; runs that are not in it have no family columns.
        measure: of the protocol, for the regret.

    Returns:
        A row per run. Columns:

        - `run`, `category`, `regime`, `templates`, `seed`, `num_samples` (test images);
        - from the counts of the selected templates: `entropy` (nats), `effective_templates` (its
          exponential), `templates_used`, `top1_share` and `top5_share` (of all samples);
        - with references: `regret`, how much worse the measure of the deformed selected template is
          than that of the best deformed template of the same network, mean over samples, in the
          measure's unit; `undeformed_regret`, the same of the templates as they are; `best_share`
          and `undeformed_best_share`, how often the selected template is that best one. The best
          is the one of least Chamfer distance on points of its own, so a regret may come out
          slightly below zero, and in other measures need not be above it;
        - with families, over the samples whose family is known: `family_agreement`, how often the
          selected template is of the query's structural family; `family_chance`, how often it
          would be if the same templates were dealt out to the samples at random;
          `family_reachable`, how often the run has a template of the query's family at all.

        What no run has is left out; what only this run lacks is NaN.

    Raises:
        DataError: a column is missing, or a selected template that `families` does not have.
    """
    judged = measure_of(measure, protocol)
    require_columns(samples, ["run", "template", "family", judged.name, *_GROUP, "seed"])
    measures = [m.name for m in protocol.metrics if m.name in samples]
    rows = []
    for run, part in samples.groupby("run", sort=False):
        counts = part["template"].value_counts().to_numpy()
        row = {
            "run": run,
            **{name: ", ".join(part[name].unique().astype(str)) for name in _GROUP[:1]},
            **{name: part[name].iloc[0] for name in (*_GROUP[1:], "seed")},
            "num_samples": len(part),
            "entropy": selection_entropy(counts),
            "effective_templates": effective_templates(counts),
            "templates_used": len(counts),
            "top1_share": top_share(counts, 1),
            "top5_share": top_share(counts, 5),
        }
        for shape in ("", "undeformed_"):
            best = f"best_{shape or 'deformed_'}"
            if part.get(f"{best}{judged.name}", pd.Series(np.nan, part.index)).notna().all():
                gain = part[f"{best}{judged.name}"] - part[f"{shape}{judged.name}"]
                row[f"{shape}regret"] = float(gain.mean() * (1 if judged.higher_is_better else -1))
                same = [part[f"{shape}{m}"] == part[f"{best}{m}"] for m in measures]
                row[f"{shape}best_share"] = float(np.mean(np.all(same, 0)))
        row |= _family_numbers(part, (families or {}).get(str(run), {}))
        rows.append(row)
    return pd.DataFrame(rows)


def _family_numbers(part: pd.DataFrame, families: Mapping[str, str]) -> dict[str, float]:
    """Return the family columns of one run; {} where families are not known."""
    known = part[part["family"].fillna("") != ""]
    if known.empty or not any(families.values()):
        return {}
    strange = set(known["template"]) - set(families)
    if strange:
        raise DataError(
            f"{part['run'].iloc[0]} selects {min(strange)}, which is none of the templates whose "
            "families were given: read them with run_families"
        )
    query = (known["category"] + "/" + known["family"]).to_numpy(str)
    selected = known["template"].map(families).to_numpy(str)
    return {
        "family_agreement": float(np.mean(query == selected)),
        "family_chance": chance_agreement(query, selected),
        "family_reachable": float(np.isin(query, list(families.values())).mean()),
    }


def run_families(runs: Iterable[RunFolder]) -> dict[str, dict[str, str]]:
    """Read the structural family of every template that runs could select, for `selection_table`.

    Returns:
        By run (path) and template (id): `<category>/<family>`, "" where it is not known. Runs are
        left out that have no `template_ranking.csv`, or whose data knows no families.

    Raises:
        ConfigError: a `config.yaml` that is damaged.
        DataError: a `template_ranking.csv` that is damaged.
    """
    result = {}
    for run in runs:
        file = run.path / "template_ranking.csv"
        if not file.is_file():
            continue
        try:
            ranking = pd.read_csv(file, dtype=str, keep_default_na=False)
            families = dict(zip(ranking["id"], ranking["family"], strict=True))
        except (OSError, ValueError, KeyError) as error:
            raise DataError(
                f"{file} is damaged or of another version ({error}): the command of its training, "
                "with restart=true, trains the run again"
            ) from None
        if any(families.values()):
            category = select(run.settings, "category.name")
            joined = len(select(run.settings, "category.members") or []) > 1
            result[str(run.path)] = {
                i: family and f"{i.split('/')[0] if joined else category}/{family}"
                for i, family in families.items()
            }
    return result


def selection_stability(samples: pd.DataFrame) -> pd.DataFrame:
    """Return how alike the seeds of a setting select templates, over the samples both have.

    Which templates there are to select from may differ between seeds (`templates.seed`, a ranking
    of another run). `adjusted_rand` compares only which samples go together, and holds for that
    too; `same_template` asks for the very same template and is low then for that reason alone. Of
    runs that nearly always select one template (see `effective_templates`) the adjusted Rand index
    says little: it is 0 as soon as the few exceptions are others.

    Args:
        samples: as `load_samples` gives them.

    Returns:
        A row per category, regime and templates. Columns: those; `num_seeds`; `num_pairs` of
        seeds; `num_samples`, the fewest that a pair shares; over the pairs, the mean of the
        `adjusted_rand` index and of `same_template`, the share of samples for which both select
        the same. For one seed there is no pair, and these are NaN.

    Raises:
        DataError: a column is missing, two runs of the same seed, or a pair that shares fewer than
            two samples.
    """
    require_columns(samples, ["run", "id", "view", "template", *_GROUP, "seed"])
    rows = []
    for values, part in samples.groupby(_GROUP, sort=False):
        check_seeds(part)
        runs = dict(list(part.set_index(["id", "view"]).groupby("run", sort=False)["template"]))
        shared = []
        for a, b in combinations(runs, 2):
            both = pd.concat([runs[a], runs[b]], axis=1, join="inner", keys=["a", "b"])
            if len(both) < 2:
                raise DataError(
                    f"{a} and {b} share {len(both)} test samples, 2 at least are needed: compare "
                    "seeds with the same data and split"
                )
            shared.append(both)
        rows.append(
            {
                **dict(zip(_GROUP, values, strict=True)),
                "num_seeds": len(runs),
                "num_pairs": len(shared),
                "num_samples": min((len(s) for s in shared), default=len(part)),
                "adjusted_rand": _mean([adjusted_rand(s["a"], s["b"]) for s in shared]),
                "same_template": _mean([float((s["a"] == s["b"]).mean()) for s in shared]),
            }
        )
    return pd.DataFrame(rows)


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else float("nan")
