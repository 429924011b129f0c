"""Scores of a network under a protocol, and what they are worth: resumable, on all cores."""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from filelock import FileLock
from numpy.typing import NDArray

from ffd_lightning.data.preparation.prepared import digest_of
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation import summaries
from ffd_lightning.evaluation.candidates import (
    CANDIDATES,
    Candidate,
    PreparedShape,
    ResampledTemplate,
    TemplateShape,
)
from ffd_lightning.evaluation.protocols import Protocol, ProtocolDescription
from ffd_lightning.evaluation.protocols.parts import check_templates, labelled_rows
from ffd_lightning.evaluation.references import NetworkFree, best_template, nearest_by_feature
from ffd_lightning.evaluation.samples import (
    Journal,
    Predictions,
    Row,
    Sample,
    Subset,
    predict,
    predict_in_chunks,
    score_all,
    score_sample,
)
from ffd_lightning.files import lock_folder, read_json, write_csv, write_json
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.nn.viewpoint import viewpoints

FORMAT_VERSION = 8
"""Goes up when the same weights and settings give other numbers or files."""

SHARED_FOLDER = "references"
"""Where evaluations share the scores of references, beside the folder of the prepared sets."""

TABLES = ("samples.csv", "template_ranking.csv")


@dataclass(frozen=True)
class EvaluatedNetwork:
    """A network, and what it is evaluated with.

    Attributes:
        network: on the device to use.
        bank: its templates.
        trained_on: the shapes of its training.
        tested_on: the shapes to test on.
        step: of the training that its weights are from, for the record.
        twins: ids of shapes to test on that have a near copy among those that the training saw.
    """

    network: TemplateFfdNetwork
    bank: TemplateBank
    trained_on: Subset
    tested_on: Subset
    step: int
    twins: frozenset[str] = frozenset()


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
        shared: folder in which evaluations on the same data share the scores of references that no
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
    protocol: Protocol,
    folder: str | Path,
    options: EvaluationOptions,
) -> dict[str, float]:
    """Score a network on its test shapes; resume where an earlier attempt stopped.

    Writes `samples.csv`, `summary.json` and `template_ranking.csv` into a folder.

    Returns:
        The summary: means over all samples, and how templates were selected. Read back where the
        same weights were evaluated in the same way already; then it has references, too, where it
        had them.

    Raises:
        ConfigError: another process writes to the folder.
        DataError: the network's outputs are not finite; data is damaged; there are no part labels
            and the protocol needs them.
    """
    folder, settings = Path(folder), _settings(evaluated, protocol, options)
    finished = _read_summary(folder, settings)
    if finished is not None and not options.restart:
        return finished
    evaluated = with_labels(evaluated, protocol, options.references)
    with lock_folder(folder, f"another process evaluates into {folder}: wait for it"):
        partial, key = folder / "samples.partial", digest_of(settings)
        journal = Journal(partial, key, options.restart)
        table, prediction = _score(evaluated, protocol, journal, settings, folder, options)
        counts = np.bincount(prediction.selected, minlength=len(evaluated.bank))
        summary = {**summaries.means(table), **summaries.selection_summary(counts)}
        summary["num_samples"] = float(len(table))
        summary |= summaries.without_twins(table, [metric.name for metric in protocol.metrics])
        ranking = summaries.template_ranking(evaluated.bank, [prediction])
        content = {
            **summary,
            "protocol": ProtocolDescription.of(protocol).to_json(),
            "definitions": {m.name: m.definition for m in protocol.metrics} | CANDIDATES,
            "unit": protocol.note,
            "step": evaluated.step,
            "settings": settings,
            "key": key,
        }
        # Tables are never beside a summary of others, not even after a kill.
        (folder / "summary.json").unlink(missing_ok=True)
        for name, rows in zip(TABLES, (table, ranking), strict=True):
            write_csv(folder / name, rows)
        write_json(folder / "summary.json", content)
        partial.unlink()
    return summary


