"""The LightningModule: one network, one objective, one shared step."""

import warnings
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from functools import partial
from typing import Any

import torch
from lightning import LightningModule
from lightning.pytorch.utilities.types import OptimizerConfig, OptimizerLRSchedulerConfig
from torch import Tensor
from torch.optim import Optimizer
from torch.optim.lr_scheduler import LRScheduler
from torch.optim.optimizer import ParamsT

from ffd_lightning.checkpoint import model_entry, storable
from ffd_lightning.data.batches import Batch
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.errors import ConfigError
from ffd_lightning.evaluation.template_scores import (
    BOX_CHAMFER_FACTOR,
    TemplateScores,
    TemplateScoring,
)
from ffd_lightning.losses.objective import Objective
from ffd_lightning.nn.network import FfdPrediction, TemplateFfdNetwork
from ffd_lightning.nn.viewpoint import viewpoint_loss
from ffd_lightning.training.batch_statistics import SharedBatchStatistics
from ffd_lightning.training.finite import FiniteLosses

MakeOptimizer = Callable[[ParamsT], Optimizer]
MakeScheduler = Callable[[Optimizer, int], LRScheduler]

paper_optimizer: MakeOptimizer = partial(torch.optim.Adam, lr=1e-3, fused=True)
"""The paper's: Adam with a learning rate of 1e-3, betas 0.9 and 0.999, epsilon 1e-8."""

_LOGGED = ("box_chamfer", "undeformed_box_chamfer", "entropy", "effective_templates")


