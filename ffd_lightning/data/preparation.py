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
import time
import zipfile
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout
from numpy.lib.format import open_memmap
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeRemainingColumn,
)

from ffd_lightning.config import RenderConfig
from ffd_lightning.data.mesh import Mesh
from ffd_lightning.data.prepared import MANIFEST, UNKNOWN_PART, PreparedSet, file_digest
from ffd_lightning.data.rendering import render
from ffd_lightning.data.sources.base import Source
from ffd_lightning.errors import DataError, RejectedModelError
from ffd_lightning.geometry.normalization import normalize
from ffd_lightning.geometry.sampling import sample_surface

FORMAT_VERSION = 1
_QUIET_INTERVAL = 10.0
_PER_MODEL = ("images", "points", "face_ids", "point_parts")
# Barycentric coordinates spread over a face, (36, 3).
_FACE_PLACES = np.array([(i, j, 7 - i - j) for i in range(8) for j in range(8 - i)]) / 7
_PACKED = ("vertices", "faces", "face_parts", "face_colors")


@dataclass(frozen=True)
class _Job:
    """All that a worker needs for one model."""

    source: Source
    category: str
    num_points: int
    render: RenderConfig
    folder: Path

    def file(self, model_id: str) -> Path:
        """Where a finished model goes; ids may hold anything, names of files may not."""
        return self.folder / f"{hashlib.sha256(model_id.encode()).hexdigest()[:24]}.npz"

    def rejection(self, model_id: str) -> Path:
        return self.file(model_id).with_suffix(".rejected")


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

    Args:
        source: where models come from.
        category: its name.
        num_points: surface samples per model.
        render: the images.
        root: prepared sets are kept in `root/prepared`.
        workers: processes, 0 for one per core.
        progress: show a bar on stderr (lines now and then where that is no terminal).

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
    key = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:12]
    target = Path(root) / "prepared" / f"{category}-{key}"
    if target.exists():
        return PreparedSet.open(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _locked(target, progress):
            if target.exists():
                return PreparedSet.open(target)
            work = target.with_name(f".{target.name}.partial")
            work.mkdir(exist_ok=True)
            job = _Job(source, category, num_points, render, work)
            ids = source.model_ids(category)
            _make_models(job, ids, workers or _cores(), progress, target)
            _assemble(job, ids, settings, target)
            shutil.rmtree(work, ignore_errors=True)
    except OSError as error:
        raise DataError(f"cannot prepare {target}: {error}") from error
    prepared = PreparedSet.open(target)
    _report(prepared)
    return prepared


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _locked(target: Path, progress: bool) -> FileLock:
    """Take the kernel's lock of a set: freed when its holder ends, however it ends."""
    lock = FileLock(target.with_name(f".{target.name}.lock"))
    try:
        lock.acquire(timeout=0)
    except Timeout:
        if progress:
            print(f"another process is preparing {target}: waiting for it", file=sys.stderr)
        lock.acquire()
    return lock


# --- one model ---------------------------------------------------------------------------------


def _make_model(job: _Job, model_id: str) -> None:
    """Write one model's file, or the reason why it is rejected."""
    try:
        arrays = _model_arrays(job, model_id)
    except RejectedModelError as error:
        _write_rejection(job, model_id, str(error))
    except OSError:
        raise  # a full disk, say: no fault of this model
    except Exception as error:  # one odd model must not end hours of work
        _write_rejection(job, model_id, f"{type(error).__name__}: {error}")
    else:
        file = job.file(model_id)
        temporary = file.with_suffix(f".{os.getpid()}.tmp")
        with temporary.open("wb") as stream:
            np.savez(stream, **arrays)
        temporary.replace(file)


def _model_arrays(job: _Job, model_id: str) -> dict[str, Any]:
    model = job.source.load(job.category, model_id)
    mesh = model.mesh
    mesh = mesh.with_vertices(normalize(mesh.vertices, mesh.faces))
    key = hashlib.sha256(f"{job.category}/{model_id}".encode()).digest()
    points, face_ids = sample_surface(
        mesh.vertices, mesh.faces, job.num_points, np.random.default_rng(list(key))
    )
    images = [
        render(
            mesh,
            height=job.render.height,
            width=job.render.width,
            elevation=job.render.elevation,
            azimuth=azimuth,
            samples=job.render.samples,
        )
        for azimuth in job.render.azimuths
    ]
    parts = mesh.face_parts
    if parts is None:
        parts = np.full(len(mesh.faces), UNKNOWN_PART, np.uint8)
    return {
        "images": np.stack(images),
        "points": points.astype(np.float32),
        "face_ids": face_ids.astype(np.int32),
        "point_parts": parts[face_ids],
        "vertices": mesh.vertices.astype(np.float32),
        "faces": mesh.faces.astype(np.int32),
        "face_parts": parts,
        "face_colors": _plain_colors(mesh),
        "family": np.str_(model.family),
        "part_names": np.array(mesh.part_names, dtype=np.str_),
    }


def _plain_colors(mesh: Mesh) -> NDArray[np.uint8]:
    """Return one colour per face, (F, 4) uint8: the mean of its texture at a few places on it."""
    colors = mesh.face_colors.copy()
    if mesh.face_textures is None or mesh.face_uvs is None:
        return colors
    places = np.einsum("pc,fcd->fpd", _FACE_PLACES, mesh.face_uvs) % 1.0
    for index, texture in enumerate(mesh.textures):
        u, v = np.moveaxis(places[mesh.face_textures == index], -1, 0)
        height, width = texture.shape[:2]
        rows = np.minimum(((1 - v) * height).astype(int), height - 1)
        columns = np.minimum((u * width).astype(int), width - 1)
        colors[mesh.face_textures == index] = np.round(texture[rows, columns].mean(axis=1))
    return colors


def _write_rejection(job: _Job, model_id: str, reason: str) -> None:
    file = job.rejection(model_id)
    temporary = file.with_suffix(f".{os.getpid()}.tmp")
    temporary.write_text(reason, encoding="utf-8")
    temporary.replace(file)


# --- all models --------------------------------------------------------------------------------


def _start_worker() -> None:
    """Make a worker leave Ctrl-C to the parent, and end when the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _make_models(job: _Job, ids: Sequence[str], workers: int, progress: bool, target: Path) -> None:
    """Make all models that are not done yet."""
    todo = [i for i in ids if not _is_done(job, i)]
    if not todo:
        return
    with _Bar(job.category, len(ids), len(ids) - len(todo), progress, target) as advance:
        suspects = _run_pool(job, todo, workers, advance)
        # A worker died. Models go alone now, so that the culprit can be told from its neighbours.
        for model_id in suspects:
            if _run_pool(job, [model_id], 1, advance):
                _write_rejection(job, model_id, "its worker process died (out of memory?)")
                advance()


def _is_done(job: _Job, model_id: str) -> bool:
    if job.rejection(model_id).exists():
        return True
    file = job.file(model_id)
    try:
        with np.load(file, allow_pickle=False) as arrays:
            return set(_PER_MODEL + _PACKED) <= set(arrays.files)
    except FileNotFoundError:
        return False
    except (OSError, ValueError, EOFError, zipfile.BadZipFile):
        file.unlink(missing_ok=True)
        return False


def _run_pool(job: _Job, ids: Sequence[str], workers: int, advance: Any) -> list[str]:
    """Make models in worker processes; return those left undone by a worker's death."""
    # spawn: a fork would copy the threads' locks of torch and of the progress bar.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(workers, len(ids)), context, _start_worker)
    waiting = iter(ids)
    pending: dict[Future[None], str] = {}
    try:
        while True:
            for model_id in waiting:
                pending[pool.submit(_make_model, job, model_id)] = model_id
                if len(pending) >= 4 * workers:
                    break
            if not pending:
                return []
            for future in wait(pending, return_when=FIRST_COMPLETED).done:
                future.result()
                del pending[future]
                advance()
    except BrokenProcessPool:
        return [i for i in ids if not _is_done(job, i)]
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


class _Bar:
    """Progress on stderr: a bar on a terminal, else a line every few seconds."""

    def __init__(self, category: str, total: int, done: int, show: bool, target: Path) -> None:
        self.category, self.total, self.done, self.show = category, total, done, show
        self.target, self.start, self.made, self.last = target, time.monotonic(), 0, 0.0
        self.bar: Progress | None = None

    def __enter__(self) -> Any:
        if not self.show:
            return lambda: None
        resumed = f" ({self.done} are done already)" if self.done else ""
        print(
            f"preparing {self.total} models of {self.category} in {self.target}{resumed}",
            file=sys.stderr,
        )
        if sys.stderr.isatty():
            self.bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[rate]}"),
                TimeRemainingColumn(),
                console=Console(stderr=True),
            )
            self.bar.start()
            self.task = self.bar.add_task(
                self.category, total=self.total, completed=self.done, rate=""
            )
        return self.advance

    def advance(self) -> None:
        """Count one model."""
        self.made += 1
        elapsed = max(time.monotonic() - self.start, 1e-9)
        rate = self.made / elapsed
        if self.bar is not None:
            self.bar.update(self.task, advance=1, rate=f"{rate:.1f}/s")
        elif elapsed - self.last > _QUIET_INTERVAL:
            self.last = elapsed
            left = self.total - self.done - self.made
            print(
                f"  {self.done + self.made} of {self.total} models, {rate:.1f}/s, about "
                f"{left / rate:.0f} s left",
                file=sys.stderr,
            )

    def __exit__(self, *_: object) -> None:
        if self.bar is not None:
            self.bar.stop()


