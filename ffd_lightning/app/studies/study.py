"""What a study is: a question, and the sweeps of `train.py` that answer it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import ChoiceSweep, Glob, RangeSweep
from omegaconf import MISSING, OmegaConf

from ffd_lightning.errors import ConfigError


@dataclass
class Stage:
    """One sweep.

    Attributes:
        overrides: of `train.py -m`, one value or several separated by commas each.
        quick: further ones, or others, for the quick version.
    """

    overrides: list[str] = field(default_factory=list)
    quick: list[str] = field(default_factory=list)


@dataclass
class Range:
    """Where a setting is looked for: from `low` to `high`, evenly in its logarithm if `log`."""

    low: float = MISSING
    high: float = MISSING
    log: bool = False


@dataclass
class Search:
    """A search for the settings with the best score.

    Attributes:
        parameters: settings, as on the command line, and where to look for them.
        trials: how many runs it may take.
        quick_trials: the same, for the quick version.
        measure: of protocol `evaluation.protocol`; averaged over what the overrides sweep.
    """

    parameters: dict[str, Range] = field(default_factory=dict)
    trials: int = 50
    quick_trials: int = 4
    measure: str = "chamfer"


@dataclass
class Study:
    """A study as its file in `sweeps/` has it.

    Attributes:
        question: what it is to answer.
        overrides: of all stages.
        quick: further ones, or others, for the quick version.
        stages: sweeps, one after the other; a later one may read what an earlier one wrote.
        search: instead of stages.
        beside_paper: sets the results beside the paper's Table 3 at the end, and in the report.
    """

    question: str = MISSING
    overrides: list[str] = field(default_factory=list)
    quick: list[str] = field(default_factory=list)
    stages: list[Stage] = field(default_factory=list)
    search: Search | None = None
    beside_paper: bool = False


def load_study(file: Path) -> Study:
    """Read a study.

    Raises:
        ConfigError: no such file, or it is not a study.
    """
    if not file.is_file():
        names = ", ".join(sorted(p.stem for p in file.parent.glob("*.yaml")))
        raise ConfigError(f"no study {file.stem!r}: {file.parent} has {names or 'none'}")
    try:
        merged = OmegaConf.merge(OmegaConf.structured(Study), OmegaConf.load(file))
        content: Any = OmegaConf.to_container(merged)  # ${...} is for train.py
        if "???" in str(content):
            raise ConfigError("its question, or a search's low or high, is not given")
    except Exception as error:
        reason = " ".join(str(error).split("\n")[0].split())
        raise ConfigError(f"{file} is not a study: {reason}") from None
    search = content.pop("search")
    if search is not None:
        ranges = {key: Range(**r) for key, r in search.pop("parameters").items()}
        search = Search(parameters=ranges, **search)
    stages = [Stage(**stage) for stage in content.pop("stages")]
    study = Study(stages=stages, search=search, **content)
    if bool(study.stages) == (study.search is not None):
        raise ConfigError(f"{file} is not a study: give either stages or a search")
    return study


def commands(study: Study, name: str, quick: bool, overrides: Sequence[str]) -> list[list[str]]:
    """Return what each stage gives to `train -m`.

    What the study itself sets is told as `base`: names of folders leave it out, so that runs of a
    study are where its stages look for them, and only what a user adds is seen in the name.

    Args:
        study: the study.
        name: of its folder.
        quick: the quick version.
        overrides: the user's, which replace the study's of the same key.
    """
    result = []
    for stage in study.stages or [Stage()]:
        layers = [study.overrides, stage.overrides]
        if quick:
            layers += [study.quick, stage.quick]
        own = merge_overrides(*(x for layer in layers for x in layer))
        base = ",".join(f'"{_escaped(x)}"' for x in own if not _is_swept(x))
        result.append(merge_overrides(f"name={name}", *own, *overrides) + [f"base=[{base}]"])
    return result


def sample_jobs(
    overrides: Sequence[str], every: Sequence[str] = ("schedule", "encoder", "encoder.weights")
) -> list[list[str]]:
    """Return some jobs of a sweep, without Hydra's own settings.

    Args:
        overrides: of `train -m`.
        every: settings of which the jobs have all values, each with each; of others the first.

    >>> sample_jobs(["regime=b,e", "schedule=quick,paper", "seed=0"])
    [['regime=b', 'schedule=quick', 'seed=0'], ['regime=b', 'schedule=paper', 'seed=0']]
    """
    choices = []
    own = [x for x in overrides if not x.startswith("hydra")]
    for override in OverridesParser.create().parse_overrides(own):
        key, value = override.get_key_element(), override.value()
        if not isinstance(value, ChoiceSweep | RangeSweep):
            # A pattern of options (glob) is Hydra's to read: here the default stands for it.
            choices += [] if isinstance(value, Glob) else [[str(override.input_line)]]
            continue
        values = [f"{key}={x}" for x in override.sweep_string_iterator()]
        choices.append(values if key in every else values[:1])
    return [list(job) for job in product(*choices)]


def _is_swept(override: str) -> bool:
    """Tell whether an override has several values: commas outside of brackets and quotes.

    >>> _is_swept("regime=b,e"), _is_swept("seed=range(5)"), _is_swept("category.members=[a,b]")
    (True, True, False)
    """
    value = re.sub(r"\[[^]]*\]|\{[^}]*\}|\"[^\"]*\"|'[^']*'", "", override.partition("=")[2])
    return "," in value or re.match(r"(range|choice|glob|interval)\(", value) is not None


def _escaped(override: str) -> str:
    return override.replace("\\", "\\\\").replace('"', '\\"')


def merge_overrides(*overrides: str) -> list[str]:
    """Keep the last override of each key, in the place of its first.

    >>> merge_overrides("regime=b,e", "seed=0", "regime=r")
    ['regime=r', 'seed=0']
    """
    last: dict[str, str] = {}
    for override in overrides:
        last[override.split("=", 1)[0].lstrip("+~")] = override
    return list(last.values())


def value_of(key: str, overrides: Iterable[str], default: str) -> str:
    """Return what overrides say of a key."""
    values = [x.split("=", 1)[1] for x in overrides if x.split("=", 1)[0] == key and "=" in x]
    return values[-1] if values else default
