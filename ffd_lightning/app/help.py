"""Help of the commands that Hydra runs: what can be chosen, and the settings of each choice."""

import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any, get_origin

from omegaconf import OmegaConf

from ffd_lightning import components
from ffd_lightning.app.config import GROUPS, LISTS
from ffd_lightning.app.configuration import common_settings, config_folder
from ffd_lightning.app.settings import default_text, settings_help, two_columns
from ffd_lightning.components import KINDS, OWN, Setting, settings_of

_USUAL = (
    *("data.limit", "encoder.weights", "schedule.steps", "schedule.learning_rate", "name", "seed"),
    *("restart", "paths.data", "paths.runs"),
)
_NOT_GIVEN = ("provided", "base")  # by users


@dataclass(frozen=True)
class Section:
    """The settings of a group, or of one component of it, by their names on the command line.

    Titles are "data.render", "encoder=", "encoder=mobilenet", "" of the whole. Options are files.
    """

    title: str
    text: str
    options: Mapping[str, str]
    settings: Mapping[str, Setting]


def sections(schema: type[Any], folders: Sequence[Path]) -> Iterator[Section]:
    """Yield all settings of a command: the one source of help and of the documentation.

    `folders` are of configurations; their subfolders hold options.
    """
    fields = settings_of(schema)
    own = {k: s for k, s in fields.items() if not _is_group(s) and k not in _NOT_GIVEN}
    yield Section("", components.summary(schema), {}, own)
    for name, setting in fields.items():
        if _is_group(setting):
            yield from _group(name, setting.hint, folders)


def _is_group(setting: Setting) -> bool:
    return dataclasses.is_dataclass(setting.hint) or get_origin(setting.hint) is Mapping


def _group(place: str, hint: Any, folders: Sequence[Path]) -> Iterator[Section]:
    kind, listed = GROUPS.get(place) or LISTS.get(place, ""), place in LISTS
    settings = common_settings(kind) if kind else settings_of(hint)
    text = KINDS[kind].meaning if kind else components.summary(hint)
    options = {file.stem: _first_comment(file) for file in _option_files(place, folders)}
    prefix = f"{place}.LABEL" if listed else place
    title = place.replace(".", "/").removesuffix("s" if listed else "")
    own = {f"{prefix}.{k}": s for k, s in settings.items() if not _is_group(s)}
    yield Section(f"{title}=" if kind or options else place, text, options, own)
    for name in components.names(kind) if kind else ():
        provider, found = components.provider(kind, name), components.settings(kind, name)
        text = components.summary(components.find(kind, name))
        text += "" if provider == OWN else f" ({provider})"
        yield Section(f"{title}={name}", text, {}, dict(each_setting(prefix, found)))
    for name, setting in settings.items():
        if _is_group(setting):
            yield from _group(f"{place}.{name}", setting.hint, folders)


def each_setting(prefix: str, settings: Mapping[str, Setting]) -> Iterator[tuple[str, Setting]]:
    """Yield settings by their whole names, those of a dataclass one by one."""
    for name, setting in settings.items():
        if dataclasses.is_dataclass(setting.hint) and setting.default is not None:
            inner = settings_of(setting.hint)
            if setting.default != components.MISSING:
                values = vars(setting.default)
                inner = {k: dataclasses.replace(s, default=values[k]) for k, s in inner.items()}
            yield from each_setting(f"{prefix}.{name}", inner)
        else:
            yield f"{prefix}.{name}", setting


def _option_files(group: str, folders: Sequence[Path]) -> list[Path]:
    """Return the files of a group's options, t2 before t16."""
    files = [p for f in folders for p in (f / group.replace(".", "/")).glob("*.yaml")]
    return sorted(files, key=lambda p: (re.sub(r"\d+", "", p.stem), len(p.stem), p.stem))


def _first_comment(file: Path) -> str:
    lines = takewhile(lambda x: x.startswith("#"), file.read_text("utf-8").splitlines())
    # A line such as `# @package _global_` is for Hydra.
    return " ".join(line.lstrip("# ") for line in lines if not line.startswith("# @"))


def command_help(
    name: str, schema: type[Any], config_dir: str | None, everything: bool = False
) -> str:
    """Return the help of a command: what is usual, or everything; options of `config_dir`, too.

    It begins with `hydra.help.template` of our `<name>.yaml`.
    """
    folders = [config_folder(), *([] if config_dir is None else [Path(config_dir)])]
    file = OmegaConf.load(folders[0] / f"{name}.yaml")
    intro = str(OmegaConf.select(file, "hydra.help.template")).rstrip()
    if everything:
        found = []
        for section in sections(schema, folders):
            title = f"{section.title or 'Of the whole'}    {section.text}"
            texts = title, two_columns(section.options.items()), settings_help(section.settings)
            found.append("\n".join(filter(None, texts)))
        end = "--cfg job prints every setting with its value; --hydra-help what Hydra can do."
        return "\n\n".join([intro, *found, end])
    # The components themselves are not asked here: to import them all takes seconds.
    usual = {g: c for x in file.defaults if OmegaConf.is_dict(x) for g, c in x.items()}
    choices, fields, known = [], settings_of(schema), {}
    for place in fields:
        options = [file.stem for file in _option_files(place, folders)]
        options += components.names(GROUPS[place]) if place in GROUPS else []
        if options and place in usual:  # evaluate's templates are meshes
            choices.append((f"{place}={usual[place]}", ", ".join(options)))
    for key in dict.fromkeys([*(_USUAL), *(f for f in fields if name != "train")]):
        place, _, setting = key.rpartition(".")
        if (place or key) in fields and key not in _NOT_GIVEN:
            kind, hint = GROUPS.get(place), fields[place or key].hint
            there = common_settings(kind) if kind else settings_of(hint) if place else fields
            if not _is_group(there[setting]):
                known[f"{key}={default_text(there[setting])}"] = there[setting].help.split(". ")[0]
    settings = two_columns(((k, re.sub(r"(?<!\.)\.$", "", text)) for k, text in known.items()), 28)
    end = f"ffd {name} --help all lists all settings, and those of each choice."
    return "\n\n".join(
        [intro, f"Choices:\n{two_columns(choices, 28)}", f"Settings:\n{settings}", end]
    )
