"""Learning free-form deformations for 3D object reconstruction from a single image.

Everything that a script needs is here, loaded when it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

_NAMES = {
    "Camera": "imaging.camera",
    "FfdDataModule": "data.datamodule",
    "FfdModule": "training.module",
    "FfdPrediction": "nn.network",
    "ImageEncoder": "nn.encoders.base",
    "Lattice": "geometry.ffd",
    "Mesh": "geometry.mesh",
    "Metric": "evaluation.protocols.base",
    "Objective": "losses.objective",
    "Predictor": "inference.predictor",
    "PreparedSet": "data.preparation.prepared",
    "RenderSettings": "imaging.render_settings",
    "SourceShape": "data.source",
    "SplitInput": "data.splits",
    "StepInput": "losses.terms",
    "Teaching": "losses.selection",
    "TemplateBank": "data.templates.bank",
    "TemplateFfdNetwork": "nn.network",
    "Candidate": "evaluation.candidates",
    "PreparedShape": "evaluation.candidates",
    "Protocol": "evaluation.protocols.base",
    "Source": "data.source",
    "chamfer_distance": "geometry.chamfer",
    "deform": "geometry.ffd",
    "deformation_matrix": "geometry.ffd",
    "fit_offsets": "geometry.ffd",
    "component": "components",
    "make": "components",
    "regime": "app.build",
}

__all__ = [*_NAMES, "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_NAMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)


if TYPE_CHECKING:
    from ffd_lightning.app.build import regime as regime
    from ffd_lightning.components import component as component
    from ffd_lightning.components import make as make
    from ffd_lightning.data.datamodule import FfdDataModule as FfdDataModule
    from ffd_lightning.data.preparation.prepared import PreparedSet as PreparedSet
    from ffd_lightning.data.source import Source as Source
    from ffd_lightning.data.source import SourceShape as SourceShape
    from ffd_lightning.data.splits import SplitInput as SplitInput
    from ffd_lightning.data.templates.bank import TemplateBank as TemplateBank
    from ffd_lightning.evaluation.candidates import Candidate as Candidate
    from ffd_lightning.evaluation.candidates import PreparedShape as PreparedShape
    from ffd_lightning.evaluation.protocols.base import Metric as Metric
    from ffd_lightning.evaluation.protocols.base import Protocol as Protocol
    from ffd_lightning.geometry.chamfer import chamfer_distance as chamfer_distance
    from ffd_lightning.geometry.ffd import Lattice as Lattice
    from ffd_lightning.geometry.ffd import deform as deform
    from ffd_lightning.geometry.ffd import deformation_matrix as deformation_matrix
    from ffd_lightning.geometry.ffd import fit_offsets as fit_offsets
    from ffd_lightning.geometry.mesh import Mesh as Mesh
    from ffd_lightning.imaging.camera import Camera as Camera
    from ffd_lightning.imaging.render_settings import RenderSettings as RenderSettings
    from ffd_lightning.inference.predictor import Predictor as Predictor
    from ffd_lightning.losses.objective import Objective as Objective
    from ffd_lightning.losses.selection import Teaching as Teaching
    from ffd_lightning.losses.terms import StepInput as StepInput
    from ffd_lightning.nn.encoders.base import ImageEncoder as ImageEncoder
    from ffd_lightning.nn.network import FfdPrediction as FfdPrediction
    from ffd_lightning.nn.network import TemplateFfdNetwork as TemplateFfdNetwork
    from ffd_lightning.training.module import FfdModule as FfdModule
