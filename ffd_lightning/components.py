"""Components: what a researcher replaces, found by kind and name, ours and other packages' alike.

A component is one class. Its signature is its settings with their types and defaults, its docstring
is their help, its constructor is their check (it raises ValueError), and its module is where one
looks. What a constructor needs of its surroundings (`KINDS` says what there is) it names among its
parameters; those are handed over and are no settings.

Nothing heavy is imported here: built-in components are imported when they are asked for.
"""

import copy
import dataclasses
import functools
import importlib
import importlib.metadata
import inspect
import logging
import pkgutil
import sys
import traceback
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from numbers import Integral, Real
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from docstring_parser import parse

from ffd_lightning.errors import ConfigError, did_you_mean

log = logging.getLogger(__name__)

_Target = TypeVar("_Target", bound=Callable[..., Any])
MISSING: Any = "???"
"""The default of a setting that must be given, as OmegaConf writes it."""
OWN = "ffd_lightning"
ENTRY_POINTS = "ffd_lightning.plugins"
"""The group in which packages name their modules: `my_components = "my_package.components"`."""


@dataclass(frozen=True)
class Kind:
    """One kind of component.

    Attributes:
        meaning: what components of this kind do.
        context: parameters that are handed to a constructor that names them.
        built_in: our components: name -> "module:Class".
    """

    meaning: str
    context: tuple[str, ...] = ()
    built_in: dict[str, str] = dataclasses.field(default_factory=dict)


def _of(module: str, **classes: str) -> dict[str, str]:
    """Name classes of a module of ours."""
    return {name: f"{OWN}.{module}:{target}" for name, target in classes.items()}


_SPEED = ("fused", "foreach", "capturable", "differentiable", "maximize")  # of torch's optimizers
_OPTIMIZERS = {"adam": "torch.optim:Adam", "adamw": "torch.optim:AdamW", "sgd": "torch.optim:SGD"}

KINDS: dict[str, Kind] = {
    "encoder": Kind(
        "turns images into a feature map",
        ("image_size", "batch_norm_momentum"),
        _of("nn.encoders.mobilenet", mobilenet="MobileNetV1")
        | _of("nn.encoders.timm", timm="TimmEncoder"),
    ),
    "heads": Kind(
        "gives template logits and control point offsets",
        ("in_channels", "map_size", "num_templates", "num_control_points", "bottleneck", "hidden")
        + ("offset_std", "batch_norm_momentum"),
        _of("nn.heads", per_template="TemplateHeads", conditioned="ConditionedHeads"),
    ),
    "term": Kind(
        "a term of the objective",
        built_in=_of("losses.terms", chamfer="Chamfer", mean_chamfer="MeanChamfer")
        | _of("losses.terms", lattice_bending="LatticeBending", lattice_folding="LatticeFolding")
        | _of("losses.terms", negative_entropy="NegativeEntropy", offset_penalty="OffsetPenalty")
        | _of("losses.terms", uniform_penalty="UniformPenalty")
        | _of("losses.terms", sliced_wasserstein="SlicedWasserstein"),
    ),
    "selection": Kind(
        "how template weights are taught",
        built_in=_of("losses.selection", weighted="WeightedCosts", posterior="PosteriorTaught"),
    ),
    "augmentation": Kind(
        "changes training images",
        built_in=_of("imaging.augmentation", none="Unchanged", photo="PhotoAugmentation"),
    ),
    "template_strategy": Kind(
        "how templates are chosen",
        built_in=_of("data.templates.choice", auto="AutoTemplates", paper="PaperTemplates")
        | _of("data.templates.choice", medoids="MedoidTemplates", random="RandomTemplates")
        | _of("data.templates.choice", listed="ListedTemplates", ranking="ListedTemplates"),
    ),
    "source": Kind(
        "where shapes come from",
        built_in=_of("data.sources.procedural", procedural="ProceduralSource")
        | _of("data.sources.folder", folder="FolderSource")
        | _of("data.sources.shapenet", shapenet="ShapeNetSource"),
    ),
    "split": Kind(
        "which shapes are trained on, validated on, tested on",
        built_in=_of("data.splits", hash="HashSplit", auto="AutoSplit", r2n2="R2n2Split")
        | _of("data.splits", listed="ListedSplit"),
    ),
    "protocol": Kind(
        "how predictions are measured",
        built_in=_of("evaluation.protocols.paper", paper="PaperProtocol")
        | _of("evaluation.protocols.surface", modern="SurfaceProtocol", pixel2mesh="Pixel2Mesh")
        | _of("evaluation.protocols.surface", atlasnet="AtlasNet", mesh_rcnn="MeshRcnn")
        | _of("evaluation.protocols.surface", occnet="OccNet")
        | _of("evaluation.protocols.parts", parts="PartProtocol"),
    ),
    "optimizer": Kind("moves the weights", ("params", "lr", *_SPEED), _OPTIMIZERS),
    "lr_schedule": Kind(
        "what becomes of the learning rate over the run",
        ("optimizer", "total_steps"),
        _of("training.schedules", none="constant", cosine="cosine", one_cycle="one_cycle"),
    ),
    "callback": Kind("takes part in the training"),
}
"""Everything that can be replaced, and what it does."""
_DESCRIBED = ("encoder", "protocol")  # to attributes of others, a schedule's say, nothing is added

