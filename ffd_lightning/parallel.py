"""How many cores there are, and work on many items in threads that have one core each."""

import os
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from queue import Empty, SimpleQueue
from typing import TypeVar

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def as_completed(futures: Collection[Future[_Result]]) -> Iterator[Future[_Result]]:
    """Yield futures as they are done.

    The standard library's function waits without end: a Ctrl-C that comes just before it does is
    not seen until another future is done.
    """
    done: SimpleQueue[Future[_Result]] = SimpleQueue()
    for future in futures:
        future.add_done_callback(done.put)
    left = len(futures)
    while left:
        try:
            future = done.get(timeout=1)
        except Empty:
            continue
        left -= 1
        yield future


def in_threads(
    function: Callable[[_Item], _Result], items: Iterable[_Item], workers: int
) -> Iterator[tuple[_Item, _Result]]:
    """Yield (item, function(item)) as they are done.

    Threads do, since the heavy parts are compiled and free the interpreter. Ctrl-C, or an error,
    waits for the items in work and no more. Meanwhile torch has one thread, in every thread; so
    there must not be two calls at once.
    """
    import torch  # here: workers of the preparation need this module, and no torch

    pool = ThreadPoolExecutor(workers, thread_name_prefix="worker")
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # for this thread, and all that start later
    try:
        pending = {pool.submit(function, item): item for item in items}
        for future in as_completed(pending):
            yield pending.pop(future), future.result()
    finally:
        pool.shutdown(cancel_futures=True)
        torch.set_num_threads(threads)
