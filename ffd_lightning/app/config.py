"""Settings that are no component's, and the only defaults that no YAML file states.

A group's name, its package and its field here are the same word. Components (`components.KINDS`)
declare their own settings; what is common to all of a kind, beside those, is declared here. What a
group does not say of a setting is said by the signature that its `settings_like` names.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from ffd_lightning import pretrained
from ffd_lightning.components import MISSING, Component, NotNegative, Positive, Range
from ffd_lightning.data.reading.orientation import Up
from ffd_lightning.errors import ConfigError
from ffd_lightning.imaging.render_settings import RenderSettings

if TYPE_CHECKING:
    from ffd_lightning.checkpoint import TrainedModel
    from ffd_lightning.inference.own_templates import OwnTemplates

EMBEDDED_WIDTH = 0.25
"""Of the encoder that comes with the package, a MobileNet."""


@dataclass(frozen=True, kw_only=True)
class Data(Component):
    """Where shapes come from, and what is kept of them.

    Attributes:
        variants: deformed variants of each shape, in other colours, to train on beside it; auto
            brings fewer than 300 shapes to 300, with 15 of each at most. By default auto with
            data=folder, and none with other data.
    """

    settings_like: ClassVar[str] = "ffd_lightning.data.preparation.preparation:Preparation"
    limit: Positive | None
    leave_out: list[str]
    variants: NotNegative | Literal["auto"] | None = None
    num_points: Positive
    render: RenderSettings

    @property
    def asked_variants(self) -> int | Literal["auto"]:
        """What `variants` means."""
        if self.variants is None:
            return "auto" if self.name == "folder" else 0
        return self.variants


@dataclass(frozen=True)
class Split(Component):
    """Which shapes are trained on, validated on, tested on.

    Attributes:
        val_fraction: share of the training shapes to validate on, where the split names none.
        drop_outliers: leaves shapes that are like nothing else in their category out of all
            subsets and of the choice of templates; of more than 1,000 shapes 1,000 are looked at.
    """

    val_fraction: Annotated[float, Range("[0, 1)")] = 0.1
    drop_outliers: bool = False


@dataclass(frozen=True)
class Encoder(Component):
    """What turns images into a feature map.

    Attributes:
        weights: the first weights. mobilenet takes a Keras .h5 file, such as
            mobilenet_2_5_192_tf_no_top.h5, or embedded: the encoder of the trained model that comes
            with the package, which was trained on 13 categories of the embedded dataset, without
            its test shapes. timm takes pretrained, timm's own. none trains from scratch. By default
            embedded if it fits, else none; schedule=paper has no default.
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

    weight: Annotated[float, Range("[0, inf)")] = 1.0
    annealing: Literal["constant", "exponential", "linear"] = "constant"


HOLDERS = {"source": Data, "split": Split, "encoder": Encoder, "term": Term}
"""Kinds whose components have settings in common."""

_OF_THEIR_KIND = (
    *("split", "template_strategy", "augmentation", "encoder", "heads", "optimizer"),
    *("lr_schedule", "protocol"),
)
GROUPS = {"data": "source", "regime.selection": "selection", **{k: k for k in _OF_THEIR_KIND}}
"""The groups that choose one component, and of which kind."""

LISTS = {"regime.terms": "term", "callback": "callback"}
"""The places of several components, by labels of their own, and of which kind."""


@dataclass
class CategoryConfig:
    """One category of objects.

    Attributes:
        name: of the category; a data set's own name or id for `category=custom`.
        members: categories that one network is trained on together; `name` is what they are called.
    """

    name: str = MISSING
    members: list[str] | None = None

    def __post_init__(self) -> None:
        if Path(self.name).name != self.name:
            raise ValueError(f"name={self.name} must be the name of a folder, not a path")


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
    min_weight: Annotated[float, Range("[0, 1)")]
    selection: Component
    terms: Mapping[str, Term]
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

    name: str
    count: Positive
    hold_out: int | None = None
    max_edge: Annotated[float, Range("(0, inf)")] = 0.02


