"""What a researcher replaces, found by kind and name: ours and that of other packages alike.

An entry is a kind ("encoder", say), a name, a dataclass of its own settings, and a factory that
takes an instance of it. `docs/extending.md` shows how a package of your own adds entries.
"""

from __future__ import annotations

import dataclasses
import difflib
import importlib
import importlib.metadata
import inspect
import logging
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import ModuleType, NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from ffd_lightning.errors import ConfigError

log = logging.getLogger(__name__)

KINDS: dict[str, str] = {
    "augmentation": "changes training images",
    "encoder": "turns images into a feature map",
    "term": "a term of the objective",
    "selection": "how template weights are taught",
    "template_strategy": "how templates are chosen",
    "source": "where shapes come from",
    "split": "which shapes are trained on, validated on, tested on",
    "protocol": "how predictions are measured",
}
"""Everything that can be replaced, and what it does."""

_WHERE, _START, _MEANING, _WITHIN = "only_where", "only_start", "meaning", "within"

ENTRY_POINTS = "ffd_lightning.plugins"
"""The group in which packages name their modules: `my_parts = "my_package.parts"`."""

_BUILT_IN = "ffd_lightning.app.parts"
_MUST_BE_GIVEN = "???"  # `omegaconf.MISSING`
_Factory = TypeVar("_Factory", bound=Callable[..., Any])


def setting(
    default: Any = dataclasses.MISSING,
    *,
    factory: Any = dataclasses.MISSING,
    only_where: bool = False,
    only_start: bool = False,
    meaning: Callable[[Any, Any], Any] | None = None,
    within: str | None = None,
) -> Any:
    """Return a dataclass field that says more about a setting than its type and default.

    Args:
        default: of the setting.
        factory: makes the default, for lists.
        only_where: it decides where or how fast something is computed, and not what comes out:
            runs that differ in nothing else are the same run.
        only_start: it decides the first weights: a checkpoint brings its own.
        meaning: returns what a value stands for, of the value and all settings beside it, where
            there are words for values, "none" for None, say, or a default follows from another
            setting: runs of one meaning are the same run, and parts are built with it.
        within: the interval of a number, or of all numbers of a list: "[0, inf)", "(0, 1]".
    """
    metadata = {_WHERE: only_where, _START: only_start, _MEANING: meaning, _WITHIN: within}
    if factory is not dataclasses.MISSING:
        return dataclasses.field(default_factory=factory, metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def is_only_where(field: dataclasses.Field[Any]) -> bool:
    """Tell whether a setting does not change what a run computes; see `setting`."""
    return bool(field.metadata.get(_WHERE))


def range_problems(settings: Any, prefix: str = "") -> list[str]:
    """Return what settings, and settings in them, have that is out of range; see `setting`.

    Args:
        settings: instance of a dataclass, or a mapping of those.
        prefix: stands before the names.
    """
    if isinstance(settings, Mapping):
        below = settings.items()
        return [x for key, value in below for x in range_problems(value, f"{prefix}{key}.")]
    found = []
    for f in dataclasses.fields(settings) if dataclasses.is_dataclass(settings) else ():
        value, within = getattr(settings, f.name), f.metadata.get(_WITHIN)
        found += range_problems(value, f"{prefix}{f.name}.")
        if within is None or value is None:
            continue
        low, high = within[1:-1].split(", ")
        opens, closes = within[0] == "(", within[-1] == ")"
        for number in value if isinstance(value, list | tuple) else (value,):
            above = float(low) < number if opens else float(low) <= number
            if not (above and (number < float(high) if closes else number <= float(high))):
                bound = f"be above {low}" if opens else f"be {low} or more"
                must = f"lie in {within}" if above or high != "inf" else bound
                found.append(f"{prefix}{f.name}={plain(value)} must {must}")
                break
    return found


def meant(settings: Any, field: dataclasses.Field[Any]) -> Any:
    """Return what the value of a field of some settings stands for; see `setting`."""
    value, meaning = getattr(settings, field.name), field.metadata.get(_MEANING)
    return value if meaning is None else meaning(value, settings)


def plain(value: Any) -> Any:
    """Return a setting's value as files keep it and command lines write it.

    >>> plain([Path("data"), (1, 2)])
    ['data', [1, 2]]
    """
    if isinstance(value, Enum):
        return value.name  # of which OmegaConf makes it again
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, dict):
        return {plain(key): plain(v) for key, v in value.items()}
    return value


