"""Learning free-form deformations for 3D object reconstruction from a single image.

Everything that a script needs is here, loaded when it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

_NAMES = {
    "FfdDataModule": "data.datamodule",
    "FfdModule": "training.module",
    "FfdPrediction": "nn.network",
    "ImageEncoder": "nn.encoders.base",
    "Lattice": "geometry.lattice",
    "EvaluationProtocol": "evaluation.protocols.base",
    "Measure": "evaluation.protocols.base",
    "Mesh": "geometry.mesh",
    "Objective": "losses.objective",
    "Predictor": "inference.predictor",
    "PreparedSet": "data.preparation.prepared",
    "RenderSettings": "imaging.render_settings",
    "SourceModel": "data.sources.base",
    "SplitInput": "data.splits",
    "StepInput": "losses.terms",
    "Survey": "data.sources.base",
    "Teaching": "losses.selection",
    "TemplateBank": "data.templates.bank",
    "TemplateFfdNetwork": "nn.network",
    "ModelShape": "evaluation.shapes",
    "Shape": "evaluation.shapes",
    "Source": "data.sources.base",
    "chamfer_distance": "geometry.chamfer",
    "deform": "geometry.deformation",
    "deformation_matrix": "geometry.deformation",
    "fit_offsets": "geometry.deformation",
    "part": "registry",
    "regime": "app.regimes",
    "register": "registry",
    "setting": "registry",
}

__all__ = [*_NAMES, "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_NAMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)


if TYPE_CHECKING:
    from ffd_lightning.app.regimes import regime
    from ffd_lightning.data.datamodule import FfdDataModule
    from ffd_lightning.data.preparation.prepared import PreparedSet
    from ffd_lightning.data.sources.base import Source, SourceModel, Survey
    from ffd_lightning.data.splits import SplitInput
    from ffd_lightning.data.templates.bank import TemplateBank
    from ffd_lightning.evaluation.protocols.base import EvaluationProtocol, Measure
    from ffd_lightning.evaluation.shapes import ModelShape, Shape
    from ffd_lightning.geometry.chamfer import chamfer_distance
    from ffd_lightning.geometry.deformation import deform, deformation_matrix, fit_offsets
    from ffd_lightning.geometry.lattice import Lattice
    from ffd_lightning.geometry.mesh import Mesh
    from ffd_lightning.imaging.render_settings import RenderSettings
    from ffd_lightning.inference.predictor import Predictor
    from ffd_lightning.losses.objective import Objective
    from ffd_lightning.losses.selection import Teaching
    from ffd_lightning.losses.terms import StepInput
    from ffd_lightning.nn.encoders.base import ImageEncoder
    from ffd_lightning.nn.network import FfdPrediction, TemplateFfdNetwork
    from ffd_lightning.registry import part, register, setting
    from ffd_lightning.training.module import FfdModule
