"""Scores of every template for every query: how training judges itself on its way.

By the box Chamfer distance: squared, mean over points, both directions added, in units in which
every shape's bounding box has diagonal 1. Results are measured by `evaluation.evaluator`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torchmetrics import Metric
from torchmetrics.utilities import dim_zero_cat

from ffd_lightning.data.batches import Batch
from ffd_lightning.evaluation.summaries import selection_summary
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.nn.network import FfdPrediction

BOX_CHAMFER_FACTOR = 1000.0
"""What the box Chamfer distance is multiplied by where people read it."""


@dataclass(frozen=True)
class TemplateScores:
    """Every template tried on every query.

    Attributes:
        rows: row of each query in the prepared set, (q,).
        weights: template weights, (q, T).
        deformed: box Chamfer distance of each deformed template, not multiplied, (q, T).
        undeformed: the same of each template as it is, (q, T).
    """

    rows: NDArray[np.int64]
    weights: NDArray[np.float32]
    deformed: NDArray[np.float32]
    undeformed: NDArray[np.float32]

    @classmethod
    def of(cls, computed: Mapping[str, Tensor]) -> TemplateScores:
        """Return what a `TemplateScoring` has computed, in the order of the rows."""
        rows = computed["rows"].cpu().numpy().reshape(-1)
        order = np.argsort(rows, kind="stable")
        # torchmetrics squeezes what has one element.
        columns = (computed[f.name].cpu().numpy() for f in fields(cls)[1:])
        return cls(rows[order], *(c.reshape(len(rows), -1)[order] for c in columns))

    @property
    def selected(self) -> NDArray[np.int64]:
        """The template of the greatest weight for each query, (q,)."""
        return self.weights.argmax(1)

    @property
    def counts(self) -> NDArray[np.int64]:
        """How often each template was selected, (T,)."""
        return np.bincount(self.selected, minlength=self.weights.shape[1])

    def of_selected(self, scores: NDArray[np.float32]) -> NDArray[np.float32]:
        """Pick the selected template's column of scores (q, T), giving (q,)."""
        return np.take_along_axis(scores, self.selected[:, None], 1)[:, 0]

    def summary(self) -> dict[str, float]:
        """Return means over queries, distances multiplied by 1000, and how templates were selected.

        `box_chamfer` and `undeformed_box_chamfer` are of the selected template; `best_...` of the
        best template for each query, chosen by an oracle.
        """
        distances = {
            "box_chamfer": self.of_selected(self.deformed),
            "undeformed_box_chamfer": self.of_selected(self.undeformed),
            "best_undeformed_box_chamfer": self.undeformed.min(1),
            "best_deformed_box_chamfer": self.deformed.min(1),
        }
        return {
            **{k: BOX_CHAMFER_FACTOR * float(v.mean()) for k, v in distances.items()},
            **selection_summary(self.counts),
            "num_samples": float(len(self.rows)),
        }


class TemplateScoring(Metric):
    """Collects the scores of every template on every query; each device adds its share."""

    full_state_update = False

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        for f in fields(TemplateScores):
            self.add_state(f.name, [], dist_reduce_fx="cat")

    @torch.no_grad()
    def update(self, prediction: FfdPrediction, batch: Batch) -> None:
        """Score all templates, deformed and not, on the queries of a batch."""
        target = batch.target_points[:, None]
        deformed = batch.templates.deformed(prediction.offsets)
        undeformed = batch.templates.deformed(torch.zeros_like(batch.templates.control_points))
        found = {
            "rows": batch.rows,
            "weights": prediction.template_weights.detach().float(),
            "deformed": chamfer_distance(deformed, target, "mean").float(),
            "undeformed": chamfer_distance(undeformed, target, "mean").float(),
        }
        for name, values in found.items():
            getattr(self, name).append(values)

    def compute(self) -> dict[str, Tensor]:
        """Return what `TemplateScores.of` makes scores of."""
        return {f.name: dim_zero_cat(getattr(self, f.name)) for f in fields(TemplateScores)}