@dataclass
class TemplateRankingConfig:
    """How the trained network ranks its templates, by selections, in `template_ranking.csv`.

    Attributes:
        subset: of which shapes; `val` takes those trained on where there are none to validate on.
        all_views: every image of a shape counts instead of its first.
    """

    subset: Literal["val", "train"] = "val"
    all_views: bool = False


@dataclass(kw_only=True)
class NetworkConfig:
    """What stands on top of the encoder (the paper's Table 1).

    Attributes:
        degrees: of the lattices, one per axis.
        batch_norm_momentum: share of a new batch in moving statistics, of encoder and heads.
        seen_height: of the images as the encoder sees them: higher ones are shrunk, by the largest
            whole factor that leaves so many pixels; null takes them as they are.
        weights: the first weights of the whole network, those of the encoder included: a run's
            folder, a checkpoint, or embedded, that of the package (heads=conditioned).
    """

    settings_like: ClassVar[str] = "ffd_lightning.nn.network:TemplateFfdNetwork"
    bottleneck: Positive
    hidden: Positive
    degrees: Annotated[tuple[int, int, int], Range("[1, inf)")] = (3, 3, 3)
    offset_std: Annotated[float, Range("(0, inf)")]
    batch_norm_momentum: Annotated[float, Range("(0, 1]")]
    seen_height: Annotated[int, Range("[32, inf)")] | None = None
    weights: str | None = None


@dataclass
class PreparationConfig:
    """How data is prepared. What comes out is the same, but for shapes that exceed `timeout`."""

    settings_like: ClassVar[str] = "ffd_lightning.data.preparation.preparation:Preparation"
    workers: NotNegative
    timeout: Annotated[float, Range("(0, inf]")]


@dataclass
class ScheduleConfig:
    """How long and how fast to train. Everything that counts steps counts optimizer steps.

    Attributes:
        name: of the schedule.
        steps: of the training.
        batch_size: images of a step, or of each batch that a step accumulates.
        num_points: of each cloud that a step compares.
        learning_rate: of the optimizer; `lr_schedule` says what becomes of it.
        offset_rate: factor of the learning rate for the weights that turn an image into offsets.
        annealing_steps: b_0, over which annealed terms fade.
    """

    name: str
    steps: Positive
    batch_size: Annotated[int, Range("[2, inf)")]  # batch norm needs two
    num_points: Positive
    learning_rate: Annotated[float, Range("(0, inf)")]
    annealing_steps: Annotated[float, Range("(0, inf]")]
    offset_rate: Annotated[float, Range("(0, inf)")] = 1.0


@dataclass
class TrainerConfig:
    """Where to train, and how often to look; passed to `lightning.Trainer`.

    Attributes:
        accelerator, devices, strategy: see `lightning.Trainer`.
        val_every: steps between validations.
        checkpoint_every: steps between checkpoints.
        precision: `bf16-mixed` runs the network, and nothing else, in bfloat16, `16-mixed` in
            float16.
        accumulate_grad_batches: batches of `schedule.batch_size` whose gradients a step adds up.
        gradient_clip_val: scales a step's gradients to this norm where theirs is larger.
        residency: where images and clouds are kept while training: files, or the device that
            trains.
        num_workers: the data loader's processes, by default none on the CPU and some beside a GPU.
        compile: has `torch.compile` fuse the encoder's layers.
        jobs_per_gpu: how many jobs of a sweep share a GPU.
        progress_bar: shows how far it is.
    """

    accelerator: str
    val_every: Positive
    checkpoint_every: Positive
    devices: str = "1"
    strategy: str = "auto"
    precision: Literal["32-true", "bf16-mixed", "16-mixed"] = "32-true"
    accumulate_grad_batches: Positive = 1
    gradient_clip_val: Annotated[float, Range("(0, inf)")] | None = None
    residency: Literal["auto", "disk", "device"] = "auto"
    num_workers: NotNegative | None = None
    compile: bool = False
    jobs_per_gpu: Positive = 1
    progress_bar: bool = True


@dataclass
class LoggerConfig:
    """What is logged, and every how many steps.

    Attributes:
        tensorboard: writes TensorBoard's files.
        every: how many steps.
    """

    tensorboard: bool = True
    every: Positive = 20


