"""From what was composed, or read from a file, to typed settings; each part by its own schema."""

from __future__ import annotations

import copyreg
import dataclasses
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, TypeVar, get_type_hints

from hydra.core.config_store import ConfigStore
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import MissingMandatoryValue, OmegaConfBaseException

from ffd_lightning import registry
from ffd_lightning.app.config import BEFORE, COMMON, GROUPS, TrainConfig
from ffd_lightning.app.messages import explain, unknown_setting
from ffd_lightning.errors import ConfigError
from ffd_lightning.registry import Entry

_Config = TypeVar("_Config")

# Nodes are made here, in no module, so they travel to other processes and back by value. What says
# that a field has no default must then stay the one object that it is.
copyreg.pickle(type(dataclasses.MISSING), lambda _: "MISSING")


@cache
def node_type(entry: Entry) -> type[Any]:
    """Return the dataclass of a part's node: `name`, its own settings, those of its whole kind.

    Raises:
        ConfigError: a setting of a type that OmegaConf does not know, or of a taken name.
    """
    what = f"{entry.kind} {entry.name!r} of {entry.provider}"
    label = "term" if entry.kind == "term" else "name"
    fields: dict[str, tuple[Any, Any]] = {label: (str, dataclasses.field(default=entry.name))}
    for schema in (entry.settings, COMMON.get(entry.kind)):
        if schema is None:
            continue
        try:
            types = get_type_hints(schema)
        except NameError as error:
            raise ConfigError(
                f"{what}: the types of its settings cannot be told: {error}"
            ) from None
        for f in dataclasses.fields(schema):
            if f.name in fields:
                raise ConfigError(
                    f"{what}: every {entry.kind} has a setting {f.name!r}; choose another name"
                )
            made = dataclasses.field(
                default=f.default, default_factory=f.default_factory, metadata=dict(f.metadata)
            )
            try:
                OmegaConf.structured(
                    dataclasses.make_dataclass("One", [(f.name, types[f.name], made)])
                )
            except OmegaConfBaseException as error:
                raise ConfigError(
                    f"{what}: its setting {f.name!r} has a type that is not known, or a default of "
                    f"another type: {str(error).splitlines()[0]}. Known are numbers, str, "
                    "bool, Path, Enum, lists and dicts of those, and dataclasses, also with | None"
                ) from None
            fields[f.name] = types[f.name], made
    made_of = [(name, kind, value) for name, (kind, value) in fields.items()]
    return dataclasses.make_dataclass(f"{entry.name}_{entry.kind}", made_of, kw_only=True)


def register(schema: type[Any]) -> None:
    """Make a schema and all parts known to Hydra."""
    store = ConfigStore.instance()
    store.store(name="schema", node=schema)
    for group, kind in GROUPS.items():
        for entry in registry.entries(kind):
            # A class of its own: jobs of joblib send theirs back pickled, which overwrites the one
            # here, with marks of missing defaults that are not this process's.
            node = node_type.__wrapped__(entry)
            store.store(group=group.replace(".", "/"), name=entry.name, node=node)


def typed_config(cfg: DictConfig | Mapping[str, Any], schema: type[_Config]) -> _Config:
    """Turn a composed or read configuration into typed settings.

    Args:
        cfg: what Hydra composed, or a file held.
        schema: of which kind it is.

    Raises:
        ConfigError: a value that must be given is missing, a part that is not here, a setting that
            does not exist, or a value of the wrong type; the message names it.
    """
    given = cfg if isinstance(cfg, DictConfig) else OmegaConf.create(dict(cfg))
    missing = sorted(str(key) for key in OmegaConf.missing_keys(given))
    if missing:
        raise ConfigError(f"these settings must be given: {', '.join(f'{k}=...' for k in missing)}")
    plain = OmegaConf.to_container(given, resolve=True)
    assert isinstance(plain, dict)
    if issubclass(schema, TrainConfig):
        plain = {group: {"name": option} for group, option in BEFORE.items()} | plain
    registry.load_plugins(plain.get("plugins") or [])
    parts = {}
    for where, kind, node in _part_nodes(plain):
        provided = plain.get("provided")
        name = node.get("term" if kind == "term" else "name", where.rpartition(".")[2])
        parts[where] = _merged(where, registry.get(kind, name, provided), node)
    for where in parts:  # they have been merged with their own schema
        _drop(plain, where)
    config = _to_object(OmegaConf.structured(schema), plain, parts)
    assert isinstance(config, schema)
    if isinstance(config, TrainConfig):
        if len(config.network.degrees) != 3:
            raise ConfigError(f"network.degrees={config.network.degrees} must be three numbers")
        first, second, third = config.network.degrees  # OmegaConf hands tuples over as lists
        config.network.degrees = (first, second, third)
    return config


