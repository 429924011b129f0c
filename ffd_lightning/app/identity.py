"""Which settings make two runs the same; names of folders and resuming derive from it.

The one declaration is in the schema: what is marked `only_where` there, and in the settings of
parts, says where or how fast something is computed. All other settings decide what comes out.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning.app.config import EvaluateConfig, TrainConfig
from ffd_lightning.app.schema import typed_config
from ffd_lightning.errors import ConfigError
from ffd_lightning.files import write_atomic
from ffd_lightning.registry import is_only_where, meant, plain
from ffd_lightning.run_folder import RunFolder

_PLACED = ("category.name", "regime.name", "templates.name", "seed")  # the folder's path has them
_PLACED_GROUPS = ("category", "regime", "templates")
_LONGEST = 40  # characters of a name's readable part
_HASH = 6  # hexadecimal digits


def identity(config: Any) -> dict[str, Any]:
    """Return what decides a run, flat: plain values by the name that they have on a command line.

    >>> from ffd_lightning.app.config import ScheduleConfig
    >>> decides = identity(ScheduleConfig("quick", 300, 32, 1024, 1e-3, annealing_steps=150))
    >>> decides["steps"], "val_every" in decides
    (300, False)
    """
    return dict(_flat(config))


def _flat(node: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    if dataclasses.is_dataclass(node):
        for f in dataclasses.fields(node):
            if not is_only_where(f):
                yield from _flat(meant(node, f), f"{prefix}{f.name}.")
    elif isinstance(node, Mapping):
        for key, value in node.items():
            yield from _flat(value, f"{prefix}{key}.")
    else:
        yield prefix.removesuffix("."), plain(node)


def check_folder(cfg: TrainConfig, run: RunFolder) -> None:
    """Write `config.yaml`, or make sure that the one there is of the same run.

    A setting that the earlier file does not have yet had its default then.

    Raises:
        ConfigError: the folder holds a run with other settings; the message lists them.
    """
    if run.config.exists() and not cfg.restart:
        try:
            loaded = OmegaConf.load(run.config)
            assert isinstance(loaded, DictConfig)
            earlier = identity(typed_config(loaded, TrainConfig))
        except Exception as error:  # a YAML parser meets anything in a damaged file
            reason = str(error).split("\n")[0]
            raise ConfigError(
                f"{run.config} is of another version or damaged ({reason}): remove it or add "
                "restart=true"
            ) from None
        differences = _differences(earlier, identity(cfg))
        if differences:
            raise ConfigError(
                f"{run.path} holds a run with other settings: {'; '.join(differences)}. Choose "
                "another run with name=..., or add restart=true to discard what is there"
            )
    if cfg.restart:
        run.discard()
    if not (run.finished and run.config.exists()):  # else it says how the run was trained
        write_atomic(run.config, to_yaml(cfg))


def to_yaml(cfg: TrainConfig) -> str:
    """Return a configuration as the text of `config.yaml`."""
    return OmegaConf.to_yaml(OmegaConf.create(_container(cfg)))


def _container(node: Any) -> Any:
    if dataclasses.is_dataclass(node):
        values = {f.name: meant(node, f) for f in dataclasses.fields(node)}
        return {name: _container(value) for name, value in values.items()}
    if isinstance(node, Mapping):
        return {key: _container(value) for key, value in node.items()}
    return plain(node)


def _differences(earlier: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    changed = _changed(earlier, now)
    return [f"{key} was {earlier.get(key)}, now {now.get(key)}" for key in changed]


# --- names of folders ----------------------------------------------------------------------------


def run_folder(root: DictConfig) -> str:
    """Return a run's folder below its experiment's: `<category>/<regime>/<templates>/seed<k>...`.

    The last part ends with what else differs from the defaults; see `run_suffix`.
    """
    names = [str(OmegaConf.select(root, key)) for key in _PLACED]
    return f"{'/'.join(names[:3])}/seed{names[3]}{run_suffix(root)}"


def run_suffix(root: DictConfig) -> str:
    """Return what a run's folder says beside category, regime, templates and seed.

    Options of groups that are not the default's, then settings that are not their options'. What
    cannot be run has a folder of its own, for its log.
    """
    content: Any = OmegaConf.to_container(root, resolve=False)
    # In the job itself the configuration comes without Hydra's own.
    hydra: Any = content.pop("hydra", None) or HydraConfig.get()
    content = _without_suffix(content)
    try:
        config = typed_config(OmegaConf.create(content), TrainConfig)
    except (ConfigError, OmegaConfBaseException):
        # The job itself says what is wrong, as soon as it starts: not in another run's folder.
        told = "\n".join(hydra["overrides"]["task"])
        return f"_invalid-{hashlib.sha256(told.encode()).hexdigest()[:_HASH]}"
    chosen = hydra["runtime"]["choices"]
    choices = {k: str(v) for k, v in chosen.items() if v and not k.startswith("hydra/")}
    placed = {group: choices[group] for group in _PLACED_GROUPS}
    base, plugins = tuple(config.base), tuple(config.plugins)
    default = _composed(tuple(placed.items()), base, plugins)
    option = _composed(tuple(choices.items()), base, plugins)
    words = []
    for group, choice in choices.items():
        prefix = group.replace("/", ".") + "."
        if group not in placed and any(key.startswith(prefix) for key in _changed(default, option)):
            words.append(choice)
    own = identity(config)
    changed = {key: own.get(key) for key in _changed(option, own) if key not in _PLACED}
    return difference_name(words, changed, {*own, *option})


def _without_suffix(node: Any) -> Any:
    """Leave out what would need this very name: files of earlier stages are below it."""
    if isinstance(node, dict):
        return {key: _without_suffix(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_without_suffix(value) for value in node]
    return node.replace("${run_suffix:}", "") if isinstance(node, str) else node


@lru_cache(maxsize=256)
def _composed(
    choices: tuple[tuple[str, str], ...], base: tuple[str, ...], plugins: tuple[str, ...]
) -> dict[str, Any]:
    """Return what decides a run that was given these options, and a study's overrides, alone."""
    groups = {group for group, _ in choices}
    further = [x for x in base if x.split("=", 1)[0] not in groups]
    loader = GlobalHydra.instance().config_loader()
    composed = loader.load_configuration(
        "train",
        overrides=[*(f"{group}={choice}" for group, choice in choices), *further],
        run_mode=RunMode.RUN,
        from_shell=False,
    )
    content = OmegaConf.to_container(composed, resolve=False)
    assert isinstance(content, dict)
    content.pop("hydra", None)
    blank = OmegaConf.create(content)
    for key in OmegaConf.missing_keys(blank):  # what must be given has no default to differ from
        OmegaConf.update(blank, str(key), "", force_add=True)
    OmegaConf.update(blank, "plugins", list(plugins), force_add=True)
    return identity(typed_config(blank, TrainConfig))


