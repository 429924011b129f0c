"""How well part labels are transferred from templates of the query's family, and of others."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ffd_lightning.analysis.compare import require_columns
from ffd_lightning.analysis.results import Families
from ffd_lightning.analysis.uncertainty import Estimate

_FEWEST = 6  # shapes that have an interval: fewer show nothing
_RUN = ["run", "category", "regime", "templates", "seed"]


def family_table(samples: pd.DataFrame, families: Families) -> pd.DataFrame:
    """Return the part IoU by whether the selected template is of the query's structural family.

    Args:
        samples: of `Results` under protocol parts.
        families: of `Results`; runs that are not in it have no rows.

    Returns:
        Three rows per run and category, by column `family`: "same", "other", and "same - other",
        their difference. Columns: `run`, `category`, `regime`, `templates`, `seed`, `num_samples`
        (test shapes, several images of one averaged), `mean`, its standard `error` and its 95%
        interval `low`, `high` over test shapes (NaN for fewer than 6). Shapes whose family is not
        known are left out; a group without shapes is NaN.
    """
    require_columns(samples, ["family", "template", "part_iou"])
    rows = []
    for values, part in samples.groupby(_RUN, sort=False):
        run, category = values[:2]
        known = part[part["family"].fillna("") != ""]
        if known.empty or not families.get(run):
            continue
        is_same = known["template"].map(families[run]) == category + "/" + known["family"]
        same, other = (
            known[mask].groupby("id")["part_iou"].mean().to_numpy(float)
            for mask in (is_same, ~is_same)
        )
        # Twice the groups, one of them negated: the mean over both strata is their difference.
        groups = {"same": [same], "other": [other], "same - other": [2 * same, -2 * other]}
        for name, strata in groups.items():
            row = dict(zip(_RUN, values, strict=True)) | {"family": name}
            rows.append(row | {"num_samples": sum(map(len, strata))} | _mean(strata))
    return pd.DataFrame(rows)


def _mean(strata: Sequence[NDArray[np.float64]]) -> dict[str, float]:
    """Return a mean over strata of shapes, (n,) each, with its interval."""
    fewest = min(map(len, strata))
    mean = float(np.mean([x.mean() for x in strata])) if fewest else np.nan
    error = low = high = np.nan
    if fewest >= _FEWEST:
        found = Estimate.over_strata(strata)
        error, (low, high) = found.error, found.interval
    return {"mean": mean, "error": error, "low": low, "high": high}