# --- the set -----------------------------------------------------------------------------------


def _assemble(job: _Job, ids: Sequence[str], settings: dict[str, Any], target: Path) -> None:
    """Join the models' files into arrays and put the finished folder in place."""
    good = [i for i in ids if job.file(i).exists()]
    rejected = [
        (i, job.rejection(i).read_text(encoding="utf-8")) for i in ids if job.rejection(i).exists()
    ]
    if not good:
        reasons = "; ".join(f"{i}: {why}" for i, why in rejected[:3]) or "there are no models"
        raise DataError(f"no usable model of {job.category} ({reasons})")
    folder = target.with_name(f".{target.name}.tmp")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    with (folder / "rejected.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([("id", "reason"), *rejected])
    families, part_names = _write_arrays(job, good, folder)
    names = sorted(path.stem for path in folder.glob("*.npy"))
    manifest = {
        "settings": settings,
        "ids": good,
        "families": families,
        "part_names": part_names,
        "rejected": len(rejected),
        "files": {name: _facts(folder / f"{name}.npy") for name in names},
    }
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")
    for path in folder.iterdir():
        _sync(path)
    folder.rename(target)
    _sync(target.parent)


def _write_arrays(job: _Job, ids: Sequence[str], folder: Path) -> tuple[list[str], list[str]]:
    """Write all arrays; return the families by model and the names of the parts."""
    offsets = np.zeros((len(ids) + 1, 2), np.int64)
    families: list[str] = []
    part_names: list[str] = []
    for row, model in enumerate(_models(job, ids)):
        offsets[row + 1] = offsets[row] + (len(model["vertices"]), len(model["faces"]))
        families.append(str(model["family"]))
        part_names += [str(n) for n in model["part_names"] if str(n) not in part_names]
    arrays: dict[str, np.memmap] = {}
    skipped = () if part_names else ("point_parts", "face_parts")
    for row, model in enumerate(_models(job, ids)):
        numbers = [part_names.index(str(n)) for n in model["part_names"]]
        table = np.full(256, UNKNOWN_PART, np.uint8)
        table[: len(numbers)] = numbers
        for name in (*_PER_MODEL, *_PACKED):
            if name in skipped:
                continue
            value = table[model[name]] if name.endswith("parts") else model[name]
            if name in _PER_MODEL:
                shape, place = (len(ids), *value.shape), row
            else:
                axis = 0 if name == "vertices" else 1
                shape = (offsets[-1, axis], *value.shape[1:])
                place = slice(offsets[row, axis], offsets[row + 1, axis])
            if name not in arrays:
                arrays[name] = open_memmap(
                    folder / f"{name}.npy", "w+", dtype=value.dtype, shape=tuple(map(int, shape))
                )
            arrays[name][place] = value
    for array in arrays.values():
        array.flush()
    np.save(folder / "mesh_offsets.npy", offsets)
    return families, part_names


def _models(job: _Job, ids: Sequence[str]) -> Iterator[Any]:
    for model_id in ids:
        with np.load(job.file(model_id), allow_pickle=False) as arrays:
            yield arrays


def _facts(file: Path) -> dict[str, Any]:
    array = np.load(file, mmap_mode="r", allow_pickle=False)
    return {
        "shape": list(array.shape),
        "dtype": str(array.dtype),
        "bytes": file.stat().st_size,
        "sha256": file_digest(file),
    }


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _report(prepared: PreparedSet) -> None:
    """Say in one line what was prepared and what was rejected."""
    line = f"prepared {len(prepared)} models in {prepared.path}"
    rejected = prepared.manifest["rejected"]
    if rejected:
        with (prepared.path / "rejected.csv").open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        first = "; ".join(f"{r['id']}: {r['reason']}" for r in rows[:3])
        more = "; ..." if rejected > 3 else ""
        line += f"; rejected {rejected} ({first}{more}), see {prepared.path / 'rejected.csv'}"
    print(line, file=sys.stderr)