def _changed(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    return [key for key in sorted({*before, *after}) if before.get(key) != after.get(key)]


def difference_name(
    options: Sequence[str], settings: Mapping[str, Any], among: Collection[str] = ()
) -> str:
    """Return a short name for options and settings, "" for none.

    What is too long to read, or cannot be in a name, is left to a hash of all of them.

    Args:
        options: of groups.
        settings: values by name; the last words of a name are shown, as many as tell it from
            all others.
        among: the names of all settings.

    >>> difference_name(["paper"], {"schedule.steps": 50})
    '_paper_steps-50'
    >>> difference_name(["folder"], {"data.root": "/data/meshes"})
    '_folder_50594d'
    >>> difference_name([], {"data.seed": 1}, ["seed", "data.seed"])
    '_data.seed-1'
    """
    words, exact = list(options), True
    for key, value in settings.items():
        readable = re.fullmatch(r"[\w.+-]{1,12}", str(value)) is not None
        if readable:
            words.append(f"{_tail(key, among)}-{value}")
        exact &= readable
    name = "_".join(words)
    if len(name) > _LONGEST:
        name, exact = name[:_LONGEST].rpartition("_")[0] or name[:_LONGEST], False
    if not exact:
        told = json.dumps([list(options), dict(settings)], sort_keys=True, default=str)
        digest = hashlib.sha256(told.encode()).hexdigest()[:_HASH]
        name = f"{name}_{digest}" if name else digest
    return f"_{name}" if name else ""


def evaluation_name(cfg: TrainConfig | EvaluateConfig) -> str:
    """Return how results are measured: the protocol's name, then what differs from its defaults.

    References are not in it: they stand beside the scores, and change none.
    """
    kind = type(cfg.protocol)
    must_be_given = [f.name for f in dataclasses.fields(kind) if f.default is f.default_factory]
    default = identity(kind(**dict.fromkeys(must_be_given)))
    own = identity(cfg.protocol)
    settings = {f"protocol.{key}": own.get(key) for key in _changed(default, own)}
    if cfg.evaluation.seed:
        settings["evaluation.seed"] = cfg.evaluation.seed
    options = ["all-views"] if cfg.evaluation.all_views else []
    among = {"evaluation.seed", *(f"protocol.{key}" for key in own)}
    return cfg.protocol.name + difference_name(options, settings, among).replace("_", "-", 1)


def _tail(key: str, among: Collection[str]) -> str:
    """Return the last words of a setting's name that no other has.

    >>> _tail("encoder.width", ["encoder.width", "data.render.width", "data.limit"])
    'encoder.width'
    """
    words = key.split(".")
    tails = (".".join(words[k:]) for k in reversed(range(len(words))))
    others = [f".{other}" for other in among if other != key]
    return next((t for t in tails if not any(o.endswith(f".{t}") for o in others)), key)


def hyperparameters(cfg: TrainConfig) -> dict[str, Any]:
    """Return what tells runs of one study apart, flat, for TensorBoard's HPARAMS page."""
    return {
        "category": cfg.category.name,
        "regime": cfg.regime.name,
        "templates": cfg.templates.count,
        "strategy": cfg.template_strategy.name,
        "seed": cfg.seed,
        "steps": cfg.schedule.steps,
        "batch_size": cfg.schedule.batch_size,
        "learning_rate": cfg.schedule.learning_rate,
        "annealing_steps": cfg.schedule.annealing_steps,
        "min_weight": cfg.regime.min_weight,
        "selection": cfg.regime.selection.name,
        **{f"{label}_weight": term.weight for label, term in cfg.regime.terms.items()},
    }
