"""Errors that are shown to the user as one message, and what tells them from our own bugs."""

import difflib
import traceback
from collections.abc import Collection
from pathlib import Path


class UserError(Exception):
    """Something only the user can mend: the message names it and the way out."""


class ConfigError(UserError):
    """A setting that cannot work, found before anything is built."""


class DataError(UserError):
    """Data that is missing, damaged or too little for what was asked."""


class RejectedShapeError(Exception):
    """One model that cannot be used; it is listed with this reason and the rest goes on."""


def did_you_mean(name: object, there: Collection[str], prefix: str = "") -> str:
    """Return the end of a message on a name that is not there: the one most like it, or ""."""
    close = difflib.get_close_matches(str(name), there, 1)
    return f" Did you mean {prefix}{close[0]}?" if close else ""


_PACKAGE = Path(__file__).parent
_BUGS = (AssertionError, AttributeError, NameError, TypeError)


def is_bug(error: BaseException) -> bool:
    """Tell whether an error comes of a mistake in this package rather than of a damaged file.

    Libraries raise errors of all kinds on damaged bytes; where a line of our own raises one that
    says that the code is wrong, it is.
    """
    frames = traceback.extract_tb(error.__traceback__)
    inside = bool(frames) and _PACKAGE in Path(frames[-1].filename).parents
    return inside and isinstance(error, _BUGS)


def is_of_machine(error: BaseException) -> bool:
    """Tell whether disk, network or memory failed, which says nothing of what a file holds.

    Libraries raise `OSError` for damaged content, too; only the system's have a number.
    """
    numbered = isinstance(error, OSError) and error.errno is not None
    return numbered or isinstance(error, MemoryError)


def explain_unforeseen(error: BaseException) -> str:
    """Return an unforeseen error's kind and message, and where in the code it was raised."""
    text, frames = f"{type(error).__name__}: {error}", traceback.extract_tb(error.__traceback__)
    if not frames:
        return text
    bug = ", a bug of ffd_lightning: please report it" if is_bug(error) else ""
    return f"{text} ({Path(frames[-1].filename).name}:{frames[-1].lineno}{bug})"