def _typed(hint: Any, value: Any) -> Any:
    """Return the value of which `plain` made words.

    Raises:
        LookupError: a setting, or a word of an Enum, that there is not.
    """
    inner = [kind for kind in get_args(hint) if kind not in (NoneType, Ellipsis)]
    if value is None:
        return None
    if get_origin(hint) in (Union, UnionType):
        return _typed(inner[0], value) if len(inner) == 1 else value
    if isinstance(value, list) and inner:
        each = inner if len(inner) == len(value) else inner[:1] * len(value)
        return [_typed(kind, one) for kind, one in zip(each, value, strict=True)]
    if isinstance(value, dict) and inner:
        return {_typed(inner[0], key): _typed(inner[1], one) for key, one in value.items()}
    if isinstance(value, dict) and isinstance(hint, type) and dataclasses.is_dataclass(hint):
        hints = get_type_hints(hint)
        return hint(
            **{  # type: ignore[operator]
                name: _typed(hints[name], one) for name, one in value.items()
            }
        )
    if isinstance(hint, type) and isinstance(value, str):
        if issubclass(hint, Enum):
            return hint[value]
        if issubclass(hint, Path):
            return hint(value)
    return value


@dataclass(frozen=True)
class Part:
    """What something was built from: enough to build it again.

    Attributes:
        kind: one of `KINDS`.
        name: of the entry.
        settings: plain values by name.
        provider: see `Entry`.
    """

    kind: str
    name: str
    settings: dict[str, Any]
    provider: str

    def build(self, **context: Any) -> Any:
        """Build it again, without what only decides first weights.

        Raises:
            ConfigError: the package that it came from is not here, or does not know a setting.
        """
        entry = get(self.kind, self.name, {part_key(self.kind, self.name): self.provider})
        first = [f.name for f in dataclasses.fields(entry.settings) if f.metadata.get(_START)]
        hints, own = get_type_hints(entry.settings), {}
        for name in sorted(set(self.settings) - set(first)):
            value = self.settings[name]
            try:
                own[name] = _typed(hints[name], value)
            except LookupError:
                raise ConfigError(
                    f"the {_words(self.kind)} {self.name!r} was built with {name}={value}, which "
                    f"{entry.provider} does not know here: install the version that built it "
                    f"({self.provider})"
                ) from None
        return entry.make(entry.settings(**own), **context)


@dataclass(frozen=True)
class Entry:
    """One thing that can be chosen.

    Attributes:
        kind: one of `KINDS`.
        name: what it is called on the command line, in run folders and in checkpoints.
        settings: dataclass of its own settings; each has a default, or is `MISSING` of omegaconf.
        factory: takes an instance of `settings`, and what `docs/extending.md` lists for the kind.
        provider: the package that it comes from, "own-parts 0.1", say.
    """

    kind: str
    name: str
    settings: type[Any]
    factory: Callable[..., Any]
    provider: str

    @property
    def summary(self) -> str:
        """What it is, in one line: the first of the docstring of its settings."""
        doc = inspect.getdoc(self.settings) or ""
        first = doc.split("\n")[0]
        # A dataclass without a docstring is given one by Python: its own signature.
        return "" if first.startswith(f"{self.settings.__name__}(") else first

    def build(self, settings: Any, **context: Any) -> Any:
        """Build it from settings: anything that has the fields of `self.settings`."""
        return self.make(self.own_settings(settings), **context)

    def own_settings(self, settings: Any) -> Any:
        """Return an instance of `self.settings` with what another object has of its fields."""
        fields = dataclasses.fields(self.settings)
        own = {f.name: meant(settings, f) for f in fields}
        return self.settings(**own)

    def make(self, settings: Any, **context: Any) -> Any:
        """Build it from its own settings; what has an attribute `part` is told what it is."""
        try:
            inspect.signature(self.factory).bind(settings, **context)
        except TypeError as error:
            given = _list(["settings", *context])
            raise ConfigError(
                f"the factory of {_words(self.kind)} {self.name!r} ({self.provider}) must take "
                f"{given}: {error}"
            ) from None
        made = self.factory(settings, **context)
        if hasattr(type(made), "part"):
            own = plain(dataclasses.asdict(settings))
            made.part = Part(self.kind, self.name, own, self.provider)
        return made


