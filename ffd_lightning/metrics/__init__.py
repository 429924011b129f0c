"""Metrics, each a function of numpy or torch input and a torchmetrics class over it."""

from ffd_lightning.metrics.chamfer import ChamferDistance, ChamferL1, chamfer, chamfer_l1
from ffd_lightning.metrics.emd import (
    AssignmentBound,
    EarthMoversDistance,
    approximate_emd,
    earth_movers_distance,
)
from ffd_lightning.metrics.iou import VoxelIoU, mesh_iou, voxel_iou
from ffd_lightning.metrics.mesh_quality import MeshQuality, mesh_quality
from ffd_lightning.metrics.scalings import SCALINGS, score_like
from ffd_lightning.metrics.selection import effective_templates, selection_entropy
from ffd_lightning.metrics.surface import (
    FScore,
    HausdorffDistance,
    NormalConsistency,
    SurfaceSample,
    fscore,
    hausdorff,
    normal_consistency,
    sample_with_normals,
    surface_scores,
)

__all__ = [
    "SCALINGS",
    "AssignmentBound",
    "ChamferDistance",
    "ChamferL1",
    "EarthMoversDistance",
    "FScore",
    "HausdorffDistance",
    "MeshQuality",
    "NormalConsistency",
    "SurfaceSample",
    "VoxelIoU",
    "approximate_emd",
    "chamfer",
    "chamfer_l1",
    "earth_movers_distance",
    "effective_templates",
    "fscore",
    "hausdorff",
    "mesh_iou",
    "mesh_quality",
    "normal_consistency",
    "sample_with_normals",
    "score_like",
    "selection_entropy",
    "surface_scores",
    "voxel_iou",
]