def _settings(
    evaluated: EvaluatedNetwork, protocol: Protocol, options: EvaluationOptions
) -> dict[str, object]:
    """Everything that the numbers follow from: another value, another evaluation."""
    return {
        "format": FORMAT_VERSION,
        "protocol": protocol.key,
        "weights": weights_digest(evaluated.network),
        "templates": list(evaluated.bank.ids),
        "max_edge": evaluated.bank.max_edge,
        "tested_on": evaluated.tested_on.fingerprint(),
        "trained_on": evaluated.trained_on.fingerprint() if options.references else None,
        "all_views": options.all_views,
        "seed": options.seed,
        **({"twins": sorted(evaluated.twins)} if evaluated.twins else {}),
    }


def with_labels(
    evaluated: EvaluatedNetwork, protocol: Protocol, references: bool
) -> EvaluatedNetwork:
    """Leave out shapes that a protocol can do nothing with: those without the labels it needs.

    Raises:
        DataError: nothing is left.
    """
    if not protocol.needs_parts:
        return evaluated
    tested_on, trained_on = evaluated.tested_on, evaluated.trained_on
    tested_on = tested_on._replace(rows=labelled_rows(*tested_on, "test"))
    check_templates(evaluated.bank)
    if references:
        trained_on = trained_on._replace(rows=labelled_rows(*trained_on, "training"))
    return replace(evaluated, tested_on=tested_on, trained_on=trained_on)


def _score(
    evaluated: EvaluatedNetwork,
    protocol: Protocol,
    journal: Journal,
    settings: Mapping[str, object],
    folder: Path,
    options: EvaluationOptions,
) -> tuple[list[Row], Predictions]:
    """Score what the journal does not hold yet, and return the rows of all samples."""
    bank, prepared = evaluated.bank, evaluated.tested_on.prepared
    training, seen = evaluated.trained_on.prepared, evaluated.trained_on.samples(options.all_views)
    samples = evaluated.tested_on.samples(options.all_views)
    how = options.workers, options.progress
    prediction = predict(evaluated.network, prepared, samples, *how)
    references: dict[str, Row] = {}
    if options.references:
        references = _reference_rows(evaluated, protocol, settings, folder, options)
        features = [p.features for p in predict_in_chunks(evaluated.network, training, seen, *how)]
        alike = nearest_by_feature(prediction.features, np.concatenate(features))
    places = {sample: k for k, sample in enumerate(samples)}

    def score(sample: Sample) -> Row:
        row, k = sample.row, places[sample]
        t, offsets = int(prediction.selected[k]), prediction.offsets[k]
        model = TemplateShape(bank, t, offsets[t])
        candidates: dict[str, Candidate] = {"": model, "undeformed": TemplateShape(bank, t)}
        if options.references:
            if protocol.carries_points:
                candidates["resampled"] = ResampledTemplate(bank, t, offsets[t])
            best = best_template(prepared, row, bank, offsets)
            deformed = model if best == t else TemplateShape(bank, best, offsets[best])
            candidates["best_deformed"] = deformed
            candidates["feature_retrieval"] = PreparedShape(training, seen[alike[k]].row)
        return {
            "id": prepared.ids[row],
            "category": prepared.category(row),
            "family": prepared.families[row],
            "view": sample.view,
            "template": bank.ids[t],
            "weight": float(prediction.weights[k, t]),
            **_azimuth_error(prediction.viewpoints[k], prepared.camera(row, sample.view).azimuth),
            **({"twin": prepared.ids[row] in evaluated.twins} if evaluated.twins else {}),
            **score_sample(protocol, prepared, row, candidates, options.seed),
            **model.distortion(),
        }

    named = {(prepared.ids[sample.row], sample.view): sample for sample in samples}
    rows = score_all(score, named, journal, *how, f"protocol {protocol.name}")
    rows = [{**row, **references.get(row["id"], {}), "view": row["view"]} for row in rows]
    # Every row has the columns of all, None where a shape has no such part.
    columns = dict.fromkeys(name for row in rows for name in row)
    return [{name: row.get(name) for name in columns} for row in rows], prediction


