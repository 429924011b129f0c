"""Where models come from."""

from __future__ import annotations

from pathlib import Path

from ffd_lightning.app.config import DataConfig, ImageKind, SourceKind
from ffd_lightning.data.sources.base import Source, SourceModel

__all__ = ["Source", "SourceModel", "build_source"]


def build_source(data: DataConfig) -> Source:
    """Return the source that a data configuration names."""
    root = Path(str(data.root)).expanduser()
    up, yaw, size = data.up, data.yaw, (data.render.height, data.render.width)
    if data.source is SourceKind.folder:
        from ffd_lightning.data.sources.folder import FolderSource

        return FolderSource(root, up, yaw)
    if data.source is SourceKind.modelnet:
        from ffd_lightning.data.sources.modelnet import ModelNetSource

        return ModelNetSource(root, up, yaw)
    if data.source is SourceKind.pix3d:
        from ffd_lightning.data.sources.pix3d import Pix3dSource

        return Pix3dSource(root, *size, tuple(data.leave_out), up, yaw)
    if data.source is SourceKind.shapenet:
        from ffd_lightning.data.sources.parts import PartAnnotations
        from ffd_lightning.data.sources.r2n2 import R2n2Images
        from ffd_lightning.data.sources.shapenet import ShapeNetSource

        images = parts = None
        if data.images is ImageKind.r2n2:
            images = R2n2Images(Path(data.images_root or root).expanduser(), *size)
        if data.parts_root is not None:
            parts = PartAnnotations(Path(data.parts_root).expanduser())
        return ShapeNetSource(root, images, data.mix_versions, parts)
    from ffd_lightning.data.sources.procedural import ProceduralSource

    return ProceduralSource(data.num_models, data.seed)
