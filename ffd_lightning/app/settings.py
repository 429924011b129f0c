"""Settings of commands that need no configuration file: `key=value` into a dataclass."""

import argparse
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar, get_args

import yaml
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning import components
from ffd_lightning.components import MISSING, Setting, settings_of, written
from ffd_lightning.errors import ConfigError
from ffd_lightning.terminal import terminal_width

_Settings = TypeVar("_Settings")


def read_settings(schema: type[_Settings], arguments: Sequence[str], main: str = "") -> _Settings:
    """Read `key=value` arguments into a dataclass; fields of default `MISSING` must be given.

    A lone argument, one without "=", is the value of the setting `main`.
    """
    known = settings_of(schema)
    given: dict[str, Any] = {}
    for argument in arguments:
        key, equals, value = argument.partition("=")
        if not equals or (main and not key.replace(".", "").isidentifier()):  # a path with "="
            if not main or main in given:
                hint = f"write {main or next(iter(known))}={argument}, say"
                raise ConfigError(f"{argument!r} is no setting: {hint}")
            key, value = main, argument
        if key in given:
            raise ConfigError(f"{key}= is given twice")
        if value == "":
            raise ConfigError(f"{key}= is empty: give a value, or leave it out")
        given[key] = read_value(value, known.get(key, Setting(str)).hint)
    return components.build(schema, given, "")


def read_options(
    command: str, arguments: Sequence[str], *flags: str
) -> tuple[argparse.Namespace, list[str]]:
    """Read --config-dir and the flags of a command; return the other words, too.

    Raises:
        ConfigError: an option that there is not.
    """
    parser = argparse.ArgumentParser(f"ffd {command}", allow_abbrev=False, add_help=False)
    for flag in flags:
        parser.add_argument(flag, action="store_true")
    parser.add_argument("--config-dir")
    options, words = parser.parse_known_args(arguments)
    if unknown := [word for word in words if word.startswith("-")]:
        raise ConfigError(f"no option {unknown[0]}: {', '.join([*flags, '--config-dir'])}")
    return options, words


def read_value(text: str, hint: Any) -> Any:
    """Return what a user wrote, of whatever type the setting has."""
    # Names of files may hold what means something to YAML: they are taken as they are.
    if hint is str or (hint == str | None and text != "null"):
        return text
    kind = components.described(hint)
    null = text == "null" and kind.endswith("or null")
    if kind.startswith("a list") and not null and not text.startswith("["):
        if list[str] in (hint, *get_args(hint)):
            return [text]  # one is a list of one: names of files may hold commas
        text = f"[{text}]"
    try:
        found: Any = OmegaConf.to_container(OmegaConf.create(f"value: {text}"))
        return found["value"]
    except (OmegaConfBaseException, ValueError, yaml.YAMLError):
        return text


def default_text(setting: Setting) -> str:
    """Return a default as it is written on the command line, and what else there is.

    >>> from typing import Literal
    >>> default_text(Setting(Literal["a", "b"], "b")), default_text(Setting(int))
    ('b|a', '...')
    """
    default = written(components.plain(setting.default)).replace(MISSING, "...")
    return "|".join(dict.fromkeys([default, *map(written, components.choices(setting.hint))]))


def settings_help(settings: Mapping[str, Setting]) -> str:
    """Return a table of settings by name, with their defaults and what each is."""
    return two_columns((f"{k}={default_text(s)}", s.help) for k, s in settings.items())


def two_columns(rows: Iterable[tuple[str, str]], width: int = 20) -> str:
    """Return lines of names and texts; a name that is too long has a line of its own.

    Lines are as long as the terminal is wide, but 120 characters at most, and 100 elsewhere.
    """
    whole = max(min(terminal_width() or 100, 120), 2 * width)
    lines = []
    for name, text in rows:
        head, wrapped = name, textwrap.wrap(text, whole - width - 2) or [""]
        if len(name) >= width:
            lines.append(f"  {name}")
            head = ""
        lines += [f"  {head:<{width}}{wrapped[0]}", *(" " * (width + 2) + x for x in wrapped[1:])]
    return "\n".join(line.rstrip() for line in lines if line.strip())
