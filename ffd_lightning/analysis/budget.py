"""Where a network's error comes from: the metric's floor, the templates, the heads, the choice."""

from __future__ import annotations

from typing import NamedTuple

import pandas as pd

from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import ProtocolDescription


class Share(NamedTuple):
    """One part of the error; the column of prefix `upto` is the sum of the parts up to it."""

    name: str
    meaning: str
    upto: str


SHARES = (
    Share("floor", "the truth sampled again", "floor"),
    Share("capacity", "the best template, its offsets fitted to the truth", "fitted"),
    Share("deformation", "the best template as the network deforms it", "best_deformed"),
    Share("selection", "the selected template", ""),
)
"""What a score is made of, from what nothing can mend to what the selection costs."""

QUALITY = {
    "folded": ("folded", "share of the surface turned inside out, %", 100.0),
    "stretch_95": ("stretch", "ratio of edge lengths, 95th percentile", 1.0),
    "bending": ("bending", "squared second differences of the offsets", 1.0),
    "density": (
        "density",
        "share of the earth mover's distance that is gone with points drawn anew on the deformed "
        "surface, %",
        100.0,
    ),
}
"""What the deformed meshes are like: column, its heading, meaning and factor."""


def error_budget(samples: pd.DataFrame, protocol: ProtocolDescription) -> pd.DataFrame:
    """Return what each run's mean error is made of, in the protocol's main measure.

    Args:
        samples: of `Results`; runs that were scored without references are left out.
        protocol: that they were measured under; its main measure is a distance.

    Returns:
        A row per run (index `run`): `floor`, `capacity`, `deformation` and `selection`, which add
        up to `total`, in the measure as people read it; `regret`, the selection's share of it;
        and of `QUALITY` what the samples have, means as they are.

    Raises:
        DataError: no run has the references, or of the main measure more is better.
    """
    measure = protocol.main_metric
    if measure.higher_is_better:
        raise DataError(
            f"no error to split: of {measure.title}, what protocol {protocol.name} measures, more "
            "is better"
        )
    names = [f"{s.upto}_{measure.name}" if s.upto else measure.name for s in SHARES]
    if not set(names) <= set(samples):
        raise DataError(
            "no run was scored with its references: evaluate one again (ffd evaluate run=DIR "
            "evaluation.references=true restart=true)"
        )
    known = samples.dropna(subset=names)
    sums = measure.factor * known.groupby("run", sort=False)[names].mean()
    parts = sums.diff(axis=1).fillna({names[0]: sums[names[0]]})
    table = parts.set_axis([share.name for share in SHARES], axis=1)
    table["total"] = sums[measure.name]
    table["regret"] = table["selection"] / table["total"]
    return table.join(mesh_quality(known))


def mesh_quality(samples: pd.DataFrame) -> pd.DataFrame:
    """Return of `QUALITY` what samples have: means of each run (index `run`)."""
    means = samples.groupby("run", sort=False).mean(numeric_only=True)
    if "resampled_emd" in means:
        means["density"] = 1 - means["resampled_emd"] / means["emd"]
    return means[[name for name in QUALITY if name in means]]
