"""Checkpoints of a training: whole, and of steps that are over."""

from pathlib import Path
from typing import Any

import torch
from lightning import LightningModule, Trainer
from lightning.pytorch.callbacks import ModelCheckpoint
from lightning.pytorch.plugins.io import TorchCheckpointIO

from ffd_lightning.files import atomic_file


class WholeFiles(TorchCheckpointIO):
    """Writes a checkpoint beside the one that it replaces.

    Lightning writes it to the system's temporary folder. If that is on another disk, a kill during
    the move leaves half a file, and no other.
    """

    def save_checkpoint(
        self, checkpoint: dict[str, Any], path: str | Path, storage_options: Any | None = None
    ) -> None:
        """Write it, and the folders that it is in."""
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        with atomic_file(Path(path)) as file:
            torch.save(checkpoint, file)


class Checkpoints(ModelCheckpoint):
    """Saves a step that is followed by a validation after that.

    Lightning saves it before, and a training that is resumed goes on with the next step: what the
    validation writes to the log would be missing for good.
    """

    def on_train_batch_end(
        self, trainer: Trainer, pl_module: LightningModule, outputs: Any, batch: Any, batch_idx: int
    ) -> None:
        """Save, unless a validation follows."""
        every = trainer.val_check_batch if sum(trainer.num_val_batches) else None
        if not every or (batch_idx + 1) % every:
            super().on_train_batch_end(trainer, pl_module, outputs, batch, batch_idx)

    def on_validation_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Save, once the log is written."""
        for logger in trainer.loggers:
            logger.save()
        super().on_train_batch_end(trainer, pl_module, None, None, 0)
