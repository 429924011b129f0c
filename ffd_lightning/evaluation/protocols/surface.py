"""Surface metrics of dense points, as papers since report them, and four papers' own numbers."""

from typing import ClassVar, Literal, NamedTuple

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

    reported: ClassVar[dict[str, tuple[str, float]]] = {}
    """What a paper prints: its name -> (name in `surface_scores`, factor); {} for all scores."""

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
        fscores = {f"fscore_{100 * t:g}": (f"fscore@{t:g}", 1.0) for t in thresholds}
        self._scores = self.reported or fscores | {score: (score, 1.0) for score in _SCORES}
        self.metrics = (
            *(self._metric(name, *score) for name, score in self._scores.items()),
            *(Metric(f"iou_{n}", f"{n}^3 voxels, conservative and filled", True) for n in voxels),
        )

    def _metric(self, name: str, score: str, factor: float) -> Metric:
        definition = _SCORES.get(score) or score.replace("fscore@", "F-score at ")
        better = score.startswith(("fscore", "normal"))
        if self.reported:  # the factor is in the score
            return Metric(name, f"{score} x {factor:g}", better, 1.0)
        return Metric(name, definition, better)

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
            **{name: scores[score] * factor for name, (score, factor) in self._scores.items()},
            **{f"iou_{n}": voxel_iou(pred, target) for n, pred, target in grids},
        }

    def _grids(self, mesh: Surface) -> list[NDArray[np.bool_]]:
        return [voxelize(*mesh, n, half_size=0.5) for n in self.voxels]


def _scaled(surface: SurfaceSample, factor: float) -> SurfaceSample:
    return surface._replace(points=factor * surface.points)


@component("protocol", "pixel2mesh")
class Pixel2Mesh(SurfaceProtocol):
    """Pixel2Mesh's scale and numbers.

    Pixel2Mesh itself scores its 2,466 vertices against all points of its data, Mesh R-CNN 10,000
    points of either surface. Its EMD is an approximate matching: not given here.

    Source: nywang16/Pixel2Mesh eval_testset.py; facebookresearch/meshrcnn evaluate_test_p2m.
    """

    reported: ClassVar = {
        "CD": ("chamfer_l2", 1000),
        "F(1e-4)": ("fscore@0.01", 100),
        "F(2e-4)": ("fscore@0.0141421", 100),
    }

    def __init__(self, points: int = 10_000) -> None:
        super().__init__(points, "box_diagonal", 0.57, (1e-4**0.5, 2e-4**0.5), ())


@component("protocol", "atlasnet")
class AtlasNet(SurfaceProtocol):
    """AtlasNet's scale and numbers, as its code logs them.

    What the paper's tables multiply by, and how many points they take, was not checked. Its targets
    are points seen from outside, without interiors.

    Source: ThibaultGROUEIX/AtlasNet of 2019: trainer_loss.py, fscore.py, argument_parser.py.
    """

    reported: ClassVar = {"chamfer": ("chamfer_l2", 1), "fscore": ("fscore@0.0316228", 1)}

    def __init__(self, points: int = 2500) -> None:
        super().__init__(points, "radius", 1.0, (1e-3**0.5,), ())


@component("protocol", "mesh_rcnn")
class MeshRcnn(SurfaceProtocol):
    """Mesh R-CNN's scale and numbers.

    Source: facebookresearch/meshrcnn meshrcnn/utils/metrics.py, shapenet/evaluation/eval.py.
    """

    reported: ClassVar = {
        "Chamfer": ("chamfer_l2", 1),
        "Normal": ("normal_consistency", 1),
        **{f"F1({threshold})": (f"fscore@{threshold}", 100) for threshold in (0.1, 0.3, 0.5)},
    }

    def __init__(self, points: int = 10_000) -> None:
        super().__init__(points, "longest_side", 10.0, (0.1, 0.3, 0.5), ())


@component("protocol", "occnet")
class OccNet(SurfaceProtocol):
    """Occupancy Networks' scale and numbers: a tenth of the longest side is the unit.

    Its targets are watertight remeshings, without interiors; ours are the shapes' surfaces.

    Source: autonomousvision/occupancy_networks im2mesh/eval.py and issue 61.
    """

    reported: ClassVar = {
        "Chamfer-L1": ("chamfer_l1", 1),
        "Normal Consistency": ("normal_consistency", 1),
    }

    def __init__(self, points: int = 100_000) -> None:
        super().__init__(points, "longest_side", 10.0, (), ())
