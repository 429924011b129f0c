"""Parts whose implementation is imported when it is built: `--help` is there before torch is."""

from __future__ import annotations

import importlib
from dataclasses import fields
from enum import Enum
from typing import Any

from ffd_lightning.registry import register


def class_part(kind: str, name: str, settings: type[Any], place: str) -> None:
    """Register a part that a class makes of the settings, by their names; "module:class"."""

    @register(kind, name, settings)
    def build(given: Any, **_: Any) -> Any:
        values = {f.name: getattr(given, f.name) for f in fields(given)}
        plain = {k: v.value if isinstance(v, Enum) else v for k, v in values.items()}
        return _found(place)(**plain)


def function_part(kind: str, name: str, settings: type[Any], place: str) -> None:
    """Register a part that is a function itself; "module:function"."""

    @register(kind, name, settings)
    def build(given: Any, **_: Any) -> Any:
        return _found(place)


def _found(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)
