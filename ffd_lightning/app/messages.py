"""One message for every mistake: what is wrong, what could be meant, and no traceback."""

import os
import re
import sys
from collections.abc import Callable

from hydra.core.config_store import ConfigStore
from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning.errors import UserError, did_you_mean

SHOWN = (UserError, HydraException, OmegaConfBaseException)
"""Errors that are the user's to mend."""


def shown(main: Callable[[], object]) -> None:
    """Run a command; show the user's mistakes as one message, exit code 1.

    HYDRA_FULL_ERROR=1 shows the traceback instead.
    """
    if os.environ.get("HYDRA_FULL_ERROR") == "1":
        main()
        return
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra then raises instead of printing its own digest.
    try:
        try:
            main()
        finally:
            sys.stdout.flush()
    except SHOWN as error:
        print(f"error: {explain(error)}", file=sys.stderr)
        sys.exit(1)
    except BrokenPipeError:  # what reads the output, `head` say, has ended
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python flushes at its exit
        sys.exit(1)
    except OSError as error:
        if error.filename is None:
            raise
        print(f"error: {error.filename}: {error.strerror}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        without = ", without restart=true," if "restart=true" in sys.argv else ""
        print(f"interrupted: the same command{without} resumes where it stopped", file=sys.stderr)
        sys.exit(130)
    finally:
        os.environ.pop("HYDRA_FULL_ERROR", None)


def explain(error: BaseException) -> str:
    """Return one message for a configuration error: what is wrong, and what could be meant."""
    if isinstance(error, UserError):
        return str(error)
    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        group, _, name = error.missing_cfg_file.rpartition("/")
        # Hydra names the options of group=option, not of group=[option].
        stored = error.options or ConfigStore.instance().list(group)
        options = [name.removesuffix(".yaml") for name in stored]
        hint = did_you_mean(name, options, f"{group}=")
        choices = ", ".join(options)
        if group == "category":
            choices += f"; another of your data: category=custom category.name={name}"
        return f"no {group} {name!r}.{hint} Choices: {choices}"
    message = " ".join(str(error).split("\n")[0].split())
    cause = str(error.__cause__ or "").split("\n")[0]
    if cause not in message:
        message = f"{message}: {cause}"
    if isinstance(error, OverrideParseException):
        line = error.override or ""
        key, equals, value = line.partition("=")
        item = r"[^\[\], ][^\[\],]*" if value.startswith("[") else r".+"
        quoted = re.sub(item, r'"\g<0>"', value)
        twice = f"; quoted twice, any value is read: '{key}={quoted}'"
        twice *= bool(equals) and "'" not in value
        return (
            f"{message if line in message else f'{line}: {message}'}: write group=option or "
            f"key=value, quoted for the shell where needed{twice}"
        )
    return message
