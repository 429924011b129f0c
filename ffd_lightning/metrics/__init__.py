"""Metrics, each a function of two arrays."""

from ffd_lightning.metrics.chamfer import chamfer
from ffd_lightning.metrics.distortion import distortion
from ffd_lightning.metrics.emd import earth_movers_distance
from ffd_lightning.metrics.iou import voxel_iou
from ffd_lightning.metrics.scalings import SCALINGS, score_like
from ffd_lightning.metrics.selection import effective_templates, selection_entropy
from ffd_lightning.metrics.surface import SurfaceSample, sample_with_normals, surface_scores

__all__ = [
    "SCALINGS",
    "SurfaceSample",
    "chamfer",
    "distortion",
    "earth_movers_distance",
    "effective_templates",
    "sample_with_normals",
    "score_like",
    "selection_entropy",
    "surface_scores",
    "voxel_iou",
]
