"""Metrics, each a function of numpy or torch input and a torchmetrics class over it."""

from ffd_lightning.metrics.chamfer import ChamferDistance, ChamferL1, chamfer, chamfer_l1
from ffd_lightning.metrics.emd import (
    AssignmentBound,
    EarthMoversDistance,
    approximate_emd,
    earth_movers_distance,
)
from ffd_lightning.metrics.iou import VoxelIoU, mesh_iou, voxel_iou
from ffd_lightning.metrics.selection import effective_templates, selection_entropy

__all__ = [
    "AssignmentBound",
    "ChamferDistance",
    "ChamferL1",
    "EarthMoversDistance",
    "VoxelIoU",
    "approximate_emd",
    "chamfer",
    "chamfer_l1",
    "earth_movers_distance",
    "effective_templates",
    "mesh_iou",
    "selection_entropy",
    "voxel_iou",
]
