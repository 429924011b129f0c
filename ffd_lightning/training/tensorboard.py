"""How TensorBoard shows a run: scalars, bars, clouds; `callbacks` decide what is written when."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from lightning import Trainer
from lightning.pytorch.loggers import TensorBoardLogger
from matplotlib import colormaps
from numpy.typing import ArrayLike
from PIL import Image
from torch import Tensor
from torch.utils.tensorboard import SummaryWriter
from torch.utils.tensorboard.summary import hparams

from ffd_lightning.evaluation.protocols import ProtocolDescription
from ffd_lightning.geometry.nearest import nearest_neighbors
from ffd_lightning.imaging.grid import Picture, grid, joined, legend, text_width, write
from ffd_lightning.metrics.selection import effective_templates
from ffd_lightning.palette import COLORS, rgb

_OTHERS = ("effective_templates", "entropy", "seconds_per_step")
_ALMOST_NOTHING = 1e-30
_COLUMNS = 8  # TensorBoard shrinks pictures to some 300 pixels
_BARS, _FONT = 84, 14  # height of the highest bar, and of letters
_SHARE, _WEIGHT = rgb(COLORS[-1]), rgb(COLORS[-2])

_FAR = 0.05  # of the box diagonal: the distance from which on points have the last colour
_FAR_SHADE = 0.85  # plasma's end is lost on white
_GAP = 0.1  # between clouds in one scene
_SCENE = {
    "camera": {"cls": "PerspectiveCamera", "fov": 30},
    "material": {"cls": "PointsMaterial", "size": 0.045},
}
CLOUD_LEGEND = (
    "deformed cloud left, truth right; from blue, where they touch, to orange, "
    f"{_FAR:.0%} of the box diagonal off"
)
"""What the colours and places of `write_clouds` say."""


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


def write_histogram(writer: SummaryWriter, tag: str, heights: ArrayLike, step: int) -> None:
    """Write a histogram of the numbers from 1 to n, of given heights (n,)."""
    heights = np.array(heights, float)
    # TensorBoard cuts empty buckets off at both ends, and stretches what is left over their place.
    heights[[0, -1]] = np.maximum(heights[[0, -1]], _ALMOST_NOTHING)
    centers = np.arange(len(heights)) + 1.0
    writer.add_histogram_raw(
        tag,
        min=0.5,
        max=len(heights) + 0.5,
        num=heights.sum(),
        sum=(heights * centers).sum(),
        sum_squares=(heights * centers**2).sum(),
        bucket_limits=(centers + 0.5).tolist(),
        bucket_counts=heights.tolist(),
        global_step=step,
    )


def selection_bars(
    counts: ArrayLike, weights: ArrayLike, pictures: Sequence[Picture]
) -> Image.Image:
    """Draw how often each template is selected, (T,), most used first, and its mean weight, (T,).

    Below its bars a template has its picture, all of one size, its number, which counts from 1, and
    its share.
    """
    counts, weights = np.asarray(counts), np.asarray(weights, float)
    shares = counts / counts.sum()
    scale = _BARS / max(shares.max(), weights.max())
    order = np.argsort(-counts, kind="stable")
    cells = []
    for t in order:
        height, width = pictures[t].shape[:2]
        cell = np.full((_BARS + height, width, 3), 255, np.uint8)
        cell[_BARS:] = pictures[t][..., :3]
        for left, value, color in ((0.16, shares[t], _SHARE), (0.5, weights[t], _WEIGHT)):
            columns = slice(round(left * width), round((left + 0.34) * width))
            cell[_BARS - round(scale * value) : _BARS, columns] = color
        cells.append(cell)
    labels = [f"{t + 1}: {shares[t]:.0%}" for t in order]
    bars = grid(cells, _COLUMNS, labels, font_size=_FONT)
    words = f"{(counts > 0).sum()} of {len(counts)} templates selected, "
    words += f"effectively {effective_templates(counts):.1f}"
    head = Image.new("RGB", (max(bars.width, 8 + round(text_width(words, _FONT))), 24), "white")
    write(head, words, 4, 12, _FONT)
    colors = {f"% of {counts.sum()} images": _SHARE, "mean weight": _WEIGHT}
    return joined([head, legend(colors, head.width, _FONT), bars])


def write_clouds(
    writer: SummaryWriter, tag: str, pairs: Sequence[tuple[Tensor, Tensor]], step: int
) -> None:
    """Write deformed clouds, each with the truth to its right, below one another to the page MESH.

    All in one scene, as browsers keep few scenes alive. The first deformed cloud stays where it is.
    Clouds are (n, 3) and (m, 3), of box diagonal 1. Their points are coloured by the distance to
    the nearest point of the other: from blue (no distance) to orange (0.05 and more).
    """
    clouds = [cloud for pair in pairs for cloud in pair]
    corners = torch.stack([torch.stack([c.amin(0), c.amax(0)]) for c in clouds])
    cell = corners[:, 1].amax(0) - corners[:, 0].amin(0) + _GAP
    places = [cell * cell.new_tensor([k % 2, -(k // 2), 0]) for k in range(len(clouds))]
    points = torch.cat([cloud + place for cloud, place in zip(clouds, places, strict=True)])
    nearest = [nearest_neighbors(a, b) for a, b in pairs]
    squared = torch.cat([both for found in nearest for both in (found.a_to_b, found.b_to_a)])
    shade = _FAR_SHADE * np.minimum(squared.sqrt().numpy() / _FAR, 1)
    colors = np.round(255 * colormaps["plasma"](shade)[:, :3]).astype(np.uint8)
    writer.add_mesh(tag, points[None], torch.from_numpy(colors)[None], None, _SCENE, step)
