"""Scores that no network has a part in: computed once, for all evaluations on the same data.

Most of an evaluation's time goes into them. They follow from the prepared shapes, the templates,
the protocol and what is drawn: the same for all regimes and seeds of a sweep.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation.capacity import fitted_template
from ffd_lightning.evaluation.protocols import EvaluationProtocol
from ffd_lightning.evaluation.references import ShapeRetrieval, medoid
from ffd_lightning.evaluation.samples import Scores, best_template, sample_seed, score_shapes
from ffd_lightning.evaluation.shapes import PreparedShape, Shape, TemplateShape
from ffd_lightning.files import write_atomic
from ffd_lightning.parallel import in_threads

NETWORK_FREE = ("best_undeformed", "fitted", "retrieval", "medoid", "floor")
"""The references of `references.SHAPES` that these are the scores of."""

SHARED_FOLDER = "references"
"""Its name, beside the folder of the prepared sets."""


class ReferenceScores:
    """Scores of these references, {name: {measure: score}} for each shape by its id.

    The file is read and written as a whole: of two evaluations at the same time each computes them
    all, and the last one's, which are the same, stay.

    Args:
        folder: where evaluations share them; None for this one alone.
        settings: all that the scores follow from. Others are in a file of another name.
    """

    def __init__(self, folder: Path | None, settings: Mapping[str, object]) -> None:
        self.known: dict[str, dict[str, Scores]] = {}
        self._settings = dict(settings)
        key = _digest(self._settings)
        self._file = None if folder is None else folder / f"{key}.json"
        self._changed = False

    def read(self, protocol: EvaluationProtocol, prepared: PreparedSet, seed: int) -> None:
        """Take what earlier evaluations left, if it is as it was written and still holds.

        A protocol of another package may measure otherwise than it did, under the same settings,
        and so may another machine in the last digits: the floor of one shape tells.
        """
        known = {} if self._file is None else _read(self._file)
        row = next((k for k, name in enumerate(prepared.ids) if name in known), None)
        if row is None:
            return

        def floor(row: int) -> Scores:
            shapes = {"floor": PreparedShape(prepared, row)}
            return score_shapes(protocol, prepared, row, shapes, seed)["floor"]

        ((_, now),) = in_threads(floor, [row], workers=1)  # as all samples are
        if now == known[prepared.ids[row]]["floor"]:
            self.known = known

    def add(self, shape_id: str, scores: Mapping[str, Scores]) -> None:
        """Keep a shape's scores, given those of all its references."""
        if shape_id not in self.known:
            self.known[shape_id] = {name: scores[name] for name in NETWORK_FREE}
            self._changed = True

    def write(self) -> None:
        """Leave them for later evaluations, unless the folder cannot be written to."""
        if self._file is not None and self._changed:
            known = dict(self.known)  # threads may still be adding to it where one of them failed
            content = {"settings": self._settings, "sha256": _digest(known), "scores": known}
            with suppress(OSError):
                write_atomic(self._file, json.dumps(content) + "\n")


def network_free(
    known: Mapping[str, Mapping[str, Scores]],
    bank: TemplateBank,
    tested_on: tuple[PreparedSet, Sequence[int]],
    trained_on: tuple[PreparedSet, Sequence[int]],
    seed: int,
) -> Callable[[int], Mapping[str, Shape | Scores]]:
    """Return a function from a test shape's row to these references: their scores where known.

    Args:
        known: such scores, by the id of the shape.
        bank: the templates.
        tested_on: a prepared set, and the rows that will be asked for.
        trained_on: a prepared set, and the rows to retrieve from.
        seed: of what is drawn.
    """
    prepared, training = tested_on[0], trained_on[0]
    if all(prepared.ids[row] in known for row in tested_on[1]):
        return lambda row: known[prepared.ids[row]]
    central, retrieval = medoid(*trained_on), ShapeRetrieval(*trained_on)

    def references(row: int) -> Mapping[str, Shape | Scores]:
        name, cloud = prepared.ids[row], prepared.cloud(row)
        if name in known:
            return known[name]
        fitted, offsets = fitted_template(bank, cloud, (sample_seed(name) + seed) % 2**64)
        return {
            "best_undeformed": TemplateShape(bank, best_template(prepared, row, bank)),
            "fitted": TemplateShape(bank, fitted, offsets),
            "retrieval": PreparedShape(training, retrieval.nearest(cloud)),
            "medoid": PreparedShape(training, central),
            "floor": PreparedShape(prepared, row),
        }

    return references


def bank_digest(bank: TemplateBank) -> str:
    """Return what changes when templates are others, though of the same ids, or their lattices."""
    digest = hashlib.sha256()
    for array in (bank.points.numpy(), bank.control_points.numpy(), bank.point_parts):
        digest.update(b"" if array is None else array.tobytes())
    return digest.hexdigest()


def _digest(content: object) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _read(file: Path) -> dict[str, dict[str, Scores]]:
    """Return what a file holds, {} where it is not there, or not as it was written."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        scores: dict[str, dict[str, Scores]] = content["scores"]
        return scores if content["sha256"] == _digest(scores) else {}
    except (OSError, ValueError, KeyError, TypeError):
        return {}
