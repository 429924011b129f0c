"""How predictions are measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ffd_lightning.app.parts.lazy import class_part
from ffd_lightning.registry import register, setting


@dataclass
class Paper:
    """The paper's own: Chamfer, EMD, IoU.

    Attributes:
        points: of each cloud.
    """

    points: int = setting(1024, within="(0, inf)")


class_part("protocol", "paper", Paper, "ffd_lightning.evaluation.protocols:PaperProtocol")


@dataclass
class Modern:
    """F-scores, normals, Chamfer-L1.

    Attributes:
        points: drawn from each mesh.
    """

    points: int = setting(10_000, within="(0, inf)")


class_part("protocol", "modern", Modern, "ffd_lightning.evaluation.protocols:ModernProtocol")


@dataclass
class Pixel2Mesh:
    """Scale, points and names of Pixel2Mesh."""


@dataclass
class AtlasNet:
    """Scale, points and names of AtlasNet."""


@dataclass
class MeshRcnn:
    """Scale, points and names of Mesh R-CNN."""


@dataclass
class OccNet:
    """Scale, points and names of occupancy networks."""


def _scaled(name: str, settings: type[Any]) -> None:
    @register("protocol", name, settings)
    def build(_: Any) -> Any:
        from ffd_lightning.evaluation.protocols import ScaledProtocol

        return ScaledProtocol(name)


for _name, _settings in (
    ("pixel2mesh", Pixel2Mesh),
    ("atlasnet", AtlasNet),
    ("mesh_rcnn", MeshRcnn),
    ("occnet", OccNet),
):
    _scaled(_name, _settings)


@dataclass
class Parts:
    """Part labels that templates carry along."""


@register("protocol", "parts", Parts)
def parts_protocol(settings: Parts) -> Any:
    """Build the protocol."""
    from ffd_lightning.evaluation.protocols import PartProtocol

    return PartProtocol()
