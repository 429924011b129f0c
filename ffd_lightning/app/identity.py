"""Which settings make two runs the same; names of folders and resuming derive from it.

A run is its configuration without the groups that say where, how fast and how measured
(`NOT_DECIDING`): all other settings decide what comes out.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from typing import Any

from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning import components
from ffd_lightning.app.config import GROUPS, EvaluateConfig, TrainConfig
from ffd_lightning.app.configuration import (
    choose,
    content,
    differences,
    flat,
    label_of,
    typed_config,
)
from ffd_lightning.components import Component
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.files import write_atomic
from ffd_lightning.run_folder import RunFolder

NOT_DECIDING = (
    *("trainer", "logger", "callbacks", "protocol", "evaluation", "paths", "preparation"),
    *("name", "restart", "plugins", "provided", "base"),
)
"""Groups and settings of where, how fast, how measured and under what name."""

_PLACED = ("category.name", "regime.name", "templates.name", "seed")  # the folder's path has them
_PLACED_GROUPS = ("category", "regime", "templates")
_LONGEST = 40  # characters of a name's readable part
_HASH = 6  # hexadecimal digits


def decides(key: str) -> bool:
    """Tell whether a setting decides what a run computes.

    >>> [decides(key) for key in ("schedule.steps", "trainer.devices", "trainer.precision")]
    [True, False, True]
    """
    return key == "trainer.precision" or key.split(".")[0] not in NOT_DECIDING


def identity(config: Any) -> dict[str, Any]:
    """Return what decides a run: plain values by the names that they have on a command line.

    Callbacks may change a training; those whose class has `only_watches = True` do not count.
    """
    watching = {
        f"callback.{label}"
        for label, chosen in getattr(config, "callback", {}).items()
        if getattr(components.find(chosen.kind, chosen.name), "only_watches", False)
    }
    found = flat(content(config))
    return {
        key: value
        for key, value in found.items()
        if decides(key) and ".".join(key.split(".")[:2]) not in watching
    }


def check_folder(cfg: TrainConfig, run: RunFolder) -> None:
    """Write `config.yaml`, or make sure that the one there is of the same run.

    Raises:
        ConfigError: the folder holds a run with other settings; the message lists them.
    """
    if run.config.exists() and not cfg.restart:
        try:
            earlier = identity(typed_config(run.settings, TrainConfig))
        except (UserError, OmegaConfBaseException) as error:
            reason = str(error).split("\n")[0]
            raise ConfigError(
                f"{run.config} is of another version or damaged ({reason}): remove it or add "
                "restart=true"
            ) from None
        now = identity(cfg)
        if changed := differences(earlier, now):
            listed = "; ".join(f"{k} was {earlier.get(k)}, now {now.get(k)}" for k in changed)
            raise ConfigError(
                f"{run.path} holds a run with other settings: {listed}. Choose "
                "another run with name=..., or add restart=true to discard what is there"
            )
    if cfg.restart:
        run.discard()
    if not (run.finished and run.config.exists()):  # else it says how the run was trained
        write_atomic(run.config, to_yaml(cfg))


def to_yaml(cfg: TrainConfig) -> str:
    """Return a configuration as the text of `config.yaml`."""
    return OmegaConf.to_yaml(OmegaConf.create(content(cfg)))


# --- names of folders ----------------------------------------------------------------------------


def run_folder(root: DictConfig) -> str:
    """Return a run's folder below its experiment's: `<category>/<regime>/<templates>/seed<k>...`.

    The last part ends with what else differs from the defaults; see `run_suffix`.
    """
    names = [str(OmegaConf.select(root, key)) for key in _PLACED]
    return f"{'/'.join(names[:3])}/seed{names[3]}{run_suffix(root)}"


def run_suffix(root: DictConfig) -> str:
    """Return what a run's folder says beside category, regime, templates and seed.

    Options of groups that are not the usual ones, then settings that are not their options'. What
    cannot be run has a folder of its own, for its log.
    """
    whole: Any = OmegaConf.to_container(root, resolve=False)
    # In the job itself the configuration comes without Hydra's own.
    hydra: Any = whole.pop("hydra", None) or HydraConfig.get()
    try:
        config = typed_config(OmegaConf.create(_without_suffix(whole)), TrainConfig)
    except (ConfigError, OmegaConfBaseException):
        # The job itself says what is wrong, as soon as it starts: not in another run's folder.
        told = "\n".join(hydra["overrides"]["task"])
        return f"_invalid-{_digest(told)}"
    choices = {
        key: choice
        for key, choice in hydra["runtime"]["choices"].items()
        if choice and not key.startswith("hydra/")
    }
    base, plugins = tuple(config.base), tuple(config.plugins)
    placed = {group: choices[group] for group in _PLACED_GROUPS}
    usual = _composed(tuple(placed.items()), base)[0]
    own = identity(config)
    option = _option(OmegaConf.create(_composed(tuple(choices.items()), base)[1]), own, plugins)
    words = [
        _word(group, choice)
        for group, choice in choices.items()
        if group not in placed
        and decides(group)
        and choice != usual.get(group)
        # An option may bring another along: schedule=paper, lr_schedule=none, say.
        and choice != _composed(_without(choices, group), base)[0].get(group)
    ]
    for chosen in (*config.regime.terms.values(), *config.callback.values()):
        named = {f"{chosen.where}.{key}": value for key, value in _usual(chosen).items()}
        new = named and named.keys() <= own.keys() and option.keys().isdisjoint(named)
        if new and chosen.where.endswith(f".{chosen.name}"):
            words.append(chosen.name)
            option |= named
    changed = {key: own.get(key) for key in differences(option, own) if key not in _PLACED}
    return difference_name(words, changed, {*own, *option})


def _usual(chosen: Component) -> dict[str, Any]:
    """Return a component with its default settings, {} where it has none without being told."""
    node = {label_of(chosen.kind): chosen.name}
    try:
        return flat(content(choose(chosen.kind, node, chosen.where)))
    except ConfigError:
        return {}


def _without(choices: Mapping[str, str], group: str) -> tuple[tuple[str, str], ...]:
    return tuple((key, choice) for key, choice in choices.items() if key != group)


def _word(group: str, choice: str) -> str:
    """Return the name of an option; with its group, where another group has one of that name."""
    kinds = {where.replace(".", "/"): kind for where, kind in GROUPS.items()}
    others = (kind for other, kind in kinds.items() if other != group and decides(other))
    shared = any(choice in components.names(kind) for kind in others)
    return f"{group.rpartition('/')[2]}-{choice}" if shared else choice


def _without_suffix(node: Any) -> Any:
    """Leave out what would need this very name: files of earlier stages are below it."""
    if isinstance(node, dict):
        return {key: _without_suffix(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_without_suffix(value) for value in node]
    return node.replace("${run_suffix:}", "") if isinstance(node, str) else node


@lru_cache(maxsize=256)
def _composed(
    choices: tuple[tuple[str, str], ...], base: tuple[str, ...]
) -> tuple[dict[str, str], dict[str, Any]]:
    """Return all options, and the content of a configuration of these and a study's overrides."""
    groups = {group for group, _ in choices}
    further = [x for x in base if x.split("=", 1)[0] not in groups]
    loader = GlobalHydra.instance().config_loader()
    composed = loader.load_configuration(
        "train",
        overrides=[*(f"{group}={choice}" for group, choice in choices), *further],
        run_mode=RunMode.RUN,
        from_shell=False,
    )
    whole: Any = OmegaConf.to_container(composed, resolve=False)
    options = whole.pop("hydra")["runtime"]["choices"]
    return options, whole


