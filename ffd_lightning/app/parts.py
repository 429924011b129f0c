"""The parts that this package brings: what can be chosen by name, and what each can be told.

They use the same door as those of other packages (`docs/extending.md`). What builds them is
imported when it is built, so that `--help` is there before torch is loaded.
"""

from __future__ import annotations

from dataclasses import dataclass, field
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


class Weighting(Enum):
    """f of the weighted costs."""

    identity = "identity"
    log = "log"


# --- encoders ------------------------------------------------------------------------------------


@dataclass
class MobileNet:
    """MobileNet v1 without its top (the paper: width 0.25, ImageNet weights).

    Attributes:
        width: the width multiplier.
        weights: a Keras .h5 file, such as mobilenet_2_5_192_tf_no_top.h5; null trains from scratch.
    """

    width: float = 0.25
    weights: str | None = setting(None, only_start=True)

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        if not self.width > 0:
            raise ConfigError(f"encoder.width={self.width} must be above 0")
        if self.weights is not None and not Path(self.weights).expanduser().is_file():
            raise ConfigError(f"encoder.weights={self.weights} is not a file")


@register("encoder", "mobilenet", MobileNet)
def mobilenet(
    settings: MobileNet, image_size: tuple[int, int], batch_norm_momentum: float = 0.1
) -> Any:
    """Build MobileNet v1."""
    from ffd_lightning.nn.encoders.mobilenet import MobileNetV1

    encoder = MobileNetV1(settings.width, batch_norm_momentum)
    if settings.weights is not None:
        from ffd_lightning.nn.encoders.keras_weights import load_keras_weights

        load_keras_weights(encoder, Path(settings.weights).expanduser())
    return encoder


@dataclass
class Timm:
    """Any timm backbone: pip install 'ffd_lightning[timm]'.

    Attributes:
        model: its name there, resnet18 say.
        pretrained: downloads timm's weights.
    """

    model: str = MISSING
    pretrained: bool = setting(False, only_start=True)


@register("encoder", "timm", Timm)
def timm(settings: Timm, image_size: tuple[int, int], batch_norm_momentum: float = 0.1) -> Any:
    """Build a timm model, whose batch norms keep their own momentum."""
    from ffd_lightning.nn.encoders.timm import TimmEncoder

    return TimmEncoder(settings.model, settings.pretrained, image_size)


# --- objective -----------------------------------------------------------------------------------


@dataclass
class Chamfer:
    """Chamfer distance of each deformed template."""


@register("term", "chamfer", Chamfer)
def chamfer(settings: Chamfer) -> Any:
    """Return the term."""
    from ffd_lightning.losses.terms import chamfer

    return chamfer


@dataclass
class NegativeEntropy:
    """Negative entropy of the batch's mean template weights."""


@register("term", "negative_entropy", NegativeEntropy)
def negative_entropy(settings: NegativeEntropy) -> Any:
    """Return the term."""
    from ffd_lightning.losses.terms import negative_entropy

    return negative_entropy


@dataclass
class OffsetPenalty:
    """Squared norm of the offsets under the template weights."""


@register("term", "offset_penalty", OffsetPenalty)
def offset_penalty(settings: OffsetPenalty) -> Any:
    """Return the term."""
    from ffd_lightning.losses.terms import offset_penalty

    return offset_penalty


@dataclass
class Weighted:
    """Costs count by a function of the template weights, which learn through them (the paper).

    Attributes:
        function: `identity`, or `log`, which punishes overconfident selection.
    """

    function: Weighting = Weighting.identity


@register("selection", "weighted", Weighted)
def weighted(settings: Weighted) -> Any:
    """Build the paper's selection."""
    from ffd_lightning.losses.selection import WeightedCosts

    return WeightedCosts(settings.function.value)


# --- template strategies -------------------------------------------------------------------------


@dataclass
class AutoStrategy:
    """The paper's own templates for ShapeNet's shapes, else `diverse`."""


@register("template_strategy", "auto", AutoStrategy)
def auto_strategy(settings: AutoStrategy) -> Any:
    """Return the strategy."""
    from ffd_lightning.data.templates.strategies import auto_choice

    return auto_choice


