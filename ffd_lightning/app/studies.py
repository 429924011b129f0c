"""What a study is: a question, and the sweeps of `ffd train` that answer it."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import OverrideParseException
from omegaconf import OmegaConf

from ffd_lightning import components
from ffd_lightning.app.config import Data, TrainConfig
from ffd_lightning.app.configuration import compose_config, jobs, typed_config
from ffd_lightning.components import Positive
from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.data.source import Source
from ffd_lightning.errors import ConfigError

_CHECKED = ("schedule=", "encoder", "trainer")  # settings that a job may fail by at its start


@dataclass(frozen=True)
class Stage:
    """One sweep: overrides of `ffd train -m`, and further ones, or others, if it is to be quick."""

    overrides: list[str] = field(default_factory=list)
    quick: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Bounds:
    """From where to where a real number is searched, evenly in its logarithm if `log`."""

    low: float
    high: float
    log: bool = False

    def __post_init__(self) -> None:
        if not (0 if self.log else -math.inf) < self.low < self.high < math.inf:
            above = "above 0 and " if self.log else ""
            raise ValueError(f"low={self.low:g} must be {above}below high={self.high:g}")


@dataclass(frozen=True)
class Search:
    """A search for the settings whose `measure`, averaged over what the study sweeps, is best."""

    parameters: Mapping[str, Bounds]
    trials: Positive = 50
    quick_trials: Positive = 4
    measure: str = "chamfer"

    def __post_init__(self) -> None:
        if not self.parameters:
            raise ValueError("parameters must name settings and their bounds")

    @property
    def ends(self) -> list[list[str]]:
        """Overrides with the least value of each setting, and with the greatest."""
        bounds = [(key, (b.low, b.high)) for key, b in self.parameters.items()]
        return [[f"{key}={ends[k]!r}" for key, ends in bounds] for k in (0, 1)]


@dataclass(frozen=True)
class Study:
    """A study as its file in `sweeps/` has it.

    Attributes:
        overrides, quick: of all stages, see `Stage`.
        stages: sweeps, one after the other; a later one may read what an earlier one wrote.
        search: instead of stages.
        beside_paper: sets the results beside the paper's Table 3 at the end, and in the report.
    """

    question: str
    overrides: list[str] = field(default_factory=list)
    quick: list[str] = field(default_factory=list)
    stages: list[Stage] = field(default_factory=list)
    search: Search | None = None
    beside_paper: bool = False

    def __post_init__(self) -> None:
        if bool(self.stages) == (self.search is not None):
            raise ValueError("give either stages or a search")


def load_study(file: Path) -> Study:
    """Read a study."""
    if not file.is_file():
        names = ", ".join(sorted(p.stem for p in file.parent.glob("*.yaml")))
        raise ConfigError(f"there is no study {file}; beside it: {names or 'none'}")
    try:
        text = file.read_text(encoding="utf-8")
        # As Hydra reads numbers: to YAML itself 1e-5 is a word.
        content: Any = OmegaConf.to_container(OmegaConf.create(text))
        if not isinstance(content, dict):
            raise ValueError("it must hold settings by name")
        study: Study = components.build(Study, content, "")
        parts: list[Study | Stage] = [study, *study.stages]
        for part in parts:
            OverridesParser.create().parse_overrides([*part.overrides, *part.quick])
    except OverrideParseException as error:
        raise ConfigError(
            f"{file} is not a study: {error.override} is not key=value; within brackets YAML takes "
            "commas as its own, unless quoted: ['regime=b,e', seed=0]"
        ) from None
    except (ConfigError, TypeError, ValueError, yaml.YAMLError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError(f"{file} is not a study: {reason}") from None
    return study


def sweeps(study: Study, name: str, quick: bool, overrides: Sequence[str]) -> list[list[str]]:
    """Return what each stage gives to `ffd train -m`.

    What the study itself sets is given as `base`: names of folders leave it out, so that runs of a
    study are where its stages look for them, and only what a user adds is seen in the name. Their
    overrides replace the study's of the same key.

    Raises:
        ConfigError: an override of what is another in each stage.
    """
    parser, result = OverridesParser.create(), []
    stages = [
        merged([*study.overrides, *x.overrides, *(quick * [*study.quick, *x.quick])])
        for x in study.stages or [Stage()]
    ]
    for key in map(key_of, overrides):
        if len({tuple(x for x in own if key_of(x) == key) for own in stages}) > 1:
            raise ConfigError(
                f"the stages of this study differ in {key}: change it in a copy of the study's "
                "file, and give that"
            )
    for own in stages:
        fixed = [x for x in own if not parser.parse_override(x).is_sweep_override()]
        quoted = ('"{}"'.format(x.replace("\\", "\\\\").replace('"', '\\"')) for x in fixed)
        result.append([*merged([f"name={name}", *own, *overrides]), f"base=[{','.join(quoted)}]"])
    return result


def merged(overrides: Iterable[str]) -> list[str]:
    """Keep the last override of each key, in the place of its first.

    >>> merged(["regime=b,e", "seed=0", "regime=r"])
    ['regime=r', 'seed=0']
    """
    return list({key_of(x): x for x in overrides}.values())


def key_of(override: str) -> str:
    """Return what an override sets, adds or removes."""
    return override.split("=", 1)[0].lstrip("+~")


def value_of(key: str, overrides: Iterable[str], default: str) -> str:
    """Return what overrides say of a key."""
    values = [x.split("=", 1)[1] for x in overrides if x.startswith(f"{key}=")]
    return values[-1] if values else default


def check_study(
    stages: Sequence[Sequence[str]], config_dir: str | None = None
) -> tuple[TrainConfig, str]:
    """Compose and check the first job of each stage, and that all categories are there.

    Jobs of other encoders, schedules and devices than the first are checked too. Files of earlier
    stages need not be there.

    Returns:
        The settings of the first job, and what would stop jobs at their start, "" for nothing.
    """
    from ffd_lightning.app.build import category_names
    from ffd_lightning.app.checks import validate

    configs: list[TrainConfig] = []
    problems: dict[str, None] = {}
    names: dict[str, None] = {}
    for k, stage in enumerate(stages):
        later = ("base=", "template_strategy") if k else ("base=",)
        cluster = ["trainer.accelerator=cpu"] if any("submitit" in x for x in stage) else []
        every = jobs(stage)
        unlike = {tuple(x for x in job if x.startswith(_CHECKED)): job for job in reversed(every)}
        for job in reversed(unlike.values()):
            given = merged([*(x for x in job if not x.startswith(later)), *cluster])
            composed = compose_config("train", TrainConfig, given, config_dir)
            configs.append(typed_config(composed, TrainConfig))
            names.update(dict.fromkeys(category_names(configs[-1])))
            try:
                validate(configs[-1])
            except ConfigError as error:
                problems[str(error)] = None
        # All others': composing each would take most of a second.
        swept = {value_of(key, job, "") for job in every for key in ("category", "category.name")}
        names.update((name, None) for name in sorted(swept) if name in SYNSETS)
    if not problems and (absent := _absent(configs[0].data, list(names))):
        problems[absent] = None
    return configs[0], "; ".join(problems)


def _absent(data: Data, names: Sequence[str]) -> str:
    """Say which of some categories the data lacks, "" where all are there."""
    source: Source = data.build()
    there = source.categories()
    known = {SYNSETS.get(name, name) for name in there}
    absent = [name for name in names if SYNSETS.get(name, name) not in known]
    if len(absent) == len(names):
        source.shape_ids(absent[0])  # raises, and says what there is
    return bool(absent) * (
        f"data={data.name} has {', '.join(there)}, and lacks {len(absent)} of the study's "
        f"{len(names)} categories: {', '.join(absent)}. Leave them out (docs/studies.md)"
    )
