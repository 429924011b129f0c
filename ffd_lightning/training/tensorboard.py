"""How TensorBoard shows a run; what is written when is decided in `callbacks`."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from lightning import Trainer
from lightning.pytorch.loggers import TensorBoardLogger
from numpy.typing import ArrayLike
from torch.utils.tensorboard import SummaryWriter
from torch.utils.tensorboard.summary import hparams

from ffd_lightning.evaluation.protocols import ProtocolDescription

_OTHERS = ("effective_templates", "entropy", "seconds_per_step")
_ALMOST_NOTHING = 1e-30


class StepLogger(TensorBoardLogger):
    """Counts steps from 1, as callbacks do, and leaves out the epoch: a run is one.

    Lightning calls the first step 0, and a validation after 100 steps 99.
    """

    def log_metrics(self, metrics: Mapping[str, float], step: int | None = None) -> None:
        """Write scalars of the step that Lightning calls `step`."""
        kept = {name: value for name, value in metrics.items() if name != "epoch"}
        super().log_metrics(kept, None if step is None else step + 1)

    def save(self) -> None:
        """Write what is pending; Lightning would put an empty `hparams.yaml` beside it."""
        self.experiment.flush()

    def log_results(
        self,
        settings: Mapping[str, str | float],
        summary: Mapping[str, float],
        protocol: ProtocolDescription,
        steps: int,
    ) -> None:
        """Write a run's results to the page HPARAMS, among its settings.

        What that page calls a metric would be a dot among the curves, too. `summary` has means
        under the protocol, after so many optimizer steps.
        """
        main = protocol.main_metric
        measures = {m.name: (m.scaled_title, m.factor) for m in protocol.metrics}
        measures[f"undeformed_{main.name}"] = f"undeformed {main.scaled_title}", main.factor
        found = ((*measures[name], summary[name]) for name in measures if name in summary)
        results = {title: factor * value for title, factor, value in found}
        results |= {k.replace("_", " "): summary[k] for k in _OTHERS if k in summary}
        # A run that logged nothing else, or whose log was closed, has no open file.
        writer = self.experiment._get_file_writer()
        for event in hparams({**settings, **results}, {}):
            writer.add_summary(event, steps)


def tensorboard_writer(trainer: Trainer) -> SummaryWriter | None:
    """Return the trainer's TensorBoard writer, None where it has no such logger."""
    writer = getattr(trainer.logger, "experiment", None)
    return writer if isinstance(writer, SummaryWriter) else None


def write_histogram(
    writer: SummaryWriter, tag: str, heights: ArrayLike, edges: ArrayLike, step: int
) -> None:
    """Write a histogram of given heights (n,) between given edges (n + 1,)."""
    heights, edges = np.array(heights, float), np.asarray(edges, float)
    # TensorBoard cuts empty buckets off at both ends, and stretches what is left over their place.
    heights[[0, -1]] = np.maximum(heights[[0, -1]], _ALMOST_NOTHING)
    centers = (edges[1:] + edges[:-1]) / 2
    writer.add_histogram_raw(
        tag,
        min=edges[0],
        max=edges[-1],
        num=heights.sum(),
        sum=(heights * centers).sum(),
        sum_squares=(heights * centers**2).sum(),
        bucket_limits=edges[1:].tolist(),
        bucket_counts=heights.tolist(),
        global_step=step,
    )
