"""The configuration: composed by Hydra from what signatures and `conf/` say, then typed.

Hydra is given plain values, without types: a component's settings are those of its signature, all
other settings are fields of `app.config`. `typed_config` then checks everything at once, names
included: every `key=value` is handed to Hydra as one that may be new.
"""

import contextlib
import dataclasses
import logging
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial, update_wrapper
from pathlib import Path
from typing import Any, TypeVar, get_origin

import hydra
from hydra import compose, initialize_config_dir
from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra._internal.utils import get_args_parser
from hydra.core.config_store import ConfigStore
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Glob, Override
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf

from ffd_lightning import components
from ffd_lightning.app.config import GROUPS, HOLDERS, LISTS, Data, Encoder
from ffd_lightning.app.messages import SHOWN, explain
from ffd_lightning.components import OWN, Component, Setting, settings_of
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.files import write_atomic
from ffd_lightning.run_folder import RunFolder

log = logging.getLogger(__name__)
# Hydra shows what is logged as information. Here, as jobs in other processes load this too.
logging.getLogger("matplotlib").setLevel(logging.WARNING)

_Config = TypeVar("_Config")
_PACKAGE = Path(__file__).parents[1]
_COMPONENT = {f.name for f in dataclasses.fields(Component)}

RENAMED: dict[str, str] = {
    "data.residency": "trainer.residency",
    "schedule.val_every": "trainer.val_every",
    "schedule.checkpoint_every": "trainer.checkpoint_every",
    "schedule.learning_rate_decay": "lr_schedule",
    "encoder.pretrained": "encoder.weights=pretrained",
    "category.symmetric": "regime.mirror_offsets",
}
"""Settings of earlier versions, and what does the same now."""


def label_of(kind: str) -> str:
    """Return the key under which a configuration names the component of a group."""
    return "term" if kind == "term" else "name"


def common_settings(kind: str) -> dict[str, Setting]:
    """Return the settings that all components of a kind have, beside their own."""
    found = settings_of(HOLDERS[kind]) if kind in HOLDERS else {}
    return {name: setting for name, setting in found.items() if name not in _COMPONENT}


def all_settings(kind: str, name: str) -> dict[str, Setting]:
    """Return the settings of a component, its own and those of its kind."""
    own, common = components.settings(kind, name), common_settings(kind)
    taken = [key for key in own if key in common or key == label_of(kind)]
    if taken:
        raise ConfigError(
            f"{kind} {name!r} of {components.provider(kind, name)}: every {kind} has a setting "
            f"{taken[0]!r}; choose another name"
        )
    return own | common


def nodes(settings: Mapping[str, Setting]) -> dict[str, Any]:
    """Return settings as Hydra composes them: plain defaults, "???" for what must be given."""
    found = {}
    for name, setting in settings.items():
        hint = setting.hint
        if isinstance(hint, type) and issubclass(hint, Component):
            continue  # the group's option brings it
        if dataclasses.is_dataclass(hint):
            found[name] = nodes(settings_of(hint))
        else:
            found[name] = {} if get_origin(hint) is Mapping else components.plain(setting.default)
    return found


def _places(schema: type[Any]) -> Iterator[tuple[str, str]]:
    """Yield place and kind of the components that a command chooses."""
    fields = settings_of(schema)
    yield from ((w, k) for w, k in {**GROUPS, **LISTS}.items() if w.split(".")[0] in fields)