_registered: dict[tuple[str, str], tuple[Any, str]] = {}  # -> target, provider
_loaded: set[str] = set()
_provider = ""  # the installed package whose plugin is being imported
_broken: dict[str, str] = {}  # plugins that could not be imported, and why


# --- what a signature says ------------------------------------------------------------------------


@dataclass(frozen=True)
class Setting:
    """One setting: its type, its default (`MISSING` where it must be given) and its help."""

    hint: Any
    default: Any = MISSING
    help: str = ""


@dataclass(frozen=True)
class Range:
    """The interval that numbers must lie in, for `Annotated`: "[0, inf)", "(0, 1]"."""

    interval: str


Positive = Annotated[int, Range("(0, inf)")]
NotNegative = Annotated[int, Range("[0, inf)")]


def settings_of(target: Any, context: tuple[str, ...] = ()) -> dict[str, Setting]:
    """Return the settings that a signature, or a dataclass, declares, without its `context`.

    A class's attribute `settings_like`, "module:Class", names a signature that has the defaults and
    help that it lacks.
    """
    return _settings_of(target, context)


@functools.cache
def _settings_of(target: Any, context: tuple[str, ...]) -> dict[str, Setting]:
    helps = _helps(target)
    factories: dict[str, Any] = {}
    if dataclasses.is_dataclass(target):
        factories = {f.name: f.default_factory for f in dataclasses.fields(target)}
    like = getattr(target, "settings_like", None)
    others = settings_of(pkgutil.resolve_name(like)) if like else {}
    found = {}
    for p in inspect.signature(target).parameters.values():
        if p.name in context or p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD):
            continue
        other = others.get(p.name, Setting(Any))
        default = other.default if p.default is p.empty else p.default
        if factories.get(p.name, dataclasses.MISSING) is not dataclasses.MISSING:
            default = factories[p.name]()  # in the signature it is a sentinel
        if _is_plain(plain(None if default is p.empty else default)):  # else no file can hold it
            found[p.name] = Setting(_hint(target, p), default, helps.get(p.name) or other.help)
    return found


def _hint(target: Any, parameter: inspect.Parameter) -> Any:
    """Return the type of one parameter; `Any` where its name exists for type checkers only."""
    if parameter.annotation is parameter.empty:
        return Any
    # Alone, since one that cannot be resolved would take all others with it.
    alone = types.SimpleNamespace(__annotations__={"hint": parameter.annotation})
    for each in _bases(target):
        try:
            names = vars(sys.modules[each.__module__])
            return get_type_hints(alone, names, include_extras=True)["hint"]
        except NameError:
            continue
    return Any


def _bases(target: Any) -> list[Any]:
    """Return a class and those it inherits from, as far as parameters can come from them."""
    if not inspect.isclass(target):
        return [inspect.unwrap(target)]
    return [each for each in target.__mro__ if each is not object]


def _helps(target: Any) -> dict[str, str]:
    """Return what docstrings say of parameters; those of inherited ones are found, too."""
    found: dict[str, str] = {}
    for each in reversed(_bases(target)):
        for doc in (each.__doc__, getattr(vars(each).get("__init__"), "__doc__", "")):
            for p in parse(doc or "").params:
                for name in p.arg_name.split(","):
                    found[name.strip()] = " ".join((p.description or "").split())
    return found