def _azimuth_error(viewpoint: NDArray[np.float32], azimuth: float) -> dict[str, float]:
    """Return by how many degrees the network's azimuth is off, {} if it says none."""
    if not len(viewpoint):
        return {}
    found = viewpoints(torch.from_numpy(viewpoint))[0].azimuth
    return {"azimuth_error": abs((found - azimuth + 180) % 360 - 180)}


def _reference_rows(
    evaluated: EvaluatedNetwork,
    protocol: Protocol,
    settings: Mapping[str, object],
    folder: Path,
    options: EvaluationOptions,
) -> dict[str, Row]:
    """Return the scores of references that no network has a part in, by the shape's id.

    They take most of an evaluation's time, and follow from the data, the templates, the protocol
    and what is drawn: a journal has them for all evaluations of which that is the same. A process
    that needs what another computes waits for it.
    """
    (prepared, _), bank = evaluated.tested_on, evaluated.bank
    deciding = ("format", "protocol", "templates", "max_edge", "trained_on", "seed")
    key = digest_of([*(settings[name] for name in deciding), prepared.digest, bank_digest(bank)])
    samples = {(prepared.ids[s.row], 0): s for s in evaluated.tested_on.samples(all_views=False)}
    names, place = [f"references-{key[:20]}.{kind}" for kind in ("jsonl", "lock")], folder
    if options.shared is not None and all(_writable(options.shared / name) for name in names):
        place = options.shared  # else it is another user's
    place.mkdir(parents=True, exist_ok=True)
    file, lock = (place / name for name in names)
    with FileLock(lock):
        journal = Journal(file, key, options.restart)
        if samples.keys() <= journal.rows.keys():
            return {name: journal.rows[name, 0] for name, _ in samples}
        free = NetworkFree(bank, evaluated.trained_on, options.seed)

        def score(sample: Sample) -> Row:
            candidates = free.candidates(prepared, sample.row)
            scores = score_sample(protocol, prepared, sample.row, candidates, options.seed)
            return {"id": prepared.ids[sample.row], "view": 0, **scores}

        how = options.workers, options.progress, "references"
        return {row["id"]: row for row in score_all(score, samples, journal, *how)}


def _writable(path: Path) -> bool:
    """Return whether a file can be written, or made, with the folders that it is in."""
    return os.access(next(x for x in (path, *path.absolute().parents) if x.exists()), os.W_OK)


def bank_digest(bank: TemplateBank) -> str:
    """Return what changes when templates are others, though of the same ids, or their lattices."""
    digest = hashlib.sha256()
    for array in (bank.points.numpy(), bank.control_points.numpy(), bank.point_parts):
        digest.update(b"" if array is None else array.tobytes())
    return digest.hexdigest()


def weights_digest(network: TemplateFfdNetwork) -> str:
    """Return what changes when a weight or statistic of a network does, or what it was told."""
    digest = hashlib.sha256()
    codes = getattr(network, "template_codes", None)
    told = {} if codes is None else {"template_codes": codes}
    for value in (network.state_dict() | told).values():
        if isinstance(value, torch.Tensor):
            flat = value.detach().cpu().contiguous().reshape(-1)
            digest.update(flat.view(torch.uint8).numpy().tobytes())
        else:  # a layer's extra state
            digest.update(repr(value).encode())
    return digest.hexdigest()


def _read_summary(folder: Path, settings: Mapping[str, Any]) -> dict[str, float] | None:
    """Return the numbers of a finished evaluation of these settings, None if there is none.

    One with references holds what one without them does, and more.
    """
    content = read_json(folder / "summary.json")
    there = content.get("settings", {})
    if settings["trained_on"] is None:  # no references are asked for
        there = {**there, "trained_on": None}
    if there == settings and all((folder / name).is_file() for name in TABLES):
        return {name: value for name, value in content.items() if isinstance(value, float)}
    return None
