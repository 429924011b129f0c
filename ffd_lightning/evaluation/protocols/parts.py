"""How well part labels are transferred that a template brings along."""

import logging
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.components import component
from ffd_lightning.data.preparation.part_labels import label_points
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.source import PartCloud
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.candidates import Candidate, PreparedShape
from ffd_lightning.evaluation.protocols.base import Metric, Protocol
from ffd_lightning.geometry.mesh import UNKNOWN_PART

log = logging.getLogger(__name__)

Names = NDArray[np.str_]  # of parts; "" where there is no label to take

_WAY_OUT = (
    "train on data with labels (the embedded data has them, ShapeNet's shapes get them with "
    "data.parts_root=DIR), or choose another protocol="
)


@component("protocol", "parts")
class PartProtocol(Protocol):
    """What part labels are worth that a shape brings along: the paper shows this in pictures.

    Every true point takes the label of the candidate's nearest labelled point, both in the shapes'
    own frame; none where the candidate has none. Truth and candidate give half of their surface
    samples each, and the truth as its own floor the other half. Points, and shapes, whose true
    parts are not known are left out.

    Source: the paper's section on semantic label transfer; for `shapenet_part_iou` Yi et al. 2016.
    """

    needs_parts = True
    note = "half of a shape's points labels half of the truth's (8,192 of 16,384 by default)"
    metrics = (
        Metric("part_iou", "mean over parts, of those in the truth or transferred", True, 100),
        Metric("shapenet_part_iou", "over all the category has, absent 1", True, 100),
        Metric("part_accuracy", "share of true points labelled right", True, 100),
    )

    def truth(
        self, shape: PreparedShape, rng: np.random.Generator
    ) -> tuple[PartCloud, tuple[str, ...]]:
        """See `Protocol`."""
        own = shape.prepared.part_names_of(shape.row)
        return _known(shape.truth_labelled_points()), own

    def score(
        self,
        candidate: Candidate,
        truth: tuple[PartCloud, tuple[str, ...]],
        rng: np.random.Generator,
    ) -> dict[str, float]:
        """Return each metric, and the IoU of each part of the truth as `part_iou_<part>`."""
        cloud, category = truth
        source = candidate.labelled_points()
        transferred = _names(source, label_points(_known(source), cloud.points))
        return part_scores(_names(cloud, cloud.labels), transferred, category)


def _known(cloud: PartCloud) -> PartCloud:
    known = cloud.labels != UNKNOWN_PART
    return PartCloud(cloud.points[known], cloud.labels[known], cloud.names)


def _names(cloud: PartCloud, labels: NDArray[np.uint8]) -> Names:
    return np.array((*cloud.names, ""))[np.minimum(labels, len(cloud.names))]


def part_scores(truth: Names, transferred: Names, category: Sequence[str]) -> dict[str, float]:
    """Compare the parts that points were given with those that they belong to.

    The IoU of a part is over points: those rightly taken for it, of those that belong to it or are
    taken for it.

    Args:
        truth: names of the points' parts, (P,), P > 0.
        transferred: names that they were given, (P,); "" is always wrong.
        category: names of all parts that shapes of this category can have.

    Returns:
        `part_iou`, the mean over the parts that occur in either; `shapenet_part_iou`, the mean over
        all parts of the category, where a part that does not occur counts 1, as the ShapeNet part
        benchmark has it; `part_accuracy`, the share of points that are right; and the IoU of each
        part that the truth has, under `part_iou_<part>`.

    >>> truth, given = (np.array(x) for x in (["top", "top", "leg"], ["top", "leg", "leg"]))
    >>> scores = part_scores(truth, given, ("top", "leg", "shelf"))
    >>> {name: round(value, 3) for name, value in scores.items()}  # doctest: +NORMALIZE_WHITESPACE
    {'part_iou': 0.5, 'shapenet_part_iou': 0.667, 'part_accuracy': 0.667,
     'part_iou_top': 0.5, 'part_iou_leg': 0.5}
    """
    ious = {}
    for part in dict.fromkeys([*category, *truth.tolist(), *transferred.tolist()]):
        belong, taken = truth == part, transferred == part
        union = int((belong | taken).sum())
        if union and part:
            ious[part] = float((belong & taken).sum() / union)
    return {
        "part_iou": float(np.mean(list(ious.values()))),
        "shapenet_part_iou": float(np.mean([ious.get(part, 1.0) for part in category])),
        "part_accuracy": float(np.mean(truth == transferred)),
        **{f"part_iou_{part}": iou for part, iou in ious.items() if (truth == part).any()},
    }


def labelled_rows(prepared: PreparedSet, rows: NDArray[np.int64], subset: str) -> NDArray[np.int64]:
    """Return those rows of a prepared set whose shapes have part labels.

    Raises:
        DataError: none has; the message calls them `subset` shapes.
    """
    labelled = rows[np.array([_has_labels(prepared.point_parts(int(row))) for row in rows], bool)]
    if not len(labelled):
        without = "add evaluation.references=false, " if subset == "training" else ""
        raise DataError(
            f"protocol parts: no {subset} shape of {prepared.path} has part labels: "
            f"{without}{_WAY_OUT}"
        )
    return labelled


def check_templates(bank: TemplateBank) -> None:
    """Warn of templates without part labels.

    Raises:
        DataError: none has any.
    """
    parts = bank.point_parts
    without = [i for t, i in enumerate(bank.ids) if parts is None or not _has_labels(parts[t])]
    if len(without) == len(bank):
        raise DataError(f"protocol parts: none of the templates has part labels: {_WAY_OUT}")
    if without:
        log.warning(
            f"{len(without)} of {len(bank)} templates have no part labels, so all that they "
            f"transfer counts as wrong: {', '.join(without)}"
        )


def _has_labels(parts: NDArray[np.uint8] | None) -> bool:
    return parts is not None and bool((parts != UNKNOWN_PART).any())
