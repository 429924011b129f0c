"""A protocol: how far the sides of the bounding box are off."""

import numpy as np

import ffd_lightning as ffd


@ffd.component("protocol", "extents")
class Extents(ffd.Protocol):
    """Sides of the bounding box.

    Args:
        points: of each shape that are looked at.
    """

    metrics = (ffd.Metric("side_error", "mean difference of the box's three sides"),)

    def __init__(self, points: int = 512) -> None:
        self.points = points
        self.note = f"{points} points, box diagonal 1"

    def truth(self, shape: ffd.PreparedShape, rng: np.random.Generator) -> np.ndarray:
        """Return the sides of the ground truth, (3,)."""
        return np.ptp(shape.cloud(self.points, rng), axis=0)

    def score(
        self, candidate: ffd.Candidate, truth: np.ndarray, rng: np.random.Generator
    ) -> dict[str, float]:
        """Return each metric of a candidate."""
        sides = np.ptp(candidate.cloud(self.points, rng), axis=0)
        return {"side_error": float(np.abs(sides - truth).mean())}
