"""Scoring test samples one by one: in parallel, resumable, the same numbers however it is run."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn.functional import normalize

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.candidates import Candidate, PreparedShape
from ffd_lightning.evaluation.protocols import Protocol
from ffd_lightning.files import write_atomic
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.parallel import in_threads
from ffd_lightning.progress import CountProgress

Row = dict[str, Any]

_AT_ONCE = 4096  # images


class Sample(NamedTuple):
    """One image: a row of a prepared set, and one of its views."""

    row: int
    view: int = 0


class Subset(NamedTuple):
    """Some shapes of a prepared set, by their rows, (n,)."""

    prepared: PreparedSet
    rows: NDArray[np.int64]

    def samples(self, all_views: bool) -> list[Sample]:
        """Return the shapes' images: the first of each, or all."""
        views = self.prepared.image_shape[0] if all_views else 1
        return [Sample(int(row), view) for row in self.rows for view in range(views)]

    def fingerprint(self) -> dict[str, str]:
        """Return what changes when the set, or the shapes taken from it, are others."""
        ids = "\n".join(self.prepared.ids[row] for row in self.rows)
        digest = hashlib.sha256(ids.encode()).hexdigest()
        return {"prepared": self.prepared.digest, "ids": digest}


@dataclass(frozen=True)
class Predictions:
    """What a network predicts for n images.

    Attributes:
        weights: template weights, (n, T).
        offsets: of control points, (n, T, M, 3).
        features: of the encoder, of length 1, (n, D).
        viewpoints: what the network says of the cameras, (n, 37); (n, 0) where it says nothing.
    """

    weights: NDArray[np.float32]
    offsets: NDArray[np.float32]
    features: NDArray[np.float32]
    viewpoints: NDArray[np.float32]

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
    """Run a network over images, on the device it is on, and leave it in evaluation mode.

    On the CPU one image at a time, each in one thread, `workers` at once: the last digits of a
    convolution may depend on what else is in the batch and on the number of threads, and a score
    must not.

    Raises:
        DataError: an output is not finite.
    """
    network.eval()
    device = next(network.parameters()).device
    size, threads = (1, workers) if device.type == "cpu" else (32, 1)

    @torch.no_grad()
    def run(start: int) -> list[NDArray[np.float32]]:
        chunk = samples[start : start + size]
        whole = [prepared.image(s.row, s.view) for s in chunk]
        images, masks = np.stack([x[..., :3] for x in whole]), np.stack([x[..., 3] for x in whole])
        features = network.features(torch.from_numpy(images).permute(0, 3, 1, 2).to(device))
        prediction = network.predict(features, torch.from_numpy(masks).to(device))
        unit = normalize(features.flatten(1).float(), dim=1)
        seen = unit[:, :0] if prediction.viewpoint is None else prediction.viewpoint
        outputs = prediction.template_weights, prediction.offsets, unit, seen
        return [output.float().cpu().numpy() for output in outputs]

    done: dict[int, list[NDArray[np.float32]]] = {}
    starts = range(0, len(samples), size)
    with CountProgress("looking at images", len(starts), 0, show) as bar:
        for start, outputs in in_threads(run, starts, threads):
            done[start] = outputs
            bar.advance()
    found = Predictions(*(np.concatenate(x) for x in zip(*(done[k] for k in starts), strict=True)))
    if not (np.isfinite(found.weights).all() and np.isfinite(found.offsets).all()):
        raise DataError(
            "the network's outputs are not finite: its training has diverged (a smaller "
            "schedule.learning_rate may help) or its checkpoint is damaged"
        )
    return found


def predict_in_chunks(
    network: TemplateFfdNetwork,
    prepared: PreparedSet,
    samples: Sequence[Sample],
    workers: int,
    show: bool = False,
) -> Iterator[Predictions]:
    """Yield what `predict` does: the offsets for all training images may not fit into memory."""
    for start in range(0, len(samples), _AT_ONCE):
        yield predict(network, prepared, samples[start : start + _AT_ONCE], workers, show)


def score_sample(
    protocol: Protocol,
    prepared: PreparedSet,
    row: int,
    candidates: Mapping[str, Candidate],
    seed: int,
) -> Row:
    """Score all candidates for one shape, a row of a prepared set.

    Which points are drawn follows from the shape's id and the seed alone, and is the same for every
    candidate. One that has several names is scored once.

    Returns:
        Each metric of each candidate, under `<name>_<metric>`, or `<metric>` for the name "".

    Raises:
        ConfigError: the protocol did not give a number for each metric.
    """
    key = sample_seed(prepared.ids[row])
    truth = protocol.truth(PreparedShape(prepared, row), np.random.default_rng([seed, key, 0]))
    known: dict[int, dict[str, float]] = {}
    columns: Row = {}
    for name, candidate in candidates.items():
        if id(candidate) not in known:
            scores = protocol.score(candidate, truth, np.random.default_rng([seed, key, 1]))
            known[id(candidate)] = _numbers(protocol, scores)
        prefix = f"{name}_" if name else ""
        columns |= {prefix + metric: value for metric, value in known[id(candidate)].items()}
    return columns


def sample_seed(shape_id: str) -> int:
    """Return what is drawn with for a shape: 64 bits that follow from its id alone."""
    return int.from_bytes(hashlib.sha256(shape_id.encode()).digest()[:8], "big")


def _numbers(protocol: Protocol, scores: Any) -> dict[str, float]:
    """Return what a protocol's `score` gave, if it has a number for each metric."""
    for metric in protocol.metrics:
        score = scores.get(metric.name) if isinstance(scores, Mapping) else None
        if not isinstance(score, int | float | np.number) or not np.isfinite(score):
            raise ConfigError(
                f"protocol {protocol.name!r}: its score must give a finite number for each metric "
                f"by name; for {metric.name!r} there is none in {scores!r}"
            )
    return {name: float(score) for name, score in scores.items()}


def score_all(
    score: Callable[[Sample], Row],
    samples: Mapping[tuple[str, int], Sample],
    journal: Journal,
    workers: int,
    show: bool,
    label: str,
) -> list[Row]:
    """Return the rows of samples, given by id and view; those that a journal has are not scored."""
    todo = [sample for name, sample in samples.items() if name not in journal.rows]
    with CountProgress(label, len(samples), len(samples) - len(todo), show) as bar:
        for _, row in in_threads(score, todo, workers):
            journal.add(row)
            bar.advance()
    return [journal.rows[name] for name in samples]


class Journal:
    """Rows that are done, a line each, kept in a file: what a kill leaves is read again.

    `rows` has them by (id, view). A file of another key, which decides the rows, is begun anew.
    """

    def __init__(self, path: Path, key: str, restart: bool = False) -> None:
        self.rows: dict[tuple[str, int], Row] = {}
        lines = path.read_text("utf-8", "replace").splitlines() if path.exists() else []
        if lines and lines[0] == json.dumps({"key": key}) and not restart:
            for line in lines[1:]:
                try:
                    row = json.loads(line)
                    self.rows[row["id"], row["view"]] = row
                except (ValueError, KeyError, TypeError):
                    continue  # cut off by a kill
        # Written anew: a line that was cut off must not swallow the next.
        kept = [{"key": key}, *self.rows.values()]
        write_atomic(path, "".join(json.dumps(row) + "\n" for row in kept))
        self._path = path

    def add(self, row: Row) -> None:
        """Keep one row."""
        self.rows[row["id"], row["view"]] = row
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
