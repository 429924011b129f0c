"""Worker processes that make shapes, each as if it might die at any moment."""

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

from pebble import ProcessExpired, ProcessPool

from ffd_lightning.data.preparation.prepared_shape import Failure, ShapeMaker
from ffd_lightning.errors import DataError
from ffd_lightning.parallel import as_completed

_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def make_shapes(
    maker: ShapeMaker,
    ids: Sequence[str],
    workers: int,
    timeout: float,
    advance: Callable[[], None],
) -> dict[str, Failure]:
    """Make shapes of these ids in worker processes, and return why some could not be made, by id.

    One that takes more than `timeout` seconds, or kills its process, is given up. `advance` is
    called for every shape that was made or failed. Errors are those of `ShapeMaker.make`, and a
    DataError where worker processes cannot start.
    """
    failures: dict[str, Failure] = {}
    if not ids:
        return failures
    # spawn: a fork would copy the locks that threads of torch and of the bar may hold.
    context = multiprocessing.get_context("spawn")
    with _plain_processes():
        pool = ProcessPool(min(workers, len(ids)), 0, _start_worker, (maker,), context)
        try:
            pending: dict[Future[Failure | None], str]
            pending = {pool.schedule(_work, (i,), timeout=timeout): i for i in ids}
            for future in as_completed(pending):
                shape_id = pending[future]
                try:
                    failure = future.result()
                except TimeoutError:
                    why = f"it takes longer than preparation.timeout={timeout:g} seconds"
                    failure = Failure("given up", why)
                except ProcessExpired:
                    failure = Failure("given up", "its worker process died (out of memory?)")
                # Time may run out after the file is there, and before the result is sent.
                if failure is not None and not maker.is_done(shape_id):
                    failures[shape_id] = failure
                advance()
        except BrokenProcessPool:
            raise DataError(
                "worker processes end as soon as they start; their own message is above. A script "
                'that prepares data must do so below `if __name__ == "__main__":`, and the source '
                "must be importable from a module"
            ) from None
        finally:
            pool.stop()  # Ctrl-C or a full disk: no reason to wait for shapes in work
            pool.join()
    return failures


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
        multiprocessing.set_start_method(method, force=True)
        for name, value in before.items():
            os.environ.pop(name)
            os.environ.update({} if value is None else {name: value})


# --- in a worker process ------------------------------------------------------------------------

_maker: ShapeMaker | None = None


def _start_worker(maker: ShapeMaker) -> None:
    """Keep the maker, and end when the parent is gone, also from within a shape."""
    global _maker
    _maker = maker
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _work(shape_id: str) -> Failure | None:
    assert _maker is not None
    return _maker.make(shape_id)
