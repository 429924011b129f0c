"""Scores of the selected templates: how training judges itself on its way.

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
    """What was selected for each query, and how near it came.

    Attributes:
        rows: row of each query in the prepared set, (q,).
        weights: template weights, (q, T).
        deformed: box Chamfer distance of the selected template, deformed, not multiplied, (q,).
        undeformed: the same of the template as it is, (q,).
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
        weights = computed["weights"].cpu().numpy().reshape(len(rows), -1)
        distances = (computed[k].cpu().numpy().reshape(-1) for k in ("deformed", "undeformed"))
        return cls(rows[order], weights[order], *(distance[order] for distance in distances))

    @property
    def counts(self) -> NDArray[np.int64]:
        """How often each template was selected, (T,)."""
        return np.bincount(self.weights.argmax(1), minlength=self.weights.shape[1])

    def summary(self) -> dict[str, float]:
        """Return means over queries, distances times 1000, and how templates were selected."""
        return {
            "box_chamfer": BOX_CHAMFER_FACTOR * float(self.deformed.mean()),
            "undeformed_box_chamfer": BOX_CHAMFER_FACTOR * float(self.undeformed.mean()),
            **selection_summary(self.counts),
        }


class TemplateScoring(Metric):
    """Collects the scores of the selected templates; each device adds its share."""

    full_state_update = False

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        for f in fields(TemplateScores):
            self.add_state(f.name, [], dist_reduce_fx="cat")

    @torch.no_grad()
    def update(self, prediction: FfdPrediction, batch: Batch) -> None:
        """Score what is selected for the queries of a batch, deformed and not."""
        index, target = prediction.template_index, batch.target_points
        queries = torch.arange(len(index), device=index.device)
        deformed = batch.templates.deformed(prediction.offsets)[queries, index]
        still = torch.zeros_like(batch.templates.control_points)
        undeformed = batch.templates.deformed(still)[index]
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