@dataclass
class PaperStrategy:
    """The authors' own templates, of ShapeNet v1."""


@register("template_strategy", "paper", PaperStrategy)
def paper_strategy(settings: PaperStrategy) -> Any:
    """Return the strategy."""
    from ffd_lightning.data.templates.strategies import paper_choice

    return paper_choice


@dataclass
class DiverseStrategy:
    """The most central shape, then whichever is farthest from all chosen."""


@register("template_strategy", "diverse", DiverseStrategy)
def diverse_strategy(settings: DiverseStrategy) -> Any:
    """Return the strategy."""
    from ffd_lightning.data.templates.strategies import diverse_templates

    return diverse_templates


@dataclass
class RandomTemplates:
    """Templates drawn at random.

    Attributes:
        seed: decides which.
    """

    seed: int = 0

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        if self.seed < 0:
            raise ConfigError("template_strategy.seed must not be negative")


@register("template_strategy", "random", RandomTemplates)
def random_strategy(settings: RandomTemplates) -> Any:
    """Build the strategy."""
    from ffd_lightning.data.templates.strategies import RandomStrategy

    return RandomStrategy(settings.seed)


@dataclass
class ListedTemplates:
    """The first ids of a file.

    Attributes:
        file: one id a line; {category} in it stands for the category.
    """

    file: str = MISSING


@register("template_strategy", "listed", ListedTemplates)
def listed_strategy(settings: ListedTemplates) -> Any:
    """Build the strategy."""
    from ffd_lightning.data.templates.strategies import ListedStrategy

    return ListedStrategy(settings.file)


@dataclass
class RankedTemplates:
    """The favourites of an earlier run.

    Attributes:
        file: its template_ranking.csv; {category} in it stands for the category.
    """

    file: str = MISSING


@register("template_strategy", "ranking", RankedTemplates)
def ranking_strategy(settings: RankedTemplates) -> Any:
    """Build the strategy."""
    from ffd_lightning.data.templates.strategies import RankingStrategy

    return RankingStrategy(settings.file)


# --- sources -------------------------------------------------------------------------------------


