"""Scores of the selected templates: how training judges itself on its way.

By the box Chamfer distance: squared, mean over points, both directions added, in units in which
every shape's bounding box has diagonal 1. Results are measured by `evaluation.evaluator`.
"""

from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torchmetrics import Metric
from torchmetrics.utilities import dim_zero_cat

from ffd_lightning.data.batches import Batch
from ffd_lightning.evaluation.summaries import selection_summary
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.nn.network import FfdPrediction

BOX_CHAMFER_FACTOR = 1000.0
"""What the box Chamfer distance is multiplied by where people read it."""


class TemplateScores(NamedTuple):
    """What was selected for each query, and how near it came, in the order of the rows.

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
        for name in TemplateScores._fields:
            self.add_state(name, [], dist_reduce_fx="cat")

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

    def compute(self) -> TemplateScores:
        """Return the scores of all queries."""
        found = [dim_zero_cat(getattr(self, f)).cpu().numpy() for f in TemplateScores._fields]
        order = np.argsort(found[0], kind="stable")
        return TemplateScores(*(values[order] for values in found))
