"""From a run folder to its scores under a protocol."""

from __future__ import annotations

import hashlib
import json
import logging
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning.cli import explain
from ffd_lightning.config import EvaluateConfig, ProtocolKind, TrainConfig, typed_config
from ffd_lightning.data.prepared import PreparedSet, file_digest
from ffd_lightning.data.progress import ModelProgress
from ffd_lightning.data.templates import TemplateBank
from ffd_lightning.data.workers import available_cores
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.evaluation.evaluator import to_csv
from ffd_lightning.evaluation.loading import build_data, build_network, load_weights
from ffd_lightning.evaluation.protocols import (
    EvaluationProtocol,
    ModernProtocol,
    PaperProtocol,
    ScaledProtocol,
)
from ffd_lightning.evaluation.references import SHAPES, medoid, nearest_by_feature, nearest_by_shape
from ffd_lightning.evaluation.samples import (
    Journal,
    Predictions,
    Row,
    best_templates,
    in_threads,
    predict,
    score_sample,
)
from ffd_lightning.evaluation.shapes import ModelShape, Shape, TemplateShape
from ffd_lightning.metrics.scalings import SCALINGS
from ffd_lightning.metrics.selection import effective_templates, selection_entropy
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.run_folder import RunFolder, write_atomic

log = logging.getLogger(__name__)

FORMAT_VERSION = 1
"""Goes up when the same run and settings give other numbers."""

PROTOCOLS: dict[ProtocolKind, EvaluationProtocol] = {
    ProtocolKind.paper: PaperProtocol(),
    ProtocolKind.modern: ModernProtocol(),
    **{ProtocolKind(name): ScaledProtocol(name) for name in SCALINGS},
}


@dataclass(frozen=True)
class Subject:
    """What is evaluated: a network with its templates, on models, knowing those it was trained on.

    Attributes:
        network: on the device to use.
        bank: its templates.
        trained_on: the prepared set of its training, and the rows it was trained on.
        tested_on: the prepared set of the models to test on, and their rows.
    """

    network: TemplateFfdNetwork
    bank: TemplateBank
    trained_on: tuple[PreparedSet, NDArray[np.int64]]
    tested_on: tuple[PreparedSet, NDArray[np.int64]]


def evaluate_job(cfg: DictConfig) -> None:
    """Evaluate what Hydra composed, and print the table."""
    try:
        config = typed_config(cfg, EvaluateConfig)
        summary = evaluate_run(config)
    except (UserError, OmegaConfBaseException) as error:
        # Not as an exception: Hydra would put a line of its own above it.
        sys.exit(f"error: {explain(error)}")
    from ffd_lightning.evaluation.tables import print_summary

    print_summary(RunFolder(Path(config.run)), PROTOCOLS[config.protocol], summary)


def evaluate_run(cfg: EvaluateConfig) -> dict[str, float]:
    """Evaluate a run folder under a protocol; read the result back where it is there already.

    Raises:
        ConfigError: no run, no checkpoint, or one that does not fit.
        DataError: data that is missing or damaged.
    """
    run = RunFolder(Path(cfg.run))
    if not run.config.is_file():
        raise ConfigError(f"run={cfg.run} is not a run folder: it has no config.yaml")
    trained = typed_config(_loaded(run.config), TrainConfig)
    if cfg.data_root is not None:
        trained.paths.data = cfg.data_root
    checkpoint = Path(cfg.checkpoint) if cfg.checkpoint else run.checkpoint
    network = build_network(trained)
    step = load_weights(network, checkpoint)
    data = build_data(trained)
    data.setup()
    tested_on = (data.prepared, data.rows(data.split.test))
    if cfg.prepared is not None:
        other = PreparedSet.open(Path(cfg.prepared))
        wanted = [k for k, i in enumerate(other.ids) if i not in data.bank.ids]
        tested_on = (other, np.asarray(wanted, np.int64))
    device = "cuda" if cfg.device == "auto" and torch.cuda.is_available() else cfg.device
    subject = Subject(
        network.to("cpu" if device == "auto" else device),
        data.bank,
        (data.prepared, data.rows(data.split.train)),
        tested_on,
    )
    return evaluate_subject(
        subject,
        PROTOCOLS[cfg.protocol],
        run.evaluation(cfg.protocol.value),
        {"checkpoint": file_digest(checkpoint), "step": step},
        references=cfg.references,
        seed=cfg.seed,
        workers=cfg.workers or available_cores(),
        progress=cfg.progress_bar,
        restart=cfg.restart,
    )