@dataclass
class CallbacksConfig:
    """What is drawn: examples in the reconstruction figure, and a report at the end of a sweep.

    Attributes:
        figure_examples: in the figure of reconstructions.
        training_examples: how many of them are shown in TensorBoard while training.
        training_figures: how often.
        report: `report.html` at the end of a sweep.
    """

    figure_examples: NotNegative = 6
    training_examples: NotNegative = 2
    training_figures: NotNegative = 3
    report: bool = True


@dataclass(kw_only=True)
class EvaluationConfig:
    """How a trained network is evaluated; the protocol is a group of its own.

    Attributes:
        subset: which shapes; `val` leaves the test shapes for later.
        workers: threads, 0 for as many as torch takes.
    """

    settings_like: ClassVar[str] = "ffd_lightning.evaluation.evaluator:EvaluationOptions"
    references: bool
    subset: Literal["test", "val"] = "test"
    all_views: bool
    seed: NotNegative
    workers: NotNegative = 0


@dataclass
class PathsConfig:
    """Where prepared data and runs go.

    Attributes:
        data: prepared sets.
        runs: run folders.
    """

    data: str = "data"
    runs: str = "runs"


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
        provided: from which package each component came that is not ours; not given by users.
        base: overrides that a study makes: its folders' names leave them out.
    """

    split: Split
    regime: RegimeConfig
    templates: TemplatesConfig
    template_strategy: Component
    template_ranking: TemplateRankingConfig
    augmentation: Component
    encoder: Encoder
    heads: Component
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
    seed: Annotated[int, Range("[0, 4294967295]")] = 0
    restart: bool = False
    provided: dict[str, str] = field(default_factory=dict)
    base: list[str] = field(default_factory=list)


@dataclass(kw_only=True)
class TemplateSettings:
    """Which meshes are templates, in place of a network's own or beside them.

    Attributes:
        templates: meshes to take as templates in place of the network's own: a folder, files, a
            pattern, or a list of those. The network must have heads=conditioned, as the packaged
            one does.
        up: the axis of those meshes that points up.
        yaw: degrees about the vertical, anticlockwise from above, until those meshes face -z.
        beside: the network's own templates stay beside them.
    """

    templates: list[str] | None = None
    up: Up = "y"
    yaw: float = 0.0
    beside: bool = False

    def named_templates(
        self, model: TrainedModel, root: str | Path, progress: bool = True
    ) -> OwnTemplates | None:
        """Return the meshes as templates, prepared below `root`; None for the model's own.

        Raises:
            ConfigError, DataError: see `of_files`, and `check_unused`.
        """
        from ffd_lightning.inference.own_templates import of_files

        if self.templates is None:
            self.check_unused("there are none")
            return None
        up, yaw = self.up, self.yaw
        return of_files(model, self.templates, up=up, yaw=yaw, root=root, progress=progress)

    def check_unused(self, why: str) -> None:
        """Make sure that no setting says how meshes are taken where none are named.

        Raises:
            ConfigError: one does.
        """
        if (self.up, self.yaw, self.beside) != ("y", 0.0, False):
            raise ConfigError(f"up=, yaw= and beside= are of meshes that templates= names: {why}")


@dataclass
class EvaluateConfig(TemplateSettings):
    """Everything that `evaluate` reads.

    Attributes:
        run: a run folder.
        checkpoint: another file than the run's newest.
        prepared: the folder of another prepared set than the run's own; all its shapes are tested
            but variants and the run's templates.
        data_root: where the run's prepared data is, if not where it was.
        templates: meshes to take as templates in place of the run's, see `ffd predict`; `train` for
            all shapes of the run that are not tested on. Shapes among them are not tested.
        device: auto, cpu, cuda, cuda:1, ...
        progress_bar: shows how far it is.
        restart: scores everything again.
        plugins: modules with components of your own.
    """

    run: str = MISSING
    _: KW_ONLY
    protocol: Component
    evaluation: EvaluationConfig
    checkpoint: str | None = None
    prepared: str | None = None
    data_root: str | None = None
    device: str = "auto"
    progress_bar: bool = True
    restart: bool = False
    plugins: list[str] = field(default_factory=list)