def _option(blank: DictConfig, own: Mapping[str, Any], plugins: Sequence[str]) -> dict[str, Any]:
    """Return what decides a run of the chosen options alone; what must be given is not in it."""
    missing = {str(key) for key in OmegaConf.missing_keys(blank)}
    for key in missing:
        OmegaConf.update(blank, key, own.get(key), force_add=True)
    OmegaConf.update(blank, "plugins", list(plugins), force_add=True)
    found = identity(typed_config(blank, TrainConfig))
    return {key: value for key, value in found.items() if key not in missing}


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
        readable = re.fullmatch(r"[A-Za-z0-9.+-]{1,12}", str(value)) is not None
        if readable:
            words.append(f"{_tail(key, among)}-{value}")
        exact &= readable
    name = "_".join(words)
    if len(name) > _LONGEST:
        name, exact = name[:_LONGEST].rpartition("_")[0] or name[:_LONGEST], False
    if not exact:
        told = json.dumps([list(options), dict(settings)], sort_keys=True, default=str)
        name = f"{name}_{_digest(told)}" if name else _digest(told)
    return f"_{name}" if name else ""


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:_HASH]


def _tail(key: str, among: Collection[str]) -> str:
    """Return the last words of a setting's name that no other has.

    >>> _tail("encoder.width", ["encoder.width", "data.render.width", "data.limit"])
    'encoder.width'
    """
    words = key.split(".")
    tails = (".".join(words[k:]) for k in reversed(range(len(words))))
    others = [f".{other}" for other in among if other != key]
    return next((t for t in tails if not any(o.endswith(f".{t}") for o in others)), key)


def evaluation_name(cfg: TrainConfig | EvaluateConfig) -> str:
    """Return how results are measured: the protocol's name, then what differs from its defaults.

    References are not in it: they stand beside the scores, and change none.
    """
    protocol = cfg.protocol
    usual = components.settings(protocol.kind, protocol.name)
    changed = {
        k: v for k, v in protocol.settings.items() if v != components.plain(usual[k].default)
    }
    settings = {f"protocol.{key}": value for key, value in changed.items()}
    if cfg.evaluation.seed:
        settings["evaluation.seed"] = cfg.evaluation.seed
    options = ["all-views"] if cfg.evaluation.all_views else []
    among = {"evaluation.seed", *(f"protocol.{key}" for key in protocol.settings)}
    return protocol.name + difference_name(options, settings, among).replace("_", "-", 1)


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
