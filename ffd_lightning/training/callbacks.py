"""What is watched during training, on the screen and in TensorBoard.

Tags in TensorBoard are written against the number of optimizer steps done. Nothing here draws
random numbers or changes a weight: a run is the same with and without.
"""

import statistics
import time
from collections import deque
from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from typing import Any

import numpy as np
import torch
from lightning import Callback, LightningModule, Trainer

from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.data.preparation.prepared import spread_rows
from ffd_lightning.evaluation.figures import reconstruction_figure, template_figure
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.geometry.ffd import deform
from ffd_lightning.imaging.grid import Picture
from ffd_lightning.imaging.rendering import render
from ffd_lightning.nn.network import evaluating
from ffd_lightning.progress import CountProgress
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.training.module import FfdModule
from ffd_lightning.training.tensorboard import (
    CLOUD_LEGEND,
    selection_bars,
    tensorboard_writer,
    write_clouds,
    write_histogram,
)

_WARM_UP_STEPS = 5
_KEPT_STEPS = 1000
_WRITTEN_EVERY = 5.0  # seconds
_CLOUD_POINTS = 2048


class Clock(Callback):
    """Times steps, data included and validation left out, and writes curves beside the logger's.

    Tags: `weighted_terms/<term>`, each term that is minimised times its weight: the loss is their
    sum, and a viewpoint head's loss; `work/learning_rate`; `work/steps_per_second` and
    `work/queries_per_second` (of all devices), means since the last point. A GPU's host does not
    wait for them: they are read where the logger waits anyway.

    Args:
        every: steps from one point of a curve to the next, as the logger's.
    """

    def __init__(self, every: int) -> None:
        self.every = every
        self._durations: deque[float] = deque(maxlen=_KEPT_STEPS)
        self._last: float | None = None
        self._rate = 0.0

    @property
    def seconds_per_step(self) -> float:
        """Median of the last 1,000 steps, the first 5 left out; nan before there is any."""
        durations = list(self._durations)
        durations = durations[_WARM_UP_STEPS:] or durations
        return statistics.median(durations) if durations else float("nan")

    def on_train_batch_start(self, trainer: Trainer, *_: Any) -> None:
        """Note the step's learning rate: at its end it is the next one's."""
        self._rate = trainer.optimizers[0].param_groups[0]["lr"]
        self._last = self._last or time.perf_counter()  # after a pause, without the data

    def on_train_batch_end(
        self, trainer: Trainer, pl_module: LightningModule, outputs: Any, batch: Any, batch_idx: int
    ) -> None:
        """Note the time since the last step, and write a point whenever the loss is written."""
        now, step = time.perf_counter(), trainer.global_step
        batches = trainer.accumulate_grad_batches
        if (batch_idx + 1) % batches:  # of a step that is not over
            return
        if self._last is not None:
            self._durations.append(now - self._last)
        self._last = now
        writer = tensorboard_writer(trainer)
        if writer is None or step % self.every:
            return
        assert isinstance(pl_module, FfdModule)
        writer.add_scalar("work/learning_rate", self._rate, step)
        values, weights = trainer.callback_metrics, pl_module.objective.weights(step - 1)
        for name, weight in {**weights, "selection": 1.0}.items():  # it may have a loss of its own
            if weight and f"train/{name}" in values:
                value = weight * float(values[f"train/{name}"])
                writer.add_scalar(f"weighted_terms/{name}", value, step)
        if recent := list(self._durations)[-self.every :]:
            speed = len(recent) / sum(recent)
            writer.add_scalar("work/steps_per_second", speed, step)
            queries = speed * len(batch.rows) * batches * trainer.world_size
            writer.add_scalar("work/queries_per_second", queries, step)

    def on_validation_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Leave the pause out."""
        self._last = None

    def state_dict(self) -> dict[str, Any]:
        """Keep the durations in checkpoints, so that a resumed run reports its whole."""
        return {"durations": list(self._durations)}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Take up the durations of a checkpoint."""
        self._durations.extend(state_dict["durations"])