def typed_config(cfg: DictConfig | Mapping[str, Any], schema: type[_Config]) -> _Config:
    """Turn what Hydra composed, or a file held, into typed settings of a command.

    Raises:
        ConfigError: something is missing, does not exist or does not fit; the message names it.
    """
    given = cfg if isinstance(cfg, DictConfig) else OmegaConf.create(dict(cfg))
    plain: Any = OmegaConf.to_container(given, resolve=True)
    for old in RENAMED.keys() & flat(plain).keys():
        raise ConfigError(f"the setting {old} of earlier versions is {RENAMED[old]} now")
    if isinstance(plain.get("plugins"), str):
        plain["plugins"] = [plain["plugins"]]
    components.load_plugins(plain.get("plugins") or [])
    provided, chosen = plain.get("provided") or {}, list[Component]()
    for where, kind in _places(schema):
        above, _, key = where.rpartition(".")
        group = plain
        if above:
            group = plain[above] = _mapping(above, plain.get(above))
        if where not in LISTS:
            group[key] = choose(kind, group.get(key), where, provided)
            chosen.append(group[key])
            continue
        labelled = _mapping(where, group.get(key)).items()
        group[key] = {name: choose(kind, x, f"{where}.{name}", provided) for name, x in labelled}
        chosen += group[key].values()
    if "provided" in settings_of(schema):
        plain["provided"] = {f"{x.kind} {x.name}": x.provider for x in chosen if x.provider != OWN}
    return components.build(schema, plain, "")


def choose(kind: str, node: Any, where: str, provided: Mapping[str, str] = {}) -> Component:
    """Return what a group of a configuration, `where`, chooses: `node` has its name and settings.

    `provided` tells from which packages components came when the configuration was written.
    """
    values, label = _mapping(where, node), label_of(kind)
    name = str(values.pop(label, where.rpartition(".")[2]))
    components.find(kind, name, provided.get(f"{kind} {name}", OWN))
    common = common_settings(kind)
    typed = components.read(all_settings(kind, name), values, where)
    return components.called(
        HOLDERS.get(kind, Component),
        where,
        kind=kind,
        name=name,
        settings={k: components.plain(v) for k, v in typed.items() if k not in common},
        provider=components.provider(kind, name),
        where=where,
        **{k: v for k, v in typed.items() if k in common},
    )


def _mapping(where: str, node: Any) -> dict[str, Any]:
    if isinstance(node, Mapping):
        return {str(key): value for key, value in node.items()}
    group = where.replace(".", "/")
    if node is None:
        raise ConfigError(f"these settings must be given: {group}=...")
    raise ConfigError(f"{where}={node} is a group: write {group}={node}, without spaces")


def content(node: Any) -> Any:
    """Return typed settings as plain values, as `config.yaml` keeps them."""
    if isinstance(node, Component):
        names = [f.name for f in dataclasses.fields(node) if f.name not in _COMPONENT]
        common = {name: content(getattr(node, name)) for name in names}
        if isinstance(node, Encoder):
            common["weights"] = node.first_weights
        if isinstance(node, Data):
            common["variants"] = node.asked_variants
        return {label_of(node.kind): node.name, **node.settings, **common}
    if dataclasses.is_dataclass(node):
        return {f.name: content(getattr(node, f.name)) for f in dataclasses.fields(node)}
    if isinstance(node, Mapping):
        return {str(key): content(value) for key, value in node.items()}
    return components.plain(node)


def flat(node: Any, prefix: str = "") -> dict[str, Any]:
    """Return plain settings by the names that they have on a command line.

    >>> flat({"seed": 0, "data": {"render": {"width": 4}}})
    {'seed': 0, 'data.render.width': 4}
    """
    if not isinstance(node, Mapping):
        return {prefix.removesuffix("."): node}
    return {k: v for key, value in node.items() for k, v in flat(value, f"{prefix}{key}.").items()}


def differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """Return the names of settings that are not equal, or not in both."""
    return [k for k in sorted({*before, *after}) if before.get(k) != after.get(k)]


def config_folder(name: str = "conf") -> Path:
    """Return the folder of configurations, of studies or others: `conf`, `sweeps`.

    In a checkout it is at the top, in an installed package, which has these two, inside of it.
    """
    inside = _PACKAGE / name
    return inside if inside.is_dir() else _PACKAGE.parent / name


def named_plugins(arguments: Sequence[str]) -> list[str]:
    """Return the modules that `plugins=` names on a command line.

    >>> named_plugins(["regime=e", "plugins=[my_module,more.module]"])
    ['my_module', 'more.module']
    """
    given = [x for x in arguments if re.match(r"\+{0,2}plugins=", x)]
    values = [x.value() for x in OverridesParser.create().parse_overrides(given)]
    return [str(name) for v in values for name in (v if isinstance(v, list) else [v]) if name]