_entries: dict[tuple[str, str], Entry] = {}
_loaded: set[str] = set()
_provider = "ffd_lightning"
_broken: dict[str, str] = {}  # plugins that could not be imported, and why


def register(kind: str, name: str, settings: type[Any]) -> Callable[[_Factory], _Factory]:
    """Add an entry; decorates its factory.

    Args:
        kind: one of `KINDS`.
        name: an identifier, so that it can be written on any command line.
        settings: see `Entry`.

    Raises:
        ConfigError: no such kind, a name that cannot be written, settings that are no dataclass,
            or a name that another factory has taken.
    """
    if kind not in KINDS:
        raise ConfigError(f"no kind {kind!r} to register {name!r} as: use one of {_list(KINDS)}")
    if not name.isidentifier():
        raise ConfigError(f"{kind} {name!r}: a name has letters, digits and underscores only")
    if not (isinstance(settings, type) and dataclasses.is_dataclass(settings)):
        raise ConfigError(f"{kind} {name!r}: its settings must be a dataclass, not {settings!r}")

    def add(factory: _Factory) -> _Factory:
        taken = _entries.get((kind, name))
        again = taken is not None and (
            (taken.factory.__module__, taken.factory.__qualname__)
            == (factory.__module__, factory.__qualname__)
        )
        if taken is not None and not again:  # the same factory again: its module was reloaded
            raise ConfigError(
                f"{kind} {name!r} of {factory.__module__} is taken by {taken.provider}: choose "
                "another name"
            )
        _entries[kind, name] = Entry(kind, name, settings, factory, _provider)
        return factory

    return add


def entries(kind: str) -> list[Entry]:
    """Return all entries of a kind, ours first, each package's in the order of registration."""
    load_plugins()
    found = [entry for entry in _entries.values() if entry.kind == kind]
    return sorted(found, key=lambda entry: entry.provider != "ffd_lightning")


def get(kind: str, name: str, provided: Mapping[str, str] | None = None) -> Entry:
    """Return an entry.

    Args:
        kind: one of `KINDS`.
        name: of the entry.
        provided: which package had it where a run was made ("encoder tiny" -> "own-parts 0.1").

    Raises:
        ConfigError: there is none; the message says what there is, or which package is missing.
    """
    load_plugins()
    if (kind, name) in _entries:
        return _entries[kind, name]
    key = part_key(kind, name)
    if provided and provided.get(key, "ffd_lightning") != "ffd_lightning":
        raise ConfigError(
            f"the {_words(kind)} {name!r} comes from {provided[key]}, which is not here: install "
            "that package, or name its module with plugins=[MODULE]"
        )
    choices = [entry.name for entry in entries(kind)]
    close = difflib.get_close_matches(str(name), choices, 1)
    hint = f" Did you mean {close[0]}?" if close else ""
    broken = "".join(f" ({plugin} could not be loaded: {why})" for plugin, why in _broken.items())
    raise ConfigError(f"no {_words(kind)} {name!r}.{hint} Choices: {_list(choices)}{broken}")


