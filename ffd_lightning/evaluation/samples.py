"""Scoring test samples one by one: in parallel, resumable, the same numbers however it is run."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import normalize

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.protocols import EvaluationProtocol
from ffd_lightning.evaluation.shapes import PreparedShape, Shape, TemplateShape
from ffd_lightning.files import write_atomic
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import deform
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.parallel import in_threads
from ffd_lightning.progress import CountProgress

Row = dict[str, Any]
Scores = dict[str, float]
"""Of one shape, by the name of the measure."""

_POINTS = 1024  # of each cloud, for the oracle that chooses the best template


class Sample(NamedTuple):
    """One image: a row of a prepared set, and one of its views."""

    row: int
    view: int = 0


@dataclass(frozen=True)
class Predictions:
    """What a network says of n images.

    Attributes:
        weights: template weights, (n, T).
        offsets: of control points, (n, T, M, 3).
    """

    weights: NDArray[np.float32]
    offsets: NDArray[np.float32]

    @property
    def selected(self) -> NDArray[np.int64]:
        """The template of the greatest weight for each image, (n,)."""
        return self.weights.argmax(1)


def predict(
    network: TemplateFfdNetwork,
    prepared: PreparedSet,
    samples: Sequence[Sample],
    workers: int = 1,
    show: bool = False,
) -> Predictions:
    """Run a network over images, on the device it is on.

    Args:
        network: put into evaluation mode here.
        prepared: where the images are.
        samples: which of them.
        workers: images at once (CPU).
        show: progress on stderr.

    Raises:
        DataError: an output is not finite.
    """

    def outputs(images: Tensor) -> tuple[Tensor, ...]:
        prediction = network(images)
        return prediction.template_weights, prediction.offsets

    weights, offsets = _of_images(outputs, network, prepared, samples, workers, show)
    if not (weights.isfinite().all() and offsets.isfinite().all()):
        raise DataError(
            "the network's outputs are not finite: its training has diverged (a smaller "
            "schedule.learning_rate may help) or its checkpoint is damaged"
        )
    return Predictions(weights.numpy(), offsets.numpy())


def encode(
    network: TemplateFfdNetwork,
    prepared: PreparedSet,
    samples: Sequence[Sample],
    workers: int = 1,
    show: bool = False,
) -> Tensor:
    """Return the encoder's features of images, of length 1, (n, D); see `predict`."""

    def outputs(images: Tensor) -> tuple[Tensor, ...]:
        features = network.features(images).flatten(1).float()
        return (normalize(features, dim=1),)

    return _of_images(outputs, network, prepared, samples, workers, show)[0]


def _of_images(
    outputs: Callable[[Tensor], tuple[Tensor, ...]],
    network: TemplateFfdNetwork,
    prepared: PreparedSet,
    samples: Sequence[Sample],
    workers: int,
    show: bool,
) -> list[Tensor]:
    """Return what comes out for all images.

    On the CPU one image at a time, each in one thread: the last digits of a convolution may depend
    on what else is in the batch and on the number of threads, and a score must not.
    """
    network.eval()
    device = next(network.parameters()).device
    size, threads = (1, workers) if device.type == "cpu" else (32, 1)

    @torch.no_grad()
    def run(start: int) -> list[Tensor]:
        chunk = samples[start : start + size]
        images = np.stack([prepared.image(s.row, s.view)[..., :3] for s in chunk])
        batch = torch.from_numpy(images).permute(0, 3, 1, 2).to(device)
        return [output.float().cpu() for output in outputs(batch)]

    done: dict[int, list[Tensor]] = {}
    starts = range(0, len(samples), size)
    with CountProgress("looking at images", len(starts), 0, show) as bar:
        for start, found in in_threads(run, starts, threads):
            done[start] = found
            bar.advance()
    return [torch.cat(parts) for parts in zip(*(done[k] for k in starts), strict=True)]


@torch.no_grad()
def best_template(
    prepared: PreparedSet,
    row: int,
    bank: TemplateBank,
    offsets: NDArray[np.float32] | None = None,
) -> int:
    """Return the template nearest to a shape in Chamfer distance.

    Args:
        prepared: the shapes.
        row: the shape.
        bank: T templates.
        offsets: that deform them, (T, M, 3); None leaves them as they are.
    """
    truth, points = torch.from_numpy(prepared.cloud(row, _POINTS)), bank.points[:, :_POINTS]
    if offsets is not None:
        matrix = bank.deformation_matrix[:, :_POINTS]
        points = deform(matrix, bank.control_points, torch.from_numpy(offsets))
    return int(chamfer_distance(points, truth, "mean").argmin())


