"""How things look in TensorBoard: steps, the page of custom scalars, histograms, images, clouds.

What is written when is decided in `callbacks`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from lightning import Trainer
from lightning.pytorch.loggers import TensorBoardLogger
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData
from torch import Tensor
from torch.utils.tensorboard import SummaryWriter
from torch.utils.tensorboard.summary import hparams

from ffd_lightning.geometry.nearest import nearest_neighbors
from ffd_lightning.metrics.selection import effective_templates

_FAR = 0.05  # of the bounding box's diagonal: the distance from which on a point is all red
_GAP = 0.1  # between clouds in one scene
_SCENE = {
    "camera": {"cls": "PerspectiveCamera", "fov": 30},
    "material": {"cls": "PointsMaterial", "size": 0.045},
}

_ALMOST_NOTHING = 1e-30

# The page HPARAMS: which settings come first, and which of an evaluation's thirty numbers it lists.
_TOLD_APART_BY = ("category", "regime", "templates", "seed")
_LISTED = (
    "chamfer",
    "undeformed_chamfer",
    "effective_templates",
    "emd",
    "iou",
    "entropy",
    "seconds_per_step",
)

# The page CUSTOM SCALARS. Tags are regular expressions there, matched from the start.
CUSTOM_SCALARS = {
    "training": {
        "loss and its unweighted terms": [
            "Multiline",
            [
                f"train/{t}$"
                for t in ("loss", "weighted_chamfer", "negative_entropy", "offset_penalty")
            ],
        ],
        "learning rate": ["Multiline", ["train/learning_rate$"]],
        "weights of the terms": ["Multiline", ["train/weight/.*"]],
    },
    "validation shapes": {
        "Chamfer distance, deformed and undeformed": [
            "Multiline",
            ["val/chamfer$", "val/undeformed_chamfer$"],
        ],
        "selection: entropy, effective templates": [
            "Multiline",
            ["val/entropy$", "val/effective_templates$"],
        ],
    },
}


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
        self, settings: Mapping[str, str | float], results: Mapping[str, float], steps: int
    ) -> None:
        """Write a run's results as scalars, and to the page HPARAMS beside its settings.

        Args:
            settings: what tells runs apart.
            results: by name; all become scalars `test/<name>`.
            steps: optimizer steps done.
        """
        self.log_metrics({f"test/{name}": value for name, value in results.items()}, steps - 1)
        listed = {f"test/{name}": results[name] for name in _LISTED if name in results}
        experiment, start, end = hparams(dict(settings), listed)
        # TensorBoard shows five settings: those that differ, then by the alphabet. It takes this
        # description from any one run, which cannot know what differs: it says what mostly does.
        plugin = experiment.value[0].metadata.plugin_data
        content = HParamsPluginData.FromString(plugin.content)
        for info in content.experiment.hparam_infos:
            info.differs = info.name in _TOLD_APART_BY
        plugin.content = content.SerializeToString()
        for summary in (experiment, start, end):
            self.experiment.file_writer.add_summary(summary, steps)


def distance_colors(a: Tensor, b: Tensor) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Colour the points of two clouds by the distance to the nearest point of the other.

    Args:
        a: (n, 3), box diagonal 1.
        b: (m, 3).

    Returns:
        RGB of both, (n, 3) and (m, 3) uint8: from blue (no distance) to red (0.05 and more).
    """
    nearest = nearest_neighbors(a, b)
    return _colors(nearest.a_to_b), _colors(nearest.b_to_a)


def _colors(squared: Tensor) -> NDArray[np.uint8]:
    distances = squared.sqrt().numpy()
    shade = 0.1 + 0.8 * np.minimum(distances / _FAR, 1)  # both ends of the colours are near black
    return np.round(255 * colormaps["turbo"](shade)[:, :3]).astype(np.uint8)


def selection_bars(counts: ArrayLike, weights: ArrayLike) -> NDArray[np.uint8]:
    """Draw how often each template is selected, most used first, and its mean weight.

    Args:
        counts: selections per template, (T,).
        weights: mean weight per template, (T,).

    Returns:
        RGB image, (H, W, 3) uint8.
    """
    counts, weights = np.asarray(counts), np.asarray(weights)
    order = np.argsort(-counts, kind="stable")
    places = np.arange(len(counts))
    figure = Figure(figsize=(5, 3), dpi=100, layout="constrained")
    axes = figure.add_subplot()
    axes.bar(places, 100 * counts[order] / counts.sum(), color="tab:blue", label="selected")
    axes.plot(places, 100 * weights[order], "o", ms=4, color="tab:orange", label="mean weight")
    axes.set_xticks(places, [str(t) for t in order], fontsize=9 if len(order) <= 16 else 6)
    axes.set_xlabel("template")
    axes.set_ylabel(f"% of {counts.sum()} test images")
    axes.set_title(
        f"{(counts > 0).sum()} of {len(counts)} templates selected, "
        f"effectively {effective_templates(counts):.1f}",
        fontsize=11,
    )
    axes.legend(loc="upper right")
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def tensorboard_writer(trainer: Trainer) -> SummaryWriter | None:
    """Return the trainer's TensorBoard writer, None where it has no such logger."""
    writer = getattr(trainer.logger, "experiment", None)
    return writer if isinstance(writer, SummaryWriter) else None


def write_clouds(
    writer: SummaryWriter, tag: str, pairs: Sequence[tuple[Tensor, Tensor]], step: int
) -> None:
    """Write deformed clouds, each with the truth to its right, below one another to the page MESH.

    All in one scene: the page does not say which tag it shows, and browsers keep few scenes alive.
    The first deformed cloud stays where it is. Colours: `distance_colors`.
    """
    clouds = [cloud for pair in pairs for cloud in pair]
    corners = torch.stack([torch.stack([c.amin(0), c.amax(0)]) for c in clouds])
    cell = corners[:, 1].amax(0) - corners[:, 0].amin(0) + _GAP
    places = [cell * cell.new_tensor([k % 2, -(k // 2), 0]) for k in range(len(clouds))]
    points = torch.cat([cloud + place for cloud, place in zip(clouds, places, strict=True)])
    colors = np.concatenate([color for a, b in pairs for color in distance_colors(a, b)])
    writer.add_mesh(tag, points[None], torch.from_numpy(colors)[None], None, _SCENE, step)


def write_bars(writer: SummaryWriter, tag: str, heights: ArrayLike, step: int) -> None:
    """Write a histogram whose bucket t has the height of template t."""
    heights = np.asarray(heights, float)
    write_buckets(writer, tag, heights, np.arange(len(heights) + 1) - 0.5, step)


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