def _to_object(base: DictConfig, plain: dict[Any, Any], parts: dict[str, Any]) -> Any:
    try:
        merged = OmegaConf.merge(base, plain)
    except OmegaConfBaseException as error:
        raise _named(error, "") from error
    assert isinstance(merged, DictConfig)
    OmegaConf.set_struct(merged, False)
    for where, node in parts.items():
        OmegaConf.update(merged, where, node, force_add=True, merge=False)
    try:
        return OmegaConf.to_object(merged)
    except MissingMandatoryValue as error:
        raise ConfigError(f"these settings must be given: {error.full_key}=...") from None


def _merged(where: str, entry: Entry, node: Mapping[str, Any]) -> DictConfig:
    """Return a part's node, checked against its schema."""
    typed = OmegaConf.structured(node_type(entry))
    names = [str(name) for name in typed]  # `in` would not find those that must be given
    unknown = [key for key in node if key not in names]
    if unknown:
        names = [name for name in names if name not in ("name", "term")]
        raise ConfigError(unknown_setting(where, unknown[0], names))
    try:
        merged = OmegaConf.merge(typed, dict(node))
    except OmegaConfBaseException as error:
        raise _named(error, where) from error
    assert isinstance(merged, DictConfig)
    return merged


def _named(error: OmegaConfBaseException, where: str) -> ConfigError:
    """Return one message for a value that does not fit."""
    key = ".".join(x for x in (where, str(getattr(error, "full_key", "") or "")) if x)
    reason = explain(error, where=where)
    if reason.startswith("no setting"):
        return ConfigError(reason)
    return ConfigError(f"{key}: {reason}" if key and key not in reason else reason)


def _part_nodes(plain: Mapping[Any, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield place, kind and content of every part in a configuration."""
    for where, kind in GROUPS.items():
        node: Any = plain
        for step in where.split("."):
            node = node.get(step) if isinstance(node, Mapping) else None
        if node is not None:
            yield where, kind, _mapping(where, node)
    regime = plain.get("regime")
    terms = regime.get("terms") if isinstance(regime, Mapping) else None
    for label, node in (terms or {}).items():
        yield f"regime.terms.{label}", "term", _mapping(f"regime.terms.{label}", node)


def _mapping(where: str, node: Any) -> dict[str, Any]:
    if not isinstance(node, Mapping):
        group = where.replace(".", "/")
        raise ConfigError(f"{where}={node} is a group: write {group}={node}, without spaces")
    return {str(key): value for key, value in node.items()}


def _drop(plain: dict[Any, Any], where: str) -> None:
    *path, key = where.split(".")
    node = plain
    for step in path:
        node = node[step]
    del node[key]


def part_names(config: Any) -> list[tuple[str, str]]:
    """Return (kind, name) of every part of typed settings."""
    found = []
    for where, kind in GROUPS.items():
        node = config
        for step in where.split("."):
            node = getattr(node, step, None)
        if node is not None:
            found.append((kind, node.name))
    regime = getattr(config, "regime", None)
    terms = [] if regime is None else regime.terms.values()
    return [*found, *(("term", node.term) for node in terms)]
