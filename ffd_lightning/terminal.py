"""What commands print for people: tables as wide as they need to be, and times."""

import math
import sys

from rich.console import Console

_NO_LIMIT = 10_000  # columns


def table_console() -> Console:
    """Return where tables are printed: as wide as the terminal, elsewhere without a limit."""
    return Console(width=terminal_width() or _NO_LIMIT)


def terminal_width() -> int | None:
    """Return how many columns standard output has, None where it is no terminal."""
    return Console().width if sys.stdout.isatty() else None


def counted(number: float, noun: str) -> str:
    """Return a number of things in words.

    >>> counted(1, "shape"), counted(2000, "test shape")
    ('1 shape', '2,000 test shapes')
    """
    return f"{number:,.0f} {noun}{'' if number == 1 else 's'}"


def duration(seconds: float) -> str:
    """Return a time in seconds, minutes, hours or days, rounded up where it is short.

    >>> duration(7.2), duration(100), duration(3 * 3600), duration(50 * 3600)
    ('8 s', '2 min', '3.0 h', '2.1 days')
    """
    for unit, length, least in (("days", 86400, 2), ("h", 3600, 1.5)):
        if seconds >= least * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{math.ceil(seconds / 60)} min" if seconds >= 90 else f"{math.ceil(seconds)} s"
