"""Compiling numeric loops with numba."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import numba


def jit(function: Callable[..., Any], fastmath: Collection[str] = ()) -> Callable[..., Any]:
    """Compile at first use, without the interpreter's lock; later processes reuse the result.

    Args:
        function: arrays and numbers in.
        fastmath: liberties that may be taken in arithmetic; none by default, so that results are
            the same on every machine.
    """
    liberties = set(fastmath) or False
    try:
        return numba.njit(function, nogil=True, cache=True, fastmath=liberties)
    except RuntimeError:  # neither the package's folder nor the user's cache can be written
        return numba.njit(function, nogil=True, fastmath=liberties)
