"""How TensorBoard shows a run: its tags, the page of custom scalars, and histograms.

What is written when is decided in `callbacks`. TensorBoard sorts by the first word of a tag, and
opens the first groups: `train` and `val` have what matters, the other words come later.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from lightning import Trainer
from lightning.pytorch.loggers import TensorBoardLogger
from numpy.typing import ArrayLike
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData
from torch.utils.tensorboard import SummaryWriter
from torch.utils.tensorboard.summary import hparams

from ffd_lightning.evaluation.protocols import ProtocolDescription

# The page HPARAMS: what it shows to begin with, and what it lists beside the protocol's measures.
_TOLD_APART_BY = ("category", "regime", "templates")
_SHOWN = 5
_OTHERS = ("effective_templates", "entropy", "seconds_per_step")

_ALMOST_NOTHING = 1e-30
_BINS = 30  # that TensorBoard draws a histogram in

VALUES, WEIGHTED, WEIGHTS = "values_of_terms", "weighted_terms", "weights_of_terms"
"""Groups of curves: the objective's terms as they are, times their weights, and the weights."""


class StepLogger(TensorBoardLogger):
    """Counts steps from 1, as callbacks do, and leaves out the epoch: a run is one.

    Lightning calls the first step 0, and a validation after 100 steps 99. Of `train/...` only
    `box_chamfer` keeps its name: the loss goes beside the weighted terms that it is the sum of, and
    terms as they are have a group of their own.
    """

    def log_metrics(self, metrics: Mapping[str, float], step: int | None = None) -> None:
        """Write scalars of the step that Lightning calls `step`."""
        kept = {_tag(name): value for name, value in metrics.items() if name != "epoch"}
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
        """Write a run's results to the page HPARAMS, beside its settings.

        The page calls a number a metric if it is a curve too; results are numbers of one step, and
        would be dots among the curves. Here they stand among the settings.

        Args:
            settings: what tells runs apart.
            summary: means of the evaluation, some of which are listed.
            protocol: that they are of.
            steps: optimizer steps done.
        """
        results = _listed(summary, protocol)
        experiment, start, end = hparams({**settings, **results}, {})
        # TensorBoard shows five columns: those that differ, then by the alphabet. It takes this
        # description from any one run, which cannot know what differs: it says what mostly does.
        plugin = experiment.value[0].metadata.plugin_data
        content = HParamsPluginData.FromString(plugin.content)
        shown = [*_TOLD_APART_BY, *results][:_SHOWN]
        for info in content.experiment.hparam_infos:
            info.differs = info.name in shown
        plugin.content = content.SerializeToString()
        # A run that logged nothing else, or whose log was closed, has no open file.
        writer = self.experiment._get_file_writer()
        for event in (experiment, start, end):
            writer.add_summary(event, steps)


def _tag(name: str) -> str:
    group, _, term = name.partition("/")
    if group != "train" or term == "box_chamfer":
        return name
    return f"{WEIGHTED if term == 'loss' else VALUES}/{term}"


def _listed(summary: Mapping[str, float], protocol: ProtocolDescription) -> dict[str, float]:
    """Return what the page HPARAMS lists of an evaluation, as people read it."""
    main = protocol.main_measure
    measures = {m.name: (m.title, m.factor) for m in protocol.measures}
    measures[f"undeformed_{main.name}"] = f"undeformed {main.title}", main.factor
    found = {
        title if factor == 1 else f"{title} x {factor:g}": factor * summary[name]
        for name, (title, factor) in measures.items()
        if name in summary
    }
    return found | {k.replace("_", " "): summary[k] for k in _OTHERS if k in summary}


def custom_scalars(terms: Iterable[str]) -> dict[str, Any]:
    """Return the layout of the page CUSTOM SCALARS.

    Tags are regular expressions there, matched from the start. TensorBoard joins the charts of all
    runs.

    Args:
        terms: those of the run's objective: each has a chart, as their sizes differ.
    """
    pages = {
        "selection on the validation shapes": {
            "effective templates": ["val/effective_templates$"],
            "entropy (nats)": ["val/entropy$"],
        },
        "box Chamfer (x 1000)": {
            "validation: deformed, and the template as it is": [
                "val/box_chamfer$",
                "val/undeformed_box_chamfer$",
            ],
            "training and validation": ["train/box_chamfer$", "val/box_chamfer$"],
        },
        "loss": {
            "loss and its weighted terms": [f"{WEIGHTED}/.*"],
            "weights of the terms": [f"{WEIGHTS}/.*"],
            "learning rate": ["work/learning_rate$"],
        },
        "terms without their weights": {term: [f"{VALUES}/{term}$"] for term in terms},
    }
    return {
        page: {title: ["Multiline", tags] for title, tags in charts.items()}
        for page, charts in pages.items()
    }


def tensorboard_writer(trainer: Trainer) -> SummaryWriter | None:
    """Return the trainer's TensorBoard writer, None where it has no such logger."""
    writer = getattr(trainer.logger, "experiment", None)
    return writer if isinstance(writer, SummaryWriter) else None


def write_bars(writer: SummaryWriter, tag: str, heights: ArrayLike, step: int) -> None:
    """Write a histogram that has a bar of its height at each template's number, from 1.

    TensorBoard draws a histogram as a line through the middles of 30 buckets of its own. These are
    the same, equally many for each template, of which the last is empty if there is room, as is the
    first of all: bars would run into one another and into the edge.
    """
    heights = np.asarray(heights, float)
    room = max(1, _BINS // len(heights))  # buckets of a template
    filled = max(1, room - 1)
    found = np.zeros(max(_BINS, len(heights)))
    lead = int(room * len(heights) < _BINS)
    for t, height in enumerate(heights):
        found[lead + t * room :][:filled] = height
    first = 1 - (lead + filled / 2) / room
    write_buckets(writer, tag, found, first + np.arange(len(found) + 1) / room, step)


def write_buckets(
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
