"""Running a command as a Hydra application: one place for schema, help, messages and plugins."""

from __future__ import annotations

import logging
import re
import sys
from collections.abc import Callable, Sequence
from functools import partial, update_wrapper
from pathlib import Path
from typing import Any

import hydra
from hydra import compose, initialize_config_dir
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf

from ffd_lightning import registry
from ffd_lightning.app import identity, schema
from ffd_lightning.app.help import command_help
from ffd_lightning.app.messages import SHOWN, explain
from ffd_lightning.errors import DataError

log = logging.getLogger(__name__)
# Hydra shows all that is logged as information. Here, as jobs in other processes load this too.
logging.getLogger("matplotlib").setLevel(logging.WARNING)

_ROOT = Path(__file__).parents[2]
_PACKAGE = Path(__file__).parents[1]


def config_folder(name: str = "conf") -> Path:
    """Return the folder of configurations, or of studies: `conf`, `sweeps`.

    In a checkout it is at the top, in an installed package inside of it.
    """
    inside = _PACKAGE / name
    return inside if inside.is_dir() else _ROOT / name


def command_folder(name: str) -> Path:
    """Return the folder of a command's configuration: `conf`, or one of its own in there.

    A folder's subfolders are groups, and no setting may bear their names: `predict` has a setting
    `category`, which is a group elsewhere.
    """
    own = config_folder() / name
    return own if (own / f"{name}.yaml").is_file() else config_folder()


def named_plugins(arguments: Sequence[str]) -> list[str]:
    """Return the modules that `plugins=` names on a command line.

    >>> named_plugins(["regime=e", "plugins=[my_parts,more.parts]"])
    ['my_parts', 'more.parts']
    """
    found: list[str] = []
    for argument in arguments:
        match = re.fullmatch(r"\+{0,2}plugins=(.*)", argument)
        if match:
            found += [name.strip(" '\"") for name in match[1].strip("[]").split(",")]
    return [name for name in found if name]


def prepare_hydra(config: type[Any], arguments: Sequence[str]) -> None:
    """Make schema, parts and resolvers known to Hydra, plugins of the command line included."""
    registry.load_plugins(named_plugins(arguments))
    schema.register(config)
    for name in ("run_folder", "run_suffix"):
        OmegaConf.register_new_resolver(name, _resolver(getattr(identity, name)), replace=True)


def _resolver(function: Callable[[DictConfig], str]) -> Callable[..., str]:
    def resolve(*, _root_: DictConfig) -> str:
        return function(_root_)

    return resolve


def compose_config(
    name: str, config: type[Any], overrides: Sequence[str], extra: str | None = None
) -> DictConfig:
    """Compose one of the configurations in `conf/`, for what is no Hydra application.

    Args:
        name: of the configuration.
        config: its schema.
        overrides: as on the command line.
        extra: a folder with further options, as --config-dir.

    Raises:
        HydraException: an override that does not fit.
    """
    prepare_hydra(config, overrides)
    more = [] if extra is None else [f"hydra.searchpath=[file://{Path(extra).absolute()}]"]
    with initialize_config_dir(str(command_folder(name)), version_base="1.3"):
        return compose(name, [*overrides, *more])


def run_hydra(
    name: str,
    config: type[Any],
    run: Callable[[Any], Any],
    arguments: Sequence[str],
    paths: Sequence[str] = (),
    counted: bool = False,
) -> None:
    """Run a command as a Hydra application.

    Args:
        name: of the command and its configuration in `conf/`.
        config: its schema.
        run: takes the typed settings; what it returns is the job's result.
        arguments: of the command line.
        paths: settings whose values are files' names, to be taken as they are.
        counted: a callback of the configuration counts the jobs of a multirun that have failed.
    """
    given = quote_paths(arguments, paths)
    prepare_hydra(config, given)
    if {"-h", "--help"} & set(given):
        print(command_help(name, config, command_folder(name), _option(given, "--config-dir")))
        return
    sys.argv[1:] = given
    # Hydra names the log after the function's module: the command's, not functools.
    job = update_wrapper(partial(_job, config, run, counted), run)
    main = hydra.main(version_base="1.3", config_path=str(command_folder(name)), config_name=name)
    main(job)()


def _job(config: type[Any], run: Callable[[Any], Any], counted: bool, cfg: DictConfig) -> Any:
    """Run one job; in a multirun, one that fails does not stop the others."""
    try:
        return run(schema.typed_config(cfg, config))
    except SHOWN as error:
        if HydraConfig.get().mode is not RunMode.MULTIRUN:
            # Not as an exception: Hydra would put a line of its own above it.
            sys.exit(f"error: {explain(error)}")
        if counted:
            log.error("%s", explain(error))  # to the log in the job's folder too
            return None
        print(f"error: {explain(error)}", file=sys.stderr)
        # Hydra goes on, and shows the first of all exceptions at the end.
        raise DataError("not all jobs came to their end: see the messages above") from None


def _option(arguments: Sequence[str], name: str) -> str | None:
    for k, argument in enumerate(arguments):
        if argument == name and k + 1 < len(arguments):
            return arguments[k + 1]
        if argument.startswith(f"{name}="):
            return argument.partition("=")[2]
    return None


def quote_paths(arguments: Sequence[str], keys: Sequence[str]) -> list[str]:
    """Quote the values of some settings for Hydra, to which brackets, commas and = mean something.

    Lists and what is quoted already stay as they are.

    >>> quote_paths(["image=photo (1), a=b.png", "top_k=2", "mask=null"], ["image", "mask"])
    ['image="photo (1), a=b.png"', 'top_k=2', 'mask=null']
    """
    result = []
    for argument in arguments:
        key, _, value = argument.partition("=")
        if key in keys and value not in ("", "null", "???") and value[0] not in "['\"":
            # Backslashes count only before a quote.
            escaped = re.sub(r'(\\*)("|$)', lambda m: 2 * m[1] + (m[2] and '\\"'), value)
            argument = f'{key}="{escaped}"'
        result.append(argument)
    return result
