"""Worker processes that make shapes, each as if it might die at any moment."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ffd_lightning.data.preparation.shape_file import (
    Failure,
    Recipe,
    compute_shape,
    is_done,
    write_shape,
)
from ffd_lightning.errors import DataError

_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def make_shapes(
    recipe: Recipe,
    ids: Iterable[str],
    workers: int,
    timeout: float,
    advance: Callable[[], None],
) -> dict[str, Failure]:
    """Make shapes in worker processes; give up by name the one at which a process dies.

    Args:
        recipe: what to make, and where to.
        ids: the shapes.
        workers: at most so many processes.
        timeout: seconds after which a shape is given up.
        advance: called for every shape that was made or failed.

    Returns:
        Why shapes could not be made, by id, in the order in which they failed.

    Raises:
        DataError: worker processes cannot start, or no shape of the source can be loaded.
        OSError: a shape's file cannot be written.
    """
    todo = deque(ids)
    failures: dict[str, Failure] = {}

    def record(shape_id: str, failure: Failure | None) -> None:
        if failure is not None:
            failures[shape_id] = failure
        advance()

    while todo:
        suspects = _run_pool(recipe, todo, workers, 2 * workers, timeout, record)
        # A worker died while these were in hand. Alone, the culprit shows itself, and what was too
        # large beside others may fit.
        while suspects:
            for culprit in _run_pool(recipe, suspects, 1, 1, timeout, record):
                reason = "its worker process died twice (out of memory, or stuck)"
                record(culprit, Failure("given up", reason))
    return failures


def _run_pool(
    recipe: Recipe,
    todo: deque[str],
    workers: int,
    in_hand: int,
    timeout: float,
    record: Callable[[str, Failure | None], None],
) -> deque[str]:
    """Make shapes from the front of `todo` in worker processes, until none is left or one dies.

    Args:
        recipe: what to make.
        todo: emptied from the front as shapes are handed out.
        workers: at most so many processes.
        in_hand: at most so many shapes are handed out at a time.
        timeout: seconds after which a shape is given up.
        record: called with every shape that was made or failed, and why.

    Returns:
        The shapes that were in hand, and not done, when a worker died.
    """
    # spawn: a fork would copy the locks that threads of torch and of the bar may hold.
    context = multiprocessing.get_context("spawn")
    others = set(multiprocessing.active_children())
    pending: dict[Future[Failure | None], str] = {}
    with (
        _plain_processes(),
        ProcessPoolExecutor(
            min(workers, len(todo)), context, _start_worker, (recipe, timeout)
        ) as pool,
    ):
        try:
            _check_start(pool)
            while todo or pending:
                while todo and len(pending) < in_hand:
                    pending[_submit(pool, _work, todo[0])] = todo[0]
                    todo.popleft()
                for future in wait(pending, return_when=FIRST_COMPLETED).done:
                    record(pending[future], future.result())
                    del pending[future]
        except BrokenProcessPool:
            left: deque[str] = deque()
            for future, shape_id in pending.items():
                if future.done() and future.exception() is None:
                    record(shape_id, future.result())
                elif is_done(recipe, shape_id):
                    record(shape_id, None)
                else:
                    left.append(shape_id)
            return left
        except BaseException:
            # Ctrl-C or a full disk: no reason to wait for shapes in work. The pool gives up when
            # its workers die; leaving it waits for that, as its thread must not outlive it.
            for process in set(multiprocessing.active_children()) - others:
                process.terminate()
            raise
    return deque()


def _check_start(pool: ProcessPoolExecutor) -> None:
    """Tell workers that cannot even start from workers that die over a shape."""
    try:
        _submit(pool, os.getpid).result()
    except BrokenProcessPool:
        raise DataError(
            "worker processes end as soon as they start; their own message is above. A script "
            'that prepares data must do so below `if __name__ == "__main__":`, and the source '
            "must be importable from a module"
        ) from None


def _submit(pool: ProcessPoolExecutor, function: Callable[..., Any], *args: str) -> Future[Any]:
    """Submit work; a worker process that is started for it never sees Ctrl-C.

    A terminal sends Ctrl-C to the workers too, and one that is still importing would answer with
    a traceback. They inherit the mask; the parent gets what was held back when it is lifted.
    """
    if not hasattr(signal, "pthread_sigmask"):
        return pool.submit(function, *args)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    try:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        return pool.submit(function, *args)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _plain_processes() -> Iterator[None]:
    """Let processes that are started meanwhile use one thread, and know how to start."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(_ONE_THREAD)  # libraries read it when they are loaded
    method = multiprocessing.get_start_method(allow_none=True)
    if method not in (None, *multiprocessing.get_all_start_methods()):
        # In a process of joblib's it is "loky", which a new process does not know.
        multiprocessing.set_start_method("spawn", force=True)
    try:
        yield
    finally:
        if method is not None:
            multiprocessing.set_start_method(method, force=True)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


# --- in a worker process ------------------------------------------------------------------------

_recipe: Recipe | None = None
_timeout = 0.0
_expired = threading.Event()


class _TimeUp(BaseException):
    """Passes what catches errors of all kinds on the way; `_expired` tells of it if it is lost."""


def _start_worker(recipe: Recipe, timeout: float) -> None:
    """Keep the recipe, leave Ctrl-C to the parent, and end when the parent is gone."""
    global _recipe, _timeout
    _recipe, _timeout = recipe, timeout
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # for systems without the mask of `_submit`
    if hasattr(signal, "SIGALRM"):
        signal.signal(signal.SIGALRM, _give_up)
    # Where memory runs out, Linux shall end a worker, which costs one shape, and nothing else.
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _give_up(*_: object) -> None:
    _expired.set()
    raise _TimeUp


def _work(shape_id: str) -> Failure | None:
    assert _recipe is not None
    # The signal ends what Python runs; the process ends where a library does not return.
    last_resort = threading.Timer(2 * _timeout, os._exit, (1,))
    last_resort.daemon = True
    last_resort.start()
    try:
        made = _in_time(shape_id)
        if not isinstance(made, Failure):  # without the clock: a shape is written or given up
            write_shape(_recipe, shape_id, made)
            return None
        return made
    finally:
        last_resort.cancel()


def _in_time(shape_id: str) -> dict[str, Any] | Failure:
    """Compute a shape, or give it up when the time is up; no alarm rings later than this."""
    assert _recipe is not None
    late = Failure("given up", f"it takes longer than preparation.timeout={_timeout:g} seconds")
    clock = hasattr(signal, "setitimer")
    _expired.clear()
    try:
        try:
            if clock:
                signal.setitimer(signal.ITIMER_REAL, _timeout)
            made = compute_shape(_recipe, shape_id)
        finally:
            if clock:
                signal.setitimer(signal.ITIMER_REAL, 0)
    except _TimeUp:
        return late
    return late if _expired.is_set() else made
