"""Scores of a network under a protocol, and what they are worth: resumable, on all cores."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path, PurePath
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation.part_transfer import check_labels, labelled_rows
from ffd_lightning.evaluation.protocols import (
    EvaluationProtocol,
    ProtocolDescription,
    carries_points,
)
from ffd_lightning.evaluation.reference_scores import ReferenceScores, bank_digest, network_free
from ffd_lightning.evaluation.references import SHAPES, nearest_by_feature
from ffd_lightning.evaluation.samples import (
    Journal,
    Predictions,
    Row,
    Sample,
    Scores,
    as_columns,
    best_template,
    encode,
    predict,
    score_shapes,
)
from ffd_lightning.evaluation.shapes import (
    PreparedShape,
    ResampledTemplate,
    Shape,
    TemplateShape,
)
from ffd_lightning.evaluation.summaries import (
    by_category,
    means,
    selection_summary,
    template_ranking,
)
from ffd_lightning.files import lock_folder, write_atomic, write_csv
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.parallel import in_threads
from ffd_lightning.progress import CountProgress

FORMAT_VERSION = 7
"""Goes up when the same weights and settings give other numbers or files."""

TABLES = ("samples.csv", "template_ranking.csv")
_AT_ONCE = 4096  # images


class Shapes(NamedTuple):
    """Rows of a prepared set."""

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
class EvaluatedNetwork:
    """What is evaluated: a network with its templates, and shapes: of which it knows some already.

    Attributes:
        network: on the device to use.
        bank: its templates.
        trained_on: the shapes of its training.
        tested_on: the shapes to test on.
        step: of the training that its weights are from, for the record.
    """

    network: TemplateFfdNetwork
    bank: TemplateBank
    trained_on: Shapes
    tested_on: Shapes
    step: int


@dataclass(frozen=True)
class EvaluationOptions:
    """How to evaluate.

    Attributes:
        references: score also what a model must beat.
        all_views: test every image of a shape instead of the first.
        seed: decides the points that are drawn.
        workers: threads; the numbers do not depend on it.
        progress: show on stderr how far it is.
        restart: do not resume what is there, and read no shared scores.
        shared: folder that evaluations on the same data share scores in, of references that no
            network has a part in; the numbers do not depend on it. None for no sharing.
    """

    references: bool = True
    all_views: bool = False
    seed: int = 0
    workers: int = 1
    progress: bool = True
    restart: bool = False
    shared: Path | None = None


def evaluate(
    evaluated: EvaluatedNetwork,
    protocol: EvaluationProtocol,
    folder: Path,
    options: EvaluationOptions,
) -> dict[str, float]:
    """Score a network on its test shapes; resume where an earlier attempt stopped.

    Writes `samples.csv`, `summary.json` and `template_ranking.csv`.

    Args:
        evaluated: what is evaluated.
        protocol: how it is measured.
        folder: where to write.
        options: see there.

    Returns:
        The summary: means over all samples, and how templates were selected. Read back where the
        same weights were evaluated in the same way already; then it has references, too, where it
        had them.

    Raises:
        ConfigError: another process writes to the folder.
        DataError: the network's outputs are not finite; data is damaged; there are no part labels
            and the protocol needs them.
    """
    settings = _settings(evaluated, protocol, options)
    key = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()
    description = ProtocolDescription.of(protocol).to_json()
    finished = _read_summary(folder, settings, description)
    if finished is not None and not options.restart:
        return finished
    evaluated = with_labels(evaluated, protocol, options.references)
    with lock_folder(folder, f"another process evaluates into {folder}: wait for it"):
        if options.restart:
            (folder / "samples.partial").unlink(missing_ok=True)
        journal = Journal(folder / "samples.partial", key)
        try:
            table, prediction = _score(evaluated, protocol, journal, settings, options)
        finally:
            journal.close()
        counts = np.bincount(prediction.selected, minlength=len(evaluated.bank))
        summary = {**means(table), **selection_summary(counts), "num_samples": float(len(table))}
        mean_weights = prediction.weights.mean(0, dtype=np.float64)
        ranking = template_ranking(evaluated.bank, counts, mean_weights)
        content = {
            **summary,
            **by_category(table),
            "protocol": description,
            "definitions": {m.name: m.definition for m in protocol.measures} | SHAPES,
            "unit": protocol.note,
            "step": evaluated.step,
            "settings": settings,
            "key": key,
        }
        # Tables are never beside a summary of others, not even after a kill.
        (folder / "summary.json").unlink(missing_ok=True)
        for name, rows in zip(TABLES, (table, ranking), strict=True):
            write_csv(folder / name, rows)
        write_atomic(folder / "summary.json", json.dumps(content, indent=2) + "\n")
        journal.close(remove=True)
    return summary


def _settings(
    evaluated: EvaluatedNetwork, protocol: EvaluationProtocol, options: EvaluationOptions
) -> dict[str, object]:
    """Everything that the numbers follow from: another value, another evaluation."""
    return {
        "format": FORMAT_VERSION,
        "protocol": protocol_key(protocol),
        "weights": weights_digest(evaluated.network),
        "templates": list(evaluated.bank.ids),
        "max_edge": evaluated.bank.max_edge,
        "tested_on": evaluated.tested_on.fingerprint(),
        "trained_on": evaluated.trained_on.fingerprint() if options.references else None,
        "all_views": options.all_views,
        "seed": options.seed,
    }


def _reference_scores(
    evaluated: EvaluatedNetwork,
    protocol: EvaluationProtocol,
    settings: dict[str, object],
    options: EvaluationOptions,
) -> ReferenceScores:
    """Return what is known of the references' scores, where there are references."""
    # What is drawn follows from the shape's id: its images have their references in common.
    rest = {k: v for k, v in settings.items() if k not in ("weights", "all_views")}
    result = ReferenceScores(options.shared, rest | {"bank": bank_digest(evaluated.bank)})
    if options.references and not options.restart:
        result.read(protocol, evaluated.tested_on.prepared, options.seed)
    return result


