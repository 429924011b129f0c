"""Which templates runs select: how evenly, how well, of the right kind, and the same again?"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np
import pandas as pd

from ffd_lightning.analysis.compare import require_columns
from ffd_lightning.analysis.naming import GROUP, SETTING
from ffd_lightning.analysis.results import Results
from ffd_lightning.errors import DataError
from ffd_lightning.metrics.selection import (
    adjusted_rand,
    chance_agreement,
    effective_templates,
    selection_entropy,
    top_share,
)


def selection_table(results: Results, measure: str | None = None) -> pd.DataFrame:
    """Return how each run selects its templates.

    Args:
        results: of the runs.
        measure: of the protocol, for the regret; by default its main one.

    Returns:
        A row per run. Columns:

        - `run`, `category`, `regime`, `templates`, `variant`, `seed`, `num_samples` (test images);
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
    """
    protocol = results.protocol
    judged = protocol.metric(measure) if measure else protocol.main_metric
    require_columns(results.samples, ["template", "family", judged.name])
    names = [metric.name for metric in protocol.metrics]
    sign = 1 if judged.higher_is_better else -1
    rows = []
    for run, part in results.samples.groupby("run", sort=False):
        counts = part["template"].value_counts().to_numpy()
        row = {
            "run": run,
            "category": ", ".join(part["category"].unique().astype(str)),
            **{name: part[name].iloc[0] for name in (*SETTING, "seed")},
            "num_samples": len(part),
            "entropy": selection_entropy(counts),
            "effective_templates": effective_templates(counts),
            "templates_used": len(counts),
            "top1_share": top_share(counts, 1),
            "top5_share": top_share(counts, 5),
        }
        for shape in ("", "undeformed_"):
            best = f"best_{shape or 'deformed_'}"
            if f"{best}{judged.name}" in part and part[f"{best}{judged.name}"].notna().all():
                gain = part[f"{best}{judged.name}"] - part[f"{shape}{judged.name}"]
                row[f"{shape}regret"] = float(gain.mean() * sign)
                # Equal in all measures, it is the same template.
                same = [part[f"{shape}{name}"] == part[f"{best}{name}"] for name in names]
                row[f"{shape}best_share"] = float(np.mean(np.all(same, 0)))
        rows.append(row | _family_numbers(part, results.families.get(str(run), {})))
    return pd.DataFrame(rows)


def _family_numbers(part: pd.DataFrame, families: Mapping[str, str]) -> dict[str, float]:
    """Return the family columns of one run; {} where families are not known."""
    known = part[part["family"].fillna("") != ""]
    if known.empty or not families:
        return {}
    if strange := set(known["template"]) - set(families):
        raise DataError(
            f"{part['run'].iloc[0]} selects {min(strange)}, which its template_ranking.csv lacks"
        )
    query = (known["category"] + "/" + known["family"]).to_numpy(str)
    selected = known["template"].map(families).to_numpy(str)
    return {
        "family_agreement": float(np.mean(query == selected)),
        "family_chance": chance_agreement(query, selected),
        "family_reachable": float(np.isin(query, list(families.values())).mean()),
    }


def selection_stability(results: Results) -> pd.DataFrame:
    """Return how alike the seeds of a setting select templates, over the samples both have.

    Which templates there are to select from may differ between seeds (`templates.seed`, a ranking
    of another run). `adjusted_rand` compares only which samples go together, and holds for that
    too; `same_template` asks for the very same template and is low then for that reason alone. Of
    runs that nearly always select one template (see `effective_templates`) the adjusted Rand index
    says little: it is 0 as soon as the few exceptions are others.

    Returns:
        A row per category, regime, templates and variant. Columns: those; `num_seeds`; `num_pairs`
        of seeds; `num_samples`, the fewest that a pair shares; over the pairs, the mean of the
        `adjusted_rand` index and of `same_template`, the share of samples for which both select
        the same. For one seed there is no pair, and these are NaN.
    """
    rows = []
    for values, part in results.samples.groupby(GROUP, sort=False):
        selected = part.pivot(index=["id", "view"], columns="run", values="template")
        shared = []
        for a, b in combinations(part["run"].unique(), 2):
            both = selected[[a, b]].dropna()
            if len(both) < 2:
                raise DataError(
                    f"{a} and {b} share {len(both)} test samples, 2 at least are needed: compare "
                    "seeds with the same data and split"
                )
            same = float((both[a] == both[b]).mean())
            shared.append((len(both), adjusted_rand(both[a], both[b]), same))
        numbers = pd.DataFrame(shared, columns=["samples", "adjusted_rand", "same_template"])
        row = dict(zip(GROUP, values, strict=True)) | {
            "num_seeds": selected.shape[1],
            "num_pairs": len(shared),
            "num_samples": min(numbers["samples"], default=len(part)),
        }
        rows.append(row | numbers.drop(columns="samples").astype(float).mean().to_dict())
    return pd.DataFrame(rows)
