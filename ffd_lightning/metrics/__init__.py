"""Metrics, each a function of numpy or torch input."""

from ffd_lightning.metrics.chamfer import chamfer, chamfer_l1
from ffd_lightning.metrics.emd import earth_movers_distance
from ffd_lightning.metrics.iou import mesh_iou, voxel_iou
from ffd_lightning.metrics.mesh_quality import MeshQuality, mesh_quality
from ffd_lightning.metrics.scalings import SCALINGS, score_like
from ffd_lightning.metrics.selection import effective_templates, selection_entropy
from ffd_lightning.metrics.surface import (
    SurfaceSample,
    fscore,
    hausdorff,
    normal_consistency,
    sample_with_normals,
    surface_scores,
)

__all__ = [
    "SCALINGS",
    "MeshQuality",
    "SurfaceSample",
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
