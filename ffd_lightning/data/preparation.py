"""Preparing a category: load, normalise, sample, render; in parallel, and safe against kills.

Each model becomes one file of a working folder as soon as it is done; at the end all are joined
into arrays in a second folder, which is renamed into place. So a kill costs the models in work and
no more, and no process ever sees half a set.
"""

from __future__ import annotations

import csv
import hashlib
import json
import multiprocessing
import os
import shutil
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from ffd_lightning.config import RenderConfig
from ffd_lightning.data.assembly import assemble
from ffd_lightning.data.model_file import Recipe, is_done, make_model, reject
from ffd_lightning.data.prepared import REJECTED, PreparedSet
from ffd_lightning.data.progress import ModelProgress
from ffd_lightning.data.sources.base import Source
from ffd_lightning.errors import DataError

FORMAT_VERSION = 1
"""Goes up when the same settings give another set, so that prepared data is built anew."""

_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def prepare(
    source: Source,
    category: str,
    *,
    num_points: int,
    render: RenderConfig,
    root: Path,
    workers: int = 0,
    progress: bool = True,
) -> PreparedSet:
    """Return the prepared set of a category, building what is missing of it.

    Worker processes are started afresh, so a script that calls this needs the usual
    `if __name__ == "__main__":`.

    Args:
        source: where models come from.
        category: its name.
        num_points: surface samples per model.
        render: the images.
        root: prepared sets are kept in `root/prepared`.
        workers: processes, 0 for one per core.
        progress: show on stderr how far it is.

    Raises:
        DataError: no usable model, a damaged set, or a disk that is full or not writable.
    """
    settings = {
        "format": FORMAT_VERSION,
        "source": source.fingerprint(category),
        "category": category,
        "num_points": num_points,
        "render": asdict(render),
    }
    canonical = json.dumps(settings, sort_keys=True, separators=(",", ":"))
    key = hashlib.sha256(canonical.encode()).hexdigest()[:12]
    target = Path(root) / "prepared" / f"{category}-{key}"
    if target.exists():
        return PreparedSet.open(target)
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        # A worker that is still importing the script would wait for the lock its parent holds.
        raise RuntimeError('prepare() is called outside of `if __name__ == "__main__":`')
    ids = source.model_ids(category)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _locked(target):
            if target.exists():
                return PreparedSet.open(target)
            recipe = Recipe(source, category, num_points, render, _work_folder(target))
            _build(recipe, ids, settings, target, workers or _cores(), progress)
    except OSError as error:
        raise DataError(
            f"cannot prepare {target}: {error}. Free some space there or choose another folder "
            "(paths.data=DIR); the same command continues with the models that are left"
        ) from error
    prepared = PreparedSet.open(target)
    _report(prepared)
    return prepared


def _build(
    recipe: Recipe,
    ids: Sequence[str],
    settings: dict[str, object],
    target: Path,
    workers: int,
    progress: bool,
) -> None:
    """Make the models that are not done yet and assemble the set; the caller holds its lock."""
    recipe.folder.mkdir(exist_ok=True)
    todo = [i for i in ids if not is_done(recipe, i)]
    done = len(ids) - len(todo)
    if progress:
        resumed = f" ({done} are done already)" if done else ""
        print(
            f"preparing {len(ids)} models of {recipe.category} in {target}{resumed}",
            file=sys.stderr,
        )
    try:
        with ModelProgress(recipe.category, len(ids), done, progress) as bar:
            _make_models(recipe, deque(todo), workers, bar.advance)
    except KeyboardInterrupt:
        print(
            "preparation interrupted: the same command continues with the models that are left",
            file=sys.stderr,
        )
        raise
    try:
        assemble(recipe, ids, settings, target)
    except DataError:  # all rejected: try them again when the cause may have been mended
        shutil.rmtree(recipe.folder, ignore_errors=True)
        raise
    shutil.rmtree(recipe.folder, ignore_errors=True)


