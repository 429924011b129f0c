"""The schema of the whole configuration, and the only defaults that no YAML file states.

A group's name, its package and its field here are the same word. Every YAML file under `conf/` is
merged into these classes, so a misspelt key or a wrong type is refused before anything is built.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from omegaconf import MISSING, DictConfig, OmegaConf

from ffd_lightning.errors import ConfigError


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


class ImageKind(Enum):
    """Where a source's images come from."""

    render = "render"
    r2n2 = "r2n2"


class Residency(Enum):
    """Where images and clouds are kept while training."""

    auto = "auto"
    disk = "disk"
    ram = "ram"
    device = "device"


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
    strategy: TemplateStrategy = TemplateStrategy.auto
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
    """The models, what is sampled from them, and how they are split.

    `images`, `images_root` (by default `root`) and `mix_versions` are for `data=shapenet`.
    """

    source: SourceKind = MISSING
    root: str | None = None
    images: ImageKind = ImageKind.render
    images_root: str | None = None
    mix_versions: bool = False
    num_models: int = 500
    seed: int = 0
    num_points: int = 16384
    train_fraction: float = 0.8
    residency: Residency = Residency.auto
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
    """Where to train; passed to `lightning.Trainer`.

    `precision=bf16-mixed` runs the network, and nothing else, in bfloat16. `num_workers` are the
    data loader's processes, by default none on the CPU and some beside a GPU. `compile` has
    `torch.compile` fuse the encoder's layers.
    """

    accelerator: str = MISSING
    devices: str = "auto"
    strategy: str = "auto"
    precision: str = "32-true"
    num_workers: int | None = None
    compile: bool = False
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


def typed_config(cfg: DictConfig) -> TrainConfig:
    """Turn a composed configuration into `TrainConfig`.

    Raises:
        ConfigError: a value that must be given is missing; the message names it.
        ConfigKeyError: a key that the schema does not have.
    """
    missing = sorted(str(key) for key in OmegaConf.missing_keys(cfg))
    if missing:
        raise ConfigError(f"these settings must be given: {', '.join(f'{k}=...' for k in missing)}")
    # Hydra lets `+key=value` past a schema: merging into it once more does not.
    merged = OmegaConf.merge(OmegaConf.structured(TrainConfig), OmegaConf.to_container(cfg))
    config = OmegaConf.to_object(merged)
    assert isinstance(config, TrainConfig)
    if len(config.network.degrees) != 3:
        raise ConfigError(f"network.degrees={config.network.degrees} must be three numbers")
    first, second, third = config.network.degrees  # OmegaConf hands tuples over as lists
    config.network.degrees = (first, second, third)
    return config


def validate(cfg: TrainConfig) -> None:
    """Check what types alone cannot, before anything is built.

    Raises:
        ConfigError: names every setting that cannot work, and the way out.
    """
    checks = [*_number_checks(cfg), *_data_checks(cfg), *_regime_checks(cfg)]
    problems = [message for wrong, message in checks if wrong]
    if problems:
        raise ConfigError("; ".join(problems))


_Checks = list[tuple[bool, str]]  # whether something is wrong, and what


def _number_checks(cfg: TrainConfig) -> _Checks:
    data, render, schedule = cfg.data, cfg.data.render, cfg.schedule
    templates, network = cfg.templates, cfg.network
    positive = {
        "schedule.steps": schedule.steps,
        "schedule.num_points": schedule.num_points,
        "schedule.learning_rate": schedule.learning_rate,
        "schedule.annealing_steps": schedule.annealing_steps,
        "schedule.val_every": schedule.val_every,
        "schedule.checkpoint_every": schedule.checkpoint_every,
        "templates.count": templates.count,
        "templates.max_edge": templates.max_edge,
        "encoder.width": cfg.encoder.width,
        "network.bottleneck": network.bottleneck,
        "network.hidden": network.hidden,
        "network.offset_std": network.offset_std,
        "data.num_models": data.num_models,
        "data.num_points": data.num_points,
        "data.render.samples": render.samples,
        "logger.every": cfg.logger.every,
    }
    return [
        *((not value > 0, f"{key}={value} must be above 0") for key, value in positive.items()),
        (schedule.batch_size < 2, "schedule.batch_size must be 2 or more (batch norm needs it)"),
        (
            schedule.num_points > data.num_points,
            f"schedule.num_points={schedule.num_points} is more than "
            f"data.num_points={data.num_points}, the points kept per model",
        ),
    ]


def _data_checks(cfg: TrainConfig) -> _Checks:
    data, render = cfg.data, cfg.data.render
    name, on_disk = data.source.value, data.source is not SourceKind.procedural
    return [
        (on_disk and not data.root, f"data={name} needs data.root=DIR, a folder of categories"),
        (
            on_disk and bool(data.root) and not Path(str(data.root)).expanduser().is_dir(),
            f"data.root={data.root} is not a folder",
        ),
        (
            data.images is not ImageKind.render and data.source is not SourceKind.shapenet,
            f"data.images={data.images.value} goes with data=shapenet",
        ),
        (not 0 < data.train_fraction < 1, "data.train_fraction must lie between 0 and 1"),
        (min(render.height, render.width) < 32, "data.render.height and width must be 32 or more"),
        (not render.azimuths, "data.render.azimuths needs at least one angle"),
        (not -90 <= render.elevation <= 90, "data.render.elevation must lie in [-90, 90] degrees"),
        (
            Path(cfg.category.name).name != cfg.category.name,
            f"category.name={cfg.category.name} must be the name of a folder, not a path",
        ),
        (
            cfg.category.synset is not None and not re.fullmatch(r"\d{8}", cfg.category.synset),
            f"category.synset={cfg.category.synset} must be 8 digits; quote it",
        ),
    ]


def _regime_checks(cfg: TrainConfig) -> _Checks:
    data, regime, templates, network = cfg.data, cfg.regime, cfg.templates, cfg.network
    needs_file = templates.strategy in (TemplateStrategy.listed, TemplateStrategy.ranking)
    return [
        (
            needs_file and not (templates.file and Path(templates.file).is_file()),
            f"templates.strategy={templates.strategy.value} needs templates.file=FILE, a file that "
            f"exists (got {templates.file})",
        ),
        (not 0 <= regime.min_weight < 1, "regime.min_weight must lie in [0, 1)"),
        (
            regime.weighting is Weighting.log and templates.count == 1,
            "regime.weighting=log is infinite for a single template: use another regime (b, e, r) "
            "or more templates",
        ),
        (
            min(regime.entropy_weight, regime.offset_weight) < 0,
            "regime.entropy_weight and regime.offset_weight must not be negative",
        ),
        (min(network.degrees) < 1, f"network.degrees={list(network.degrees)} must be 1 or more"),
        (
            not 0 < network.batch_norm_momentum <= 1,
            "network.batch_norm_momentum must lie in (0, 1]",
        ),
        (
            cfg.encoder.weights is not None and not Path(cfg.encoder.weights).is_file(),
            f"encoder.weights={cfg.encoder.weights} is not a file",
        ),
        (
            cfg.seed < 0 or data.seed < 0 or templates.seed < 0,
            "seed, data.seed and templates.seed must not be negative",
        ),
    ]
