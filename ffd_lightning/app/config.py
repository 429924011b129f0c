"""The schema of the whole configuration, and the only defaults that no YAML file states.

A group's name, its package and its field here are the same word. Every YAML file under `conf/` is
merged into these classes, so a misspelt key or a wrong type is refused before anything is built.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any, TypeVar

from omegaconf import MISSING, DictConfig, OmegaConf

from ffd_lightning.errors import ConfigError
from ffd_lightning.imaging.render_settings import RenderSettings


class Weighting(Enum):
    """f in the weighted Chamfer loss."""

    identity = "identity"
    log = "log"


class TemplateStrategy(Enum):
    """How templates are chosen."""

    auto = "auto"
    paper = "paper"
    diverse = "diverse"
    random = "random"
    listed = "listed"
    ranking = "ranking"


class SourceKind(Enum):
    """Where models come from."""

    procedural = "procedural"
    folder = "folder"
    shapenet = "shapenet"
    modelnet = "modelnet"
    pix3d = "pix3d"


class ImageKind(Enum):
    """Where a source's images come from."""

    render = "render"
    r2n2 = "r2n2"


class SplitKind(Enum):
    """How models are split into those to train on and those to test on."""

    hash = "hash"
    r2n2 = "r2n2"
    source = "source"
    listed = "listed"


class Up(Enum):
    """Which axis of a source's meshes points up."""

    y = "y"
    z = "z"


class Residency(Enum):
    """Where images and clouds are kept while training."""

    auto = "auto"
    disk = "disk"
    ram = "ram"
    device = "device"


class ProtocolKind(Enum):
    """How predictions are measured."""

    paper = "paper"
    modern = "modern"
    pixel2mesh = "pixel2mesh"
    atlasnet = "atlasnet"
    mesh_rcnn = "mesh_rcnn"
    occnet = "occnet"
    parts = "parts"


class EncoderKind(Enum):
    """Which image encoder."""

    mobilenet = "mobilenet"
    timm = "timm"


class Background(Enum):
    """What tells a photograph's object from its background, where no mask is given.

    `auto`: its alpha channel if there is one, else the colour of its border; `rembg`: a network
    of the package of that name.
    """

    auto = "auto"
    rembg = "rembg"


class MeshColors(Enum):
    """What the colours of a written mesh say."""

    material = "material"
    parts = "parts"


class LearningRateDecay(Enum):
    """What becomes of the learning rate over the run."""

    none = "none"
    cosine = "cosine"


@dataclass
class CategoryConfig:
    """One object category; `synset` is its ShapeNet v1 id.

    `members` are categories that one network is trained on together; `name` is then what they are
    called.
    """

    name: str = MISSING
    synset: str | None = None
    members: list[str] | None = None


@dataclass
class RegimeConfig:
    """A training regime: one row of the paper's Table 2."""

    name: str = MISSING
    min_weight: float = MISSING
    weighting: Weighting = MISSING
    entropy_weight: float = MISSING
    offset_weight: float = MISSING


@dataclass
class TemplatesConfig:
    """Which templates, and how finely their meshes are subdivided.

    `hold_out=30` keeps the first 30 templates out of training and testing also where fewer are
    used, so that runs of different counts see the same models.
    """

    name: str = MISSING
    count: int = MISSING
    strategy: TemplateStrategy = TemplateStrategy.auto
    file: str | None = None
    seed: int = 0
    hold_out: int | None = None
    max_edge: float = 0.02


@dataclass
class EncoderConfig:
    """The image encoder. `name` is a timm model for `encoder=timm`."""

    kind: EncoderKind = MISSING
    name: str = MISSING
    width: float = 0.25
    weights: str | None = None
    pretrained: bool = False


@dataclass
class NetworkConfig:
    """What stands on top of the encoder (the paper's Table 1)."""

    bottleneck: int = 64
    hidden: int = 512
    degrees: tuple[int, int, int] = (3, 3, 3)
    offset_std: float = 1e-4
    batch_norm_momentum: float = 0.1


@dataclass
class DataConfig:
    """The models, what is sampled from them, and how they are split.

    `images`, `images_root` (by default `root`), `mix_versions` and `parts_root` are for
    `data=shapenet`; `up` and `yaw` (degrees about the vertical, anticlockwise from above) turn the
    meshes of `folder`, `modelnet` and `pix3d` until they are y up and face -z; `leave_out` names
    the kinds of photographs that `pix3d` passes over. `split_file` is for `split=listed`.
    """

    source: SourceKind = MISSING
    root: str | None = None
    images: ImageKind = ImageKind.render
    images_root: str | None = None
    mix_versions: bool = False
    parts_root: str | None = None
    up: Up = Up.y
    yaw: float = 0.0
    leave_out: list[str] = field(default_factory=lambda: ["truncated", "occluded"])
    num_models: int = 500
    seed: int = 0
    num_points: int = 16384
    split: SplitKind = SplitKind.hash
    split_file: str | None = None
    train_fraction: float = 0.8
    residency: Residency = Residency.auto
    render: RenderSettings = field(default_factory=RenderSettings)


@dataclass
class PreparationConfig:
    """How data is prepared; nothing here changes what comes out.

    0 workers = one per core; `timeout` in seconds per model; `shard=3/16` makes one machine's part.
    """

    workers: int = 0
    timeout: float = 600.0
    shard: str | None = None


