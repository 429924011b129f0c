"""Settings of commands that need no configuration file: `key=value` into a dataclass."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import yaml
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning import components
from ffd_lightning.components import MISSING, Setting, settings_of, unknown_setting, written
from ffd_lightning.errors import ConfigError

_Settings = TypeVar("_Settings")


def read_settings(schema: type[_Settings], arguments: Sequence[str], main: str = "") -> _Settings:
    """Read `key=value` arguments into a dataclass.

    Args:
        schema: a dataclass; fields whose default is `MISSING` must be given.
        arguments: of the command line; commas make lists of `[a,b]` only.
        main: the setting that a lone argument, one without "=", is the value of.

    Raises:
        ConfigError: an unknown setting, a value that does not fit or is out of range, or one that
            is missing.
    """
    known = settings_of(schema)
    given: dict[str, Any] = {}
    for argument in arguments:
        key, equals, value = argument.partition("=")
        if not equals:
            if not main or main in given:
                hint = f"write {main or next(iter(known))}={argument}, say"
                raise ConfigError(f"{argument!r} is no setting: {hint}")
            key, value = main, argument
        if key not in known:
            raise ConfigError(unknown_setting("", key, list(known)))
        if key in given:
            raise ConfigError(f"{key}= is given twice")
        if value == "":
            raise ConfigError(f"{key}= is empty: give a value, or leave it out")
        given[key] = _value(value, known[key].hint)
    settings: _Settings = components.build(schema, given, "")
    return settings


def _value(text: str, hint: Any) -> Any:
    """Return what a user wrote, of whatever type the setting has."""
    # Names of files may hold what means something to YAML: they are taken as they are.
    if hint is str or (hint == str | None and text != "null"):
        return text
    if components.described(hint) == "a list" and not text.startswith("["):
        return [text]  # one is a list of one
    try:
        found = OmegaConf.create(f"- {text}")[0]
    except (OmegaConfBaseException, ValueError, yaml.YAMLError):
        return text
    return OmegaConf.to_container(found) if OmegaConf.is_config(found) else found


def default_text(setting: Setting) -> str:
    """Return a default as it is written on the command line, and what else there is.

    >>> from typing import Literal
    >>> default_text(Setting(Literal["a", "b"], "b")), default_text(Setting(int))
    ('b|a', '...')
    """
    if isinstance(setting.default, str) and setting.default == MISSING:
        return "..."
    default, kind = written(components.plain(setting.default)), components.described(setting.hint)
    if not kind.startswith("one of "):
        return default
    return "|".join(dict.fromkeys([default, *kind.removeprefix("one of ").split(", ")]))


def settings_help(settings: Mapping[str, Setting], prefix: str = "") -> str:
    """Return a table of settings, with their defaults and what each is.

    Args:
        settings: by name.
        prefix: stands before the names.
    """
    lines = []
    for name, setting in settings.items():
        head = f"  {prefix}{name}={default_text(setting)}"
        body = textwrap.wrap(setting.help, 72) or [""]
        if len(head) < 22:
            lines.append(f"{head:<22}{body[0]}".rstrip())
        else:
            lines += [head, *([f"{'':<22}{body[0]}"] if body[0] else [])]
        lines += [f"{'':<22}{line}" for line in body[1:]]
    return "\n".join(lines)


__all__ = ["MISSING", "default_text", "read_settings", "settings_help"]
