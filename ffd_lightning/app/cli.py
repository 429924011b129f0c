"""What the entry scripts share: making the schema known to Hydra, and messages for mistakes."""

from __future__ import annotations

import difflib
import hashlib
import os
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from hydra import compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from hydra.errors import HydraException, OverrideParseException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning.app.config import TrainConfig
from ffd_lightning.errors import UserError


def run_suffix(overrides: str) -> str:
    """Return a folder suffix for further overrides, "" for none: "_schedule.steps-50".

    Settings that differ must not share a run folder. Long ones are shortened to a hash. There is no
    "=" or "," in it, which Hydra would not take in `run=FOLDER`.
    """
    if not overrides:
        return ""
    name = re.sub(r"[^\w.+-]", "-", overrides.replace(",", "+"))
    if len(name) > 120:
        name = f"{name[:100]}-{hashlib.sha256(overrides.encode()).hexdigest()[:12]}"
    return f"_{name}"


_schema: type[Any] = TrainConfig


def register(schema: type[Any] = TrainConfig) -> None:
    """Make the schema and the resolver known to Hydra; called by the entry scripts."""
    global _schema
    _schema = schema
    ConfigStore.instance().store(name="schema", node=schema)
    OmegaConf.register_new_resolver("run_suffix", run_suffix, replace=True)


def compose_config(name: str, overrides: list[str]) -> DictConfig:
    """Compose one of the configurations in `conf/`, for commands that are not Hydra applications.

    Raises:
        HydraException: an override that does not fit.
    """
    folder = Path(__file__).parents[2] / "conf"
    with initialize_config_dir(str(folder), version_base="1.3"):
        return compose(name, overrides)


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


def run_app(main: Callable[[], object]) -> None:
    """Run a Hydra application; show the user's mistakes as one message, exit code 1.

    HYDRA_FULL_ERROR=1 shows the traceback instead.
    """
    # Threads of OpenMP that spin while they wait take the cores from the nearest neighbours' own
    # threads, and from everything else on a busy machine. Read when torch is loaded.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    if os.environ.get("HYDRA_FULL_ERROR") == "1":
        main()
        return
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra then raises instead of printing its own digest.
    try:
        main()
    except (UserError, HydraException, OmegaConfBaseException, ValueError) as error:
        if isinstance(error, ValueError) and not _from_hydra(error):
            raise
        print(f"error: {explain(error)}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("interrupted: the same command goes on where it was cut off", file=sys.stderr)
        sys.exit(130)


def _from_hydra(error: BaseException) -> bool:
    """Tell whether an error was raised in Hydra's own code or OmegaConf's."""
    if isinstance(error, (HydraException, OmegaConfBaseException)):
        return True
    frames = traceback.extract_tb(error.__traceback__)
    return bool(frames) and {"hydra", "omegaconf"} & set(Path(frames[-1].filename).parts) != set()


def explain(error: BaseException) -> str:
    """Return one message for a configuration error: what is wrong, and what could be meant."""
    message = " ".join(str(error).split("\n")[0].split())
    cause = error.__cause__
    if cause is not None and str(cause) and str(cause).split("\n")[0] not in message:
        message = f"{message}: {str(cause).splitlines()[0]}"
    options = re.search(r"Could not find '([^']*)'", str(error))
    listed = re.search(r"Available options in '([^']*)':\n((?:\t\S+\n?)+)", str(error))
    if options and listed:
        group, choices = listed.group(1), listed.group(2).split()
        name = options.group(1).split("/")[-1]
        close = difflib.get_close_matches(name, choices, 1)
        hint = f" Did you mean {group}={close[0]}?" if close else ""
        return f"no {group} {name!r}.{hint} Choices: {', '.join(choices)}"
    missing = re.search(r"Missing mandatory value: (\S+)", str(error))
    if missing:
        return f"{missing.group(1)}=... must be given"
    if isinstance(error, OverrideParseException):
        return f"{message}: write group=option or key=value, quoted for the shell where needed"
    if "Ambiguous value for argument" in message:
        return (
            f"{message}: commas separate values. Several are a list, image=[a.png,b.png]; one that "
            "has a comma is quoted twice, 'image=\"a,b.png\"'; a sweep needs -m"
        )
    if "Config group override must be a string" in message:
        return "a group's option is a name, not a number: templates=t30, say, not templates=30"
    unknown = re.search(r"Key '([^']+)'(?: is)? not in", str(error) + str(cause or ""))
    full = re.search(r"full_key: (\S+)", str(error) + "\n" + str(cause or ""))
    if unknown and full:
        return _explain_key(full.group(1))
    return message


def _explain_key(full_key: str) -> str:
    """Name the siblings of a key that does not exist."""
    *path, key = full_key.split(".")
    node: Any = OmegaConf.structured(_schema)
    for part in path:
        node = node.get(part) if OmegaConf.is_dict(node) and part in node else None
    names = sorted(str(name) for name in node) if node is not None else []
    where = ".".join(path)
    close = difflib.get_close_matches(key, names, 1)
    hint = f" Did you mean {'.'.join([*path, close[0]])}?" if close else ""
    return (
        f"no setting {full_key!r}.{hint} Settings{f' in {where}' if where else ''}: "
        + ", ".join(names)
    )
