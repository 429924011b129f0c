"""The schema of the whole configuration, and the only defaults that no YAML file states.

A group's name, its package and its field here are the same word. Parts (`registry.KINDS`) have a
schema per option: what `data=folder` can be told does not exist under `data=procedural`. A misspelt
key or a wrong type is refused before anything is built.

A field made by `setting(only_where=True)` decides where or how fast something is computed, and not
what comes out. Folder names, resuming and studies all derive from that (`identity`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from omegaconf import MISSING

from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.registry import setting


class Residency(Enum):
    """Where images and clouds are kept while training: files, or the device that trains."""

    auto = "auto"
    disk = "disk"
    device = "device"


class LearningRateDecay(Enum):
    """What becomes of the learning rate over the run."""

    none = "none"
    cosine = "cosine"
    one_cycle = "one_cycle"


class Annealing(Enum):
    """What becomes of a term's weight over `schedule.annealing_steps`."""

    constant = "constant"
    exponential = "exponential"
    linear = "linear"


class Background(Enum):
    """What tells a photograph's object from its background, where no mask is given."""

    auto = "auto"
    rembg = "rembg"


class MeshColors(Enum):
    """What the colours of a written mesh say."""

    material = "material"
    parts = "parts"


class Subset(Enum):
    """Which shapes are evaluated."""

    val = "val"
    test = "test"


class RankedSubset(Enum):
    """Which shapes' selections a run's ranking of its templates counts."""

    val = "val"
    train = "train"


@dataclass
class CategoryConfig:
    """One category of objects.

    Attributes:
        name: of the category; a data set's own name or id for `category=custom`.
        members: categories that one network is trained on together; `name` is what they are called.
        symmetric: whether the left of its objects mostly mirrors their right, as they face -z;
            without that, `regime.mirror_offsets` is passed over.
    """

    name: str = MISSING
    members: list[str] | None = None
    symmetric: bool = True


@dataclass
class CommonData:
    """What all sources of shapes have in common.

    Attributes:
        limit: so many shapes of each category, evenly spread over their sorted ids; null for all.
        num_points: surface samples kept of each shape.
        residency: where images and clouds are kept while training.
        render: the images.
    """

    limit: int | None = setting(None, within="(0, inf)")
    num_points: int = setting(16384, within="(0, inf)")
    residency: Residency = setting(Residency.auto, only_where=True)
    render: RenderSettings = field(default_factory=RenderSettings)


@dataclass
class CommonSplit:
    """What all splits have in common.

    Attributes:
        val_fraction: share of the training shapes to validate on, where the split names none.
        drop_outliers: leaves shapes that are like nothing else in their category out of all
            subsets and of the choice of templates; of more than 1,000 shapes 1,000 are looked at.
    """

    val_fraction: float = setting(0.1, within="[0, 1)")
    drop_outliers: bool = False


@dataclass
class CommonTerm:
    """What all terms of the objective have in common.

    Attributes:
        weight: of the term; at 0 it is watched, and not minimised.
        annealing: whether the weight fades: by a factor of e over `schedule.annealing_steps`
            (`exponential`), or to nothing (`linear`).
    """

    weight: float = setting(1.0, within="[0, inf)")
    annealing: Annealing = Annealing.constant


@dataclass
class RegimeConfig:
    """A training regime: how template weights are taught, and what is minimised.

    Attributes:
        name: of the regime, in folders and tables.
        min_weight: epsilon_gamma, the floor of the template weights, shared out among all.
        selection: how template weights are taught.
        terms: of the objective, by the name that they are logged under; `term` is the registered
            one, by default that name.
        mirror_offsets: averages offsets with their mirror image at the plane x = 0.
    """

    name: str = MISSING
    min_weight: float = setting(MISSING, within="[0, 1)")
    selection: Any = MISSING
    terms: dict[str, Any] = field(default_factory=dict)
    mirror_offsets: bool = False


@dataclass
class TemplatesConfig:
    """How many templates, and how finely their meshes are subdivided.

    Attributes:
        name: of the choice, in folders.
        count: T.
        hold_out: keeps the first templates of that number out of training and testing also where
            fewer are used, so that runs of different counts see the same shapes.
        max_edge: longest edge of subdivided meshes.
    """

    name: str = MISSING
    count: int = setting(MISSING, within="(0, inf)")
    hold_out: int | None = None
    max_edge: float = setting(0.02, within="(0, inf)")


@dataclass
class TemplateRankingConfig:
    """How the trained network ranks its templates, by selections, in `template_ranking.csv`.

    Attributes:
        subset: of which shapes; `val` takes those trained on where there are none to validate on.
        all_views: every image of a shape counts instead of its first.
    """

    subset: RankedSubset = RankedSubset.val
    all_views: bool = False


