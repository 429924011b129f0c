"""What is to be known of chosen templates and of the set that they are from, as tables."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from ffd_lightning.data.preparation.prepared import PreparedSet, spread_rows
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.data.templates.distances import CANDIDATES, POINTS, shape_distances
from ffd_lightning.geometry.chamfer import chamfer_distance

Row = dict[str, Any]

_NAMED = 10


def template_rows(prepared: PreparedSet, bank: TemplateBank) -> tuple[list[Row], float]:
    """Return how templates cover a set, or `CANDIDATES` shapes of a larger one.

    Distances are mean Chamfer distances of clouds of `POINTS` points, in units of the squared
    bounding-box diagonal.

    Returns:
        A row per template, in their order: `order` from 1, `id`, `family`, `share` of the shapes
        that are nearest to it, itself among them, and `chamfer`, the mean distance of the others of
        these, nan where there are none. And the mean distance of all shapes that are no templates
        to the nearest one, nan where there are none.
    """
    prepared = prepared.originals
    own = np.array([prepared.index(i) for i in bank.ids])
    rows = np.union1d(spread_rows(len(prepared), CANDIDATES), own)
    points = torch.from_numpy(np.stack([prepared.cloud(int(row), POINTS) for row in rows]))
    clouds = points[np.searchsorted(rows, own)]
    table = torch.stack([chamfer_distance(cloud, points, "mean") for cloud in clouds]).double()
    nearest, distance = table.argmin(0).numpy(), table.amin(0).numpy()
    other = ~np.isin(rows, own)
    result = [
        {
            "order": t + 1,
            "id": shape_id,
            "family": bank.families[t],
            "share": float((nearest == t).mean()),
            "chamfer": _mean(distance[other & (nearest == t)]),
        }
        for t, shape_id in enumerate(bank.ids)
    ]
    return result, _mean(distance[other])


def _mean(values: NDArray[np.float64]) -> float:
    return float(values.mean()) if len(values) else float("nan")


def outlier_rows(prepared: PreparedSet) -> list[Row]:
    """Return the shapes that are like nothing else in their category, the strangest first.

    A row has `id`, and `times_usual`, by what factor the third nearest other is farther off than is
    usual in the set; see `distances.ShapeDistances.outliers`.
    """
    result: list[Row] = []
    for member in prepared.members:
        member = member.originals
        found = shape_distances(member)
        outlier, factor = found.outliers()
        prefix = f"{member.category(0)}/" if len(prepared.paths) > 1 else ""
        for k in np.flatnonzero(outlier):
            shape_id = prefix + member.ids[found.rows[k]]
            result.append({"id": shape_id, "times_usual": round(float(factor[k]), 2)})
    return sorted(result, key=lambda row: -row["times_usual"])


def outlier_note(prepared: PreparedSet, rows: Sequence[Row], dropped: bool = False) -> str:
    """Return in words what `outlier_rows` has found, and what can be done; "" where it is nothing.

    `dropped` says that they are left out already.
    """
    if not rows:
        return ""
    looked_at = sum(min(len(member.originals), CANDIDATES) for member in prepared.members)
    ids = [str(row["id"]) for row in rows[:_NAMED]]
    more = f" and {len(rows) - _NAMED} more" if len(rows) > _NAMED else ""
    listed = json.dumps(ids, ensure_ascii=False, separators=(",", ":"))
    setting = shlex.quote(f"data.leave_out={listed}")
    way = (
        "they are left out of training and tests"
        if dropped
        else "split.drop_outliers=true leaves all of them out of training and tests, "
        f"{setting} these out of the set"
    )
    count = f"{len(rows)} of {looked_at} shapes are like nothing else in their category"
    return f"{count}: {', '.join(ids)}{more}; {way}"