def summary(target: Any) -> str:
    """Return the first line of a docstring, "" without one."""
    first = inspect.cleandoc(target.__doc__ or "").split("\n")[0]
    # A dataclass without a docstring is given its own signature.
    return "" if first.startswith(f"{getattr(target, '__name__', '')}(") else first


# --- plain values and types -----------------------------------------------------------------------


def plain(value: Any) -> Any:
    """Return a value as files keep it and command lines write it.

    >>> plain([Path("data"), (1, 2)])
    ['data', [1, 2]]
    """
    if hasattr(value, "tolist"):  # of NumPy
        return value.tolist()
    if isinstance(value, Enum):
        return value.name
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    return value


def _is_plain(value: Any) -> bool:
    if isinstance(value, list | Mapping):
        return all(map(_is_plain, value.values() if isinstance(value, Mapping) else value))
    return value is None or isinstance(value, str | int | float)


class _WrongType(ConfigError):
    """A value is of another type."""


# Types of settings, and the types of values that can become one.
_SCALARS: dict[Any, tuple[type, ...]] = {
    bool: (bool,),
    int: (Integral,),  # numpy's, too
    float: (Real,),
    str: (str, int, float, Path),
    Path: (str, int, float, Path),
}


def typed(hint: Any, value: Any, where: str) -> Any:
    """Return a plain value as what a signature asks for; `where` names it in messages.

    Types are numbers, with a `Range` or without, str, bool, Path, Literal, Enums by their names,
    lists, tuples and dicts of those, dataclasses, and unions. Values of other types are passed on.

    Raises:
        ConfigError: it is of another type, or out of its range.

    >>> typed(tuple[int, ...], [3, 3], "degrees"), typed(float | None, 1, "rate")
    ((3, 3), 1.0)
    """
    origin, args = get_origin(hint), get_args(hint)
    kind = origin or hint
    if kind in (typing.Union, types.UnionType):
        inner: list[_WrongType] = []  # of values that it holds
        for each in filter(described, args):
            try:
                return typed(each, value, where)
            except _WrongType as error:
                inner += [error] * (not str(error).startswith(f"{where}="))
        if inner:
            raise inner[0]
    elif kind is Annotated:
        found = typed(args[0], value, where)
        ranges = [each.interval for each in args[1:] if isinstance(each, Range)]
        if problems := list(filter(None, (_range_problem(where, found, r) for r in ranges))):
            raise ConfigError(problems[0])
        return found
    elif kind in _SCALARS:
        if isinstance(value, _SCALARS[kind]) and isinstance(value, bool) == (kind is bool):
            return Path(str(value)).expanduser() if kind is Path else kind(value)
    elif kind is type(None):
        if value is None:
            return None
    elif isinstance(kind, type) and issubclass(kind, Enum):
        if isinstance(value, kind):
            return value
        if isinstance(value, str) and value in kind.__members__:
            return kind[value]
    elif kind is Literal:
        if any(value == each and type(value) is type(each) for each in args):
            return value
    elif dataclasses.is_dataclass(kind):
        if isinstance(value, Mapping):
            return build(kind, value, where)
        if isinstance(value, typing.cast(type, kind)):
            return value
    elif kind in (list, tuple):
        if isinstance(value, list | tuple):
            return _sequence(kind, args, value, where)
    elif kind in (dict, Mapping):
        if isinstance(value, Mapping):
            of = args[1] if args else Any
            return {str(k): typed(of, v, f"{where}.{k}") for k, v in value.items()}
    else:
        return value
    near = did_you_mean(str(value), [*map(str, choices(hint))])
    raise _WrongType(f"{where}={written(value)} must be {described(hint)}.{near}".rstrip("."))


def _sequence(kind: type, args: tuple[Any, ...], value: Any, where: str) -> Any:
    if kind is tuple and args and args[-1] is not Ellipsis:
        if len(value) != len(args):
            raise ConfigError(f"{where}={written(value)} must be {len(args)} values")
        return tuple(typed(h, v, where) for h, v in zip(args, value, strict=True))
    of = args[0] if args else Any
    return kind(typed(of, each, where) for each in value)


def choices(hint: Any) -> tuple[Any, ...]:
    """Return the values that a type has, () where they are not counted."""
    if isinstance(hint, type) and issubclass(hint, Enum):
        return tuple(hint.__members__)
    return get_args(hint) if get_origin(hint) is Literal else ()


