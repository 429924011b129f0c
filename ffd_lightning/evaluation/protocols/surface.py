"""Surface metrics of dense points, as papers since report them."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.components import check_ranges, component
from ffd_lightning.evaluation.candidates import Candidate, PreparedShape, Surface
from ffd_lightning.evaluation.protocols.base import Metric, Protocol
from ffd_lightning.geometry.voxels import voxelize
from ffd_lightning.metrics.iou import voxel_iou
from ffd_lightning.metrics.surface import SurfaceSample, sample_with_normals, surface_scores

_SCORES = {
    "chamfer_l1": "mean of accuracy and completeness, unsquared",
    "chamfer_l2": "squared, mean over points, both ways added",
    "normal_consistency": "mean absolute cosine, both ways averaged",
    "hausdorff90": "90th percentile, the larger of both ways",
}


class _Truth(NamedTuple):
    factor: float
    surface: SurfaceSample
    grids: list[NDArray[np.bool_]]


@component("protocol", "modern")
class SurfaceProtocol(Protocol):
    """What papers since report: surface metrics of points of the meshes themselves.

    Points are drawn afresh from the (deformed) meshes. Voxels are closed boxes over the box from
    -0.5 to 0.5 in the shapes' own frame, filled.

    Source: Tatarchenko et al. 2019 (F-score at 1% of the side, retrieval as a baseline), Mescheder
    et al. 2019 (Chamfer-L1, normal consistency).

    Args:
        points: drawn from either surface.
        scale: what of the truth becomes `size`: the longest side of its box, the greatest distance
            of a point from the mean of its points, or the diagonal of its box, which is 1 in all
            prepared shapes.
        size: see `scale`.
        thresholds: of the F-score, for distances after scaling.
        voxels: along each side of a grid, for each IoU.
    """

    def __init__(
        self,
        points: int = 10_000,
        scale: Literal["box_diagonal", "longest_side", "radius"] = "longest_side",
        size: float = 1.0,
        thresholds: tuple[float, ...] = (0.01, 0.02),
        voxels: tuple[int, ...] = (32, 128),
    ) -> None:
        above = "(0, inf)"
        check_ranges(locals(), points=above, size=above, thresholds=above, voxels=above)
        self.points, self.scale, self.size = points, scale, size
        self.thresholds, self.voxels = thresholds, voxels
        self.note = f"{points:,} points of the meshes, {scale.replace('_', ' ')} of the truth "
        self.note += f"{size:g}"
        self._fscores = {f"fscore_{100 * t:g}": f"fscore@{t:g}" for t in thresholds}
        fscores = zip(self._fscores, thresholds, strict=True)
        self.metrics = (
            *(Metric(name, f"F-score at {t:g}", True) for name, t in fscores),
            *(Metric(n, text, n == "normal_consistency") for n, text in _SCORES.items()),
            *(Metric(f"iou_{n}", f"{n}^3 voxels, conservative and filled", True) for n in voxels),
        )

    def truth(self, shape: PreparedShape, rng: np.random.Generator) -> _Truth:
        """See `Protocol`."""
        vertices, faces = mesh = shape.mesh()
        surface = sample_with_normals(*mesh, self.points, rng)
        extent = {
            "box_diagonal": 1.0,
            "longest_side": np.ptp(vertices[np.unique(faces)], axis=0).max(),
            "radius": np.linalg.norm(surface.points - surface.points.mean(0), axis=1).max(),
        }[self.scale]
        factor = self.size / float(extent)
        return _Truth(factor, _scaled(surface, factor), self._grids(mesh))

    def score(
        self, candidate: Candidate, truth: _Truth, rng: np.random.Generator
    ) -> dict[str, float]:
        """See `Protocol`."""
        mesh = candidate.mesh()
        surface = _scaled(sample_with_normals(*mesh, self.points, rng), truth.factor)
        scores = surface_scores(surface, truth.surface, self.thresholds)
        grids = zip(self.voxels, self._grids(mesh), truth.grids, strict=True)
        return {
            **{name: scores[score] for name, score in self._fscores.items()},
            **{name: scores[name] for name in _SCORES},
            **{f"iou_{n}": voxel_iou(pred, target) for n, pred, target in grids},
        }

    def _grids(self, mesh: Surface) -> list[NDArray[np.bool_]]:
        return [voxelize(*mesh, n, half_size=0.5) for n in self.voxels]


def _scaled(surface: SurfaceSample, factor: float) -> SurfaceSample:
    return surface._replace(points=factor * surface.points)