class Progress(Callback):
    """Says steps, box Chamfer and time left, and writes them to `progress.json` now and then.

    A bar on a terminal, else a line now and then, in place of Lightning's bar, which fills a log
    with what is meant for a terminal.

    Args:
        run: whose folder to write to.
        clock: knows how long a step takes.
        show: say it, too.
    """

    def __init__(self, run: RunFolder, clock: Clock, show: bool) -> None:
        self._run, self._clock, self._show = run, clock, show
        self._shown = ExitStack()

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Begin, where the run is resumed."""
        self._done, show = trainer.global_step, self._show and trainer.is_global_zero
        bar = CountProgress("training", trainer.max_steps, self._done, show, "steps")
        self._bar = self._shown.enter_context(bar)
        self._write(trainer)

    def on_train_batch_end(self, trainer: Trainer, *_: Any) -> None:
        """Count the steps."""
        if trainer.global_step == self._done:  # of a step that is not over
            return
        self._bar.advance(trainer.global_step - self._done, partial(_box_chamfer, trainer))
        self._done = trainer.global_step
        if time.monotonic() - self._last > _WRITTEN_EVERY:
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
        self._shown.close()

    def on_exception(self, *_: Any) -> None:
        """Take the bar away."""
        self._shown.close()


def _box_chamfer(trainer: Trainer) -> str:
    """Return the last step's.

    Read only when it is said: Lightning's own `prog_bar` reads it back from the device at every
    step, which makes each step wait for the one before.
    """
    found = trainer.callback_metrics.get("train/box_chamfer")
    return "" if found is None else f"box Chamfer {float(found):.1f}"


class TemplateSelection(Callback):
    """Draws template selection into TensorBoard at every validation.

    Images: `which_template/all`, see `template_figure`, at the first, and `which_template/bars`,
    see `selection_bars`. Histogram: `which_template/selected`, share of the images, in percent, by
    the template's number from 1.
    """

    _pictures: Sequence[Picture] = ()

    def on_validation_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Write the images and the histogram."""
        writer, data = tensorboard_writer(trainer), getattr(trainer, "datamodule", None)
        if writer is None or trainer.sanity_checking or not isinstance(data, FfdDataModule):
            return
        assert isinstance(pl_module, FfdModule)
        scores = pl_module.scores
        if scores is None:  # no validation shapes
            return
        if not self._pictures:
            self._pictures = [render(m, height=54, width=72) for m in data.bank.meshes]
        step, shares = trainer.global_step, 100 * scores.counts / scores.counts.sum()
        if step <= _between_validations(trainer):
            figure = np.asarray(template_figure(data.bank))
            writer.add_image("which_template/all", figure, step, dataformats="HWC")
        image = np.asarray(selection_bars(scores.counts, scores.weights.mean(0), self._pictures))
        writer.add_image("which_template/bars", image, step, dataformats="HWC")
        write_histogram(writer, "which_template/selected", shares, step)


class Reconstructions(Callback):
    """Shows a few validation shapes as they are reconstructed, a few times while training.

    At validations, the last one included. Tags: `worked_examples/reconstructions`, the picture that
    `reconstruction_figure` draws (the last one is drawn when the run is evaluated), and on the page
    MESH `<name>: <legend>/clouds`, see `write_clouds`: of a tag the page shows what stands before
    the slash, of a run nothing.

    Args:
        examples: of how many the run's own figure is.
        count: how many of those are shown here.
        times: how often, spread evenly over training; 0 for never.
        name: the run's, which tags begin with.
    """

    def __init__(self, examples: int, count: int, times: int, name: str) -> None:
        self.examples, self.count, self.times = examples, count, times
        self._clouds = f"{name.replace('/', ' ')}: {CLOUD_LEGEND}/clouds"

    def on_validation_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Draw what is due."""
        writer, data = tensorboard_writer(trainer), getattr(trainer, "datamodule", None)
        step, total = trainer.global_step, trainer.max_steps
        last = step - _between_validations(trainer)
        due = self.times * step // total > self.times * last // total  # of equal parts, one ended
        if writer is None or trainer.sanity_checking or not due:
            return
        assert isinstance(pl_module, FfdModule)
        assert isinstance(data, FfdDataModule)
        rows = example_rows(data, self.examples)[: self.count]
        if not rows:
            return
        network, prepared, bank = pl_module.network, data.prepared, data.bank
        with evaluating(network):
            if step < total:
                figure = np.asarray(reconstruction_figure(network, prepared, bank, rows))
                writer.add_image("worked_examples/reconstructions", figure, step, dataformats="HWC")
            found = predict(network, prepared, [Sample(row) for row in rows])
        pairs = []
        for k, (row, t) in enumerate(zip(rows, found.selected, strict=True)):
            matrix, offsets = bank.deformation_matrix[t, :_CLOUD_POINTS], found.offsets[k, t]
            moved = deform(matrix, bank.control_points[t], torch.from_numpy(offsets))
            pairs.append((moved, torch.from_numpy(prepared.cloud(row, _CLOUD_POINTS))))
        write_clouds(writer, self._clouds, pairs, step)


def _between_validations(trainer: Trainer) -> int:
    """Return how many steps there are from one validation to the next."""
    return int(trainer.val_check_batch or 0) // trainer.accumulate_grad_batches


def example_rows(data: FfdDataModule, count: int) -> list[int]:
    """Return rows of `count` validation shapes, spread evenly; of all where there are fewer."""
    rows = data.rows(data.split.selection_ids)
    return rows[spread_rows(len(rows), count)].tolist()
