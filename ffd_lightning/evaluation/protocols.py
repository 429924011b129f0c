"""What is measured, and how: each protocol turns a shape and the truth into named numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.evaluation.shapes import Cloud, Shape
from ffd_lightning.geometry.hemisphere import Hemisphere, bounding_hemisphere
from ffd_lightning.geometry.voxels import PAPER_HALF_SIZE, voxelize
from ffd_lightning.metrics.chamfer import chamfer
from ffd_lightning.metrics.emd import earth_movers_distance
from ffd_lightning.metrics.iou import voxel_iou


@dataclass(frozen=True)
class Measure:
    """One number of a protocol.

    Attributes:
        name: of its columns.
        definition: what it is, with its unit, for captions.
        higher_is_better: which way is good.
        factor: what it is multiplied by where people read it.
    """

    name: str
    definition: str
    higher_is_better: bool = False
    factor: float = 1000.0


class EvaluationProtocol(Protocol):
    """A frozen way of measuring."""

    @property
    def name(self) -> str:
        """What it is called, in commands and folders."""
        ...

    @property
    def measures(self) -> tuple[Measure, ...]:
        """What it measures."""
        ...

    def truth(self, shape: Shape, rng: np.random.Generator) -> Any:
        """Return what of the ground truth is computed once for all shapes put before it."""
        ...

    def score(self, shape: Shape, truth: Any, rng: np.random.Generator) -> dict[str, float]:
        """Return each measure of a shape."""
        ...


@dataclass(frozen=True)
class _PaperTruth:
    frame: Hemisphere
    cloud: Cloud
    voxels: NDArray[np.bool_]


@dataclass(frozen=True)
class PaperProtocol:
    """The paper's section 4.1, in the details of its authors' code.

    Convention:
        Clouds: 1,024 points of a shape's 16,384, drawn with replacement; all are carried by the
        transform that brings the ground truth's mesh into its smallest hemisphere of radius 3.2.
        Voxels: 32 x 32 x 32 over the box from -0.5 to 0.5, conservative (binvox's half-size of 0.51
        voxel), filled; the subdivided mesh in the models' own frame.

    Source: the paper's sections 4.1 and 4.2; the authors' released code.
    """

    name: str = "paper"
    points: int = 1024
    resolution: int = 32
    half_size: float = PAPER_HALF_SIZE

    @property
    def measures(self) -> tuple[Measure, ...]:
        """Chamfer, EMD and IoU."""
        frame = f"{self.points} points, hemisphere of radius 3.2"
        return (
            Measure("chamfer", f"squared, mean over points, both ways added; {frame}"),
            Measure("emd", f"exact, mean unsquared distance; {frame}"),
            Measure("iou", f"{self.resolution}^3 voxels, conservative and filled", True),
        )

    def truth(self, shape: Shape, rng: np.random.Generator) -> _PaperTruth:
        """See `EvaluationProtocol`."""
        vertices, faces = shape.mesh()
        frame = bounding_hemisphere(vertices[np.unique(faces)])
        cloud = frame.transform(shape.cloud(self.points, rng))
        return _PaperTruth(frame, cloud, self._voxels(vertices, faces))

    def score(self, shape: Shape, truth: _PaperTruth, rng: np.random.Generator) -> dict[str, float]:
        """See `EvaluationProtocol`."""
        cloud = truth.frame.transform(shape.cloud(self.points, rng))
        return {
            "chamfer": float(chamfer(cloud, truth.cloud)),
            "emd": float(earth_movers_distance(cloud, truth.cloud, workers=1)),
            "iou": float(voxel_iou(self._voxels(*shape.mesh()), truth.voxels)),
        }

    def _voxels(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
        return voxelize(vertices, faces, self.resolution, half_size=self.half_size)
