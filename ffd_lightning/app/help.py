"""Help of the commands that Hydra runs: what can be chosen, and what each choice can be told."""

from __future__ import annotations

import dataclasses
import re
import textwrap
from enum import Enum
from itertools import takewhile
from pathlib import Path
from typing import Any

from omegaconf import MISSING, OmegaConf

from ffd_lightning import registry
from ffd_lightning.app.config import COMMON, GROUPS
from ffd_lightning.app.settings import settings_help
from ffd_lightning.registry import Entry

_WIDTH = 100
_NAME = 20
_NOT_GIVEN = ("provided", "base")  # by users


def command_help(name: str, config: type[Any], folder: Path, extra: str | None = None) -> str:
    """Return the help of a command.

    Args:
        name: of the command; `<name>.yaml` in `folder` holds its introduction under
            `hydra.help.template`.
        config: its schema.
        folder: of the configurations.
        extra: a user's folder with further options (--config-dir).
    """
    file = OmegaConf.load(folder / f"{name}.yaml")
    intro = str(OmegaConf.select(file, "hydra.help.template") or "").rstrip()
    fields = [f.name for f in dataclasses.fields(config)]
    folders = [folder, *([] if extra is None else [Path(extra)])]
    sections = _sections(config)
    defaults = {g: c for each in file.defaults if OmegaConf.is_dict(each) for g, c in each.items()}
    groups = [
        _group(group, folders, sections, defaults.get(group, ""))
        for group in _groups(fields, folders)
    ]
    told = {*sections, *_NOT_GIVEN, *(group.split(".")[0] for group in GROUPS)}
    further = [
        _line(f"{n}.", _told(s, n)) for n, s in sections.items() if not option_files(n, folders)
    ]
    choices = [
        "Choices (group=option; here the default) and what each can be told (group.setting=value):",
        *(g for g in groups if g),
    ]
    return "\n\n".join(
        [
            intro,
            "Settings:",
            "\n".join([settings_help(config, told), *further]),
            *(choices if groups else []),
            "--cfg job prints every setting with its value; --hydra-help what Hydra itself can do.",
        ]
    )


def _groups(fields: list[str], folders: list[Path]) -> list[str]:
    named = [group for group in GROUPS if group.split(".")[0] in fields]
    files = {p.name for folder in folders for p in folder.iterdir() if p.is_dir()}
    groups = [name for name in fields if name in files or name in named]
    nested = [group for group in named if "." in group]
    terms = ["regime.terms"] if "regime" in fields else []
    result = []
    for group in groups:
        result.append(group)
        result += [n for n in (*nested, *terms) if n.split(".")[0] == group]
    return result


def _sections(config: type[Any]) -> dict[str, type[Any]]:
    """Return the groups that have one schema, whatever is chosen."""
    found: dict[str, type[Any]] = {}
    for f in dataclasses.fields(config):
        made: Any = f.default_factory
        if isinstance(made, type) and dataclasses.is_dataclass(made):
            found[f.name] = made
    return found


def option_files(group: str, folders: list[Path]) -> list[Path]:
    """Return the files of a group's options, t2 before t16."""
    files = [p for f in folders for p in (f / group.replace(".", "/")).glob("*.yaml")]
    return sorted(files, key=lambda p: (re.sub(r"\d+", "", p.stem), len(p.stem), p.stem))


def _group(group: str, folders: list[Path], sections: dict[str, type[Any]], default: str) -> str:
    kind = "term" if group == "regime.terms" else GROUPS.get(group)
    lines = [_line(p.stem, first_comment(p)) for p in option_files(group, folders)]
    meaning = ""
    if kind is not None:
        meaning = registry.KINDS[kind]
        for entry in registry.entries(kind):
            lines += _entry_lines(entry)
        if kind in COMMON:
            lines.append(_line("(all of them)", _told(COMMON[kind])))
    elif group in sections:
        lines.append(_line("(all of them)", _told(sections[group], group)))
    title = (
        f"{group.replace('.', '/')}={default}" if kind != "term" else "regime.terms.<label>.term="
    )
    return "\n".join([f"{title}{f'    {meaning}' if meaning else ''}", *lines]) if lines else ""


def _entry_lines(entry: Entry) -> list[str]:
    from_where = "" if entry.provider == "ffd_lightning" else f" ({entry.provider})"
    lines = [_line(entry.name, f"{entry.summary}{from_where}")]
    told = _told(entry.settings)
    return [*lines, _line("", told)] if told else lines


def _told(settings: type[Any], group: str = "") -> str:
    """Return settings with their defaults; those that are groups themselves are left out."""
    own = [f for f in dataclasses.fields(settings) if f.default_factory is not dict]
    shown = [f for f in own if f"{group}.{f.name}" not in GROUPS]
    return " ".join(f"{f.name}={default_text(f)}" for f in shown)


def _line(name: str, text: str) -> str:
    indent = " " * (_NAME + 2)
    wrapped = textwrap.wrap(text, _WIDTH - _NAME - 2) or [""]
    first = f"  {name:<{_NAME}}{wrapped[0]}".rstrip()
    return "\n".join([first, *(indent + line for line in wrapped[1:])])


def default_text(f: dataclasses.Field[Any]) -> str:
    """Return a setting's default as it is written on the command line, and what else it may be."""
    value = f.default
    if value is dataclasses.MISSING:
        value = f.default_factory() if f.default_factory is not dataclasses.MISSING else MISSING
    if value == MISSING:
        return "..."
    if value is None:
        return "null"
    if isinstance(value, Enum):
        return "|".join([value.name, *(v.name for v in type(value) if v != value)])
    if isinstance(value, bool):
        return str(value).lower()
    if dataclasses.is_dataclass(value):
        return (
            "(" + " ".join(f"{x.name}={default_text(x)}" for x in dataclasses.fields(value)) + ")"
        )
    if isinstance(value, tuple):
        value = list(value)  # as it is written
    return str(value).replace("'", "").replace(" ", "")


def first_comment(file: Path) -> str:
    """Return what an option's file says of itself, in its first lines."""
    lines = takewhile(lambda x: x.startswith("#"), file.read_text("utf-8").splitlines())
    # A line such as `# @package _global_` is for Hydra.
    return " ".join(line.lstrip("# ") for line in lines if not line.startswith("# @"))