def described(hint: Any) -> str:
    """Return a type in words, "" for one that `typed` does not check.

    >>> described(int | None), described(Literal["val", "test"])
    ('a whole number or null', 'one of val, test')
    """
    kind, args = get_origin(hint) or hint, get_args(hint)
    if choices(hint):
        return f"one of {', '.join(map(written, choices(hint)))}"
    if kind is Annotated:
        return described(args[0])
    if kind in (typing.Union, types.UnionType):
        return " or ".join(filter(None, map(described, args)))
    if kind in (list, tuple):
        return "a list of whole numbers" if int in args else "a list such as [a,b]"
    if kind in (dict, Mapping) or dataclasses.is_dataclass(kind):
        return "settings by name"
    words = {int: "a whole number", float: "a number", bool: "true or false", str: "text"}
    return (words | {Path: "a file's name", type(None): "null"}).get(kind, "")


def written(value: Any) -> str:
    """Return a value as it is written on a command line.

    >>> written([1, True, None]), written({"a": 0.5})
    ('[1,true,null]', '{a:0.5}')
    """
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{','.join(map(written, value))}]"
    if isinstance(value, Mapping):
        return f"{{{','.join(f'{k}:{written(v)}' for k, v in value.items())}}}"
    return str(plain(value))


def check_ranges(values: Mapping[str, Any], /, **within: str) -> None:
    """Make sure that settings lie in intervals; for constructors: `check_ranges(locals(), ...)`.

    Intervals are written as "[0, inf)", "(0, 1]". Of a list each number counts; None passes.

    Raises:
        ValueError: one does not; the message begins with its name.
    """
    for name, interval in within.items():
        if problem := _range_problem(name, values[name], interval):
            raise ValueError(problem)


def _range_problem(name: str, value: Any, interval: str) -> str:
    low, high = interval[1:-1].split(", ")
    for number in value if isinstance(value, list | tuple) else (value,):
        if number is None:
            continue
        above = float(low) < number if interval[0] == "(" else float(low) <= number
        below = number < float(high) if interval[-1] == ")" else number <= float(high)
        if above and below:
            continue
        bound = f"be above {low}" if interval[0] == "(" else f"be {low} or more"
        must = f"lie in {interval}" if above or high != "inf" else bound
        return f"{name}={written(value)} must {must}"
    return ""


# --- building -------------------------------------------------------------------------------------


