"""Other papers' scales, points and numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ffd_lightning.evaluation.protocols.base import Measure
from ffd_lightning.evaluation.protocols.modern import longest_side
from ffd_lightning.evaluation.shapes import PreparedShape, Shape
from ffd_lightning.metrics.scalings import SCALINGS, score_like
from ffd_lightning.metrics.surface import SurfaceSample, sample_with_normals


@dataclass(frozen=True)
class ScaledProtocol:
    """Another paper's scale, points and numbers; see `metrics.scalings.SCALINGS`."""

    name: str
    needs_parts: ClassVar[bool] = False

    @property
    def note(self) -> str:
        """See `EvaluationProtocol`."""
        scaling = SCALINGS[self.name]
        return (
            f"{scaling.num_points:,} points of the meshes, {scaling.rule} {scaling.size:g}, after "
            f"{scaling.source}. {scaling.unclear}"
        ).strip()

    @property
    def measures(self) -> tuple[Measure, ...]:
        """What the paper reports, as it prints it."""
        return tuple(
            Measure(name, f"{score} x {factor:g}", not score.startswith("chamfer"), 1.0)
            for name, (score, factor) in SCALINGS[self.name].reported.items()
        )

    def truth(self, shape: PreparedShape, rng: np.random.Generator) -> tuple[SurfaceSample, float]:
        """See `EvaluationProtocol`."""
        vertices, faces = shape.mesh()
        return self._surface(shape, rng), longest_side(vertices, faces)

    def score(
        self, shape: Shape, truth: tuple[SurfaceSample, float], rng: np.random.Generator
    ) -> dict[str, float]:
        """See `EvaluationProtocol`."""
        return score_like(self.name, self._surface(shape, rng), *truth)

    def _surface(self, shape: Shape, rng: np.random.Generator) -> SurfaceSample:
        return sample_with_normals(*shape.mesh(), SCALINGS[self.name].num_points, rng)
