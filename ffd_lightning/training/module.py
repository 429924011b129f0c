"""The LightningModule: one network, one objective, one shared step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from lightning import LightningModule
from lightning.pytorch.utilities.types import OptimizerConfig, OptimizerLRSchedulerConfig
from torch import Tensor

from ffd_lightning.app.config import LearningRateDecay
from ffd_lightning.data.batches import Batch
from ffd_lightning.evaluation.template_scores import TemplateScores, score_templates
from ffd_lightning.losses.objective import Objective
from ffd_lightning.nn.network import FfdPrediction, TemplateFfdNetwork


class FfdModule(LightningModule):
    """Trains a network under an objective.

    Logs `train/<term>` for each of the objective's terms, and on the test models `val/chamfer`
    (deformed, selected template), `val/undeformed_chamfer` and `val/entropy` (of the selection).

    Args:
        network: images to weights and offsets.
        objective: the training regime.
        learning_rate: of Adam (betas 0.9 and 0.999, epsilon 1e-8, as in the paper).
        learning_rate_decay: none (the paper), or cosine to zero over `steps`.
        steps: optimizer steps in all.
        seed: what layers with randomness draw at step k follows from (seed, k).
        kept: entries of every checkpoint, so that it is of use without the run.
    """

    def __init__(
        self,
        network: TemplateFfdNetwork,
        objective: Objective,
        *,
        learning_rate: float = 1e-3,
        learning_rate_decay: LearningRateDecay = LearningRateDecay.none,
        steps: int = 100_000,
        seed: int = 0,
        kept: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__()
        self.network, self.objective = network, objective
        self.learning_rate, self.learning_rate_decay = learning_rate, learning_rate_decay
        self.steps, self.seed, self.kept = steps, seed, dict(kept or {})
        self.validation_scores: list[TemplateScores] = []

    def forward(self, images: Tensor) -> FfdPrediction:
        """Return the network's prediction for images, (q, 3, H, W)."""
        return self.network(images)

    def on_train_batch_start(self, batch: Batch, batch_idx: int) -> None:
        """Make random layers (dropout in some timm encoders) depend on the step alone."""
        torch.manual_seed(self.seed * 1_000_003 + self.global_step)

    def training_step(self, batch: Batch, batch_idx: int) -> Tensor:
        """Return the objective's total."""
        prediction = self.network(batch.images)
        total, terms = self.objective(
            prediction,
            batch.target_points,
            batch.templates,
            self.global_step,
            self._batch_weights(prediction.template_weights),
        )
        terms = {"loss": total.detach(), **terms}
        self.log_dict({f"train/{k}": v for k, v in terms.items()}, batch_size=len(batch.rows))
        # Devices average their gradients; the paper sums over the queries of the batch.
        return total * self.trainer.world_size

    def _batch_weights(self, weights: Tensor) -> Tensor:
        """Return the weights of all devices' queries, (Q, T); gradients flow to this device's."""
        if self.trainer.world_size == 1:
            return weights
        gathered = torch.as_tensor(self.all_gather(weights.detach()))
        gathered[self.global_rank] = weights
        return gathered.flatten(0, 1)

    def validation_step(self, batch: Batch, batch_idx: int) -> None:
        """Score the templates of each query."""
        self.validation_scores.append(score_templates(self.network(batch.images), batch))

    def on_validation_epoch_start(self) -> None:
        """Forget the scores of the last validation."""
        self.validation_scores.clear()

    def on_validation_epoch_end(self) -> None:
        """Log means over all test models; callbacks read `validation_scores` after this."""
        scores = TemplateScores.concatenate(self.validation_scores)
        summary = scores.summary()
        names = ("chamfer", "undeformed_chamfer", "entropy", "effective_templates")
        self.log_dict({f"val/{n}": summary[n] for n in names}, sync_dist=True)

    def on_save_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Add what is kept with the weights."""
        checkpoint.update(self.kept)

    def configure_optimizers(self) -> OptimizerConfig | OptimizerLRSchedulerConfig:
        """Adam, with the chosen decay stepped every batch."""
        optimizer = torch.optim.Adam(self.parameters(), lr=self.learning_rate, fused=True)
        if self.learning_rate_decay is LearningRateDecay.none:
            return {"optimizer": optimizer}
        decay = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, T_max=self.steps)
        return {"optimizer": optimizer, "lr_scheduler": {"scheduler": decay, "interval": "step"}}