def _score(
    evaluated: EvaluatedNetwork,
    protocol: EvaluationProtocol,
    journal: Journal,
    settings: dict[str, object],
    options: EvaluationOptions,
) -> tuple[list[Row], Predictions]:
    """Score what the journal does not hold yet, and return the rows of all samples."""
    prepared, samples = evaluated.tested_on.prepared, evaluated.tested_on.samples(options.all_views)
    prediction = predict(evaluated.network, prepared, samples, options.workers, options.progress)
    references = _reference_scores(evaluated, protocol, settings, options)
    shapes = _shapes(evaluated, protocol, samples, prediction, references, options)

    def score(k: int) -> Row:
        row, view = samples[k]
        t = int(prediction.selected[k])
        candidates = shapes(k)
        model = candidates[""]
        assert isinstance(model, TemplateShape)
        scores = score_shapes(protocol, prepared, row, candidates, options.seed)
        if options.references:
            references.add(prepared.ids[row], scores)
        return {
            "id": prepared.ids[row],
            "category": prepared.category(row),
            "family": prepared.families[row],
            "view": view,
            "template": evaluated.bank.ids[t],
            "weight": float(prediction.weights[k, t]),
            **as_columns(scores),
            **model.distortion(),
        }

    names = [(prepared.ids[row], view) for row, view in samples]
    todo = [k for k, name in enumerate(names) if name not in journal.rows]
    done = len(samples) - len(todo)
    label = f"protocol {protocol.name}"
    try:
        with CountProgress(label, len(samples), done, options.progress) as bar:
            for _, result in in_threads(score, todo, options.workers):
                journal.add(result)
                bar.advance()
    finally:
        references.write()
    return _aligned([journal.rows[name] for name in names]), prediction


def with_labels(
    evaluated: EvaluatedNetwork, protocol: EvaluationProtocol, references: bool
) -> EvaluatedNetwork:
    """Leave out shapes that a protocol can do nothing with: those without the labels it needs.

    Raises:
        DataError: nothing is left.
    """
    if not protocol.needs_parts:
        return evaluated
    tested_on, trained_on = evaluated.tested_on, evaluated.trained_on
    tested_on = tested_on._replace(rows=labelled_rows(*tested_on))
    if references:
        trained_on = trained_on._replace(rows=labelled_rows(*trained_on))
    check_labels(
        evaluated.bank,
        (tested_on.prepared, len(tested_on.rows)),
        (trained_on.prepared, len(trained_on.rows)) if references else None,
    )
    return replace(evaluated, tested_on=tested_on, trained_on=trained_on)


def _aligned(table: Sequence[Row]) -> list[Row]:
    """Give every row the columns of all, None where it has nothing to say."""
    names = dict.fromkeys(name for row in table for name in row)
    return [{name: row.get(name) for name in names} for row in table]