@dataclass
class NetworkConfig:
    """What stands on top of the encoder (the paper's Table 1).

    Attributes:
        bottleneck: channels of the 1 x 1 convolution.
        hidden: width of the dense layer that the templates share.
        degrees: of the lattices, one per axis.
        offset_std: deviation of the offset layer's first weights.
        batch_norm_momentum: share of a new batch in moving statistics.
        seen_height: of the images as the encoder sees them: higher ones are shrunk, by the largest
            whole factor that leaves so many pixels; null takes them as they are.
    """

    bottleneck: int = setting(64, within="(0, inf)")
    hidden: int = setting(512, within="(0, inf)")
    degrees: tuple[int, int, int] = setting((3, 3, 3), within="[1, inf)")
    offset_std: float = setting(1e-4, within="(0, inf)")
    batch_norm_momentum: float = setting(0.1, within="(0, 1]")
    seen_height: int | None = setting(None, within="[32, inf)")


@dataclass
class PreparationConfig:
    """How data is prepared. What comes out is the same, but for shapes that exceed `timeout`.

    Attributes:
        workers: processes, 0 for one per core.
        timeout: seconds after which a shape is given up and left out.
    """

    workers: int = setting(0, only_where=True, within="[0, inf)")
    timeout: float = setting(600.0, only_where=True, within="(0, inf]")


@dataclass
class ScheduleConfig:
    """How long and how fast to train. Everything that counts steps counts optimizer steps.

    Attributes:
        offset_rate: factor of the learning rate for the weights that turn an image into offsets.
    """

    name: str = MISSING
    steps: int = setting(MISSING, within="(0, inf)")
    batch_size: int = setting(MISSING, within="[2, inf)")  # batch norm needs two
    num_points: int = setting(MISSING, within="(0, inf)")
    learning_rate: float = setting(MISSING, within="(0, inf)")
    learning_rate_decay: LearningRateDecay = LearningRateDecay.none
    offset_rate: float = setting(1.0, within="(0, inf)")
    annealing_steps: float = setting(MISSING, within="(0, inf]")
    val_every: int = setting(MISSING, only_where=True, within="(0, inf)")
    checkpoint_every: int = setting(MISSING, only_where=True, within="(0, inf)")


@dataclass
class TrainerConfig:
    """Where to train; passed to `lightning.Trainer`.

    Attributes:
        accelerator, devices, strategy: see `lightning.Trainer`.
        precision: `bf16-mixed` runs the network, and nothing else, in bfloat16.
        num_workers: the data loader's processes, by default none on the CPU and some beside a GPU.
        compile: has `torch.compile` fuse the encoder's layers.
        jobs_per_gpu: how many jobs of a sweep share a GPU.
        progress_bar: shows how far it is.
    """

    accelerator: str = setting(MISSING, only_where=True)
    devices: str = setting("1", only_where=True)
    strategy: str = setting("auto", only_where=True)
    precision: str = "32-true"
    num_workers: int | None = setting(None, only_where=True, within="[0, inf)")
    compile: bool = setting(False, only_where=True)
    jobs_per_gpu: int = setting(1, only_where=True, within="(0, inf)")
    progress_bar: bool = setting(True, only_where=True)


@dataclass
class LoggerConfig:
    """What is logged, and every how many steps."""

    tensorboard: bool = setting(True, only_where=True)
    every: int = setting(20, only_where=True, within="(0, inf)")


@dataclass
class CallbacksConfig:
    """What is drawn: examples in the reconstruction figure, and a report at the end of a sweep.

    Attributes:
        figure_examples: in the figure of reconstructions.
        training_examples: how many of them are shown in TensorBoard while training.
        training_figures: how often.
        report: `report.html` at the end of a sweep.
    """

    figure_examples: int = setting(6, only_where=True, within="[0, inf)")
    training_examples: int = setting(2, only_where=True, within="[0, inf)")
    training_figures: int = setting(3, only_where=True, within="[0, inf)")
    report: bool = setting(True, only_where=True)


@dataclass
class EvaluationConfig:
    """How a trained network is evaluated; the protocol is a group of its own.

    Attributes:
        references: also scores baselines and bounds beside the network.
        subset: which shapes; `val` leaves the test shapes for later.
        all_views: every image of a shape instead of its first.
        seed: decides the points that are drawn.
        workers: threads, 0 for one per core.
    """

    references: bool = setting(True, only_where=True)
    subset: Subset = setting(Subset.test, only_where=True)
    all_views: bool = setting(False, only_where=True)
    seed: int = setting(0, only_where=True, within="[0, inf)")
    workers: int = setting(0, only_where=True, within="[0, inf)")


@dataclass
class PathsConfig:
    """Where prepared data and runs go.

    Attributes:
        data: prepared sets.
        runs: run folders.
    """

    data: str = setting("data", only_where=True)
    runs: str = setting("runs", only_where=True)


@dataclass
class PrepareConfig:
    """Everything that `prepare` reads.

    Attributes:
        plugins: modules with parts of your own.
    """

    category: CategoryConfig = field(default_factory=CategoryConfig)
    data: Any = MISSING
    preparation: PreparationConfig = field(default_factory=PreparationConfig)
    paths: PathsConfig = field(default_factory=PathsConfig)
    plugins: list[str] = setting(factory=list, only_where=True)


