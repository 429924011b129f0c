"""Preparing a category: load, normalise, sample, render; in parallel, and safe against kills.

Each shape becomes one file of a working folder as soon as it is done; at the end all are joined
into arrays in a second folder, which is renamed into place. So a kill costs the shapes in work and
no more, and no process ever sees half a set.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import pickle
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from filelock import FileLock, Timeout

from ffd_lightning.data.preparation.assembly import assemble
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.preparation.shape_file import Failure, Recipe, is_done
from ffd_lightning.data.preparation.summary import describe, sheet_of, write_sheet
from ffd_lightning.data.preparation.workers import make_shapes
from ffd_lightning.data.sources.base import Source
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.parallel import available_cores
from ffd_lightning.progress import CountProgress

FORMAT_VERSION = 3
"""Goes up when the same settings give another set, so that prepared data is built anew."""


@dataclass(frozen=True)
class Preparation:
    """What a prepared set is made of and where it goes.

    Worker processes are started afresh, so a script that uses this needs the usual
    `if __name__ == "__main__":`.

    Args:
        source: where shapes come from.
        category: its name.
        num_points: surface samples per shape.
        render: the images.
        root: prepared sets are kept in `root/prepared`.
        workers: processes, 0 for one per core.
        timeout: seconds after which a shape is given up: it is left out.
        progress: show on stderr how far it is.
    """

    source: Source
    category: str
    num_points: int
    render: RenderSettings
    root: Path
    workers: int = 0
    timeout: float = 600.0
    progress: bool = True

    @cached_property
    def settings(self) -> dict[str, object]:
        """What decides the set, JSON-able."""
        return {
            "format": FORMAT_VERSION,
            "source": self.source.fingerprint(self.category),
            "category": self.category,
            "num_points": self.num_points,
            "render": self.render.to_json(),
        }

    @property
    def target(self) -> Path:
        """The set's folder, named by what decides it; by the timeout too if shapes were given up.

        So another timeout does not take a set for complete from which the clock left shapes out.
        """
        incomplete = self._folder({**self.settings, "timeout": float(self.timeout)})
        return incomplete if incomplete.exists() and not self._whole.exists() else self._whole

    @cached_property
    def _whole(self) -> Path:
        """The folder of the set that lacks no shape for want of time or memory."""
        return self._folder(self.settings)

    def _folder(self, settings: dict[str, object]) -> Path:
        fingerprint = settings["source"]
        try:
            if not isinstance(fingerprint, dict):
                raise TypeError(f"it is a {type(fingerprint).__name__}")
            canonical = json.dumps(settings, sort_keys=True, separators=(",", ":"))
        except (TypeError, ValueError) as error:
            raise ConfigError(
                f"the fingerprint of {type(self.source).__name__} must be a dict that JSON can "
                f"hold: {error}"
            ) from None
        key = hashlib.sha256(canonical.encode()).hexdigest()[:12]
        return Path(self.root) / "prepared" / f"{self.category}-{key}"

    def run(self) -> PreparedSet:
        """Return the prepared set, building what is missing of it.

        Raises:
            DataError: no usable shape, shapes whose files could not be read just now, a damaged
                set, or a disk that is full or not writable.
        """
        if self.target.exists():
            if self._whole.exists():  # else another process may be making it
                self._tidy()
            return PreparedSet.open(self.target)
        ids = self._ids()
        with self._disk_errors(), _locked(self._whole):
            made = not self.target.exists()  # else by the process that was waited for
            if made:
                self._assemble(ids, self._make(ids))
        prepared = PreparedSet.open(self.target)
        if made:
            _report(prepared)
        return prepared

    @property
    def recipe(self) -> Recipe:
        """How single shapes are made, and the folder they are kept in until all are done."""
        folder = self._whole.with_name(f".{self._whole.name}.partial")
        return Recipe(self.source, self.category, self.num_points, self.render, folder)

    def _ids(self) -> list[str]:
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            # A worker that is still importing the script would wait for the lock its parent holds.
            raise RuntimeError('data is prepared outside of `if __name__ == "__main__":`')
        name, ids = type(self.source).__name__, self.source.shape_ids(self.category)
        if not isinstance(ids, list) or len(set(ids)) != len(ids):
            raise ConfigError(f"shape_ids of {name} must give a list of ids, each of them once")
        try:
            pickle.dumps(self.source)
        except Exception as error:
            raise ConfigError(
                f"{name} cannot be sent to the processes that prepare its shapes: its class must "
                f"be importable, and what it holds picklable ({type(error).__name__}: {error})"
            ) from None
        return ids

    def _make(self, ids: list[str]) -> dict[str, Failure]:
        """Make the shapes that are not done yet, and return why others cannot be; under the lock.

        What failed in an earlier call is tried again: its cause may have been mended.
        """
        recipe = self.recipe
        recipe.folder.mkdir(exist_ok=True)
        todo = [i for i in ids if not is_done(recipe, i)]
        done = len(ids) - len(todo)
        if self.progress:
            resumed = f" ({done} are done already)" if done else ""
            print(
                f"preparing {len(ids)} shapes of {self.category} in {self.target}{resumed}",
                file=sys.stderr,
            )
        try:
            with CountProgress(self.category, len(ids), done, self.progress) as bar:
                workers = self.workers or available_cores()
                return make_shapes(recipe, todo, workers, self.timeout, bar.advance)
        except KeyboardInterrupt:
            print(
                "preparation interrupted: the same command resumes with the shapes that are left",
                file=sys.stderr,
            )
            raise

    def _assemble(self, ids: list[str], failures: dict[str, Failure]) -> None:
        unread = [f"{i}: {f.reason}" for i, f in failures.items() if f.kind == "unread"]
        if unread:
            raise DataError(
                f"{len(unread)} of {len(ids)} shapes of {self.category} could not be read "
                f"({'; '.join(unread[:3])}). The others are done: the same command tries these "
                "again. A source of your own raises RejectedShapeError for what cannot be used"
            )
        settings = self.settings
        if any(failure.kind == "given up" for failure in failures.values()):
            settings = {**settings, "timeout": float(self.timeout)}
        reasons = {i: failure.reason for i, failure in failures.items()}
        try:
            assemble(self.recipe, ids, reasons, settings, self._folder(settings))
        except DataError:  # none can be used, or views differ: make all again once that is mended
            self._tidy()
            raise
        self._tidy()

    def _tidy(self) -> None:
        """Remove the shapes' files once they are in the set, also after a kill in between."""
        shutil.rmtree(self.recipe.folder, ignore_errors=True)

    @contextmanager
    def _disk_errors(self) -> Iterator[None]:
        try:
            self.target.parent.mkdir(parents=True, exist_ok=True)
            yield
        except OSError as error:
            raise DataError(
                f"cannot prepare {self.target}: {error}. Free some space there or choose another "
                "folder (paths.data=DIR); the same command resumes with the shapes that are left"
            ) from error


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


def _report(prepared: PreparedSet) -> None:
    """Say what was prepared, rejected and seems wrong, and draw it."""
    lines = [*describe(prepared), write_sheet(prepared, sheet_of(prepared.path))]
    print("\n".join(lines), file=sys.stderr)
