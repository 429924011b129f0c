"""One message for every mistake: what is wrong, what could be meant, and no traceback."""

from __future__ import annotations

import difflib
import os
import re
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hydra.errors import HydraException, OverrideParseException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning.components import unknown_setting
from ffd_lightning.errors import UserError

SHOWN = (UserError, HydraException, OmegaConfBaseException)
"""Errors that are the user's to mend."""


def shown(main: Callable[[], object]) -> None:
    """Run a command; show the user's mistakes as one message, exit code 1.

    HYDRA_FULL_ERROR=1 shows the traceback instead.

    Args:
        main: the command.
    """
    if os.environ.get("HYDRA_FULL_ERROR") == "1":
        main()
        return
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra then raises instead of printing its own digest.
    try:
        main()
    except (*SHOWN, ValueError) as error:
        if isinstance(error, ValueError) and not _from_hydra(error):
            raise
        print(f"error: {explain(error)}", file=sys.stderr)
        sys.exit(1)
    except OSError as error:
        if error.filename is None:
            raise
        print(f"error: {error.filename}: {error.strerror}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("interrupted: the same command resumes where it stopped", file=sys.stderr)
        sys.exit(130)
    finally:
        os.environ.pop("HYDRA_FULL_ERROR", None)


def _from_hydra(error: BaseException) -> bool:
    """Tell whether an error was raised in Hydra's own code or OmegaConf's."""
    if isinstance(error, (HydraException, OmegaConfBaseException)):
        return True
    frames = traceback.extract_tb(error.__traceback__)
    return bool(frames) and {"hydra", "omegaconf"} & set(Path(frames[-1].filename).parts) != set()


def explain(error: BaseException) -> str:
    """Return one message for a configuration error: what is wrong, and what could be meant."""
    if isinstance(error, UserError):
        return str(error)
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
        if error.override is not None and error.override not in message:
            message = f"{error.override}: {message}"
        return (
            f"{message}: write group=option or key=value, quoted for the shell where needed; a "
            "value with braces is quoted twice, 'key=\"a{b}\"'"
        )
    if "Ambiguous value for argument" in message:
        return (
            f"{message}: commas separate values. Several are a list, image=[a.png,b.png]; one that "
            "has a comma is quoted twice, 'image=\"a,b.png\"'; a sweep needs -m"
        )
    if "Error merging override callback=" in message:  # without one the group does not exist
        return "no callback is registered: a package or plugins=[MODULE] brings them"
    if "Config group override must be a string" in message:
        return "a group's option is a name, not a number: templates=t30, say, not templates=30"
    return _explain_key(error) or message


def _explain_key(error: BaseException) -> str:
    """Name the siblings of a key that does not exist; "" where the error is of another kind."""
    text = str(error) + "\n" + str(error.__cause__ or "")
    unknown = re.search(r"Key '([^']+)'(?: is)? not in", text)
    full = re.search(r"full_key: (\S+)", text)
    if not (unknown and full):
        return ""
    *path, key = full.group(1).split(".")
    parents: list[Any] = [getattr(each, "parent_node", None) for each in (error, error.__cause__)]
    names = sorted({str(name) for node in parents if OmegaConf.is_dict(node) for name in node})
    return unknown_setting(".".join(path), key, names)
