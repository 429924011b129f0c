"""Which settings make two runs the same; names of folders and resuming derive from it.

A run is its configuration without the groups that say where, how fast and how measured
(`run_folder.NOT_DECIDING`): all other settings decide what comes out.
"""

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from hydra import compose
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning import components
from ffd_lightning.app.config import EvaluateConfig, TrainConfig
from ffd_lightning.app.configuration import chooses, content, differences, flat, typed_config
from ffd_lightning.components import plain
from ffd_lightning.data.preparation.prepared import digest_of
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.files import write_atomic
from ffd_lightning.run_folder import RunFolder, decides

_PLACED = ("category.name", "regime.name", "templates.name", "seed")  # the folder's path has them
_TOLD = (
    *("category.name", "regime.name", "templates.count", "template_strategy.name", "seed"),
    *("schedule.steps", "schedule.batch_size", "schedule.learning_rate"),
)  # settings that HPARAMS has of all runs
_LONGEST = 60  # characters of a name's readable part
_HASH = 6  # hexadecimal digits


def identity(config: Any) -> dict[str, Any]:
    """Return what decides a run: plain values by the names that they have on a command line.

    Callbacks may change a training; those whose class has `only_watches = True` do not count.
    """
    chosen = getattr(config, "callback", {}).items()
    watching = {f"callback.{label}" for label, callback in chosen if _watches(callback.name)}
    found = flat(content(config))
    return {
        key: value
        for key, value in found.items()
        if decides(key) and ".".join(key.split(".")[:2]) not in watching
    }


def _watches(callback: str) -> bool:
    return getattr(components.find("callback", callback), "only_watches", False)


def check_folder(cfg: TrainConfig, run: RunFolder) -> None:
    """Write `config.yaml`, or make sure that the one there is of the same run."""
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


def run_folder(_root_: DictConfig) -> str:
    """Return a run's folder below its experiment's: `<category>/<regime>/<templates>/seed<k>...`.

    The last part ends with what else differs from the defaults; see `run_suffix`. OmegaConf gives
    resolvers the whole configuration as `_root_`.
    """
    names = [str(OmegaConf.select(_root_, key)) for key in _PLACED]
    return f"{'/'.join(names[:3])}/seed{names[3]}{run_suffix(_root_)}"


def run_suffix(_root_: DictConfig) -> str:
    """Return what a run's folder says beside category, regime, templates and seed.

    Options that were chosen and matter, then settings that are not as the options have them. What
    cannot be run has a folder of its own, for its log.
    """
    whole: Any = OmegaConf.to_container(_root_, resolve=False)
    # In the job itself the configuration comes without Hydra's own.
    hydra: Any = whole.pop("hydra", None) or HydraConfig.get()
    overrides = list(hydra["overrides"]["task"])
    try:
        own = identity(config := typed_config(without_suffix(whole), TrainConfig))
    except (ConfigError, OmegaConfBaseException):
        # The job itself says what is wrong, as soon as it starts: not in another run's folder.
        return f"_invalid-{digest_of(overrides)[:_HASH]}"
    read = OverridesParser.create().parse_overrides
    options = {o.get_key_element().lstrip("+"): o for o in read(overrides) if chooses(o)}
    base = {o.get_key_element().lstrip("+"): o for o in read(config.base)}

    def without(key: str) -> dict[str, Any]:
        left = base | {k: o for k, o in options.items() if k != key}
        return _identity_of(tuple(str(o.input_line) for o in left.values()), own)

    usual, words = without(""), {}
    for key, option in sorted(options.items()):
        by_study = key in base and base[key].input_line == option.input_line
        if f"{key}.name" not in _PLACED and not by_study and differences(without(key), usual):
            value = option.value()
            chosen = value if isinstance(value, list) else [value]
            chosen = [x for x in chosen if key != "callback" or not _watches(str(x))]
            words[key.replace("/", ".")] = "-".join(map(str, chosen))
    changed = {key: own.get(key) for key in differences(usual, own) if key not in _PLACED}
    return difference_name({**words, **changed})


def without_suffix(node: Any) -> Any:
    """Leave `${run_suffix:}`, by which files of earlier stages are named, out of plain settings."""
    if isinstance(node, dict):
        return {key: without_suffix(value) for key, value in node.items()}
    if isinstance(node, list):
        return [without_suffix(value) for value in node]
    return node.replace("${run_suffix:}", "") if isinstance(node, str) else node


def _identity_of(overrides: tuple[str, ...], own: Mapping[str, Any]) -> dict[str, Any]:
    """Return what decides a run of these overrides; what must be given is not in it."""
    blank = OmegaConf.create(_composed(overrides))
    missing = {str(key) for key in OmegaConf.missing_keys(blank)}
    for key in missing:
        OmegaConf.update(blank, key, own.get(key), force_add=True)
    found = identity(typed_config(blank, TrainConfig))
    return {key: value for key, value in found.items() if key not in missing}


@lru_cache(maxsize=256)
def _composed(overrides: tuple[str, ...]) -> dict[str, Any]:
    composed: Any = OmegaConf.to_container(compose("train", [*overrides]), resolve=False)
    return composed


def difference_name(settings: Mapping[str, Any]) -> str:
    """Return a short name for settings, "" for none.

    What is too long to read, or cannot be in a name, is left to a hash of all of them.

    >>> difference_name({"schedule": "paper", "schedule.steps": 50})
    '_schedule-paper_schedule.steps-50'
    >>> difference_name({"data": "folder", "data.root": "/data/meshes"})
    '_data-folder_75155b'
    """
    given = {key: str(plain(value)) for key, value in settings.items()}
    words: list[str] = []
    for key, value in given.items():
        word = f"{key}-{value}"
        if (
            re.fullmatch(r"[A-Za-z0-9.+_-]{1,20}", value)
            and len("_".join([*words, word])) < _LONGEST
        ):
            words.append(word)
    if len(words) < len(given):
        words.append(digest_of(given)[:_HASH])
    return "".join(f"_{word}" for word in words)


def evaluation_name(cfg: TrainConfig | EvaluateConfig) -> str:
    """Return how results are measured: the protocol's name, then what differs from its defaults.

    References are not in it: they stand beside the scores, and change none.
    """
    protocol, usual = cfg.protocol, components.settings(cfg.protocol.kind, cfg.protocol.name)
    changed = {k: v for k, v in protocol.settings.items() if v != plain(usual[k].default)}
    if cfg.evaluation.seed:
        changed["evaluation.seed" if "seed" in usual else "seed"] = cfg.evaluation.seed
    views = "_all-views" if cfg.evaluation.all_views else ""
    return protocol.name + f"{views}{difference_name(changed)}".replace("_", "-", 1)


def hyperparameters(cfg: TrainConfig) -> dict[str, str | float]:
    """Return what TensorBoard's HPARAMS page tells runs apart by.

    That is some settings of all runs, and those that were given on the command line.
    """
    own = identity(cfg)
    overrides: Any = []
    if HydraConfig.initialized():  # values may be of other settings, ${paths.runs}, say
        overrides = OmegaConf.to_container(HydraConfig.get().overrides.task, resolve=False)
    given = [text.lstrip("+~").split("=")[0] for text in overrides]
    names = dict.fromkeys([*_TOLD, *given, *(f"{group}.name" for group in given)])
    told = {name: own[name] for name in sorted(names) if name in own}
    return {k: v if isinstance(v, (int, float)) else str(v) for k, v in told.items()}
