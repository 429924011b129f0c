"""Which templates runs select: how evenly, how well, and the same again?"""

from itertools import combinations

import numpy as np
import pandas as pd

from ffd_lightning.analysis.compare import require_columns
from ffd_lightning.analysis.naming import GROUP, SETTING
from ffd_lightning.analysis.results import Results
from ffd_lightning.metrics.selection import adjusted_rand, effective_templates


def selection_table(results: Results) -> pd.DataFrame:
    """Return how each run selects its templates.

    Returns:
        A row per run. Columns: `run`, `category`, `regime`, `templates`, `variant`, `seed`,
        `num_samples` (test images); from the counts of the selected templates
        `effective_templates`, `templates_used` and `top1_share` (of all samples).

        With references also `regret`, how much worse the protocol's main metric is than with the
        best deformed template of the same network, mean over samples, in the metric's unit; and
        `best_share`, how often the selected template is that best one. The best is the one of least
        Chamfer distance on points of its own, so a regret may come out slightly below zero. What
        only this run lacks is NaN.
    """
    metric = results.protocol.main_metric
    require_columns(results.samples, ["template", metric.name])
    names = [each.name for each in results.protocol.metrics]
    rows = []
    for run, part in results.samples.groupby("run", sort=False):
        counts = part["template"].value_counts().to_numpy()
        row = {
            "run": run,
            "category": ", ".join(part["category"].unique().astype(str)),
            **{name: part[name].iloc[0] for name in (*SETTING, "seed")},
            "num_samples": len(part),
            "effective_templates": effective_templates(counts),
            "templates_used": len(counts),
            "top1_share": counts.max() / counts.sum(),
        }
        best = part.get(f"best_deformed_{metric.name}", pd.Series(dtype=float))
        if len(best) and best.notna().all():
            sign = 1 if metric.higher_is_better else -1
            row["regret"] = sign * float((best - part[metric.name]).mean())
            # Equal in all metrics, it is the same template.
            same = [part[name] == part[f"best_deformed_{name}"] for name in names]
            row["best_share"] = float(np.mean(np.all(same, 0)))
        rows.append(row)
    return pd.DataFrame(rows)


def selection_stability(results: Results) -> pd.DataFrame:
    """Return how alike the seeds of a setting select templates, over the samples both have.

    Which templates there are to select from may differ between seeds (`template_strategy.seed`, a
    ranking of another run). `adjusted_rand` compares only which samples go together, and holds for
    that too; `same_template` asks for the very same template and is low then for that reason alone.
    Of runs that nearly always select one template (see `effective_templates`) the adjusted Rand
    index says little: it is 0 as soon as the few exceptions are others.

    Returns:
        A row per category, regime, templates and variant. Columns: those; `num_seeds`; `num_pairs`
        of seeds that share two samples or more; `num_samples`, the fewest that a pair shares; over
        the pairs, the mean of the `adjusted_rand` index and of `same_template`, the share of
        samples for which both select the same. Where there is no pair, these are NaN.
    """
    rows = []
    for values, part in results.samples.groupby(GROUP, sort=False):
        selected = part.pivot(index=["id", "view"], columns="run", values="template")
        shared = []
        for a, b in combinations(part["run"].unique(), 2):
            both = selected[[a, b]].dropna()
            if len(both) >= 2:
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
