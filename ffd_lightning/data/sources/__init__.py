"""Where models come from."""

from __future__ import annotations

from pathlib import Path

from ffd_lightning.config import DataConfig, ImageKind, SourceKind
from ffd_lightning.data.sources.base import Source, SourceModel

__all__ = ["Source", "SourceModel", "build_source"]


def build_source(data: DataConfig) -> Source:
    """Return the source that a data configuration names."""
    root = Path(str(data.root)).expanduser()
    if data.source is SourceKind.folder:
        from ffd_lightning.data.sources.folder import FolderSource

        return FolderSource(root)
    if data.source is SourceKind.shapenet:
        from ffd_lightning.data.sources.shapenet import ShapeNetSource

        images = None
        if data.images is ImageKind.r2n2:
            from ffd_lightning.data.sources.r2n2 import R2n2Images

            place = Path(data.images_root).expanduser() if data.images_root else root
            images = R2n2Images(place, data.render.height, data.render.width)
        return ShapeNetSource(root, images, data.mix_versions)
    from ffd_lightning.data.sources.procedural.source import ProceduralSource

    return ProceduralSource(data.num_models, data.seed)
