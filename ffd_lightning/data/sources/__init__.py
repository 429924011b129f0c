"""Where models come from."""

from __future__ import annotations

from pathlib import Path

from ffd_lightning.config import DataConfig, SourceKind
from ffd_lightning.data.sources.base import Source, SourceModel

__all__ = ["Source", "SourceModel", "build_source"]


def build_source(data: DataConfig) -> Source:
    """Return the source that a data configuration names."""
    if data.source is SourceKind.folder:
        from ffd_lightning.data.sources.folder import FolderSource

        return FolderSource(Path(str(data.root)).expanduser())
    if data.source is SourceKind.shapenet:
        from ffd_lightning.data.sources.shapenet import ShapeNetSource

        return ShapeNetSource(Path(str(data.root)))
    from ffd_lightning.data.sources.procedural.source import ProceduralSource

    return ProceduralSource(data.num_models, data.seed)
