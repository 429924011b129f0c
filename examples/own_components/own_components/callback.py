"""A callback that takes part in the training; `only_watches = True` is for those that do not."""

from typing import Any

from lightning import Callback, Trainer

import ffd_lightning as ffd


@ffd.component("callback", "frozen_start")
class FrozenStart(Callback):
    """Keeps the encoder's weights as they are for the first steps.

    Args:
        steps: so many.
    """

    def __init__(self, steps: int = 2) -> None:
        self.steps = steps

    def on_train_batch_start(
        self, trainer: Trainer, pl_module: ffd.FfdModule, batch: Any, batch_idx: int
    ) -> None:
        """Freeze the encoder, or let it learn."""
        pl_module.network.encoder.requires_grad_(trainer.global_step >= self.steps)