def _shapes(
    evaluated: EvaluatedNetwork,
    protocol: EvaluationProtocol,
    samples: Sequence[Sample],
    prediction: Predictions,
    references: ReferenceScores,
    options: EvaluationOptions,
) -> Callable[[int], dict[str, Shape | Scores]]:
    """Return a function from a sample's number to the shapes that are put before its shape.

    Of references that no network has a part in it gives the scores, where those are known.
    """
    bank, tested_on = evaluated.bank, evaluated.tested_on

    def scored(k: int) -> dict[str, Shape | Scores]:
        t = int(prediction.selected[k])
        return {
            "": TemplateShape(bank, t, prediction.offsets[k, t]),
            "undeformed": TemplateShape(bank, t),
        }

    if not options.references:
        return scored
    training = evaluated.trained_on.prepared
    seen = evaluated.trained_on.samples(options.all_views)
    features = [
        encode(evaluated.network, *images, options.workers, options.progress)
        for images in ((tested_on.prepared, samples), (training, seen))
    ]
    alike = nearest_by_feature(*features)
    free = network_free(
        references.known,
        bank,
        (tested_on.prepared, tested_on.rows.tolist()),
        (training, evaluated.trained_on.rows.tolist()),
        options.seed,
    )

    def with_references(k: int) -> dict[str, Shape | Scores]:
        row, offsets = samples[k].row, prediction.offsets[k]
        t, others = int(prediction.selected[k]), free(row)
        deformed = best_template(tested_on.prepared, row, bank, offsets)
        drawn = {"resampled": ResampledTemplate(bank, t, offsets[t])}
        return {
            **scored(k),
            **(drawn if carries_points(protocol) else {}),
            "best_undeformed": others["best_undeformed"],
            "best_deformed": TemplateShape(bank, deformed, offsets[deformed]),
            "fitted": others["fitted"],
            "feature_retrieval": PreparedShape(training, seen[alike[k]].row),
            "retrieval": others["retrieval"],
            "medoid": others["medoid"],
            "floor": others["floor"],
        }

    return with_references


def rank_templates(
    network: TemplateFfdNetwork,
    bank: TemplateBank,
    prepared: PreparedSet,
    samples: Sequence[Sample],
    workers: int = 1,
) -> list[Row]:
    """Return `template_ranking` of a network's selections on some images, at least one."""
    counts, weights = np.zeros(len(bank), np.int64), np.zeros(len(bank))
    # Predictions have offsets too: those of all images may not fit into memory.
    for start in range(0, len(samples), _AT_ONCE):
        prediction = predict(network, prepared, samples[start : start + _AT_ONCE], workers)
        counts += np.bincount(prediction.selected, minlength=len(bank))
        weights += prediction.weights.sum(0, dtype=np.float64)
    return template_ranking(bank, counts, weights / len(samples))


def protocol_key(protocol: EvaluationProtocol) -> str:
    """Return what changes when a protocol measures something else: its type and its attributes.

    The same in every process. Attributes are plain values, paths, arrays, dataclasses, and
    containers of those; of anything else the type counts.
    """
    if dataclasses.is_dataclass(protocol):
        return _written(protocol)
    kind = type(protocol)
    own = _written(getattr(protocol, "__dict__", {}))
    return f"{kind.__module__}.{kind.__qualname__} {protocol.name} {own} {protocol.measures}"


def _written(value: Any) -> str:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = (f"{f.name}={_written(getattr(value, f.name))}" for f in dataclasses.fields(value))
        return f"{type(value).__qualname__}({', '.join(fields)})"  # as `repr`, which cuts arrays
    if isinstance(value, Mapping):
        items = ", ".join(f"{_written(key)}: {_written(one)}" for key, one in value.items())
        return f"{{{items}}}"
    if isinstance(value, list | tuple | set | frozenset):
        parts = [_written(one) for one in value]
        ordered = sorted(parts) if isinstance(value, set | frozenset) else parts
        return f"{type(value).__name__}({', '.join(ordered)})"
    if isinstance(value, np.ndarray | torch.Tensor):
        return hashlib.sha256(f"{value.dtype} {value.tolist()}".encode()).hexdigest()
    if value is None or isinstance(value, str | int | float | bytes | PurePath | Enum | np.generic):
        return repr(value)
    named = value if hasattr(value, "__qualname__") else type(value)  # functions, classes
    return f"{named.__module__}.{named.__qualname__}"


def weights_digest(network: TemplateFfdNetwork) -> str:
    """Return what changes when any weight or statistic of a network does."""
    digest = hashlib.sha256()
    for value in network.state_dict().values():
        digest.update(value.detach().cpu().contiguous().reshape(-1).view(torch.uint8).numpy())
    return digest.hexdigest()


def _read_summary(
    folder: Path, settings: Mapping[str, Any], description: dict[str, Any]
) -> dict[str, float] | None:
    """Return the numbers of a finished evaluation of these settings, None if there is none.

    One with references holds what one without them does, and more. One that describes its protocol
    in other words, or not at all, is none.
    """
    try:
        content = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        found = dict(content["settings"])
        if settings["trained_on"] is None:  # no references are asked for
            found["trained_on"] = None
        if found != settings or content["protocol"] != description:
            return None
        if not all((folder / name).is_file() for name in TABLES):
            return None
        return {name: value for name, value in content.items() if isinstance(value, float)}
    except (OSError, ValueError, KeyError, TypeError):
        return None