def chooses(override: Override) -> bool:
    """Tell whether an override chooses an option of a group: others set a value."""
    key = override.key_or_group
    listed = key in LISTS and bool(components.names(LISTS[key]))
    named = key in GROUPS and "." not in key
    return "/" in key or named or listed or (config_folder() / key).is_dir()


def _group(where: str) -> str:
    """Return Hydra's group of a place in the configuration: `regime/term` of `regime.terms`."""
    group = where.replace(".", "/")
    return group.removesuffix("s") if where in LISTS else group


def _for_hydra(overrides: Sequence[str], schema: type[Any], several: bool) -> list[str]:
    """Return overrides as Hydra is to read them: what sets a value may name what is not there."""
    found, own = [], settings_of(schema)
    for override in OverridesParser.create().parse_overrides(list(overrides)):
        text, key = str(override.input_line), override.key_or_group
        if override.is_sweep_override() and not several:
            raise ConfigError(
                f"{text}: commas separate values. Several are a list, key=[a,b]; one that has a "
                "comma is quoted twice, 'key=\"a,b\"'; a sweep needs -m"
            )
        value = override.value()
        if key in LISTS and not components.names(LISTS[key]):  # no group: nothing is registered
            components.find(LISTS[key], value[0] if isinstance(value, list) else str(value))
        if override.is_hydra_override() or override.is_delete():
            found.append(text)
        elif chooses(override):
            group = key.split("/")[0]
            if group not in own:
                components.read(own, {group: value}, "")  # names what there is
            if isinstance(value, int | float):
                raise ConfigError(f"{text}: an option is a name, not a number: templates=t30, say")
            if isinstance(value, list) and key not in map(_group, LISTS):
                names = ",".join(map(str, value))  # Hydra would take the last
                joint = f"; one network for all: category=joint category.members=[{names}]"
                end = joint if key == "category" else ""
                each = f"a training for each: ffd train -m {key}={names}"
                raise ConfigError(f"{text}: one is chosen, not several; {each}{end}")
            found.append(text)
        else:
            found.append(f"++{text.lstrip('+')}")
    return found


def jobs(sweep: Sequence[str]) -> list[list[str]]:
    """Return the jobs of a sweep as Hydra makes them, without its own settings.

    Patterns of options are left out, so that the defaults take their places.

    >>> jobs(["regime=b,e", "seed=0"])
    [['regime=b', 'seed=0'], ['regime=e', 'seed=0']]
    """
    parsed = OverridesParser.create().parse_overrides([x for x in sweep if x[:5] != "hydra"])
    plain = [override for override in parsed if not isinstance(override.value(), Glob)]
    (batch,) = BasicSweeper.split_arguments(plain, None)
    return [list(job) for job in batch]


def prepare_hydra(schema: type[Any], arguments: Sequence[str]) -> None:
    """Tell Hydra a command's settings, the components that it can choose, and resolvers."""
    from ffd_lightning.app import identity

    components.load_plugins(named_plugins(arguments))
    store = ConfigStore.instance()
    store.store(name="schema", node=nodes(settings_of(schema)))
    for where, kind in _places(schema):
        for name in components.names(kind):
            node = {label_of(kind): name, **nodes(all_settings(kind, name))}
            package = f"{where}.{name}" if where in LISTS else where
            store.store(group=_group(where), name=name, node=node, package=package)
    for resolver in (identity.run_folder, identity.run_suffix):
        OmegaConf.register_new_resolver(resolver.__name__, resolver, replace=True)


def compose_config(
    name: str, schema: type[Any], overrides: Sequence[str], extra: str | None = None
) -> DictConfig:
    """Compose a configuration of `conf/`; `extra` is a folder of options, as --config-dir.

    Raises:
        ConfigError, HydraException: an override that does not fit.
    """
    prepare_hydra(schema, overrides)
    given = _for_hydra(overrides, schema, several=False)
    if extra is not None:
        given.append(f"hydra.searchpath=[file://{Path(extra).absolute()}]")
    with initialize_config_dir(str(config_folder()), version_base="1.3"):
        return compose(name, given)


