"""Settings of commands that need no configuration file: `key=value` into a dataclass."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Collection, Sequence
from dataclasses import fields
from typing import Any, TypeVar, get_type_hints

import yaml
from omegaconf import MISSING, DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException, ValidationError

from ffd_lightning.app.messages import unknown_setting
from ffd_lightning.errors import ConfigError
from ffd_lightning.registry import range_problems

_Settings = TypeVar("_Settings")


def read_settings(schema: type[_Settings], arguments: Sequence[str], main: str = "") -> _Settings:
    """Read `key=value` arguments into a dataclass.

    Args:
        schema: a dataclass; fields without a value, `MISSING`, must be given.
        arguments: of the command line; commas make lists of `[a,b]` only.
        main: the setting that a lone argument, one without "=", is the value of.

    Raises:
        ConfigError: an unknown setting, a value that does not fit or is out of range, or one that
            is missing.
    """
    names = [f.name for f in fields(schema)]  # type: ignore[arg-type]
    hints = get_type_hints(schema)
    merged = OmegaConf.structured(schema)
    seen: set[str] = set()
    for argument in arguments:
        key, equals, value = argument.partition("=")
        if not equals:
            if not main or main in seen:
                hint = f"write {main or names[0]}={argument}, say"
                raise ConfigError(f"{argument!r} is no setting: {hint}")
            key, value = main, argument
        if key not in names:
            raise ConfigError(unknown_setting("", key, names))
        if key in seen:
            raise ConfigError(f"{key}= is given twice")
        seen.add(key)
        if value == "":
            raise ConfigError(f"{key}= is empty: give a value, or leave it out")
        _set(merged, key, value, hints[key])
    missing = [name for name in names if OmegaConf.is_missing(merged, name)]
    if missing:
        raise ConfigError(f"these settings must be given: {', '.join(f'{n}=...' for n in missing)}")
    settings = OmegaConf.to_object(merged)
    assert isinstance(settings, schema)
    if problems := range_problems(settings):
        raise ConfigError("; ".join(problems))
    return settings


def _set(merged: DictConfig, key: str, value: str, hint: Any) -> None:
    """Give a setting the value that a user wrote, of whatever type the setting has."""
    plain = hint is str or (hint == str | None and value != "null")
    try:
        if OmegaConf.get_type(merged, key) is list and not value.startswith("["):
            merged[key] = [value]  # one is a list of one
            return
        # Names of files may hold what means something to YAML: they are taken as they are.
        merged[key] = value if plain else OmegaConf.create(f"- {value}")[0]
    except (ValidationError, OmegaConfBaseException, ValueError, yaml.YAMLError):
        try:
            merged[key] = value
        except (ValidationError, OmegaConfBaseException) as error:
            reason = str(error).split("\n")[0]
            raise ConfigError(f"{key}={value} cannot be used ({reason})") from None


def settings_help(schema: type[object], leave_out: Collection[str] = ()) -> str:
    """Return a table of settings with their defaults, from a dataclass and its docstring.

    Args:
        schema: the dataclass; its docstring's `Attributes:` section says what each setting is.
        leave_out: settings that are told elsewhere.
    """
    meanings = setting_meanings(schema)
    lines = []
    defaults = OmegaConf.structured(schema)
    for f in fields(schema):  # type: ignore[arg-type]
        if f.name in leave_out:
            continue
        missing = OmegaConf.is_missing(defaults, f.name)
        value = "..." if missing else _shown(defaults[f.name])
        text = meanings.get(f.name, "")
        head = f"  {f.name}={value}"
        body = textwrap.wrap(text, 72) or [""]
        if len(head) < 22:
            lines.append(f"{head:<22}{body[0]}".rstrip())
        else:
            lines += [head, f"{'':<22}{body[0]}".rstrip()]
        lines += [f"{'':<22}{line}" for line in body[1:]]
    return "\n".join(lines)


def setting_meanings(schema: type[object]) -> dict[str, str]:
    """Return what each setting is, by name, from the docstring of its dataclass."""
    found: dict[str, str] = {}
    for each in reversed(schema.__mro__):  # what is inherited is told there
        found |= _attributes(inspect.getdoc(each) or "")
    return found


def _shown(value: object) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    return str(getattr(value, "value", value))


def _attributes(doc: str) -> dict[str, str]:
    """Return what a docstring in Google's style says of each attribute."""
    if "Attributes:\n" not in doc:
        return {}
    found: dict[str, str] = {}
    name = ""
    for line in doc.split("Attributes:\n", 1)[1].splitlines():
        if line and not line.startswith(" "):
            break
        if line.startswith("    ") and not line.startswith("     ") and ":" in line:
            names, _, text = line.strip().partition(":")
            name = names
            found[name] = text.strip()
        elif name and line.strip():
            found[name] += f" {line.strip()}"
    return {n.strip(): text for names, text in found.items() for n in names.split(",")}


__all__ = ["MISSING", "read_settings", "setting_meanings", "settings_help"]