@dataclass
class DoctorConfig(PrepareConfig):
    """Everything that `doctor` reads.

    Attributes:
        sheets: folder of the pictures, one of each category; null for none.
    """

    sheets: str | None = "${paths.data}/sheets"


@dataclass
class TrainConfig(PrepareConfig):
    """Everything that `train` reads.

    Attributes:
        name: of the experiment: its folder below `paths.runs`.
        seed: decides first weights and what each step sees.
        restart: discards what the run folder holds.
        provided: which package each part came from that is not ours; filled in by training.
        base: overrides that a study makes: its folders' names leave them out.
    """

    split: Any = MISSING
    regime: RegimeConfig = field(default_factory=RegimeConfig)
    templates: TemplatesConfig = field(default_factory=TemplatesConfig)
    template_strategy: Any = MISSING
    template_ranking: TemplateRankingConfig = field(default_factory=TemplateRankingConfig)
    augmentation: Any = MISSING
    encoder: Any = MISSING
    network: NetworkConfig = field(default_factory=NetworkConfig)
    schedule: ScheduleConfig = field(default_factory=ScheduleConfig)
    trainer: TrainerConfig = field(default_factory=TrainerConfig)
    logger: LoggerConfig = field(default_factory=LoggerConfig)
    callbacks: CallbacksConfig = field(default_factory=CallbacksConfig)
    protocol: Any = setting(MISSING, only_where=True)
    evaluation: EvaluationConfig = field(default_factory=EvaluationConfig)
    name: str = setting("default", only_where=True)
    seed: int = setting(0, within="[0, 4294967295]")
    restart: bool = setting(False, only_where=True)
    provided: dict[str, str] = setting(factory=dict, only_where=True)
    base: list[str] = setting(factory=list, only_where=True)


@dataclass
class EvaluateConfig:
    """Everything that `evaluate` reads.

    Attributes:
        run: a run folder.
        protocol: how it is measured.
        evaluation: of what.
        checkpoint: another file than the run's newest.
        prepared: the folder of another prepared set than the run's own; all its shapes are tested.
        data_root: where the run's prepared data is, if not where it was.
        device: auto, cpu, cuda, cuda:1, ...
        progress_bar: shows how far it is.
        restart: scores everything again.
        plugins: modules with parts of your own.
    """

    run: str = MISSING
    protocol: Any = MISSING
    evaluation: EvaluationConfig = field(default_factory=EvaluationConfig)
    checkpoint: str | None = None
    prepared: str | None = None
    data_root: str | None = None
    device: str = "auto"
    progress_bar: bool = True
    restart: bool = False
    plugins: list[str] = field(default_factory=list)


@dataclass
class PredictConfig:
    """Everything that `predict` reads.

    Attributes:
        run: a run folder or a checkpoint file; null for the model that comes with the package.
        image: a file, a folder, a pattern such as `photos/*.png`, or a list of those.
        category: what all of them show, one that the model was trained on; null lets it guess.
        out: each image has a folder below it.
        mask: a file, or for several images a folder of masks with the images' names.
        background: what tells the object from its background, where no mask is given: `auto`, the
            alpha channel, else the colour of the border; `rembg`, the package of that name.
        top_k: so many templates are deformed, the selected one first.
        points: of `cloud.ply`.
        colors: what the colours of meshes say.
        obj: writes `mesh.obj` too.
        preview: draws a picture of each.
        seed: of the points.
        workers: threads, 0 for one per core.
        device: auto, cpu, cuda, cuda:1, ...
        progress_bar: shows how far it is.
        restart: makes again what is there.
        plugins: modules with parts of your own.
    """

    run: str | None = None
    image: Any = MISSING
    category: str | None = None
    out: str = "predictions"
    mask: str | None = None
    background: Background = Background.auto
    top_k: int = setting(1, within="[1, inf)")
    points: int = setting(16384, within="[1, inf)")
    colors: MeshColors = MeshColors.material
    obj: bool = False
    preview: bool = True
    seed: int = setting(0, within="[0, inf)")
    workers: int = setting(0, within="[0, inf)")
    device: str = "auto"
    progress_bar: bool = True
    restart: bool = False
    plugins: list[str] = field(default_factory=list)


GROUPS: dict[str, str] = {
    "data": "source",
    "split": "split",
    "template_strategy": "template_strategy",
    "augmentation": "augmentation",
    "encoder": "encoder",
    "regime.selection": "selection",
    "protocol": "protocol",
}
"""The groups whose options are parts, and of which kind; terms are below `regime.terms`."""

BEFORE: dict[str, str] = {"augmentation": "none"}
"""What runs did that are older than a group: the option that files without the group stand for."""

COMMON: dict[str, type[Any]] = {"source": CommonData, "split": CommonSplit, "term": CommonTerm}
"""What the parts of a kind have in common, beside their own settings."""
