"""How far a run is: for whoever looks at the screen or a log, and in its folder."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

from lightning import Callback, LightningModule, Trainer

from ffd_lightning.progress import CountProgress
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.training.callbacks import Clock

_EVERY = 5.0  # seconds


class Progress(Callback):
    """Says steps, box Chamfer and time left, and writes them to `progress.json` now and then.

    A bar on a terminal, else a line now and then, in place of Lightning's bar, which fills a log
    with what is meant for a terminal.

    Args:
        run: whose folder to write to.
        clock: knows how long a step takes.
        show: say it, too.
    """

    _bar: CountProgress | None = None

    def __init__(self, run: RunFolder, clock: Clock, show: bool) -> None:
        self._run, self._clock, self._show = run, clock, show

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Begin, where the run is resumed."""
        self._done, show = trainer.global_step, self._show and trainer.is_global_zero
        self._bar = CountProgress("training", trainer.max_steps, self._done, show, "steps")
        self._bar.__enter__()
        self._write(trainer)

    def on_train_batch_end(self, trainer: Trainer, *_: Any) -> None:
        """Count the steps."""
        if self._bar is not None:
            self._bar.advance(trainer.global_step - self._done, partial(_box_chamfer, trainer))
            self._done = trainer.global_step
        if time.monotonic() - self._last > _EVERY:
            self._write(trainer)

    def _write(self, trainer: Trainer) -> None:
        self._last = time.monotonic()
        if trainer.is_global_zero:
            step, total = trainer.global_step, trainer.max_steps
            seconds = self._clock.seconds_per_step
            left = None if seconds != seconds else (total - step) * seconds  # nan: no step yet
            self._run.set_progress("training", step, total, left)

    def on_train_end(self, *_: Any) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.__exit__()
            self._bar = None

    def on_exception(self, *_: Any) -> None:
        """Take the bar away."""
        self.on_train_end()


def _box_chamfer(trainer: Trainer) -> str:
    """Return the last step's.

    Read only when it is said: Lightning's own `prog_bar` reads it back from the device at every
    step, which makes each step wait for the one before.
    """
    found = trainer.callback_metrics.get("train/box_chamfer")
    return "" if found is None else f"box Chamfer {float(found):.1f}"
