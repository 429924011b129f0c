"""What is watched during training: time per step, template selection, example images."""

from __future__ import annotations

import statistics
import time
from collections import deque
from typing import Any

import numpy as np
from lightning import Callback, LightningModule, Trainer
from lightning.pytorch.callbacks import TQDMProgressBar
from numpy.typing import ArrayLike
from torch.utils.tensorboard import SummaryWriter

from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.evaluation.template_scores import TemplateScores
from ffd_lightning.training.module import FfdModule

_WARM_UP_STEPS = 5
_KEPT_STEPS = 1000


class StepTimer(Callback):
    """Median wall time from one step's end to the next, data included, validation left out.

    Of the last 1,000 steps, the first 5 of those left out as warm-up.
    """

    def __init__(self) -> None:
        self._durations: deque[float] = deque(maxlen=_KEPT_STEPS)
        self._last: float | None = None

    def on_train_batch_end(self, *_: Any) -> None:
        """Note the time since the last step."""
        now = time.perf_counter()
        if self._last is not None:
            self._durations.append(now - self._last)
        self._last = now

    def on_validation_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Leave the pause out."""
        self._last = None

    def state_dict(self) -> dict[str, Any]:
        """Keep the durations in checkpoints, so that a resumed run reports its whole."""
        return {"durations": list(self._durations)}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Take up the durations of a checkpoint."""
        self._durations.extend(state_dict["durations"])

    @property
    def seconds_per_step(self) -> float:
        """Median in seconds, warm-up left out; nan before there is any."""
        durations = list(self._durations)
        durations = durations[_WARM_UP_STEPS:] or durations
        return statistics.median(durations) if durations else float("nan")


class StepProgressBar(TQDMProgressBar):
    """Lightning's progress bar, counting steps of the whole training."""

    def get_metrics(self, trainer: Trainer, pl_module: LightningModule) -> dict[str, Any]:
        """Show the Chamfer distance of the selected templates; nothing of the logger's.

        Read here, where the bar is redrawn: Lightning's own `prog_bar` reads it back from the
        device at every step, which makes each step wait for the one before.
        """
        chamfer = trainer.callback_metrics.get("train/chamfer")
        return {} if chamfer is None else {"chamfer": f"{float(chamfer):.4f}"}

    def on_train_epoch_start(self, trainer: Trainer, *_: Any) -> None:
        """Name the bar: the only epoch is the run."""
        super().on_train_epoch_start(trainer)
        self.train_progress_bar.set_description("training")


class TemplateHistograms(Callback):
    """Draws template selection into TensorBoard at every validation.

    Tags: `templates/selected` (times each template was selected), `templates/selected_sorted` (the
    same, most used first) and `templates/mean_weight`; the horizontal axis is the template.
    """

    def on_validation_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Write the three histograms."""
        writer = tensorboard_writer(trainer)
        if writer is None or trainer.sanity_checking or not isinstance(pl_module, FfdModule):
            return
        scores = TemplateScores.concatenate(pl_module.validation_scores)
        step = trainer.global_step
        _bars(writer, "templates/selected", scores.counts, step)
        _bars(writer, "templates/selected_sorted", np.sort(scores.counts)[::-1], step)
        _bars(writer, "templates/mean_weight", scores.weights.mean(0), step)


class ExampleImages(Callback):
    """Writes a few of the test images into TensorBoard as training starts."""

    def __init__(self, count: int) -> None:
        self.count = count

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Write the images once."""
        writer, data = tensorboard_writer(trainer), getattr(trainer, "datamodule", None)
        if writer is None or trainer.global_step > 0 or not isinstance(data, FfdDataModule):
            return
        rows = data.rows(data.split.test[: self.count])
        images = np.stack([data.prepared.image(r)[..., :3] for r in rows])
        writer.add_images("examples/input", images, 0, dataformats="NHWC")


def tensorboard_writer(trainer: Trainer) -> SummaryWriter | None:
    """Return the trainer's TensorBoard writer, None where it has no such logger."""
    writer = getattr(trainer.logger, "experiment", None)
    return writer if isinstance(writer, SummaryWriter) else None


def _bars(writer: SummaryWriter, tag: str, heights: ArrayLike, step: int) -> None:
    """Write a histogram whose bucket t has the height of template t."""
    heights = np.asarray(heights, float)
    places = np.arange(len(heights))
    writer.add_histogram_raw(
        tag,
        min=-0.5,
        max=len(heights) - 0.5,
        num=heights.sum(),
        sum=(heights * places).sum(),
        sum_squares=(heights * places**2).sum(),
        bucket_limits=(places + 0.5).tolist(),
        bucket_counts=heights.tolist(),
        global_step=step,
    )