def score_sample(
    protocol: EvaluationProtocol,
    prepared: PreparedSet,
    row: int,
    shapes: Mapping[str, Shape],
    seed: int,
) -> Row:
    """Score all shapes put before one shape, as `score_shapes` does.

    Returns:
        Each measure of each shape, under `<name>_<measure>`, or `<measure>` for the name "".
    """
    return as_columns(score_shapes(protocol, prepared, row, shapes, seed))


def as_columns(scores: Mapping[str, Scores]) -> Row:
    """Name scores as the columns of a table.

    >>> as_columns({"": {"iou": 0.5}, "floor": {"iou": 1.0}})
    {'iou': 0.5, 'floor_iou': 1.0}
    """
    return {
        f"{name}_{measure}" if name else measure: value
        for name, own in scores.items()
        for measure, value in own.items()
    }


def score_shapes(
    protocol: EvaluationProtocol,
    prepared: PreparedSet,
    row: int,
    shapes: Mapping[str, Shape | Scores],
    seed: int,
) -> dict[str, Scores]:
    """Score all shapes put before one shape.

    Which points are drawn follows from the model's id and the seed alone, and is the same for every
    shape. A shape that stands under several names is scored once.

    Args:
        protocol: how it is measured.
        prepared: the set of the shape that they are put before.
        row: of that shape.
        shapes: by name; scores that are known already stand for their shape.
        seed: of what is drawn.

    Returns:
        Each measure of each shape, by its name.
    """
    key = sample_seed(prepared.ids[row])
    truth = protocol.truth(PreparedShape(prepared, row), np.random.default_rng([seed, key, 0]))
    known: dict[object, Scores] = {}
    result: dict[str, Scores] = {}
    for name, shape in shapes.items():
        if isinstance(shape, dict):
            result[name] = shape
            continue
        same = _identity(shape)
        if same not in known:
            scores = protocol.score(shape, truth, np.random.default_rng([seed, key, 1]))
            known[same] = _checked(protocol, scores)
        result[name] = known[same]
    return result


def sample_seed(shape_id: str) -> int:
    """Return what is drawn with for a shape: 64 bits that follow from its id alone."""
    return int.from_bytes(hashlib.sha256(shape_id.encode()).digest()[:8], "big")


def _checked(protocol: EvaluationProtocol, scores: Any) -> Scores:
    """Return what a protocol's `score` gave, if it has a number for each measure."""
    for measure in protocol.measures:
        score = scores.get(measure.name) if isinstance(scores, Mapping) else None
        if not isinstance(score, int | float | np.number):
            raise ConfigError(
                f"protocol {protocol.name!r}: its score must give a number for each measure by "
                f"name; for {measure.name!r} there is none in {scores!r}"
            )
    return dict(scores)


def _identity(shape: Shape) -> object:
    if isinstance(shape, TemplateShape):
        return type(shape), shape.index, None if shape.offsets is None else shape.offsets.tobytes()
    if isinstance(shape, PreparedShape):
        return id(shape.prepared), shape.row  # the sets of truth and references may be two
    return id(shape)


class Journal:
    """Rows that are done, a line each, kept until all are: what a kill leaves is read again.

    `rows` has them by (id, view).

    Args:
        path: of the file.
        key: decides the rows; a file of another key is begun anew.
    """

    def __init__(self, path: Path, key: str) -> None:
        self.rows: dict[tuple[str, int], Row] = {}
        self._path = path
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        if lines and lines[0] == json.dumps({"key": key}):
            for line in lines[1:]:
                try:
                    row = json.loads(line)
                    self.rows[row["id"], row["view"]] = row
                except (ValueError, KeyError, TypeError):
                    continue  # cut off by a kill
        # Written anew: a line that was cut off must not swallow the next.
        kept = [{"key": key}, *self.rows.values()]
        write_atomic(path, "".join(json.dumps(row) + "\n" for row in kept))
        self._file = path.open("a", encoding="utf-8")

    def add(self, row: Row) -> None:
        """Keep one row."""
        self.rows[row["id"], row["view"]] = row
        self._file.write(json.dumps(row) + "\n")
        self._file.flush()

    def close(self, remove: bool = False) -> None:
        """Close the file; remove it when its rows are elsewhere."""
        self._file.close()
        if remove:
            self._path.unlink(missing_ok=True)