def run_hydra(
    name: str,
    schema: type[Any],
    run: Callable[[Any], Any],
    arguments: Sequence[str],
    counted: bool = False,
) -> None:
    """Run a command as a Hydra application, once its first job, and all values, are well spelled.

    `run` takes the typed settings and returns the job's result. With `counted`, a callback of the
    configuration counts the jobs of a multirun that have failed.
    """
    given = sorted(arguments, key=lambda a: a not in ("-m", "--multirun"))  # wherever it stands
    args, _ = get_args_parser().parse_known_args(given)
    if args.help:
        from ffd_lightning.app.help import command_help

        components.load_plugins(named_plugins(given))
        print(command_help(name, schema, args.config_dir, everything="all" in given))
        return
    prepare_hydra(schema, given)
    overrides = _for_hydra(args.overrides, schema, several=args.multirun)
    if not (args.hydra_help or args.info):
        _check_jobs(name, schema, overrides, args.config_dir)
    spelled = dict(zip(args.overrides, overrides, strict=True))
    sys.argv[1:] = [spelled.get(argument, argument) for argument in given]
    # Hydra names the log after the function's module: the command's, not functools.
    job = update_wrapper(partial(_job, schema, run, counted), run)
    main = hydra.main(version_base="1.3", config_path=str(config_folder()), config_name=name)
    main(job)()


def _check_jobs(
    name: str, schema: type[Any], overrides: Sequence[str], config_dir: str | None
) -> None:
    """Raise a ConfigError if the first job, or a value that another has, does not fit."""
    from ffd_lightning.app.identity import without_suffix

    first, *others = jobs(overrides)
    composed = OmegaConf.to_container(compose_config(name, schema, first, config_dir))
    settings = without_suffix(composed)
    typed_config(settings, schema)
    # Composing each job would take most of a second.
    for text in sorted({x for job in others for x in job} - {*first}):
        override = OverridesParser.create().parse_override(text)
        if not (chooses(override) or override.is_delete()):
            changed = OmegaConf.create(settings)
            key, value = override.key_or_group, without_suffix(override.value())
            OmegaConf.update(changed, key, value, merge=False, force_add=True)
            typed_config(changed, schema)


def _job(schema: type[Any], run: Callable[[Any], Any], counted: bool, cfg: DictConfig) -> Any:
    """Run one job; in a multirun, one that fails does not stop the others."""
    try:
        return run(typed_config(cfg, schema))
    except SHOWN as error:
        if HydraConfig.get().mode is not RunMode.MULTIRUN:
            if counted:
                _remove_log_of_no_run()
            # Not as an exception: Hydra would put a line of its own above it.
            sys.exit(f"error: {explain(error)}")
        if counted:
            log.error("%s", explain(error))  # to the log in the job's folder too
            run_folder = RunFolder(Path(HydraConfig.get().runtime.output_dir))
            if not run_folder.config.exists():  # for the sweep's table
                write_atomic(run_folder.config, OmegaConf.to_yaml(cfg))
                run_folder.set_status("failed", reason=explain(error))
            return None
        print(f"error: {explain(error)}", file=sys.stderr)
        # Hydra runs the other jobs, and shows the first of all exceptions at the end.
        raise DataError("not all jobs came to their end: see the messages above") from None


def _remove_log_of_no_run() -> None:
    """Remove the folder that Hydra made for the log of a run that was refused at once."""
    known = HydraConfig.get()
    folder, top = Path(known.runtime.output_dir), Path(known.sweep.dir).absolute().parent
    if [file.name for file in folder.iterdir()] != [f"{known.job.name}.log"]:
        return
    with contextlib.suppress(OSError):  # a folder that holds something else stays
        next(folder.iterdir()).unlink()
        for path in (folder, *(p for p in folder.parents if p.is_relative_to(top))):
            path.rmdir()
