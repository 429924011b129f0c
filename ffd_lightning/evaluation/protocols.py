"""What is measured, and how: each protocol turns a shape and the truth into named numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.data.sources.base import PartCloud
from ffd_lightning.evaluation.part_transfer import (
    known_points,
    part_of_points,
    part_scores,
    transferred_parts,
)
from ffd_lightning.evaluation.shapes import Cloud, ModelShape, Shape
from ffd_lightning.geometry.hemisphere import Hemisphere, bounding_hemisphere
from ffd_lightning.geometry.voxels import PAPER_HALF_SIZE, voxelize
from ffd_lightning.metrics.chamfer import chamfer
from ffd_lightning.metrics.emd import earth_movers_distance
from ffd_lightning.metrics.iou import voxel_iou
from ffd_lightning.metrics.scalings import SCALINGS, score_like
from ffd_lightning.metrics.surface import SurfaceSample, sample_with_normals, surface_scores


@dataclass(frozen=True)
class Measure:
    """One number of a protocol.

    Attributes:
        name: of its columns.
        definition: what it is, for captions; points and unit are the protocol's `note`.
        higher_is_better: which way is good.
        factor: what it is multiplied by where people read it.
    """

    name: str
    definition: str
    higher_is_better: bool = False
    factor: float = 1000.0

    @property
    def arrow(self) -> str:
        """Points to where it is better."""
        return "↑" if self.higher_is_better else "↓"


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

    @property
    def note(self) -> str:
        """Points and unit of all its measures."""
        ...

    @property
    def quality(self) -> bool:
        """Whether the quality of the model's own deformed mesh is measured too."""
        ...

    @property
    def needs_parts(self) -> bool:
        """Whether only models with part labels can be tested on."""
        ...

    def truth(self, shape: ModelShape, rng: np.random.Generator) -> Any:
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
        Clouds: 1,024 points, drawn with replacement from a shape's 16,384, and for the ground truth
        from 1,024 of its own (see `ModelShape.truth_cloud`); all are carried by the transform that
        brings the ground truth's mesh into its smallest hemisphere of radius 3.2.
        Voxels: 32 x 32 x 32 over the box from -0.5 to 0.5, conservative (binvox's half-size of 0.51
        voxel), filled; the subdivided mesh in the models' own frame.

    Source: the paper's sections 4.1 and 4.2; the authors' released code.
    """

    name: str = "paper"
    points: int = 1024
    resolution: int = 32
    half_size: float = PAPER_HALF_SIZE
    quality: bool = False
    needs_parts: ClassVar[bool] = False

    @property
    def note(self) -> str:
        """See `EvaluationProtocol`."""
        return f"{self.points:,} points, hemisphere of radius 3.2"

    @property
    def measures(self) -> tuple[Measure, ...]:
        """Chamfer, EMD and IoU."""
        return (
            Measure("chamfer", "squared, mean over points, both ways added"),
            Measure("emd", "exact earth mover's, mean unsquared distance"),
            Measure("iou", f"{self.resolution}^3 voxels, conservative and filled", True),
        )

    def truth(self, shape: ModelShape, rng: np.random.Generator) -> _PaperTruth:
        """See `EvaluationProtocol`."""
        vertices, faces = shape.mesh()
        frame = bounding_hemisphere(vertices[np.unique(faces)])
        cloud = frame.transform(shape.truth_cloud(self.points, rng))
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
        -0.5 to 0.5 in the models' own frame, filled.

    Source: Tatarchenko et al. 2019 (F-score at 1% of the side, retrieval as a baseline), Mescheder
    et al. 2019 (Chamfer-L1, normal consistency).
    """

    name: str = "modern"
    points: int = 10_000
    quality: bool = True
    needs_parts: ClassVar[bool] = False

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

    def truth(self, shape: ModelShape, rng: np.random.Generator) -> _ModernTruth:
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
            "iou_32": float(voxel_iou(grids[32], truth.coarse)),
            "iou_128": float(voxel_iou(grids[128], truth.fine)),
        }

    def _surface(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        scale: float,
        rng: np.random.Generator,
    ) -> SurfaceSample:
        return sample_with_normals(vertices * scale, faces, self.points, rng)


@dataclass(frozen=True)
class ScaledProtocol:
    """Another paper's scale, points and numbers; see `metrics.scalings.SCALINGS`."""

    name: str
    quality: bool = False
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

    def truth(self, shape: ModelShape, rng: np.random.Generator) -> tuple[SurfaceSample, float]:
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


@dataclass(frozen=True)
class PartProtocol:
    """What part labels are worth that a shape brings along: the paper shows this in pictures.

    Convention:
        Every true point takes the label of the shape's nearest labelled point, both in the models'
        own frame. Truth and shape give half of their surface samples each, and the truth as its own
        floor the other half. Points, and models, whose true parts are not known are left out.

    Source: the paper's section on semantic label transfer; for `shapenet_part_iou` Yi et al. 2016.
    """

    name: str = "parts"
    quality: bool = False
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
        self, shape: ModelShape, rng: np.random.Generator
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


PROTOCOLS: dict[str, EvaluationProtocol] = {
    "paper": PaperProtocol(),
    "modern": ModernProtocol(),
    **{name: ScaledProtocol(name) for name in SCALINGS},
    "parts": PartProtocol(),
}
"""What can be chosen with `protocol=`."""


def longest_side(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    """Return the longest side of a mesh's bounding box, of the vertices that faces use."""
    return float(np.ptp(vertices[np.unique(faces)], axis=0).max())