def part(kind: str, name: str, /, **settings: Any) -> Any:
    """Build an entry by name, for scripts: `part("source", "procedural", num_models=100)`.

    Keywords that are no settings of the entry are handed to its factory as they are.

    Raises:
        ConfigError: no such entry, a setting that it does not have, one that is not given, one that
            is out of its range, or that the entry's own `check` refuses.
    """
    if kind not in KINDS:
        raise ConfigError(f"no kind {kind!r} of parts: use one of {_list(KINDS)}")
    entry = get(kind, name)
    names = [f.name for f in dataclasses.fields(entry.settings)]
    parameters = list(inspect.signature(entry.factory).parameters.values())[1:]
    context = [p.name for p in parameters]
    unknown = sorted(set(settings) - set(names) - set(context))
    if unknown:
        raise ConfigError(
            f"{_words(kind)} {name!r} has no setting {unknown[0]!r}: {_list([*names, *context])}"
        )
    given = {key: value for key, value in settings.items() if key in names}
    own = entry.own_settings(entry.settings(**given))
    absent = [key for key in names if str(getattr(own, key)) == _MUST_BE_GIVEN]
    needed = [p for p in parameters if p.default is p.empty and p.kind is not p.VAR_KEYWORD]
    absent += [p.name for p in needed if p.name not in settings]
    if absent:
        needs = ", ".join(f"{key}=..." for key in absent)
        raise ConfigError(f"{_words(kind)} {name!r} must be given {needs}")
    if problems := range_problems(own):
        raise ConfigError(f"{_words(kind)} {name!r}: {problems[0]}")
    check = getattr(own, "check", None)
    if check is not None:
        check()
    return entry.make(own, **{k: v for k, v in settings.items() if k not in names})


def part_key(kind: str, name: str) -> str:
    """Return what a part is called where runs and checkpoints say which package it came from."""
    return f"{kind} {name}"


def load_plugins(modules: Iterable[str] = ()) -> None:
    """Import what registers entries: our own, installed packages', and modules named by a user.

    A package that cannot be imported is warned of, and named where something is missing; a module
    that the user named is an error.

    Raises:
        ConfigError: one of `modules` cannot be imported.
    """
    if _BUILT_IN not in _loaded:
        _loaded.add(_BUILT_IN)
        importlib.import_module(_BUILT_IN)
        for point in importlib.metadata.entry_points(group=ENTRY_POINTS):
            _load_entry_point(point)
    for name in modules:
        if name in _loaded:
            continue
        with _from(_distribution_of(name)):
            try:
                if "" not in sys.path:
                    sys.path.insert(0, "")  # a module in the folder where the command is run
                importlib.import_module(name)
            except Exception as error:
                raise ConfigError(
                    f"plugins={name}: cannot be imported ({type(error).__name__}: {error})"
                ) from error
        _loaded.add(name)


def providers(parts: Iterable[tuple[str, str]]) -> dict[str, str]:
    """Return which package each of the (kind, name) pairs came from, ours left out."""
    found = (get(kind, name) for kind, name in parts)
    return {
        part_key(entry.kind, entry.name): entry.provider
        for entry in found
        if entry.provider != "ffd_lightning"
    }


def _load_entry_point(point: importlib.metadata.EntryPoint) -> None:
    dist = point.dist
    provider = point.name if dist is None else f"{dist.name} {dist.version}"
    with _from(provider):
        try:
            loaded = point.load()
            if not isinstance(loaded, ModuleType):
                loaded()  # a function that registers
        except Exception as error:
            _broken[provider] = f"{type(error).__name__}: {error}"
            log.warning("the plugin %s cannot be loaded: %s", provider, _broken[provider])
    _loaded.add(point.module)


def _distribution_of(module: str) -> str:
    """Return name and version of the package that a module belongs to, else the module's name."""
    names = importlib.metadata.packages_distributions().get(module.split(".")[0])
    return f"{names[0]} {importlib.metadata.version(names[0])}" if names else f"module {module}"


@contextmanager
def _from(provider: str) -> Iterator[None]:
    global _provider
    before, _provider = _provider, provider
    try:
        yield
    finally:
        _provider = before


def _words(kind: str) -> str:
    return kind.replace("_", " ")


def _list(names: Iterable[str]) -> str:
    return ", ".join(names) or "none"
