"""Chamfer distances between the shapes of a set: which stand for all of them, which for none."""

import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from numpy.typing import NDArray

from ffd_lightning.data.preparation.prepared import PreparedSet, spread_rows
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.progress import CountProgress

CANDIDATES = 1000
POINTS = 256  # per cloud: with 128, sixteen templates cover some percent worse

_ALIKE = 3  # so many others have to be near; one or two may be as odd as the shape itself
_FAR = 4.5  # times the spread: the embedded categories have none so far off
_LEAST_SPREAD = 0.25  # of logarithms: an outlier is three times as far off as usual, or more
_MOST_OUTLIERS = 0.2  # of a set
_MAD_TO_STD = 1.4826  # of a normal distribution
_WORTH_A_BAR = 200  # shapes: fewer take no second
_TIE = 1e-9
_NAMED = 10  # outliers, in a note

Row = dict[str, Any]


@dataclass(frozen=True, eq=False)
class ShapeDistances:
    """Chamfer distances between shapes of a set.

    Attributes:
        rows: the n shapes that were looked at, by row of the set, ascending.
        table: mean Chamfer distance of each pair, (n, n), 0 on the diagonal.
    """

    rows: Int[np.ndarray, " n"]
    table: Float[np.ndarray, "n n"]

    def outliers(self) -> tuple[Bool[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        """Return which shapes are like nothing else: hardly any other is as near as is usual.

        Of each shape, the distance to the third nearest other is looked at, so that two balloons
        among aeroplanes do not excuse each other. Its logarithm lies more than 4.5 robust standard
        deviations above the median. These are a fifth of the set at most, the farthest: a set that
        falls apart into more is one of several kinds.

        Returns:
            Whether each is an outlier, and by what factor it is farther off than is usual.
        """
        count = len(self.table)
        # The first of each row is the shape itself; of few others, the farthest.
        third = np.sort(self.table, axis=1)[:, min(_ALIKE, count - 1)].astype(np.float64)
        logs = np.log(np.maximum(third, np.finfo(np.float32).tiny))
        usual = np.median(logs)
        spread = max(_MAD_TO_STD * np.median(np.abs(logs - usual)), _LEAST_SPREAD)
        farthest = np.argsort(-logs, kind="stable")[: int(_MOST_OUTLIERS * count)]
        result = np.zeros(count, bool)
        result[farthest] = logs[farthest] > usual + _FAR * spread
        return result, np.exp(logs - usual)


def shape_distances(prepared: PreparedSet, at_least: int = 0) -> ShapeDistances:
    """Return the distances between the shapes of a set, of `CANDIDATES` of a larger set.

    For 1,000 shapes it takes about 13 seconds of one core, for 500 a quarter, the first time; see
    `PreparedSet.measured`.

    Args:
        prepared: a set of one category.
        at_least: look at so many, if there are.
    """
    if prepared.taken is not None and len(prepared.whole) <= CANDIDATES:
        found, own = shape_distances(prepared.whole), list(prepared.taken)
        return ShapeDistances(np.arange(len(own)), found.table[np.ix_(own, own)])
    size = min(len(prepared), max(CANDIDATES, at_least))
    kept = prepared.measured(f"distances-{size}", lambda: _measure(prepared, size))
    return ShapeDistances(kept["rows"], kept["table"])


def _measure(prepared: PreparedSet, size: int) -> dict[str, Any]:
    rows = spread_rows(len(prepared), size)
    clouds = torch.from_numpy(np.stack([prepared.cloud(int(row), POINTS) for row in rows]))
    table = np.zeros((size, size), np.float32)
    label = f"{prepared.category(0)}: distances"
    with CountProgress(label, size, 0, size >= _WORTH_A_BAR) as bar:
        for k in range(size):
            if k + 1 < size:
                table[k, k + 1 :] = chamfer_distance(clouds[k], clouds[k + 1 :], "mean").numpy()
            bar.advance()
    return {"rows": rows, "table": table + table.T}


def greedy_medoids(found: ShapeDistances, count: int) -> list[int]:
    r"""Choose shapes one by one so that all others have a chosen one near.

    Each is the one that lowers $\sum_i \min_t \sqrt{d_{it}}$ the most, so the first t of any
    larger choice are the choice of t. The root keeps few shapes that are far from everything from
    drawing templates to them. Outliers neither count in the sum nor are chosen, unless no others
    are left. Returns places in `found.rows`, in the order in which they were chosen.
    """
    outlier, _ = found.outliers()
    cost = np.sqrt(found.table[:, ~outlier].astype(np.float64))
    near = np.full(cost.shape[1], np.inf)
    free = np.ones(len(cost), bool)
    chosen: list[int] = []
    for _ in range(count):
        allowed = np.flatnonzero(free & ~outlier)
        if len(allowed) == 0:
            allowed = np.flatnonzero(free)
        total = np.minimum(cost[allowed], near).sum(axis=1)
        # Of two that are nearest to each other either is as good but for rounding: the first.
        best = np.flatnonzero(total <= total.min() * (1 + _TIE))[0]
        chosen.append(int(allowed[best]))
        free[chosen[-1]] = False
        near = np.minimum(near, cost[chosen[-1]])
    return chosen


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
    usual in the set; see `ShapeDistances.outliers`.
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