class FfdModule(LightningModule):
    """Trains a network under an objective, with any `Trainer`.

    Logs `train/loss`, `train/<term>` for each of the objective's terms, and `train/box_chamfer`;
    `val/...` and `test/...`: `box_chamfer`, `undeformed_box_chamfer`, `entropy` and
    `effective_templates` (of the selection). The box Chamfer distance is that of the selected
    template, deformed or as it is: squared, mean over points, both ways added, bounding-box
    diagonal 1, times 1000. Every checkpoint holds what `Predictor.load` needs, if the data came
    from an `FfdDataModule`. Training ends with a ConfigError at a loss or weight that is not
    finite, and no checkpoint is written of it.

    With `accumulate_grad_batches` gradients are summed over the batches, so that terms that are
    sums over queries train as with one batch of all queries. Still, batch norm sees each batch
    alone, terms that draw at random draw for each, and the mean of the batches' entropies takes
    the place of the entropy of all (`negative_entropy`). What is logged is of the last batch.

    Args:
        network: images to weights and offsets.
        objective: the training regime; its parameters, if terms or the selection have some, are
            trained with the network's.
        optimizer: makes an optimizer of parameters.
        scheduler: makes a schedule of the learning rate, stepped every optimizer step, of an
            optimizer and the number of all steps; None keeps the rate.
        offset_rate: factor of the learning rate for the weights of the layer that gives offsets,
            not for its biases. Below 1 templates first learn to be moved alike for all images: what
            an image adds is noise at first, and the layers below learn to suppress it, and the
            image with it.
        seed: what layers with randomness draw at a step follows from it.
        record: what checkpoints say about the training, for people: plain values by name.

    Attributes:
        scores: of the last validation or test; None before there is one.
    """

    def __init__(
        self,
        network: TemplateFfdNetwork,
        objective: Objective,
        *,
        optimizer: MakeOptimizer = paper_optimizer,
        scheduler: MakeScheduler | None = None,
        offset_rate: float = 1.0,
        seed: int = 0,
        record: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__()
        self.network, self.objective = network, objective
        self.make_optimizer, self.make_scheduler = optimizer, scheduler
        self.offset_rate = offset_rate
        self.seed, self.record = seed, dict(record or {})
        self.scores: TemplateScores | None = None
        self.scoring = TemplateScoring()
        self._losses = FiniteLosses()

    def forward(self, images: Tensor) -> FfdPrediction:
        """Return the network's prediction for images, (q, 3, H, W)."""
        return self.network(images)

    def setup(self, stage: str) -> None:
        """Make sure that data and network go together.

        Raises:
            ConfigError: they are of different numbers of templates, control points, image sizes or
                lattices.
        """
        data, network = self._data, self.network
        if data is None:
            return
        if network.heads.conditioned != (data.draw is not None):
            raise ConfigError(
                "conditioned heads learn from templates that each step draws, others from the same "
                "ones: FfdDataModule(draw=24) belongs to heads=conditioned, draw=None to others"
            )
        degrees = tuple(data.bank.degrees)
        for name, own, value in (
            ("num_templates", network.num_templates, len(data.bank)),
            ("num_control_points", network.num_control_points, data.bank.control_points.shape[1]),
            ("image_size", network.image_size, data.prepared.image_shape[1:3]),
            ("mirror_degrees", tuple(network.mirror_degrees or degrees), degrees),
        ):
            if own != value:
                raise ConfigError(f"the network's {name} is {own}, that of the data {value}")

    def on_train_batch_start(self, batch: Batch, batch_idx: int) -> None:
        """Make random layers (dropout in some timm encoders) depend on the batch alone."""
        every = int(self.trainer.accumulate_grad_batches)
        torch.manual_seed(self.seed * 1_000_003 + self.global_step * every + batch_idx % every)

    def training_step(self, batch: Batch, batch_idx: int) -> Tensor:
        """Return the objective's total."""
        with nullcontext() if self.trainer.world_size == 1 else SharedBatchStatistics():
            prediction = self.network(batch.images, batch.drawn)
        every = int(self.trainer.accumulate_grad_batches)
        # The last step of an epoch may be of fewer batches.
        batches = min(every, self.trainer.num_training_batches - batch_idx // every * every)
        weights = self._batch_weights(prediction.template_weights)
        total, terms = self.objective(
            prediction,
            batch.target_points,
            batch.templates,
            self.global_step,
            weights,
            batch.own_templates,
            int(batches) * len(weights),
        )
        if prediction.viewpoint is not None and batch.cameras is not None:
            viewpoint = viewpoint_loss(prediction.viewpoint, batch.cameras)
            total, terms["viewpoint"] = total + viewpoint, viewpoint.detach()
        self._losses.add(self.global_step, self.objective.parts, self.trainer)
        chamfer = BOX_CHAMFER_FACTOR * terms.pop("chamfer")
        terms = {"loss": total.detach(), **terms, "box_chamfer": chamfer}
        self.log_dict({f"train/{k}": v for k, v in terms.items()}, batch_size=len(batch.rows))
        # Devices and accumulated batches average gradients; the paper sums over the queries.
        return total * (self.trainer.world_size * every)

    def _batch_weights(self, weights: Tensor) -> Tensor:
        """Return the weights of all devices' queries, (Q, T); gradients flow to this device's."""
        if self.trainer.world_size == 1:
            return weights
        gathered = torch.as_tensor(self.all_gather(weights.detach()))
        gathered[self.global_rank] = weights
        return gathered.flatten(0, 1)

    def validation_step(self, batch: Batch, batch_idx: int) -> None:
        """Score the templates on each query."""
        self.scoring.update(self.network(batch.images), batch)

    test_step = validation_step

    def predict_step(self, batch: Batch, batch_idx: int) -> FfdPrediction:
        """Return the prediction for a batch's images."""
        return self.network(batch.images)

    def on_validation_start(self) -> None:
        """Make sure that losses and weights are finite, and tell the heads the templates."""
        self._losses.read_with_weights(self, self.state_dict())
        self.on_test_start()

    def on_train_end(self) -> None:
        """Make sure that losses and weights are finite."""
        self._losses.read_with_weights(self, self.state_dict())

    def on_test_start(self) -> None:
        """Tell conditioned heads the templates."""
        if self._data is not None:
            self._data.give_templates(self.network)

    on_predict_start = on_test_start

    def on_validation_epoch_end(self) -> None:
        """Log means over all validation, or test, shapes."""
        self.scores = self.scoring.compute()
        self.scoring.reset()
        summary, subset = self.scores.summary(), "test" if self.trainer.testing else "val"
        self.log_dict({f"{subset}/{n}": summary[n] for n in _LOGGED}, sync_dist=True)

    on_test_epoch_end = on_validation_epoch_end

    def on_save_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Add what makes the checkpoint of use without the data, if all in it is finite."""
        self._losses.read_with_weights(self, checkpoint["state_dict"])
        for name, state in checkpoint.get("callbacks", {}).items():
            checkpoint["callbacks"][name] = storable(f"the callback {name}", state)
        for state in checkpoint.get("optimizer_states", []):
            state["param_groups"] = storable("the optimizer", state["param_groups"])
        if schedules := checkpoint.get("lr_schedulers"):
            checkpoint["lr_schedulers"] = storable("the lr_schedule", schedules)
        data = self._data
        if data is None:
            warnings.warn(
                "the data came from no FfdDataModule: the checkpoint has no templates, and "
                "Predictor cannot open it",
                stacklevel=2,
            )
            return
        checkpoint.update(model_entry(self.network, data, self.record))

    @property
    def _data(self) -> FfdDataModule | None:
        data = getattr(self.trainer, "datamodule", None)
        return data if isinstance(data, FfdDataModule) else None

    def configure_optimizers(self) -> OptimizerConfig | OptimizerLRSchedulerConfig:
        """Make the optimizer, and the schedule of its learning rate over all steps."""
        offsets = self.network.heads.offsets.weight
        if self.offset_rate == 1:
            optimizer = self.make_optimizer(self.parameters())
        else:
            others = [weights for weights in self.parameters() if weights is not offsets]
            groups: list[dict[str, Any]] = [{"params": others}, {"params": [offsets]}]
            optimizer = self.make_optimizer(groups)
            optimizer.param_groups[1]["lr"] *= self.offset_rate
        if self.make_scheduler is None:
            return {"optimizer": optimizer}
        steps = int(self.trainer.estimated_stepping_batches)
        schedule = self.make_scheduler(optimizer, steps)
        return {"optimizer": optimizer, "lr_scheduler": {"scheduler": schedule, "interval": "step"}}