@dataclass
class Procedural:
    """The embedded dataset: parametric shapes of 13 categories, the same for everyone.

    Attributes:
        num_models: shapes of each category.
        seed: makes another set.
    """

    num_models: int = 500
    seed: int = 0

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        if self.num_models < 1:
            raise ConfigError(f"data.num_models={self.num_models} must be above 0")
        if self.seed < 0:
            raise ConfigError("data.seed must not be negative")


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
    """A tree of meshes: ROOT/<category>/<model>/*.obj|glb|... or ROOT/<category>/<model>.<ext>.

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
class ModelNet:
    """ModelNet40 or ModelNet10, unpacked or not.

    Attributes:
        root: with <category>/{train,test}/*.off, or an archive.
        up: the axis of the meshes that points up.
        yaw: degrees about the vertical, anticlockwise from above, until they face -z.
    """

    root: str = MISSING
    up: Up = Up.z
    yaw: float = 0.0

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        _check_root(self.root, "modelnet")


@register("source", "modelnet", ModelNet)
def modelnet(settings: ModelNet, image_size: tuple[int, int] | None = None) -> Any:
    """Build the source."""
    from ffd_lightning.data.sources.modelnet import ModelNetSource

    return ModelNetSource(_path(settings.root), settings.up.value, settings.yaw)


@dataclass
class Pix3d:
    """Pix3D's photographs, cut out by their masks.

    Attributes:
        root: with pix3d.json beside img, mask and shape.
        up: the axis of the meshes that points up.
        yaw: degrees about the vertical, anticlockwise from above, until they face -z.
        leave_out: kinds of photographs that are passed over.
    """

    root: str = MISSING
    up: Up = Up.y
    yaw: float = 0.0
    leave_out: list[str] = field(default_factory=lambda: ["truncated", "occluded"])

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        _check_root(self.root, "pix3d")


@register("source", "pix3d", Pix3d)
def pix3d(settings: Pix3d, image_size: tuple[int, int]) -> Any:
    """Build the source."""
    from ffd_lightning.data.sources.pix3d import Pix3dSource

    height, width = image_size
    left_out = tuple(settings.leave_out)
    return Pix3dSource(
        _path(settings.root), height, width, left_out, settings.up.value, settings.yaw
    )


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
def shapenet(settings: ShapeNet, image_size: tuple[int, int]) -> Any:
    """Build the source."""
    from ffd_lightning.data.sources.parts import PartAnnotations
    from ffd_lightning.data.sources.r2n2 import R2n2Images
    from ffd_lightning.data.sources.shapenet import ShapeNetSource

    images = parts = None
    if settings.images is ImageKind.r2n2:
        images = R2n2Images(_path(settings.images_root or settings.root), *image_size)
    if settings.parts_root is not None:
        parts = PartAnnotations(_path(settings.parts_root))
    return ShapeNetSource(_path(settings.root), images, settings.mix_versions, parts)


def _path(text: str) -> Path:
    return Path(text).expanduser()


# --- splits --------------------------------------------------------------------------------------


@dataclass
class Hash:
    """By the hash of the id: shapes never change sides when others are added.

    Attributes:
        train_fraction: share that is trained on.
    """

    train_fraction: float = 0.8

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        if not 0 < self.train_fraction < 1:
            raise ConfigError("split.train_fraction must lie between 0 and 1")


@register("split", "hash", Hash)
def hash_split(settings: Hash) -> Any:
    """Build the rule."""
    from ffd_lightning.data.splits import HashSplit

    return HashSplit(settings.train_fraction)


@dataclass
class Auto:
    """The data set's own (modelnet, pix3d), else by the hash of the id.

    Attributes:
        train_fraction: share that is trained on, where the hash decides.
    """

    train_fraction: float = 0.8

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        Hash(self.train_fraction).check()


@register("split", "auto", Auto)
def auto_split(settings: Auto) -> Any:
    """Build the rule."""
    from ffd_lightning.data.splits import AutoSplit

    return AutoSplit(settings.train_fraction)


@dataclass
class R2n2:
    """3D-R2N2's: the first 80% of the sorted ids are trained on."""


@register("split", "r2n2", R2n2)
def r2n2_split(settings: R2n2) -> Any:
    """Build the rule."""
    from ffd_lightning.data.splits import R2n2Split

    return R2n2Split()


@dataclass
class Published:
    """The data set's own, and nothing else."""


@register("split", "published", Published)
def published_split(settings: Published) -> Any:
    """Build the rule."""
    from ffd_lightning.data.splits import PublishedSplit

    return PublishedSplit()


@dataclass
class Listed:
    """Read from a file.

    Attributes:
        file: ids to test on, `<id> <subset>` lines, ShapeNet's all.csv, JSON, or a folder of
            train.lst, val.lst, test.lst.
    """

    file: str = MISSING

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        if not _path(self.file).exists():
            raise ConfigError(f"split.file={self.file} does not exist")


@register("split", "listed", Listed)
def listed_split(settings: Listed) -> Any:
    """Build the rule."""
    from ffd_lightning.data.splits import ListedSplit

    return ListedSplit(settings.file)


# --- protocols -----------------------------------------------------------------------------------


def _check_points(points: int) -> None:
    if points < 1:
        raise ConfigError(f"protocol.points={points} must be above 0")


@dataclass
class Paper:
    """The paper's own: Chamfer, EMD, IoU.

    Attributes:
        points: of each cloud.
    """

    points: int = 1024

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        _check_points(self.points)


@register("protocol", "paper", Paper)
def paper_protocol(settings: Paper) -> Any:
    """Build the protocol."""
    from ffd_lightning.evaluation.protocols import PaperProtocol

    return PaperProtocol(points=settings.points)


@dataclass
class Modern:
    """F-scores, normals, Chamfer-L1, mesh quality.

    Attributes:
        points: drawn from each mesh.
    """

    points: int = 10_000

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        _check_points(self.points)


@register("protocol", "modern", Modern)
def modern_protocol(settings: Modern) -> Any:
    """Build the protocol."""
    from ffd_lightning.evaluation.protocols import ModernProtocol

    return ModernProtocol(points=settings.points)


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
