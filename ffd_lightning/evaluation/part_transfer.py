"""Part labels carried from a shape to the points of another, and how many of them are right.

A template brings its labels along as it is deformed (the paper's section on semantic label
transfer, which shows pictures). Here the true points take the labels of the points nearest to them,
and are compared with their own.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.data.preparation.part_labels import label_points
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.source import PartCloud
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import DataError
from ffd_lightning.geometry.mesh import UNKNOWN_PART

log = logging.getLogger(__name__)

Names = NDArray[np.str_]
NO_PART = ""
"""What a point is said to be where there is no label to take."""

_WAY_OUT = (
    "train on data with labels (the embedded data has them, ShapeNet's shapes get them with "
    "data.parts_root=DIR), or choose another protocol="
)


def known_points(cloud: PartCloud) -> PartCloud:
    """Return the points of a cloud whose part is known."""
    known = cloud.labels != UNKNOWN_PART
    return PartCloud(cloud.points[known], cloud.labels[known], cloud.names)


def part_of_points(cloud: PartCloud) -> Names:
    """Return the names of the parts that points with known parts belong to, (P,)."""
    return np.array((*cloud.names, NO_PART))[cloud.labels]


def transferred_parts(source: PartCloud, points: NDArray[np.float64]) -> Names:
    """Return for each point the part of the nearest point of a source, (P,) names.

    Points of the source whose part is not known have no label to give: the nearest of the others
    gives its own. Where no part of the source is known, it is `NO_PART`.

    Args:
        source: labelled points, in the frame of the others.
        points: (P, 3).
    """
    known = known_points(source)
    if len(known.points) == 0:
        return np.full(len(points), NO_PART)
    return np.array(known.names)[label_points(known, points)]


def part_scores(truth: Names, found: Names, category: Sequence[str]) -> dict[str, float]:
    """Compare the parts found for points with those that they belong to.

    The IoU of a part is over points: those rightly taken for it, of those that belong to it or are
    taken for it.

    Args:
        truth: names of the points' parts, (P,), P > 0.
        found: names of what was found, (P,); `NO_PART` is always wrong.
        category: names of all parts that shapes of this category can have.

    Returns:
        `part_iou`, the mean over the parts that occur in the truth or in what was found;
        `shapenet_part_iou`, the mean over all parts of the category, where a part that does not
        occur in either counts 1, as the ShapeNet part benchmark has it; `part_accuracy`, the share
        of points that are right; and the IoU of each part that the truth has, under
        `part_iou_<part>`.

    >>> truth, found = (np.array(x) for x in (["top", "top", "leg"], ["top", "leg", "leg"]))
    >>> scores = part_scores(truth, found, ("top", "leg", "shelf"))
    >>> {name: round(value, 3) for name, value in scores.items()}  # doctest: +NORMALIZE_WHITESPACE
    {'part_iou': 0.5, 'shapenet_part_iou': 0.667, 'part_accuracy': 0.667,
     'part_iou_top': 0.5, 'part_iou_leg': 0.5}
    """
    ious = {}
    for part in dict.fromkeys([*category, *truth.tolist(), *found.tolist()]):
        belong, taken = truth == part, found == part
        union = int((belong | taken).sum())
        if union and part != NO_PART:
            ious[part] = float((belong & taken).sum() / union)
    return {
        "part_iou": float(np.mean(list(ious.values()))),
        "shapenet_part_iou": float(np.mean([ious.get(part, 1.0) for part in category])),
        "part_accuracy": float(np.mean(truth == found)),
        **{f"part_iou_{part}": iou for part, iou in ious.items() if (truth == part).any()},
    }


def labelled_rows(prepared: PreparedSet, rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return those rows of a prepared set whose shapes have part labels."""
    labelled = [_has_labels(prepared.point_parts(int(row))) for row in rows]
    return rows[np.array(labelled, bool)]


def check_labels(
    bank: TemplateBank, tested: tuple[PreparedSet, int], trained: tuple[PreparedSet, int] | None
) -> None:
    """Make sure that there are labels to give and to compare with; warn of templates without.

    Args:
        bank: the templates.
        tested: what is tested on, and how many of those shapes have labels.
        trained: the same of what is retrieved from; None where nothing is.

    Raises:
        DataError: no labels; the message says where, and what to do.
    """
    if not tested[1]:
        raise DataError(
            f"protocol parts: no test shape of {tested[0].path} has part labels: {_WAY_OUT}"
        )
    parts = bank.point_parts
    without = [i for t, i in enumerate(bank.ids) if parts is None or not _has_labels(parts[t])]
    if len(without) == len(bank):
        raise DataError(f"protocol parts: none of the templates has part labels: {_WAY_OUT}")
    if trained is not None and not trained[1]:
        raise DataError(
            f"protocol parts: no training shape of {trained[0].path} has part labels, so there are "
            f"none to retrieve: add evaluation.references=false, {_WAY_OUT}"
        )
    if without:
        log.warning(
            "%d of %d templates have no part labels, so all that they transfer counts as wrong: %s",
            len(without),
            len(bank),
            ", ".join(without),
        )


def _has_labels(parts: NDArray[np.uint8] | None) -> bool:
    return parts is not None and bool((parts != UNKNOWN_PART).any())
