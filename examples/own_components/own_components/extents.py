"""A protocol: how far the sides of the bounding box are off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import ffd_lightning as ffd


@ffd.component("protocol", "extents")
@dataclass(frozen=True)
class Extents(ffd.EvaluationProtocol):
    """Sides of the bounding box.

    Args:
        points: of each shape that are looked at.
    """

    points: int = 512

    name = "extents"
    measures = (ffd.Measure("side_error", "mean difference of the box's three sides"),)

    @property
    def note(self) -> str:
        """Points and unit of all measures."""
        return f"{self.points} points, box diagonal 1"

    def truth(self, shape: ffd.PreparedShape, rng: np.random.Generator) -> np.ndarray:
        """Return the sides of the ground truth, (3,)."""
        return np.ptp(shape.cloud(self.points, rng), axis=0)

    def score(
        self, shape: ffd.Shape, truth: np.ndarray, rng: np.random.Generator
    ) -> dict[str, float]:
        """Return each measure of a shape."""
        sides = np.ptp(shape.cloud(self.points, rng), axis=0)
        return {"side_error": float(np.abs(sides - truth).mean())}
