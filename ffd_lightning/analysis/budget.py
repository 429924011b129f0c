"""Where a network's error comes from: the metric's floor, the templates, the heads, the choice."""

import pandas as pd

from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import ProtocolDescription

SHARES = {
    "floor": "the truth sampled again",
    "capacity": "the best template, its offsets fitted to the truth",
    "deformation": "the best template as the network deforms it",
    "selection": "the selected template",
}
"""What a score is made of, from what nothing can mend to what the selection costs."""

_UPTO = ("floor_", "fitted_", "best_deformed_", "")  # columns: of the shares the sums up to each


def error_budget(samples: pd.DataFrame, protocol: ProtocolDescription) -> pd.DataFrame:
    """Return what each run's mean error is made of, in the protocol's main measure.

    Args:
        samples: of `Results`; runs that were scored without references are left out.
        protocol: that they were measured under; its main measure is a distance.

    Returns:
        A row per run (index `run`): `floor`, `capacity`, `deformation` and `selection`, which add
        up to `total`, in the measure as people read it; and `regret`, the selection's share of it.

    Raises:
        DataError: no run has the references, or of the main measure more is better.
    """
    measure = protocol.main_metric
    if measure.higher_is_better:
        raise DataError(
            f"no error to split: of {measure.title}, what protocol {protocol.name} measures, more "
            "is better"
        )
    names = [prefix + measure.name for prefix in _UPTO]
    if not set(names) <= set(samples):
        raise DataError(
            "no run was scored with its references: evaluate one again (ffd evaluate run=DIR "
            "evaluation.references=true restart=true)"
        )
    known = samples.dropna(subset=names)
    sums = measure.factor * known.groupby("run", sort=False)[names].mean()
    parts = sums.diff(axis=1).fillna({names[0]: sums[names[0]]})
    table = parts.set_axis(list(SHARES), axis=1)
    table["total"] = sums[measure.name]
    table["regret"] = table["selection"] / table["total"]
    return table
