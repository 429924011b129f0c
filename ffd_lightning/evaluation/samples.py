"""Scoring test samples one by one: in parallel, resumable, the same numbers however it is run."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from ffd_lightning.data.prepared import PreparedSet
from ffd_lightning.data.templates import TemplateBank
from ffd_lightning.evaluation.protocols import EvaluationProtocol
from ffd_lightning.evaluation.shapes import ModelShape, Shape, TemplateShape
from ffd_lightning.geometry.deformation import deform
from ffd_lightning.losses.chamfer import chamfer_distance
from ffd_lightning.nn.network import TemplateFfdNetwork, standardize
from ffd_lightning.run_folder import write_atomic

Row = dict[str, Any]
_POINTS = 1024  # of each cloud, for choosing the best template knowing the truth


@dataclass(frozen=True)
class Predictions:
    """What a network says of n images.

    Attributes:
        weights: template weights, (n, T).
        offsets: of control points, (n, T, M, 3).
        features: the encoder's, of length 1, (n, D).
    """

    weights: NDArray[np.float32]
    offsets: NDArray[np.float32]
    features: torch.Tensor

    @property
    def selected(self) -> NDArray[np.int64]:
        """The template of the greatest weight for each image, (n,)."""
        return self.weights.argmax(1)


@torch.no_grad()
def predict(
    network: TemplateFfdNetwork, prepared: PreparedSet, rows: Sequence[int], view: int = 0
) -> Predictions:
    """Run a network over one view of models, on the device it is on.

    On the CPU one image at a time and in one thread: the last digits of a convolution may depend on
    what else is in the batch, and a score must not.
    """
    network.eval()
    device = next(network.parameters()).device
    size = 32 if device.type == "cuda" else 1
    weights, offsets, features = [], [], []
    with _one_thread():
        for start in range(0, len(rows), size):
            images = np.stack(
                [prepared.image(r, view)[..., :3] for r in rows[start : start + size]]
            )
            batch = torch.from_numpy(images).permute(0, 3, 1, 2).to(device)
            prediction = network(batch)
            feature = network.encoder(standardize(batch)).flatten(1).float()
            weights.append(prediction.template_weights.float().cpu())
            offsets.append(prediction.offsets.float().cpu())
            features.append(torch.nn.functional.normalize(feature, dim=1).cpu())
    return Predictions(torch.cat(weights).numpy(), torch.cat(offsets).numpy(), torch.cat(features))


@torch.no_grad()
def best_templates(
    prepared: PreparedSet, row: int, bank: TemplateBank, offsets: NDArray[np.float32]
) -> tuple[int, int]:
    """Return the templates nearest to a model in Chamfer distance: as they are, and deformed.

    Args:
        prepared: the models.
        row: the model.
        bank: T templates.
        offsets: of the model's image, (T, M, 3).
    """
    truth = torch.from_numpy(prepared.cloud(row, _POINTS))
    matrix, points = bank.deformation_matrix[:, :_POINTS], bank.points[:, :_POINTS]
    deformed = deform(matrix, bank.control_points, torch.from_numpy(offsets))
    return (
        int(chamfer_distance(points, truth, "mean").argmin()),
        int(chamfer_distance(deformed, truth, "mean").argmin()),
    )


def score_sample(
    protocol: EvaluationProtocol,
    prepared: PreparedSet,
    row: int,
    shapes: Mapping[str, Shape],
    seed: int,
) -> Row:
    """Score all shapes put before one model.

    Which points are drawn follows from the model's id and the seed alone, and is the same for every
    shape. A shape that stands under several names is scored once.

    Returns:
        Each measure of each shape, under `<name>_<measure>`, or `<measure>` for the name "".
    """
    key = int.from_bytes(hashlib.sha256(prepared.ids[row].encode()).digest()[:8], "big")
    truth = protocol.truth(ModelShape(prepared, row), np.random.default_rng([seed, key, 0]))
    known: dict[object, dict[str, float]] = {}
    result: Row = {}
    for name, shape in shapes.items():
        same = _identity(shape)
        if same not in known:
            known[same] = protocol.score(shape, truth, np.random.default_rng([seed, key, 1]))
        result |= {f"{name}_{k}" if name else k: v for k, v in known[same].items()}
    return result


def _identity(shape: Shape) -> object:
    if isinstance(shape, TemplateShape):
        return shape.index, shape.offsets is None
    if isinstance(shape, ModelShape):
        return shape.row
    return id(shape)


class Journal:
    """Rows that are done, a line each, kept until all are: what a kill leaves is read again.

    Args:
        path: of the file.
        key: decides the rows; a file of another key is begun anew.
    """

    def __init__(self, path: Path, key: str) -> None:
        self.rows: dict[str, Row] = {}
        self._path = path
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        if lines and lines[0] == json.dumps({"key": key}):
            for line in lines[1:]:
                try:
                    row = json.loads(line)
                    self.rows[row["id"]] = row
                except (ValueError, KeyError, TypeError):
                    continue  # cut off by a kill
        # Written anew: a line that was cut off must not swallow the next.
        kept = [{"key": key}, *self.rows.values()]
        write_atomic(path, "".join(json.dumps(row) + "\n" for row in kept))
        self._file = path.open("a", encoding="utf-8")

    def add(self, row: Row) -> None:
        """Keep one row."""
        self.rows[row["id"]] = row
        self._file.write(json.dumps(row) + "\n")
        self._file.flush()

    def close(self, remove: bool = False) -> None:
        """Close the file; remove it when its rows are elsewhere."""
        self._file.close()
        if remove:
            self._path.unlink(missing_ok=True)


def in_threads(function: Callable[[int], Row], items: Sequence[int], workers: int) -> Iterator[Row]:
    """Yield function(item) as they are done; the heavy parts are compiled and free the interpreter.

    Ctrl-C, or an error, waits for the items in work and no more.
    """
    with _one_thread(), ThreadPoolExecutor(workers, thread_name_prefix="evaluation") as pool:
        todo = iter(items)
        pending: set[Future[Row]] = set()
        while True:
            for item in todo:
                pending.add(pool.submit(function, item))
                if len(pending) >= 2 * workers:
                    break
            if not pending:
                return
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            try:
                for future in done:
                    yield future.result()
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise


@contextmanager
def _one_thread() -> Iterator[None]:
    """Keep torch to one thread, as several at once would each start as many as there are cores."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
