"""Preparing a category: load, normalise, sample, render; in parallel, and safe against kills.

Each shape becomes one file of a working folder as soon as it is done; at the end the manifest is
written and the folder renamed into place. So a kill costs the shapes in work and no more, and no
process ever sees half a set.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import multiprocessing
import pickle
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout

from ffd_lightning.data.preparation.overview import describe, sheet_of, write_sheet
from ffd_lightning.data.preparation.prepared import (
    FORMAT_VERSION,
    MANIFEST,
    PreparedSet,
    digest_of,
)
from ffd_lightning.data.preparation.prepared_shape import Failure, Recipe, is_done, shape_file
from ffd_lightning.data.preparation.workers import make_shapes
from ffd_lightning.data.source import Source
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.files import write_atomic
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.parallel import available_cores
from ffd_lightning.progress import CountProgress

_PACKAGES = ("ffd_lightning", "numpy", "embreex")


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
        limit: take so many shapes at most, evenly spread over their ids.
        workers: processes, 0 for one per core.
        timeout: seconds after which a shape is given up: it is left out.
        progress: show on stderr how far it is.
    """

    source: Source
    category: str
    num_points: int
    render: RenderSettings
    root: Path
    limit: int | None = None
    workers: int = 0
    timeout: float = 600.0
    progress: bool = True

    def __post_init__(self) -> None:
        if self.limit is not None and self.limit < 1:
            raise ConfigError(f"limit={self.limit} must be 1 or more")

    @property
    def shape_ids(self) -> list[str]:
        """The ids of the shapes to prepare, sorted."""
        ids = self.source.shape_ids(self.category)
        if self.limit is None or not isinstance(ids, list):
            return ids
        count = min(self.limit, len(ids))
        return [ids[k * len(ids) // count] for k in range(count)]

    @cached_property
    def settings(self) -> dict[str, object]:
        """What decides the set, JSON-able."""
        fingerprint = self.source.fingerprint(self.category)
        if self.limit is not None and isinstance(fingerprint, dict):
            fingerprint = {**fingerprint, "limit": self.limit}
        return {
            "format": FORMAT_VERSION,
            "source": fingerprint,
            "category": self.category,
            "num_points": self.num_points,
            "render": asdict(self.render),
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
        if self._missing() == []:
            return PreparedSet.open(self.target)
        ids = self._ids()
        with self._disk_errors(), _locked(self._whole):
            missing = self._missing()
            if missing is None:
                self._make_set(ids)
            elif missing:  # somebody removed what was damaged
                failures = self._make(missing, self.target)
                if failures:
                    raise DataError(f"{self.target} cannot be mended: {_some(failures)}")
        prepared = PreparedSet.open(self.target)
        if missing is None:
            lines = [*describe(prepared), write_sheet(prepared, sheet_of(prepared.path))]
            print("\n".join(lines), file=sys.stderr)
        return prepared

    def try_some(self, ids: Sequence[str]) -> tuple[PreparedSet | None, dict[str, str]]:
        """Prepare some shapes into a set of their own, below `root`.

        Args:
            ids: of the shapes.

        Returns:
            The set, None where all are rejected; and why shapes are not in it.
        """
        folder = Path(self.root) / f"{self.category}-trial"
        folder.mkdir()
        failures = self._make(ids, folder)
        reasons = {i: failures[i].reason for i in ids if i in failures}
        if len(reasons) == len(ids):
            return None, reasons
        _write_manifest(folder, ids, reasons, self.settings)
        return PreparedSet.open(folder), reasons

    def _missing(self) -> list[str] | None:
        """Return the shapes whose files are missing from the set, None where there is no set."""
        if not self.target.exists():
            return None
        try:
            manifest = json.loads((self.target / MANIFEST).read_bytes())
            there = {path.name for path in self.target.iterdir()}
            return [i for i in manifest["ids"] if shape_file(self.target, i).name not in there]
        except (OSError, ValueError, TypeError, KeyError):
            return []  # it is damaged, and opening it says so

    def _ids(self) -> list[str]:
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            # A worker that is still importing the script would wait for the lock its parent holds.
            raise RuntimeError('data is prepared outside of `if __name__ == "__main__":`')
        name, ids = type(self.source).__name__, self.shape_ids
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

    def _make(self, ids: Sequence[str], folder: Path) -> dict[str, Failure]:
        """Make the shapes that are not done yet, and return why others cannot be; under the lock.

        What failed in an earlier call is tried again: its cause may have been mended.
        """
        recipe = Recipe(self.source, self.category, self.num_points, self.render, folder)
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

    def _make_set(self, ids: list[str]) -> None:
        """Make all shapes in a working folder, then put it in its place."""
        folder = self._whole.with_name(f".{self._whole.name}.partial")
        folder.mkdir(exist_ok=True)
        failures = self._make(ids, folder)
        if unread := {i: f for i, f in failures.items() if f.kind == "unread"}:
            raise DataError(
                f"{len(unread)} of {len(ids)} shapes of {self.category} could not be read "
                f"({_some(unread)}). The others are done: the same command tries these "
                "again. A source of your own raises RejectedShapeError for what cannot be used"
            )
        good = [i for i in ids if i not in failures]
        if not good:
            found = f"all {len(ids)} are rejected ({_some(failures)})" if ids else "there are none"
            raise DataError(f"no usable shape of {self.category}: {found}")
        settings = self.settings
        if any(failure.kind == "given up" for failure in failures.values()):
            settings = {**settings, "timeout": float(self.timeout)}
        wanted = {shape_file(folder, shape_id).name for shape_id in good}
        for path in folder.iterdir():  # what kills left behind
            if path.name not in wanted:
                path.unlink()
        reasons = {i: failures[i].reason for i in ids if i in failures}
        _write_manifest(folder, ids, reasons, settings)
        folder.rename(self._folder(settings))

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


def _some(failures: Mapping[str, Failure]) -> str:
    """Return the first few shapes that failed, and why."""
    return "; ".join(f"{i}: {failure.reason}" for i, failure in sorted(failures.items())[:3])


def _write_manifest(
    folder: Path, ids: Sequence[str], reasons: Mapping[str, str], settings: Mapping[str, Any]
) -> None:
    """Write what is known of all shapes together.

    Args:
        folder: where their files are.
        ids: the shapes that were tried, in the order of the set.
        reasons: why shapes are not in it, by id.
        settings: what decides the set.

    Raises:
        DataError: shapes have other numbers of views.
    """
    good = [i for i in ids if i not in reasons]
    families, warnings, image_shape = [], {}, None
    part_names: dict[str, None] = {}
    for shape_id in good:
        with np.load(shape_file(folder, shape_id), allow_pickle=False) as arrays:
            shape = arrays["image_shape"].tolist()
            image_shape = image_shape or shape
            if shape != image_shape:
                for done in folder.iterdir():  # all shapes are made anew once that is mended
                    done.unlink()
                raise DataError(
                    f"{shape_id} of {settings['category']} has images {shape}, others have "
                    f"{image_shape}: the source must give all shapes as many views"
                )
            families.append(str(arrays["family"]))
            part_names |= dict.fromkeys(arrays["part_names"].tolist())
            if lines := str(arrays["warning"]).splitlines():
                warnings[shape_id] = lines
    versions = {}
    for package in _PACKAGES:
        with suppress(importlib.metadata.PackageNotFoundError):
            versions[package] = importlib.metadata.version(package)
    manifest = {
        "settings": settings,
        "versions": versions,
        "sha256": digest_of([settings, good]),
        "image_shape": image_shape,
        "part_names": list(part_names),
        "ids": good,
        "families": families,
        "rejected": reasons,
        "warnings": warnings,
    }
    write_atomic(folder / MANIFEST, json.dumps(manifest, indent=1) + "\n")