def evaluate_subject(
    subject: Subject,
    protocol: EvaluationProtocol,
    folder: Path,
    facts: dict[str, object],
    *,
    references: bool = True,
    seed: int = 0,
    workers: int = 1,
    progress: bool = True,
    restart: bool = False,
) -> dict[str, float]:
    """Score a network on its test models and write `samples.csv` and `summary.json`.

    Args:
        subject: what is evaluated.
        protocol: how it is measured.
        folder: where to write.
        facts: what the weights are; together with the settings it decides the numbers.
        references: score also what a model must beat.
        seed: decides the points that are drawn.
        workers: threads; the numbers do not depend on it.
        progress: show on stderr how far it is.
        restart: do not go on from what is there.

    Returns:
        The summary: means over all samples, and how templates were selected.
    """
    prepared, rows = subject.tested_on
    settings = {
        "format": FORMAT_VERSION,
        "protocol": protocol.name,
        **facts,
        "templates": list(subject.bank.ids),
        "prepared": prepared.manifest["sha256"],
        "samples": len(rows),
        "references": references,
        "seed": seed,
    }
    key = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()
    finished = _read_summary(folder / "summary.json", key)
    if finished is not None and not restart:
        return finished
    if restart:
        (folder / "samples.partial").unlink(missing_ok=True)
    prediction = predict(subject.network, prepared, rows.tolist())
    score = _scorer(subject, protocol, prediction, references, seed)
    journal = Journal(folder / "samples.partial", key)
    todo = [k for k, row in enumerate(rows) if prepared.ids[row] not in journal.rows]

    try:
        with ModelProgress(protocol.name, len(rows), len(rows) - len(todo), progress) as bar:
            for result in in_threads(score, todo, workers):
                journal.add(result)
                bar.advance()
    finally:
        journal.close()
    table = [journal.rows[prepared.ids[row]] for row in rows]
    summary = _summary(table, protocol, prediction)
    write_atomic(folder / "samples.csv", to_csv(table))
    content = {
        **summary,
        "definitions": {m.name: m.definition for m in protocol.measures} | SHAPES,
        "unit": protocol.note,
        "settings": settings,
        "key": key,
    }
    write_atomic(folder / "summary.json", json.dumps(content, indent=2) + "\n")
    journal.close(remove=True)
    return summary


def _scorer(
    subject: Subject,
    protocol: EvaluationProtocol,
    prediction: Predictions,
    references: bool,
    seed: int,
) -> Callable[[int], Row]:
    """Return a function from a sample's number to its row of `samples.csv`."""
    prepared, rows = subject.tested_on
    shapes = _shapes(subject, prediction, references)

    def score(k: int) -> Row:
        row, t = int(rows[k]), int(prediction.selected[k])
        head = {
            "id": prepared.ids[row],
            "view": 0,
            "family": prepared.families[row],
            "template": subject.bank.ids[t],
            "weight": float(prediction.weights[k, t]),
        }
        candidates = shapes(k)
        scores = score_sample(protocol, prepared, row, candidates, seed)
        model = candidates[""]
        assert isinstance(model, TemplateShape)
        return head | scores | (model.quality() if protocol.quality else {})

    return score


def _shapes(
    subject: Subject, prediction: Predictions, references: bool
) -> Callable[[int], dict[str, Shape]]:
    """Return a function from a sample's number to the shapes that are put before its model."""
    bank, (prepared, rows) = subject.bank, subject.tested_on
    found = _retrieved(subject, prediction) if references else None

    def shapes(k: int) -> dict[str, Shape]:
        t, offsets = int(prediction.selected[k]), prediction.offsets[k]
        result: dict[str, Shape] = {
            "": TemplateShape(bank, t, offsets[t]),
            "undeformed": TemplateShape(bank, t),
        }
        if found is None:
            return result
        as_is, deformed = best_templates(prepared, int(rows[k]), bank, offsets)
        training, nearest = subject.trained_on[0], {n: int(r[k]) for n, r in found.items()}
        return {
            **result,
            "best_undeformed": TemplateShape(bank, as_is),
            "best_deformed": TemplateShape(bank, deformed, offsets[deformed]),
            **{name: ModelShape(training, row) for name, row in nearest.items()},
            "floor": ModelShape(prepared, int(rows[k])),
        }

    return shapes


def _retrieved(subject: Subject, prediction: Predictions) -> dict[str, NDArray[np.int64]]:
    """Return for each reference that is a training shape its row for each sample, (n,)."""
    (training, among), (prepared, rows) = subject.trained_on, subject.tested_on
    device = next(subject.network.parameters()).device
    log.info("looking for the nearest of %d training shapes", len(among))
    features = predict(subject.network, training, among.tolist()).features
    central = medoid(training, among.tolist(), device)
    return {
        "retrieval": nearest_by_shape(prepared, rows.tolist(), training, among.tolist(), device),
        "feature_retrieval": nearest_by_feature(prediction.features, features, among.tolist()),
        "medoid": np.full(len(rows), central, np.int64),
    }


def _summary(
    table: Sequence[Row], protocol: EvaluationProtocol, prediction: Predictions
) -> dict[str, float]:
    names = [name for name in table[0] if name not in ("id", "view", "family", "template")]
    counts = np.bincount(prediction.selected, minlength=prediction.weights.shape[1])
    return {
        **{name: float(np.mean([row[name] for row in table])) for name in names},
        "entropy": selection_entropy(counts),
        "effective_templates": effective_templates(counts),
        "templates_used": float((counts > 0).sum()),
        "num_samples": float(len(table)),
    }


def _read_summary(file: Path, key: str) -> dict[str, float] | None:
    """Return the numbers of a finished evaluation of this key, None if there is none."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        if content["key"] != key:
            return None
        return {name: value for name, value in content.items() if isinstance(value, float)}
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _loaded(file: Path) -> DictConfig:
    try:
        config = OmegaConf.load(file)
        assert isinstance(config, DictConfig)
        return config
    except Exception as error:
        raise ConfigError(f"{file} is damaged: {error}") from None
