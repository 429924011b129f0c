"""Scores of every template for every query, and what they come to.

This is how training judges itself on its way: squared Chamfer distance, mean over points, both
directions added, in units in which every model's bounding box has diagonal 1. Results are measured
by `evaluation.evaluator`, under a protocol.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.data.batches import Batch
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.deformation import deform
from ffd_lightning.metrics.selection import effective_templates, selection_entropy
from ffd_lightning.nn.network import FfdPrediction


@dataclass(frozen=True)
class TemplateScores:
    """Every template tried on every query.

    Attributes:
        rows: row of each query in the prepared set, (q,).
        weights: template weights, (q, T).
        deformed: Chamfer distance of each deformed template, (q, T).
        undeformed: Chamfer distance of each template as it is, (q, T).
    """

    rows: NDArray[np.int64]
    weights: NDArray[np.float32]
    deformed: NDArray[np.float32]
    undeformed: NDArray[np.float32]

    @classmethod
    def concatenate(cls, parts: Sequence[TemplateScores]) -> TemplateScores:
        """Join the scores of several batches."""
        return cls(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)))

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
        """Return means over queries.

        `chamfer` and `undeformed_chamfer` are of the selected template; `best_undeformed_chamfer`
        and `best_deformed_chamfer` of the best template for each query, chosen knowing the answer;
        `entropy` (nats) and `effective_templates` are of the selection counts.
        """
        return {
            "chamfer": float(self.of_selected(self.deformed).mean()),
            "undeformed_chamfer": float(self.of_selected(self.undeformed).mean()),
            "best_undeformed_chamfer": float(self.undeformed.min(1).mean()),
            "best_deformed_chamfer": float(self.deformed.min(1).mean()),
            "entropy": selection_entropy(self.counts),
            "effective_templates": effective_templates(self.counts),
            "templates_used": float((self.counts > 0).sum()),
            "num_samples": float(len(self.rows)),
        }


@torch.no_grad()
def score_templates(prediction: FfdPrediction, batch: Batch) -> TemplateScores:
    """Score all templates, deformed and not, on the queries of a batch."""

    def array(tensor: Tensor) -> NDArray[np.float32]:
        return tensor.float().cpu().numpy()

    target = batch.target_points[:, None]
    deformed = deform(*batch.templates, prediction.offsets)
    undeformed = deform(*batch.templates, torch.zeros_like(batch.templates.control_points))
    return TemplateScores(
        rows=batch.rows.cpu().numpy(),
        weights=array(prediction.template_weights),
        deformed=array(chamfer_distance(deformed, target, "mean")),
        undeformed=array(chamfer_distance(undeformed, target, "mean")),
    )
