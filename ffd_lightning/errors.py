"""Errors that are shown to the user as one message, and what tells them from our own bugs."""

from __future__ import annotations

import traceback
from pathlib import Path


class UserError(Exception):
    """Something only the user can mend: the message names it and the way out."""


class ConfigError(UserError):
    """A setting that cannot work, found before anything is built."""


class DataError(UserError):
    """Data that is missing, damaged or too little for what was asked."""


class RejectedModelError(Exception):
    """One model that cannot be used; it is listed with this reason and the rest goes on."""


_PACKAGE = Path(__file__).parent
_BUGS = (AssertionError, AttributeError, NameError, TypeError)


def is_bug(error: BaseException) -> bool:
    """Tell whether an error comes of a mistake in this package rather than of a damaged file.

    Libraries raise errors of all kinds on damaged bytes; where a line of our own raises one that
    says that the code is wrong, it is.
    """
    return isinstance(error, _BUGS) and _PACKAGE in _origin(error)[0].parents


def explain_unforeseen(error: BaseException) -> str:
    """Return an unforeseen error's kind and message, and where in the code it comes from.

    The system's own errors, of files and of time, say enough without the place.
    """
    text = f"{type(error).__name__}: {error}"
    file, line = _origin(error)
    if isinstance(error, OSError) or not line:
        return text
    bug = ", a bug of ffd_lightning: please report it" if is_bug(error) else ""
    return f"{text} ({file.name}, line {line}{bug})"


def _origin(error: BaseException) -> tuple[Path, int]:
    """Return the file and the line that an error was raised at."""
    frames = traceback.extract_tb(error.__traceback__)
    return (Path(frames[-1].filename), frames[-1].lineno or 0) if frames else (Path(), 0)
