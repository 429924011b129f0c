"""How well part labels are transferred."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ffd_lightning.data.source import PartCloud
from ffd_lightning.evaluation.part_transfer import (
    known_points,
    part_of_points,
    part_scores,
    transferred_parts,
)
from ffd_lightning.evaluation.protocols.base import Measure
from ffd_lightning.evaluation.shapes import PreparedShape, Shape


@dataclass(frozen=True)
class PartProtocol:
    """What part labels are worth that a shape brings along: the paper shows this in pictures.

    Convention:
        Every true point takes the label of the shape's nearest labelled point, both in the shapes'
        own frame. Truth and shape give half of their surface samples each, and the truth as its own
        floor the other half. Points, and shapes, whose true parts are not known are left out.

    Source: the paper's section on semantic label transfer; for `shapenet_part_iou` Yi et al. 2016.
    """

    name: str = "parts"
    needs_parts: ClassVar[bool] = True

    @property
    def note(self) -> str:
        """See `EvaluationProtocol`."""
        return "half of a shape's points labels half of the truth's (8,192 of 16,384 by default)"

    @property
    def measures(self) -> tuple[Measure, ...]:
        """IoU of parts, and share of points."""
        return (
            Measure("part_iou", "mean over parts, of those in the truth or transferred", True, 100),
            Measure("shapenet_part_iou", "over all the category has, absent 1", True, 100),
            Measure("part_accuracy", "share of true points labelled right", True, 100),
        )

    def truth(
        self, shape: PreparedShape, rng: np.random.Generator
    ) -> tuple[PartCloud, tuple[str, ...]]:
        """See `EvaluationProtocol`."""
        return known_points(shape.truth_labelled_points()), shape.category_parts

    def score(
        self, shape: Shape, truth: tuple[PartCloud, tuple[str, ...]], rng: np.random.Generator
    ) -> dict[str, float]:
        """Return each measure, and the IoU of each part of the truth as `part_iou_<part>`."""
        cloud, category = truth
        found = transferred_parts(shape.labelled_points(), cloud.points)
        return part_scores(part_of_points(cloud), found, category)
