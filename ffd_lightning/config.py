"""The schema of the whole configuration, and the only defaults that no YAML file states.

A group's name, its package and its field here are the same word. Every YAML file under `conf/` is
merged into these classes, so a misspelt key or a wrong type is refused before anything is built.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from omegaconf import MISSING


class Weighting(Enum):
    """f in the weighted Chamfer loss."""

    identity = "identity"
    log = "log"


class TemplateStrategy(Enum):
    """How templates are chosen."""

    diverse = "diverse"
    random = "random"
    listed = "listed"
    ranking = "ranking"


class SourceKind(Enum):
    """Where models come from."""

    procedural = "procedural"
    folder = "folder"


class EncoderKind(Enum):
    """Which image encoder."""

    mobilenet = "mobilenet"
    timm = "timm"


class LearningRateDecay(Enum):
    """What becomes of the learning rate over the run."""

    none = "none"
    cosine = "cosine"


@dataclass
class CategoryConfig:
    """One object category; `synset` is its ShapeNet v1 id."""

    name: str = MISSING
    synset: str | None = None


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
    """Which templates, and how finely their meshes are subdivided."""

    name: str = MISSING
    count: int = MISSING
    strategy: TemplateStrategy = TemplateStrategy.diverse
    file: str | None = None
    seed: int = 0
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
class RenderConfig:
    """The images. Angles in degrees; azimuth 0 is the front, 90 the object's own left (+x)."""

    height: int = 192
    width: int = 256
    elevation: float = 30.0
    azimuths: list[float] = field(default_factory=lambda: [45.0])
    samples: int = 3


@dataclass
class DataConfig:
    """The models, what is sampled from them, and how they are split."""

    source: SourceKind = MISSING
    root: str | None = None
    num_models: int = 500
    seed: int = 0
    num_points: int = 16384
    train_fraction: float = 0.8
    render: RenderConfig = field(default_factory=RenderConfig)


@dataclass
class PreparationConfig:
    """How data is prepared; nothing here changes what comes out. 0 workers = one per core."""

    workers: int = 0


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
    """Where to train; passed to `lightning.Trainer`. `num_workers` are the data loader's."""

    accelerator: str = MISSING
    devices: str = "auto"
    strategy: str = "auto"
    precision: str = "32-true"
    num_workers: int = 0
    progress_bar: bool = True


@dataclass
class LoggerConfig:
    """What is logged, and every how many steps."""

    tensorboard: bool = True
    every: int = 20


@dataclass
class CallbacksConfig:
    """Pictures: how many examples in the reconstruction figure, and how often during training."""

    figure_examples: int = 6


@dataclass
class PathsConfig:
    """Where prepared data and runs go."""

    data: str = "data"
    runs: str = "runs"


@dataclass
class TrainConfig:
    """Everything that `train.py` reads."""

    category: CategoryConfig = field(default_factory=CategoryConfig)
    regime: RegimeConfig = field(default_factory=RegimeConfig)
    templates: TemplatesConfig = field(default_factory=TemplatesConfig)
    encoder: EncoderConfig = field(default_factory=EncoderConfig)
    network: NetworkConfig = field(default_factory=NetworkConfig)
    data: DataConfig = field(default_factory=DataConfig)
    preparation: PreparationConfig = field(default_factory=PreparationConfig)
    schedule: ScheduleConfig = field(default_factory=ScheduleConfig)
    trainer: TrainerConfig = field(default_factory=TrainerConfig)
    logger: LoggerConfig = field(default_factory=LoggerConfig)
    callbacks: CallbacksConfig = field(default_factory=CallbacksConfig)
    paths: PathsConfig = field(default_factory=PathsConfig)
    name: str = "default"
    seed: int = 0
    restart: bool = False
