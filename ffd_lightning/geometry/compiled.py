"""Loops over numbers that numba compiles, and their work shared among threads."""

import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import numba
import numpy as np
import torch

_SLICES_PER_THREAD = 4  # so that a thread that was held up does not hold up the others


def jit(function: Callable[..., Any], fastmath: bool | set[str] = False) -> Callable[..., Any]:
    """Compile at first use, without the interpreter's lock; later processes reuse the result.

    Without fastmath, liberties that may be taken in arithmetic, all machines give the same results.
    """
    try:
        return numba.njit(function, nogil=True, cache=True, fastmath=fastmath)
    except RuntimeError:  # neither the package's folder nor the user's cache can be written
        return numba.njit(function, nogil=True, fastmath=fastmath)


def over_threads(function: Callable[..., None], count: int, *arguments: Any) -> None:
    """Call function(*arguments, start, stop) over slices of range(count) in torch's thread count.

    Plain threads rather than numba's own: those abort when two callers overlap or a process forks
    after using them.
    """
    threads = min(torch.get_num_threads(), count)
    if threads <= 1:
        function(*arguments, 0, count)
        return
    edges = np.linspace(0, count, min(count, threads * _SLICES_PER_THREAD) + 1).astype(int).tolist()
    submit = _pool(threads, os.getpid()).submit
    for job in [submit(function, *arguments, *ends) for ends in itertools.pairwise(edges)]:
        job.result()


@lru_cache(maxsize=4)
def _pool(threads: int, process: int) -> ThreadPoolExecutor:
    """Return a pool of the process's own: the threads of its parent are not in a fork."""
    return ThreadPoolExecutor(threads, thread_name_prefix="nearest")