def _work_folder(target: Path) -> Path:
    return target.with_name(f".{target.name}.partial")


def _cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def _locked(target: Path) -> Iterator[None]:
    """Hold the kernel's lock of a set: it is freed when its holder ends, however it ends."""
    lock = FileLock(target.with_name(f".{target.name}.lock"))
    try:
        lock.acquire(timeout=0)
    except Timeout:
        print(f"another process is preparing {target}: waiting for it", file=sys.stderr)
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


def _make_models(
    recipe: Recipe, todo: deque[str], workers: int, advance: Callable[[], None]
) -> None:
    """Make all models in `todo`; reject by name the one at which a worker process dies."""
    while todo:
        suspects = _run_pool(recipe, todo, workers, 2 * workers, advance)
        # A worker died while these were in hand. Alone, the culprit shows itself.
        while suspects:
            for culprit in _run_pool(recipe, suspects, 1, 1, advance):
                reject(recipe, culprit, "its worker process died (out of memory?)")
                advance()


def _run_pool(
    recipe: Recipe, todo: deque[str], workers: int, in_hand: int, advance: Callable[[], None]
) -> deque[str]:
    """Make models from the front of `todo` in worker processes, until none is left or one dies.

    Args:
        recipe: what to make.
        todo: emptied from the front as models are handed out.
        workers: at most so many processes.
        in_hand: at most so many models are handed out at a time.
        advance: called for every model done.

    Returns:
        The models that were in hand, and not done, when a worker died.
    """
    # spawn: a fork would copy the locks that threads of torch and of the bar may hold.
    context = multiprocessing.get_context("spawn")
    others = set(multiprocessing.active_children())
    pending: dict[Future[None], str] = {}
    with (
        _one_thread_each(),
        ProcessPoolExecutor(min(workers, len(todo)), context, _start_worker, (recipe,)) as pool,
    ):
        try:
            _check_start(pool)
            while todo or pending:
                while todo and len(pending) < in_hand:
                    pending[_submit(pool, _work, todo[0])] = todo[0]
                    todo.popleft()
                for future in wait(pending, return_when=FIRST_COMPLETED).done:
                    future.result()
                    del pending[future]
                    advance()
        except BrokenProcessPool:
            left = deque(i for i in pending.values() if not is_done(recipe, i))
            for _ in range(len(pending) - len(left)):
                advance()
            return left
        except BaseException:
            # Ctrl-C or a full disk: no reason to wait for models in work. The pool gives up when
            # its workers die; leaving it waits for that, as its thread must not outlive it.
            for process in set(multiprocessing.active_children()) - others:
                process.terminate()
            raise
    return deque()


def _check_start(pool: ProcessPoolExecutor) -> None:
    """Tell workers that cannot even start from workers that die over a model."""
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
def _one_thread_each() -> Iterator[None]:
    """Let processes that are started meanwhile use one thread; libraries read this on loading."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(_ONE_THREAD)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


# --- in a worker process ------------------------------------------------------------------------

_recipe: Recipe | None = None


def _start_worker(recipe: Recipe) -> None:
    """Keep the recipe, leave Ctrl-C to the parent, and end when the parent is gone."""
    global _recipe
    _recipe = recipe
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # for systems without the mask of `_submit`
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _work(model_id: str) -> None:
    assert _recipe is not None
    make_model(_recipe, model_id)


# --- what is said at the end --------------------------------------------------------------------


def _report(prepared: PreparedSet) -> None:
    """Say in one line what was prepared and what was rejected."""
    line = f"prepared {len(prepared)} models in {prepared.path}"
    with (prepared.path / REJECTED).open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if rows:
        first = "; ".join(f"{r['id']}: {r['reason']}" for r in rows[:3])
        more = "; ..." if len(rows) > 3 else ""
        line += f"; rejected {len(rows)} ({first}{more}), see {prepared.path / REJECTED}"
    print(line, file=sys.stderr)
