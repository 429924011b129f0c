"""How far a run is, noted in its folder for whoever looks from outside."""

from __future__ import annotations

import time
from typing import Any

from lightning import Callback, LightningModule, Trainer

from ffd_lightning.run_folder import RunFolder
from ffd_lightning.training.callbacks import StepTimer

_EVERY = 5.0  # seconds


class ProgressNote(Callback):
    """Writes the step and the time left to `progress.json`, every few seconds.

    Args:
        run: whose folder to write to.
        timer: knows how long a step takes.
    """

    def __init__(self, run: RunFolder, timer: StepTimer) -> None:
        self._run, self._timer = run, timer
        self._last = 0.0

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Note where it starts."""
        self._note(trainer)

    def on_train_batch_end(self, trainer: Trainer, *_: Any) -> None:
        """Note where it is, now and then."""
        if time.monotonic() - self._last > _EVERY:
            self._note(trainer)

    def _note(self, trainer: Trainer) -> None:
        if not trainer.is_global_zero:
            return
        self._last = time.monotonic()
        step, total = trainer.global_step, trainer.max_steps
        seconds = self._timer.seconds_per_step
        left = None if seconds != seconds else (total - step) * seconds  # nan: no step yet
        self._run.set_progress("training", step, total, left)
