"""How far a run is: for whoever looks at the screen or a log, and in its folder."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

from lightning import Callback, LightningModule, Trainer

from ffd_lightning.progress import CountProgress
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.training.callbacks import StepTimer

_EVERY = 5.0  # seconds


class StepProgress(Callback):
    """Shows steps, box Chamfer and time left: a bar on a terminal, else a line now and then.

    In place of Lightning's bar, which fills a log with what is meant for a terminal.
    """

    _bar: CountProgress | None = None

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Begin, where the run is resumed."""
        self._done, shown = trainer.global_step, trainer.is_global_zero
        bar = CountProgress("training", trainer.max_steps, self._done, shown, "steps")
        self._bar = bar.__enter__()

    def on_train_batch_end(self, trainer: Trainer, *_: Any) -> None:
        """Count the steps."""
        if self._bar is not None:
            self._bar.advance(trainer.global_step - self._done, partial(_box_chamfer, trainer))
            self._done = trainer.global_step

    def on_train_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Take the bar away."""
        self._end()

    def on_exception(self, *_: Any) -> None:
        """Take the bar away."""
        self._end()

    def _end(self) -> None:
        if self._bar is not None:
            self._bar.__exit__(None, None, None)
            self._bar = None


def _box_chamfer(trainer: Trainer) -> str:
    """Return the last step's, for people.

    Read only when it is shown: Lightning's own `prog_bar` reads it back from the device at every
    step, which makes each step wait for the one before.
    """
    found = trainer.callback_metrics.get("train/box_chamfer")
    return "" if found is None else f"box Chamfer {float(found):.1f}"


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
