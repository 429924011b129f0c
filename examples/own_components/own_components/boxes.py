"""A source of shapes: boxes of random sides."""

from dataclasses import dataclass

import numpy as np

import ffd_lightning as ffd

_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
_FACES = np.array([face for a, b, c, d in _SIDES for face in ((a, b, c), (a, c, d))])


@ffd.component("source", "boxes")
@dataclass(frozen=True)
class Boxes(ffd.Source):
    """Boxes of random sides: each follows from its number and the seed.

    Args:
        count: how many.
        seed: makes others.
    """

    count: int = 40
    seed: int = 0

    def categories(self) -> list[str]:
        """Return what can be asked for."""
        return ["box"]

    def shape_ids(self, category: str) -> list[str]:
        """Return the ids, sorted."""
        return [f"box-{k:04d}" for k in range(self.count)]

    def load(self, category: str, shape_id: str) -> ffd.SourceShape:
        """Return one box, y up, facing -z."""
        rng = np.random.default_rng([self.seed, int(shape_id.rpartition("-")[2])])
        sides, color = rng.uniform(0.2, 1, 3), [*rng.integers(40, 200, 3), 255]
        colors = np.tile(np.array(color, np.uint8), (len(_FACES), 1))
        return ffd.SourceShape(ffd.Mesh(_CORNERS * sides, _FACES, colors), family="box")

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return what decides the boxes: prepared data is kept by it."""
        return {"source": "boxes", "version": 1, "count": self.count, "seed": self.seed}
