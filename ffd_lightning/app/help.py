"""Help of the commands that Hydra runs: what can be chosen, and what each choice can be told."""

from __future__ import annotations

import dataclasses
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any, get_origin

from omegaconf import OmegaConf

from ffd_lightning import components
from ffd_lightning.app.config import GROUPS, LISTS
from ffd_lightning.app.configuration import common_settings
from ffd_lightning.app.settings import default_text, settings_help
from ffd_lightning.components import KINDS, OWN, Setting, settings_of

_WIDTH, _NAME, _WIDE = 100, 20, 28
_USUAL = (
    *("data.limit", "encoder.weights", "schedule.steps", "schedule.learning_rate", "name", "seed"),
    *("restart", "paths.data", "paths.runs"),
)
_NOT_GIVEN = ("provided", "base")  # by users


@dataclass(frozen=True)
class Option:
    """What one option of a group is, and its own settings.

    Attributes:
        name: of the option, or of the component.
        summary: what it is.
        settings: its own.
    """

    name: str
    summary: str
    settings: Mapping[str, Setting]


@dataclass(frozen=True)
class Group:
    """A place of settings in a command's configuration.

    Attributes:
        place: "encoder" or "data.render", say; "" of the whole.
        meaning: what it decides.
        options: what can be chosen.
        settings: what can be said whatever is chosen.
        kind: of the components that can be chosen, "" where they are none.
    """

    place: str
    meaning: str
    options: Sequence[Option]
    settings: Mapping[str, Setting]
    kind: str = ""


def groups_of(schema: type[Any], folders: Sequence[Path]) -> Iterator[Group]:
    """Yield all that a command can be told: the one source of help and of the documentation.

    Args:
        schema: of the command's settings.
        folders: of configurations, whose subfolders hold options.
    """
    fields = settings_of(schema)
    plain = {name: s for name, s in fields.items() if not _is_group(s) and name not in _NOT_GIVEN}
    yield Group("", components.summary(schema), (), plain)
    for name, setting in fields.items():
        if _is_group(setting):
            yield from _group(name, setting.hint, folders)


def _is_group(setting: Setting) -> bool:
    return dataclasses.is_dataclass(setting.hint) or get_origin(setting.hint) is Mapping


def _group(place: str, hint: Any, folders: Sequence[Path]) -> Iterator[Group]:
    kind = GROUPS.get(place) or LISTS.get(place, "")
    files = [Option(p.stem, first_comment(p), {}) for p in option_files(place, folders)]
    if kind:
        found = [Option(n, *_component(kind, n)) for n in components.names(kind)]
        settings, meaning = common_settings(kind), KINDS[kind].meaning
        files += found
    else:
        settings, meaning = settings_of(hint), components.summary(hint)
    own = {name: s for name, s in settings.items() if not _is_group(s)}
    yield Group(place, meaning, files, own, kind)
    for name, setting in settings.items():
        if _is_group(setting):
            yield from _group(f"{place}.{name}", setting.hint, folders)


def _component(kind: str, name: str) -> tuple[str, Mapping[str, Setting]]:
    provider = components.provider(kind, name)
    from_where = "" if provider == OWN else f" ({provider})"
    summary = components.summary(components.find(kind, name))
    return f"{summary}{from_where}", components.settings(kind, name)


def command_help(
    name: str, schema: type[Any], folders: Sequence[Path], everything: bool = False
) -> str:
    """Return the help of a command: what is usual, or everything.

    Args:
        name: of the command; `<name>.yaml` in the first folder holds its introduction under
            `hydra.help.template`.
        schema: of its settings.
        folders: of configurations: ours, then those of --config-dir.
        everything: also what each choice can be told.
    """
    file = OmegaConf.load(folders[0] / f"{name}.yaml")
    intro = str(OmegaConf.select(file, "hydra.help.template") or "").rstrip()
    listed: Any = file.defaults
    usual = {g: c for each in listed if OmegaConf.is_dict(each) for g, c in each.items()}
    groups = list(groups_of(schema, folders))
    if everything:
        body = [text for group in groups if (text := _everything(group, usual))]
        end = (
            "--cfg job prints every setting with its value; --hydra-help what Hydra itself can do."
        )
        return "\n\n".join([intro, *body, end])
    choices = [
        _line(f"{_spelled(g)}={usual[_spelled(g)]}", ", ".join(o.name for o in g.options), _WIDE)
        for g in groups
        if g.options and "." not in g.place and g.place not in LISTS
    ]
    known = {f"{g.place}.{n}".lstrip("."): s for g in groups for n, s in g.settings.items()}
    keys = _USUAL if name == "train" else [*_USUAL, *groups[0].settings]
    shown = {key: known[key] for key in dict.fromkeys(keys) if key in known}
    further = f"ffd {name} --help all tells all settings, and what each choice can be told."
    if not choices:
        return "\n\n".join([intro, "Settings:", settings_help(known)])
    short = [
        _line(f"{k}={default_text(s)}", s.help.split(". ")[0].rstrip("."), 28)
        for k, s in shown.items()
    ]
    return "\n\n".join(
        [intro, "Choices:\n" + "\n".join(choices), "Settings:\n" + "\n".join(short), further]
    )


def _spelled(group: Group) -> str:
    """Return how a group is chosen on the command line."""
    return group.place.replace(".", "/")


def _everything(group: Group, usual: Mapping[str, str]) -> str:
    """Return all of a group: its options, and what each can be told."""
    prefix = f"{group.place}." if group.place else ""
    title = f"{_spelled(group)}={usual.get(_spelled(group), '')}" if group.options else prefix
    if group.place in LISTS:
        prefix, title = f"{prefix}LABEL.", f"{_spelled(group).removesuffix('s')}=[NAME,...]"
    lines = [f"{title or 'Of the whole'}    {group.meaning}"]
    for option in group.options:
        lines.append(_line(option.name, option.summary))
        if option.settings:
            lines.append(textwrap.indent(settings_help(option.settings, prefix), "  "))
    if group.settings:
        lines += [*(["  all of them:"] if group.options else [])]
        lines.append(settings_help(group.settings, prefix))
    return "\n".join(lines) if len(lines) > 1 else ""


def option_files(group: str, folders: Sequence[Path]) -> list[Path]:
    """Return the files of a group's options, t2 before t16."""
    files = [p for f in folders for p in (f / group.replace(".", "/")).glob("*.yaml")]
    return sorted(files, key=lambda p: (re.sub(r"\d+", "", p.stem), len(p.stem), p.stem))


def first_comment(file: Path) -> str:
    """Return what an option's file says of itself, in its first lines."""
    lines = takewhile(lambda x: x.startswith("#"), file.read_text("utf-8").splitlines())
    # A line such as `# @package _global_` is for Hydra.
    return " ".join(line.lstrip("# ") for line in lines if not line.startswith("# @"))


def _line(name: str, text: str, column: int = _NAME) -> str:
    wrapped = textwrap.wrap(text, _WIDTH - column - 2) or [""]
    first = f"  {name:<{column}}{wrapped[0]}".rstrip()
    return "\n".join([first, *(" " * (column + 2) + line for line in wrapped[1:])])
