"""What a study is: a question, and the sweeps of `ffd train` that answer it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Glob
from omegaconf import MISSING, OmegaConf

from ffd_lightning.app.build import build_source, category_names
from ffd_lightning.app.checks import validate
from ffd_lightning.app.config import PrepareConfig
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.data.source import Source
from ffd_lightning.errors import ConfigError, DataError

_INSTEAD = {"cellphone": "telephone", "firearm": "rifle"}  # what 3D-R2N2's 13 have


@dataclass
class Stage:
    """One sweep.

    Attributes:
        overrides: of `ffd train -m`, one value or several separated by commas each.
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
        content: Any = OmegaConf.to_container(merged)  # ${...} is for `ffd train`
        if "???" in str(content):
            raise ConfigError("its question, or a search's low or high, is not given")
        if bool(content["stages"]) == (content["search"] is not None):
            raise ConfigError("give either stages or a search")
    except Exception as error:
        reason = " ".join(str(error).split("\n")[0].split())
        raise ConfigError(f"{file} is not a study: {reason}") from None
    search = content.pop("search")
    if search is not None:
        ranges = {key: Range(**r) for key, r in search.pop("parameters").items()}
        search = Search(parameters=ranges, **search)
    stages = [Stage(**stage) for stage in content.pop("stages")]
    return Study(stages=stages, search=search, **content)


def sweeps(study: Study, name: str, quick: bool, overrides: Sequence[str]) -> list[list[str]]:
    """Return what each stage gives to `ffd train -m`.

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
        own = [*study.overrides, *stage.overrides]
        own = merged([*own, *study.quick, *stage.quick] if quick else own)
        fixed = [
            x for x in own if not OverridesParser.create().parse_override(x).is_sweep_override()
        ]
        quoted = ('"{}"'.format(x.replace("\\", "\\\\").replace('"', '\\"')) for x in fixed)
        result.append([*merged([f"name={name}", *own, *overrides]), f"base=[{','.join(quoted)}]"])
    return result


def merged(overrides: Iterable[str]) -> list[str]:
    """Keep the last override of each key, in the place of its first.

    >>> merged(["regime=b,e", "seed=0", "regime=r"])
    ['regime=r', 'seed=0']
    """
    return list({x.split("=", 1)[0].lstrip("+~"): x for x in overrides}.values())


def value_of(key: str, overrides: Iterable[str], default: str) -> str:
    """Return what overrides say of a key."""
    values = [x.split("=", 1)[1] for x in overrides if x.startswith(f"{key}=")]
    return values[-1] if values else default


def jobs(sweep: Sequence[str]) -> list[list[str]]:
    """Return the jobs of a sweep as Hydra makes them, without its own settings.

    Patterns of options are left out, so that the defaults stand for them.

    >>> jobs(["regime=b,e", "seed=0"])
    [['regime=b', 'seed=0'], ['regime=e', 'seed=0']]
    """
    parsed = OverridesParser.create().parse_overrides([x for x in sweep if x[:5] != "hydra"])
    plain = [override for override in parsed if not isinstance(override.value(), Glob)]
    (batch,) = BasicSweeper.split_arguments(plain, None)
    return [list(job) for job in batch]


# --- categories -----------------------------------------------------------------------------------


def absent_categories(source: Source, names: Iterable[str]) -> list[str]:
    """Return the categories that a source does not have, in their order.

    Args:
        source: where shapes come from.
        names: the project's names, a data set's own, or synsets.

    Raises:
        DataError: the source is not what it should be.
    """
    there = set(source.categories())
    there |= {SYNSETS[name] for name in there & set(SYNSETS)}
    return [name for name in dict.fromkeys(names) if not {name, SYNSETS.get(name, name)} & there]


def say_absent(source: Source, absent: Sequence[str]) -> str:
    """Return absent categories with their synsets, and what the source has in their place."""
    listed = ", ".join(f"{n} ({SYNSETS[n]})" if n in SYNSETS else n for n in absent)
    there = source.categories()
    others = [_INSTEAD[n] for n in absent if _INSTEAD.get(n) in there]
    return listed + (f"; it has {' and '.join(others)} instead" if others else "")


def check_categories(stages: Iterable[Sequence[str]], config_dir: str | None = None) -> None:
    """Refuse a study of categories that its data does not have.

    Args:
        stages: what each gives to `ffd train -m`.
        config_dir: a folder with options of the user's own.

    Raises:
        ConfigError: settings of the data that cannot work.
        DataError: some categories are not there; the message names them and the way out.
    """
    names: dict[str, None] = {}
    cfg, joint = None, False
    for stage in stages:
        decide = ("data", "category", "plugins", "paths")
        asked = [x for x in stage if x.lstrip("+~").split("=")[0].split(".")[0] in decide]
        for job in jobs(asked):
            name = value_of("category", job, "")
            if cfg is not None and name in SYNSETS:  # composing takes most of a second
                names[name] = None
                continue
            cfg = typed_config(
                compose_config("prepare", PrepareConfig, job, config_dir), PrepareConfig
            )
            validate(cfg)
            names.update(dict.fromkeys(category_names(cfg)))
            joint |= bool(cfg.category.members)
    assert cfg is not None
    source = build_source(cfg)
    absent = absent_categories(source, names)
    if not absent:
        return
    left = [name for name in names if name not in absent]
    if not left:
        source.shape_ids(absent[0])  # raises, and says what there is
    way = f"leave them out with category={','.join(left)}" if left else "choose others"
    if joint and left:  # a category of the user's would take the place of the joint one too
        way = (
            "give a copy of the study's file that leaves them out, in category, category.members "
            "and the numbers of templates"
        )
    raise DataError(
        f"data={cfg.data.name} lacks {len(absent)} of the study's {len(names)} categories: "
        f"{say_absent(source, absent)}. Nothing has run yet: {way}"
    )
