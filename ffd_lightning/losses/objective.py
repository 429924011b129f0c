"""What is minimised: weighted Chamfer plus annealed regularizers, by training regime."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import torch
from jaxtyping import Float
from torch import Tensor

from ffd_lightning.app.config import Weighting
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.deformation import TemplateSample, deform
from ffd_lightning.losses.annealing import exponential_annealing
from ffd_lightning.losses.regularizers import negative_entropy, offset_penalty
from ffd_lightning.losses.weighting import weight_function


@runtime_checkable
class Prediction(Protocol):
    """What the objective reads of a network's output."""

    @property
    def template_weights(self) -> Tensor:
        """Template weights, (q, T)."""
        ...

    @property
    def offsets(self) -> Tensor:
        """Control point offsets, (q, T, M, 3)."""
        ...


@dataclass(frozen=True)
class Objective:
    """A training regime as a loss; every field is combinable with every other.

    Args:
        weighting: f of the weighted Chamfer loss.
        entropy_weight: kappa_e0, of the negative entropy.
        offset_weight: kappa_r0, of the offset penalty.
        annealing_steps: b_0, over which both fade by a factor of e.
    """

    weighting: Weighting
    entropy_weight: float
    offset_weight: float
    annealing_steps: float

    def __call__(
        self,
        prediction: Prediction,
        target_points: Float[Tensor, "queries num_target 3"],
        templates: TemplateSample,
        step: int,
        batch_weights: Float[Tensor, "all_queries templates"] | None = None,
    ) -> tuple[Float[Tensor, ""], dict[str, Tensor]]:
        r"""Return the total and its named, unweighted terms.

        .. math:: \sum_{q,t} f(\gamma^{(qt)}) \lambda_c(s^{(q)}, \tilde s^{(qt)})
                  + \kappa_e \lambda_e + \kappa_r \lambda_r

        Sums run over queries, templates and points, as the paper writes them.

        Args:
            prediction: weights (q, T) and offsets (q, T, M, 3).
            target_points: ground truth clouds, (q, N', 3).
            templates: decomposed template points.
            step: index of the batch, for the annealing.
            batch_weights: weights of the whole batch, (Q, T), where its queries are split over
                devices; the prediction's own by default. Only the entropy needs them.

        Returns:
            The total, and the terms `weighted_chamfer` (summed over queries), `entropy` (of the
            batch's mean weights, nats, positive), `offset_penalty` (summed over queries), and for
            reading only `chamfer`: of each query's selected template, mean over points and queries.

        Source: the paper's equations 7 to 12.
        """
        weights = prediction.template_weights
        pred_points = deform(*templates, prediction.offsets)
        chamfer = chamfer_distance(pred_points, target_points[:, None])
        weighted_chamfer = (weight_function(weights, self.weighting) * chamfer).sum()
        spread = negative_entropy(weights if batch_weights is None else batch_weights)
        penalty = offset_penalty(weights, prediction.offsets)
        fade = exponential_annealing(step, self.annealing_steps)
        total = (
            weighted_chamfer
            + fade * self.entropy_weight * spread
            + fade * self.offset_weight * penalty
        )
        with torch.no_grad():
            selected = chamfer.gather(1, weights.argmax(1, keepdim=True))
            # Sums over equally many points each way; for unequal clouds this is the mean count.
            count = (pred_points.shape[-2] + target_points.shape[-2]) / 2
        terms = {
            "weighted_chamfer": weighted_chamfer,
            "entropy": -spread,
            "offset_penalty": penalty,
            "chamfer": selected.mean() / count,
        }
        return total, {name: term.detach() for name, term in terms.items()}
