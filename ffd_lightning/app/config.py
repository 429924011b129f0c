"""Settings that are no component's, and the only defaults that no YAML file states.

A group's name, its package and its field here are the same word. Components (`components.KINDS`)
declare their own settings; what is common to all of a kind, beside those, is declared here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from ffd_lightning import pretrained
from ffd_lightning.components import MISSING, Component, check_ranges
from ffd_lightning.imaging.render_settings import RenderSettings

EMBEDDED_WIDTH = 0.25
"""Of the encoder that comes with the package, a MobileNet."""


# --- components, and what all of a kind have in common --------------------------------------------


@dataclass(frozen=True)
class Data(Component):
    """Where shapes come from, and what is kept of them.

    Attributes:
        limit: so many shapes of each category, evenly spread over their sorted ids; null for all.
        num_points: surface samples kept of each shape.
        render: the images.
    """

    limit: int | None = None
    num_points: int = 16384
    render: RenderSettings = field(default_factory=RenderSettings)

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(vars(self), limit="(0, inf)", num_points="(0, inf)")


@dataclass(frozen=True)
class Split(Component):
    """Which shapes are trained on, validated on, tested on.

    Attributes:
        val_fraction: share of the training shapes to validate on, where the split names none.
        drop_outliers: leaves shapes that are like nothing else in their category out of all
            subsets and of the choice of templates; of more than 1,000 shapes 1,000 are looked at.
    """

    val_fraction: float = 0.1
    drop_outliers: bool = False

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(vars(self), val_fraction="[0, 1)")


@dataclass(frozen=True)
class Encoder(Component):
    """What turns images into a feature map.

    Attributes:
        weights: the first weights. mobilenet takes a Keras .h5 file, such as
            mobilenet_2_5_192_tf_no_top.h5, or embedded: the encoder of the trained model that comes
            with the package, which was trained on 13 categories of the embedded dataset, its shapes
            to test on left out. timm takes pretrained, timm's own. none trains from scratch. Where
            nothing is said, embedded is meant if it fits, else none; schedule=paper asks.
    """

    weights: str | None = None

    @property
    def first_weights(self) -> str:
        """What `weights` means."""
        width = self.settings.get("width")
        fits = self.name == "mobilenet" and width == EMBEDDED_WIDTH and pretrained.MODEL.is_file()
        return self.weights or ("embedded" if fits else "none")


@dataclass(frozen=True)
class Term(Component):
    """A term of the objective under its weight.

    Attributes:
        weight: of the term; at 0 it is watched, and not minimised.
        annealing: whether the weight fades: by a factor of e over `schedule.annealing_steps`
            (`exponential`), or to nothing (`linear`).
    """

    weight: float = 1.0
    annealing: Literal["constant", "exponential", "linear"] = "constant"

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(vars(self), weight="[0, inf)")


HOLDERS: dict[str, type[Component]] = {
    "source": Data,
    "split": Split,
    "encoder": Encoder,
    "term": Term,
}
"""Kinds whose components have settings in common."""

GROUPS: dict[str, str] = {
    "data": "source",
    "split": "split",
    "regime.selection": "selection",
    "template_strategy": "template_strategy",
    "augmentation": "augmentation",
    "encoder": "encoder",
    "optimizer": "optimizer",
    "lr_schedule": "lr_schedule",
    "protocol": "protocol",
}
"""The groups that choose one component, and of which kind."""

LISTS: dict[str, str] = {"regime.terms": "term", "callback": "callback"}
"""The places of several components, by labels of their own, and of which kind."""


# --- groups that are no components ----------------------------------------------------------------


@dataclass
class CategoryConfig:
    """One category of objects.

    Attributes:
        name: of the category; a data set's own name or id for `category=custom`.
        members: categories that one network is trained on together; `name` is what they are called.
    """

    name: str = MISSING
    members: list[str] | None = None


@dataclass
class RegimeConfig:
    """A training regime: how template weights are taught, and what is minimised.

    Attributes:
        name: of the regime, in folders and tables.
        min_weight: epsilon_gamma, the floor of the template weights, shared out among all.
        selection: how template weights are taught.
        terms: of the objective, by the name that they are logged under; `term` is the component, by
            default that name.
        mirror_offsets: averages offsets with their mirror image at the plane x = 0.
    """

    name: str
    min_weight: float
    selection: Component
    terms: Mapping[str, Term]
    mirror_offsets: bool = False

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(vars(self), min_weight="[0, 1)")


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

    name: str
    count: int
    hold_out: int | None = None
    max_edge: float = 0.02

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(vars(self), count="(0, inf)", max_edge="(0, inf)")


@dataclass
class TemplateRankingConfig:
    """How the trained network ranks its templates, by selections, in `template_ranking.csv`.

    Attributes:
        subset: of which shapes; `val` takes those trained on where there are none to validate on.
        all_views: every image of a shape counts instead of its first.
    """

    subset: Literal["val", "train"] = "val"
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

    bottleneck: int = 64
    hidden: int = 512
    degrees: tuple[int, int, int] = (3, 3, 3)
    offset_std: float = 1e-4
    batch_norm_momentum: float = 0.1
    seen_height: int | None = None

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(
            vars(self),
            bottleneck="(0, inf)",
            hidden="(0, inf)",
            degrees="[1, inf)",
            offset_std="(0, inf)",
            batch_norm_momentum="(0, 1]",
            seen_height="[32, inf)",
        )


@dataclass
class PreparationConfig:
    """How data is prepared. What comes out is the same, but for shapes that exceed `timeout`.

    Attributes:
        workers: processes, 0 for one per core.
        timeout: seconds after which a shape is given up and left out.
    """

    workers: int = 0
    timeout: float = 600.0

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(vars(self), workers="[0, inf)", timeout="(0, inf]")


@dataclass
class ScheduleConfig:
    """How long and how fast to train. Everything that counts steps counts optimizer steps.

    Attributes:
        name: of the schedule.
        steps: of the training.
        batch_size: images of a step.
        num_points: of each cloud that a step compares.
        learning_rate: of the optimizer; `lr_schedule` says what becomes of it.
        offset_rate: factor of the learning rate for the weights that turn an image into offsets.
        annealing_steps: b_0, over which annealed terms fade.
    """

    name: str
    steps: int
    batch_size: int
    num_points: int
    learning_rate: float
    annealing_steps: float
    offset_rate: float = 1.0

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        positive = "(0, inf)"
        check_ranges(
            vars(self),
            steps=positive,
            batch_size="[2, inf)",  # batch norm needs two
            num_points=positive,
            learning_rate=positive,
            offset_rate=positive,
            annealing_steps="(0, inf]",
        )


@dataclass
class TrainerConfig:
    """Where to train, and how often to look; passed to `lightning.Trainer`.

    Attributes:
        accelerator, devices, strategy: see `lightning.Trainer`.
        val_every: steps between validations.
        checkpoint_every: steps between checkpoints.
        precision: `bf16-mixed` runs the network, and nothing else, in bfloat16.
        residency: where images and clouds are kept while training: files, or the device that
            trains.
        num_workers: the data loader's processes, by default none on the CPU and some beside a GPU.
        compile: has `torch.compile` fuse the encoder's layers.
        jobs_per_gpu: how many jobs of a sweep share a GPU.
        progress_bar: shows how far it is.
    """

    accelerator: str
    val_every: int
    checkpoint_every: int
    devices: str = "1"
    strategy: str = "auto"
    precision: str = "32-true"
    residency: Literal["auto", "disk", "device"] = "auto"
    num_workers: int | None = None
    compile: bool = False
    jobs_per_gpu: int = 1
    progress_bar: bool = True

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(
            vars(self),
            val_every="(0, inf)",
            checkpoint_every="(0, inf)",
            num_workers="[0, inf)",
            jobs_per_gpu="(0, inf)",
        )


@dataclass
class LoggerConfig:
    """What is logged, and every how many steps.

    Attributes:
        tensorboard: writes TensorBoard's files.
        every: how many steps.
    """

    tensorboard: bool = True
    every: int = 20

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(vars(self), every="(0, inf)")


@dataclass
class CallbacksConfig:
    """What is drawn: examples in the reconstruction figure, and a report at the end of a sweep.

    Attributes:
        figure_examples: in the figure of reconstructions.
        training_examples: how many of them are shown in TensorBoard while training.
        training_figures: how often.
        report: `report.html` at the end of a sweep.
    """

    figure_examples: int = 6
    training_examples: int = 2
    training_figures: int = 3
    report: bool = True

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        numbers = ("figure_examples", "training_examples", "training_figures")
        check_ranges(vars(self), **dict.fromkeys(numbers, "[0, inf)"))


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

    references: bool = True
    subset: Literal["test", "val"] = "test"
    all_views: bool = False
    seed: int = 0
    workers: int = 0

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(vars(self), seed="[0, inf)", workers="[0, inf)")


@dataclass
class PathsConfig:
    """Where prepared data and runs go.

    Attributes:
        data: prepared sets.
        runs: run folders.
    """

    data: str = "data"
    runs: str = "runs"


# --- all that a command reads ---------------------------------------------------------------------


@dataclass(kw_only=True)
class PrepareConfig:
    """What data is prepared from, by `prepare` or at the start of a training.

    Attributes:
        plugins: modules with components of your own.
    """

    category: CategoryConfig
    data: Data
    preparation: PreparationConfig
    paths: PathsConfig
    plugins: list[str] = field(default_factory=list)


@dataclass(kw_only=True)
class PrepareCommandConfig(PrepareConfig):
    """Everything that `prepare` reads.

    Attributes:
        trial: prepares a few shapes in a temporary folder, and says what there is.
    """

    trial: bool = False


@dataclass(kw_only=True)
class TrainConfig(PrepareConfig):
    """Everything that `train` reads.

    Attributes:
        name: of the experiment: its folder below `paths.runs`.
        seed: decides first weights and what each step sees.
        restart: discards what the run folder holds.
        provided: which package each component came from that is not ours; filled in by training.
        base: overrides that a study makes: its folders' names leave them out.
        callback: components that take part in the training, by label.
    """

    split: Split
    regime: RegimeConfig
    templates: TemplatesConfig
    template_strategy: Component
    template_ranking: TemplateRankingConfig
    augmentation: Component
    encoder: Encoder
    network: NetworkConfig
    optimizer: Component
    lr_schedule: Component
    schedule: ScheduleConfig
    callback: Mapping[str, Component]
    trainer: TrainerConfig
    logger: LoggerConfig
    callbacks: CallbacksConfig
    protocol: Component
    evaluation: EvaluationConfig
    name: str = "default"
    seed: int = 0
    restart: bool = False
    provided: dict[str, str] = field(default_factory=dict)
    base: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(vars(self), seed="[0, 4294967295]")


@dataclass(kw_only=True)
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
        plugins: modules with components of your own.
    """

    run: str = MISSING
    protocol: Component
    evaluation: EvaluationConfig
    checkpoint: str | None = None
    prepared: str | None = None
    data_root: str | None = None
    device: str = "auto"
    progress_bar: bool = True
    restart: bool = False
    plugins: list[str] = field(default_factory=list)
