"""Where shapes come from."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from omegaconf import MISSING

from ffd_lightning.errors import ConfigError
from ffd_lightning.registry import register, setting


class Up(Enum):
    """Which axis of a source's meshes points up."""

    y = "y"
    z = "z"


class ImageKind(Enum):
    """Where ShapeNet's images come from."""

    render = "render"
    r2n2 = "r2n2"


@dataclass
class Procedural:
    """The embedded dataset: parametric shapes of 13 categories, the same for everyone.

    Attributes:
        num_models: shapes of each category.
        seed: makes another set.
    """

    num_models: int = setting(500, within="(0, inf)")
    seed: int = setting(0, within="[0, inf)")


@register("source", "procedural", Procedural)
def procedural(settings: Procedural, image_size: tuple[int, int] | None = None) -> Any:
    """Build the source."""
    from ffd_lightning.data.sources.procedural import ProceduralSource

    return ProceduralSource(settings.num_models, settings.seed)


def _check_root(root: str, name: str) -> None:
    if not Path(root).expanduser().exists():
        raise ConfigError(
            f"data.root={root} does not exist: data={name} needs the folder of its data"
        )


@dataclass
class Folder:
    """A tree of meshes: ROOT/<category>/<shape>/*.obj|glb|... or ROOT/<category>/<shape>.<ext>.

    Attributes:
        root: its folder.
        up: the axis of the meshes that points up.
        yaw: degrees about the vertical, anticlockwise from above, until they face -z.
    """

    root: str = MISSING
    up: Up = Up.y
    yaw: float = 0.0

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        _check_root(self.root, "folder")


@register("source", "folder", Folder)
def folder(settings: Folder, image_size: tuple[int, int] | None = None) -> Any:
    """Build the source."""
    from ffd_lightning.data.sources.folder import FolderSource

    return FolderSource(_path(settings.root), settings.up.value, settings.yaw)


@dataclass
class ShapeNet:
    """ShapeNetCore v1 or v2 as downloaded, folders or archives.

    Attributes:
        root: with <synset>/<model>/... or <synset>.zip.
        images: `r2n2` takes 3D-R2N2's published renderings (of v1).
        images_root: where those are, if not in `root`.
        mix_versions: takes them with v2 all the same.
        parts_root: adds part annotations.
    """

    root: str = MISSING
    images: ImageKind = ImageKind.render
    images_root: str | None = None
    mix_versions: bool = False
    parts_root: str | None = None

    def check(self) -> None:
        """Raise ConfigError where it cannot work, or where a setting would do nothing."""
        _check_root(self.root, "shapenet")
        if self.images is ImageKind.render:
            for name in ("images_root", "mix_versions"):
                if getattr(self, name):
                    raise ConfigError(f"data.{name} means nothing without data.images=r2n2")


@register("source", "shapenet", ShapeNet)
def shapenet(settings: ShapeNet, image_size: tuple[int, int] | None = None) -> Any:
    """Build the source."""
    from ffd_lightning.data.sources.shapenet import ShapeNetSource

    return ShapeNetSource(
        _path(settings.root),
        settings.images.value,
        None if settings.images_root is None else _path(settings.images_root),
        settings.mix_versions,
        None if settings.parts_root is None else _path(settings.parts_root),
    )


def _path(text: str) -> Path:
    return Path(text).expanduser()
