"""Surface metrics of dense points, as papers since report them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.components import check_ranges
from ffd_lightning.evaluation.protocols.base import Measure
from ffd_lightning.evaluation.shapes import PreparedShape, Shape
from ffd_lightning.geometry.voxels import voxelize
from ffd_lightning.metrics.iou import voxel_iou
from ffd_lightning.metrics.surface import SurfaceSample, sample_with_normals, surface_scores


@dataclass(frozen=True)
class _ModernTruth:
    scale: float
    surface: SurfaceSample
    coarse: NDArray[np.bool_]
    fine: NDArray[np.bool_]


@dataclass(frozen=True)
class ModernProtocol:
    """What papers since report: surface metrics of 10,000 points of the meshes themselves.

    Convention:
        Distances are in units of the longest side of the ground truth's box. Points are drawn
        afresh from the (deformed) meshes. Voxels are closed boxes (half-size 0.5) over the box from
        -0.5 to 0.5 in the shapes' own frame, filled.

    Source: Tatarchenko et al. 2019 (F-score at 1% of the side, retrieval as a baseline), Mescheder
    et al. 2019 (Chamfer-L1, normal consistency).
    """

    name: str = "modern"
    points: int = 10_000
    needs_parts: ClassVar[bool] = False

    def __post_init__(self) -> None:
        check_ranges(vars(self), points="(0, inf)")

    @property
    def note(self) -> str:
        """See `EvaluationProtocol`."""
        return f"{self.points:,} points of the meshes, longest side of the truth 1"

    @property
    def measures(self) -> tuple[Measure, ...]:
        """F-scores, Chamfer distances, normals, Hausdorff, IoU."""
        return (
            Measure("fscore_1", "F-score at 0.01", True),
            Measure("fscore_2", "F-score at 0.02", True),
            Measure("chamfer_l1", "mean of accuracy and completeness, unsquared"),
            Measure("chamfer_l2", "squared, mean over points, both ways added"),
            Measure("normal_consistency", "mean absolute cosine, both ways averaged", True),
            Measure("hausdorff90", "90th percentile, the larger of both ways"),
            Measure("iou_32", "32^3 voxels, conservative and filled", True),
            Measure("iou_128", "128^3 voxels, conservative and filled", True),
        )

    def truth(self, shape: PreparedShape, rng: np.random.Generator) -> _ModernTruth:
        """See `EvaluationProtocol`."""
        vertices, faces = shape.mesh()
        scale = 1 / longest_side(vertices, faces)
        grids = (voxelize(vertices, faces, size, half_size=0.5) for size in (32, 128))
        return _ModernTruth(scale, self._surface(vertices, faces, scale, rng), *grids)

    def score(
        self, shape: Shape, truth: _ModernTruth, rng: np.random.Generator
    ) -> dict[str, float]:
        """See `EvaluationProtocol`."""
        vertices, faces = shape.mesh()
        surface = self._surface(vertices, faces, truth.scale, rng)
        scores = surface_scores(surface, truth.surface, (0.01, 0.02))
        grids = {size: voxelize(vertices, faces, size, half_size=0.5) for size in (32, 128)}
        return {
            "fscore_1": scores["fscore@0.01"],
            "fscore_2": scores["fscore@0.02"],
            **{k: scores[k] for k in ("chamfer_l1", "chamfer_l2", "normal_consistency")},
            "hausdorff90": scores["hausdorff90"],
            "iou_32": voxel_iou(grids[32], truth.coarse),
            "iou_128": voxel_iou(grids[128], truth.fine),
        }

    def _surface(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        scale: float,
        rng: np.random.Generator,
    ) -> SurfaceSample:
        return sample_with_normals(vertices * scale, faces, self.points, rng)


def longest_side(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    """Return the longest side of a mesh's bounding box, of the vertices that faces use."""
    return float(np.ptp(vertices[np.unique(faces)], axis=0).max())