@dataclass
class ScheduleConfig:
    """How long and how fast to train. Everything that counts steps counts optimizer steps."""

    name: str = MISSING
    steps: int = MISSING
    batch_size: int = MISSING
    num_points: int = MISSING
    learning_rate: float = MISSING
    learning_rate_decay: LearningRateDecay = LearningRateDecay.none
    annealing_steps: float = MISSING
    val_every: int = MISSING
    checkpoint_every: int = MISSING


@dataclass
class TrainerConfig:
    """Where to train; passed to `lightning.Trainer`.

    `precision=bf16-mixed` runs the network, and nothing else, in bfloat16. `num_workers` are the
    data loader's processes, by default none on the CPU and some beside a GPU. `compile` has
    `torch.compile` fuse the encoder's layers. Jobs of a sweep take a GPU each; `jobs_per_gpu` lets
    so many share one.
    """

    accelerator: str = MISSING
    devices: str = "auto"
    strategy: str = "auto"
    precision: str = "32-true"
    num_workers: int | None = None
    compile: bool = False
    jobs_per_gpu: int = 1
    progress_bar: bool = True


@dataclass
class LoggerConfig:
    """What is logged, and every how many steps."""

    tensorboard: bool = True
    every: int = 20


@dataclass
class CallbacksConfig:
    """What is drawn: examples in the reconstruction figure, and a report at the end of a sweep.

    `training_examples` of them are shown `training_figures` times in TensorBoard while training.
    """

    figure_examples: int = 6
    training_examples: int = 2
    training_figures: int = 3
    report: bool = True


@dataclass
class EvaluationConfig:
    """How a trained run is evaluated: see `EvaluateConfig`."""

    protocol: ProtocolKind = ProtocolKind.paper
    references: bool = True
    workers: int = 0


@dataclass
class PathsConfig:
    """Where prepared data and runs go."""

    data: str = "data"
    runs: str = "runs"


@dataclass
class PrepareConfig:
    """Everything that `prepare.py` reads."""

    category: CategoryConfig = field(default_factory=CategoryConfig)
    data: DataConfig = field(default_factory=DataConfig)
    preparation: PreparationConfig = field(default_factory=PreparationConfig)
    paths: PathsConfig = field(default_factory=PathsConfig)


@dataclass
class TrainConfig(PrepareConfig):
    """Everything that `train.py` reads."""

    regime: RegimeConfig = field(default_factory=RegimeConfig)
    templates: TemplatesConfig = field(default_factory=TemplatesConfig)
    encoder: EncoderConfig = field(default_factory=EncoderConfig)
    network: NetworkConfig = field(default_factory=NetworkConfig)
    schedule: ScheduleConfig = field(default_factory=ScheduleConfig)
    trainer: TrainerConfig = field(default_factory=TrainerConfig)
    logger: LoggerConfig = field(default_factory=LoggerConfig)
    callbacks: CallbacksConfig = field(default_factory=CallbacksConfig)
    evaluation: EvaluationConfig = field(default_factory=EvaluationConfig)
    name: str = "default"
    seed: int = 0
    restart: bool = False


@dataclass
class EvaluateConfig:
    """Everything that `evaluate.py` reads.

    `run` is a run folder; `checkpoint` another file than its newest, `prepared` the folder of
    another prepared set than its own (all its models are tested then). 0 workers = one per core.
    `data_root` is where the run's prepared data is, if not where it was. `all_views` tests every
    image of a model instead of its first.
    """

    run: str = MISSING
    protocol: ProtocolKind = ProtocolKind.paper
    checkpoint: str | None = None
    prepared: str | None = None
    data_root: str | None = None
    references: bool = True
    all_views: bool = False
    seed: int = 0
    workers: int = 0
    device: str = "auto"
    progress_bar: bool = True
    restart: bool = False


@dataclass
class PredictConfig:
    """Everything that `predict.py` reads.

    `run` is a run folder or a checkpoint file; `image` a file, a folder, a pattern such as
    `photos/*.png`, or a list of those; `mask` a file, or for several images a folder of masks with
    the images' names. Below `out` each image has a folder. `points` are those of `cloud.ply`;
    `top_k` templates are deformed, the selected one first. `preview` draws a picture of each.
    0 workers = one per core.
    """

    run: str = MISSING
    image: Any = MISSING
    out: str = "predictions"
    mask: str | None = None
    background: Background = Background.auto
    top_k: int = 1
    points: int = 16384
    colors: MeshColors = MeshColors.material
    obj: bool = False
    preview: bool = True
    seed: int = 0
    workers: int = 0
    device: str = "auto"
    progress_bar: bool = True
    restart: bool = False


_Config = TypeVar("_Config")


def typed_config(cfg: DictConfig, schema: type[_Config]) -> _Config:
    """Turn a composed configuration into the classes above.

    Args:
        cfg: what Hydra composed.
        schema: of which kind it is.

    Raises:
        ConfigError: a value that must be given is missing; the message names it.
        ConfigKeyError: a key that the schema does not have.
    """
    missing = sorted(str(key) for key in OmegaConf.missing_keys(cfg))
    if missing:
        raise ConfigError(f"these settings must be given: {', '.join(f'{k}=...' for k in missing)}")
    # Hydra lets `+key=value` past a schema: merging into it once more does not.
    merged = OmegaConf.merge(OmegaConf.structured(schema), OmegaConf.to_container(cfg))
    config = OmegaConf.to_object(merged)
    assert isinstance(config, schema)
    if isinstance(config, TrainConfig):
        if len(config.network.degrees) != 3:
            raise ConfigError(f"network.degrees={config.network.degrees} must be three numbers")
        first, second, third = config.network.degrees  # OmegaConf hands tuples over as lists
        config.network.degrees = (first, second, third)
    return config
