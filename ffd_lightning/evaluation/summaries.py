"""Means of an evaluation's rows, and how templates were selected."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation.samples import Predictions, Row
from ffd_lightning.metrics.selection import effective_templates, selection_entropy

_WORDS = frozenset(("id", "category", "family", "view", "template", "twin"))  # have no mean


def means(table: Sequence[Row]) -> dict[str, float]:
    """Return the mean of every column of numbers, over the rows that have one.

    >>> means([{"iou": 1.0, "iou_leg": 0.5}, {"iou": 0.0, "iou_leg": None}])
    {'iou': 0.5, 'iou_leg': 0.5}
    """
    names = dict.fromkeys(n for row in table for n in row if n not in _WORDS)
    numbers = {n: [row[n] for row in table if row.get(n) is not None] for n in names}
    return {n: float(np.mean(values)) for n, values in numbers.items() if values}


def without_twins(table: Sequence[Row], metrics: Sequence[str]) -> dict[str, float]:
    """Return `num_twins`, and `without_twins_<metric>`, means over the other shapes.

    Twins are samples of shapes that have a near copy in training. {} where there are none.

    >>> without_twins([{"iou": 1.0, "twin": True}, {"iou": 0.5, "twin": False}], ["iou"])
    {'num_twins': 1.0, 'without_twins_iou': 0.5}
    """
    others = [row for row in table if not row.get("twin")]
    if len(others) == len(table):
        return {}
    found = means([{name: row[name] for name in metrics} for row in others])
    count = float(len(table) - len(others))
    return {"num_twins": count, **{f"without_twins_{name}": found[name] for name in found}}


def selection_summary(counts: NDArray[np.int64]) -> dict[str, float]:
    """Return how templates were selected, from how often each was, (T,)."""
    return {
        "entropy": selection_entropy(counts),
        "effective_templates": effective_templates(counts),
        "templates_used": float((counts > 0).sum()),
    }


def template_ranking(bank: TemplateBank, predictions: Iterable[Predictions]) -> list[Row]:
    """Return how often each template is selected for images, at least one, and its mean weight.

    A row per template, the most selected first; of equals the one of greater weight.
    """
    counts, weights = np.zeros(len(bank), np.int64), np.zeros(len(bank))
    for prediction in predictions:
        counts += np.bincount(prediction.selected, minlength=len(bank))
        weights += prediction.weights.sum(0, dtype=np.float64)
    mean_weights = weights / counts.sum()
    return [
        {
            "rank": rank + 1,
            "id": bank.ids[t],
            "family": bank.families[t],
            "count": int(counts[t]),
            "share": float(counts[t] / counts.sum()),
            "mean_weight": float(mean_weights[t]),
        }
        for rank, t in enumerate(np.lexsort((-mean_weights, -counts)))
    ]