def read(known: Mapping[str, Setting], given: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return typed settings: those given, and the defaults of the others."""
    dot = f"{where}." if where else ""
    for key in given:
        if key not in known:
            near, place = did_you_mean(key, list(known), dot), f" in {where}" if where else ""
            raise ConfigError(f"no setting '{dot}{key}'.{near} Settings{place}: {_list(known)}")
    values = {key: given.get(key, setting.default) for key, setting in known.items()}
    missing = [key for key, value in values.items() if isinstance(value, str) and value == MISSING]
    if missing:
        needs = ", ".join(f"{dot}{key}=..." for key in missing)
        raise ConfigError(f"these settings must be given: {needs}")
    return {
        key: typed(s.hint, given[key], f"{dot}{key}") if key in given else copy.deepcopy(s.default)
        for key, s in known.items()
    }


def build(target: Any, given: Mapping[str, Any], where: str) -> Any:
    """Call a class with plain settings, and defaults for the others.

    `where` is the settings' place, for messages: "encoder", say.

    Raises:
        ConfigError: a setting that does not fit, or that the constructor refuses.
    """
    return called(target, where, **read(settings_of(target), given, where))


def _abstract(target: type) -> list[str]:
    """Return the methods that a class should have, and has not: bases need not be ABCs."""
    members = inspect.getmembers_static(target)
    return [name for name, each in members if getattr(each, "__isabstractmethod__", False)]


def called(target: Any, place: str, /, **given: Any) -> Any:
    """Call a constructor: its "width=0 must be ..." is "encoder.width=0 must be ..." to users."""
    try:
        return target(**given)
    except ValueError as error:
        own = str(error).partition("=")[0] in given
        prefix = f"{place}{'.' if own else ': '}" if place else ""
        raise ConfigError(f"{prefix}{error}") from error


@dataclass(frozen=True)
class Component:
    """A component that is chosen: what configurations and checkpoints hold of it.

    Settings are plain values; `where` is its place in a configuration, for messages.
    """

    kind: str
    name: str
    settings: Mapping[str, Any]
    provider: str = OWN
    where: str = ""

    def build(self, **context: Any) -> Any:
        """Build it; `context` is handed over as far as the class names it.

        Raises:
            ConfigError: its package is not here, its settings do not fit, or it lacks one of its
                kind's methods.
        """
        target, whose = find(self.kind, self.name, self.provider), provider(self.kind, self.name)
        if _package(whose) != _package(self.provider) and self.provider != OWN:
            named = _words(self.kind), self.name, self.provider, whose
            log.warning("the %s %r came from %s; that of %s is taken", *named)
        where = self.where or f"{_words(self.kind)} {self.name}"
        if inspect.isclass(target) and (absent := ", ".join(_abstract(target))):
            raise ConfigError(f"{where}: {target.__name__} of {target.__module__} lacks {absent}")
        given = read(settings(self.kind, self.name), self.settings, where)
        parameters = inspect.signature(target).parameters
        handed = {key: value for key, value in context.items() if key in parameters}
        made = called(target, where, **given, **handed)
        if self.kind in _DESCRIBED and getattr(made, "component", None) is None:
            # A function made it, or a class that was registered from elsewhere.
            own = dataclasses.replace(self, settings=plain(given), provider=whose)
            with suppress(AttributeError):  # of what is nothing of this kind
                object.__setattr__(made, "component", own)
        return made


# --- registering and finding ----------------------------------------------------------------------


def component(kind: str, name: str) -> Callable[[_Target], _Target]:
    """Give a class the name by which command lines, run folders and checkpoints know it.

    Encoders and protocols have an attribute `component`, which says what they were made of: also
    of those made in scripts, checkpoints and results say it. Classes of other packages,
    `component("optimizer", "adamw")(torch.optim.AdamW)`, stay as they are.

    Args:
        kind: one of `KINDS`.
        name: an identifier, so that it can be written on any command line.

    Raises:
        ConfigError: no such kind, a name that cannot be written, or one that is taken.
    """
    _check_kind(kind)
    if not name.isidentifier():
        raise ConfigError(f"{kind} {name!r}: a name has letters, digits and underscores only")
    caller = sys._getframe(1).f_globals.get("__name__", "")
    ours = caller.split(".")[0] == OWN  # also where a plugin is the first to import it
    owner = OWN if ours else _provider or _distribution_of(caller)

    def add(target: _Target) -> _Target:
        place = f"{target.__module__}:{target.__qualname__}"
        there, whose = _registered.get((kind, name), (None, OWN))
        taken = KINDS[kind].built_in.get(name, place)
        if there is not None:
            taken = f"{there.__module__}:{there.__qualname__}"
        if taken != place:  # the same class again: its module was reloaded
            raise ConfigError(
                f"{kind} {name!r} of {target.__module__} is taken by {whose}: choose another name"
            )
        if kind in _DESCRIBED and inspect.isclass(target) and target.__module__ == caller:
            _remember(target, kind, name)
        _registered[kind, name] = target, owner
        return target

    return add


def _remember(target: Any, kind: str, name: str) -> None:
    """Have objects of a class know what they were made of, also those made in scripts."""
    init = target.__init__

    @functools.wraps(init)
    def remembering(self: Any, *args: Any, **kwargs: Any) -> None:
        if type(self) is not target:
            return init(self, *args, **kwargs)
        signature = inspect.signature(init)
        given = signature.bind(self, *args, **kwargs).arguments
        variable = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
        for parameter in signature.parameters.values():
            if parameter.kind in variable and given.get(parameter.name):
                place = f"{_words(kind)} {name}: what is given by *{parameter.name}"
                raise ConfigError(f"{place} would not be kept: let the constructor name it")
        own = settings_of(target, KINDS[kind].context)
        settings = {key: plain(given.get(key, s.default)) for key, s in own.items()}
        init(self, *args, **kwargs)
        made_of = Component(kind, name, settings, provider(kind, name))
        object.__setattr__(self, "component", made_of)  # also where they are frozen

    target.__init__ = remembering


def names(kind: str) -> list[str]:
    """Return the names of all components of a kind, ours first."""
    load_plugins()
    return list(dict.fromkeys([*KINDS[kind].built_in, *(n for k, n in _registered if k == kind)]))


def find(kind: str, name: str, from_package: str = OWN) -> Any:
    """Return the class of a component, which came `from_package` when it was written down.

    Raises:
        ConfigError: there is none; the message says what there is, or which package is missing.
    """
    load_plugins()
    if (kind, name) not in _registered and name in KINDS[kind].built_in:
        target = pkgutil.resolve_name(KINDS[kind].built_in[name])
        _registered.setdefault((kind, name), (target, OWN))  # torch's classes register nothing
    if (kind, name) in _registered:
        return _registered[kind, name][0]
    if from_package != OWN and from_package not in (whose for _, whose in _registered.values()):
        raise ConfigError(
            f"the {_words(kind)} {name!r} comes from {from_package}, which is not here: install "
            "that package, or name its module with plugins=[MODULE]"
        )
    there = names(kind)
    hint = "" if there else "; packages, and modules named by plugins=[MODULE], bring them"
    broken = "".join(f" ({plugin} could not be loaded: {why})" for plugin, why in _broken.items())
    hint = f"{did_you_mean(name, there)} Choices: {_list(there)}{hint}{broken}"
    raise ConfigError(f"no {_words(kind)} {name!r}.{hint}")


def settings(kind: str, name: str) -> dict[str, Setting]:
    """Return the settings of a component, by name."""
    return settings_of(find(kind, name), KINDS[kind].context)


def provider(kind: str, name: str) -> str:
    """Return the package that a component comes from, "own-components 0.1", say."""
    find(kind, name)
    return _registered[kind, name][1]


def _package(provider: str) -> str:
    """Return whom a component is from, whatever the version."""
    return provider if provider.startswith("module ") else provider.partition(" ")[0]


def make(kind: str, name: str, /, **given: Any) -> Any:
    """Build a component by name, for scripts: `make("source", "procedural", num_models=100)`.

    What it names of its kind's context is given as its settings are.

    Raises:
        ConfigError: no such component, or a setting that does not fit.
    """
    _check_kind(kind)
    context = {key: value for key, value in given.items() if key in KINDS[kind].context}
    own = {key: value for key, value in given.items() if key not in context}
    return Component(kind, name, own).build(**context)


# --- plugins --------------------------------------------------------------------------------------


def load_plugins(modules: Iterable[str] = ()) -> None:
    """Import what registers components: installed packages', and modules named by a user.

    A package that cannot be imported is warned of, and named where something is missing; a module
    that the user named is an error.
    """
    global _provider
    if ENTRY_POINTS not in _loaded:
        _loaded.add(ENTRY_POINTS)
        for point in importlib.metadata.entry_points(group=ENTRY_POINTS):
            whose = point.name if point.dist is None else f"{point.dist.name} {point.dist.version}"
            _provider = whose
            try:
                point.load()
            except Exception as error:
                _broken[whose] = _with_place(error)
                log.warning("the plugin %s cannot be loaded: %s", whose, _broken[whose])
            _loaded.add(point.module)
        _provider = ""
    for name in modules:
        if name in _loaded:
            continue
        if "" not in sys.path:
            sys.path.insert(0, "")  # a module in the folder where the command is run
        try:
            importlib.import_module(name)
        except Exception as error:
            log.debug("plugins=%s", name, exc_info=True)
            why = _with_place(error)
            raise ConfigError(f"plugins={name}: cannot be imported: {why}") from error
        _loaded.add(name)


def _with_place(error: BaseException) -> str:
    """Return an error of somebody else's module with its place: `NameError: ... (file.py:3)`."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if "importlib" not in f.filename and f.filename != __file__]
    place = f" ({own[-1].filename}:{own[-1].lineno})" if own else ""
    return f"{type(error).__name__}: {error}{place}"


@functools.cache
def _distribution_of(module: str) -> str:
    """Return name and version of the package that a module belongs to, else the module's name."""
    found = importlib.metadata.packages_distributions().get(module.split(".")[0])
    return f"{found[0]} {importlib.metadata.version(found[0])}" if found else f"module {module}"


def _check_kind(kind: str) -> None:
    if kind not in KINDS:
        raise ConfigError(f"no kind {kind!r} of components: use one of {_list(KINDS)}")


def _words(kind: str) -> str:
    return kind.replace("_", " ")


def _list(values: Iterable[str]) -> str:
    return ", ".join(values) or "none"
