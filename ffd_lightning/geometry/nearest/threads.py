"""Share work among threads that release the GIL."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import numpy as np
import torch

_SLICES_PER_THREAD = 4  # so that a thread that was held up does not hold up the others


@lru_cache(maxsize=4)
def _pool(threads: int, process: int) -> ThreadPoolExecutor:
    """Return a pool of the process's own: the threads of its parent are not in a fork."""
    return ThreadPoolExecutor(threads, thread_name_prefix="nearest")


def over_threads(function: Callable[..., None], count: int, *arguments: Any) -> None:
    """Call function(*arguments, start, stop) over slices of range(count) in torch's thread count.

    Plain threads rather than numba's own: those abort when two callers overlap or a process forks
    after using them.
    """
    threads = min(torch.get_num_threads(), count)
    if threads <= 1:
        function(*arguments, 0, count)
        return
    slices = min(count, threads * _SLICES_PER_THREAD)
    edges = np.linspace(0, count, slices + 1).astype(int)
    submit = _pool(threads, os.getpid()).submit
    jobs = [
        submit(function, *arguments, int(start), int(stop))
        for start, stop in itertools.pairwise(edges)
    ]
    for job in jobs:
        job.result()
