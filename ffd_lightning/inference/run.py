"""From photographs on the disk to folders of what was made of them."""

from __future__ import annotations

import glob
import hashlib
import json
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning.cli import explain
from ffd_lightning.config import PredictConfig, RenderConfig, typed_config
from ffd_lightning.data.progress import ModelProgress
from ffd_lightning.data.workers import available_cores
from ffd_lightning.errors import ConfigError, DataError, UserError
from ffd_lightning.evaluation.threads import in_threads
from ffd_lightning.inference.files import (
    MeshWriter,
    record,
    write_cloud,
    write_json,
    write_preview,
)
from ffd_lightning.inference.predictor import Predictor, checkpoint_of
from ffd_lightning.inference.reconstruction import Reconstruction

_SUFFIXES = frozenset(
    (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".gif", ".tif", ".tiff", ".ppm", ".heic", ".avif")
)
"""What is taken for an image in a folder; what of it cannot be read is named."""

FORMAT_VERSION = 1
"""Goes up when the same photograph and settings give other files."""


@dataclass(frozen=True)
class Job:
    """One photograph, the mask of its object if there is one, and where its files go."""

    image: Path
    mask: Path | None
    folder: Path


@dataclass(frozen=True)
class Outcome:
    """What came of one photograph: a line about it, its warnings, or why there is nothing."""

    line: str = ""
    warnings: tuple[str, ...] = ()
    error: str = ""
    known: bool = False


def predict_job(cfg: DictConfig) -> None:
    """Reconstruct what Hydra was given; the exit code is 1 if a photograph failed."""
    try:
        config = typed_config(cfg, PredictConfig)
        outcomes = predict_files(config)
    except (UserError, OmegaConfBaseException) as error:
        # Not as an exception: Hydra would put a line of its own above it.
        sys.exit(f"error: {explain(error)}")
    failed = sum(bool(outcome.error) for outcome in outcomes)
    known = sum(outcome.known for outcome in outcomes)
    if len(outcomes) > 1 or known:
        there = f", {known} of them there already (restart=true does them again)" if known else ""
        print(f"{len(outcomes) - failed} of {len(outcomes)} photographs done{there}: {config.out}")
    sys.exit(int(failed > 0))


def predict_files(config: PredictConfig) -> list[Outcome]:
    """Reconstruct photographs, each into its own folder below `out`.

    A photograph that cannot be used does not stop the others. What is there already, from the same
    photograph, checkpoint and settings, is not made again.

    Raises:
        ConfigError: settings that cannot work, no run or checkpoint, or no photographs.
        DataError: the checkpoint is damaged.
    """
    if config.points < 1 or config.top_k < 1:
        raise ConfigError(f"points={config.points} and top_k={config.top_k} must each be 1 or more")
    jobs = find_jobs(config.image, config.mask, Path(config.out).expanduser())
    checkpoint = checkpoint_of(config.run)
    predictor = Predictor.load(checkpoint, config.device)
    bank = predictor.model.bank
    if config.top_k > len(bank):
        raise ConfigError(f"top_k={config.top_k}: the run has {len(bank)} templates")
    writer = MeshWriter(bank, config.colors)
    digest = hashlib.sha256(checkpoint.read_bytes()).hexdigest()

    def work(job: Job) -> Outcome:
        try:
            return _predict_file(job, predictor, writer, config, digest)
        except UserError as error:
            return Outcome(error=str(error))
        except Exception as error:  # the others go on
            return Outcome(error=f"{job.image}: {type(error).__name__}: {error}")

    done: dict[Path, Outcome] = {}
    show = config.progress_bar and len(jobs) > 1
    with ModelProgress("reconstructing", len(jobs), 0, show) as bar:
        for job, outcome in in_threads(work, jobs, config.workers or available_cores()):
            done[job.folder] = outcome
            bar.advance()
            _report(job, outcome)
    return [done[job.folder] for job in jobs]


def find_jobs(image: Any, mask: str | None, out: Path) -> list[Job]:
    """Return the photographs that `image` names, sorted within a folder or pattern.

    Raises:
        ConfigError: it names none, or `mask` does not fit them.
    """
    entries = [image] if isinstance(image, str) else image
    if not isinstance(entries, list) or not all(isinstance(e, str) for e in entries):
        raise ConfigError("image= takes a file, a folder, a pattern, or a list [a.png,b.png]")
    images = list(dict.fromkeys(path for entry in entries for path in _expand(entry)))
    if not images:
        raise ConfigError(f"image={image}: no images there")
    folders = [out / name for name in _names(images)]
    masks = _masks(images, Path(mask).expanduser()) if mask is not None else [None] * len(images)
    return [Job(*job) for job in zip(images, masks, folders, strict=True)]


def _expand(entry: str) -> list[Path]:
    path = Path(entry).expanduser()
    if path.is_dir():
        return sorted(file for file in path.iterdir() if file.suffix.lower() in _SUFFIXES)
    if path.exists() or not glob.has_magic(entry):
        return [path]
    return sorted(p for p in map(Path, glob.glob(str(path), recursive=True)) if p.is_file())


def _names(images: Sequence[Path]) -> list[str]:
    """Return a folder's name for each image: its stem, with its suffix or a number if need be."""
    stems = Counter(image.stem for image in images)
    names: dict[str, None] = {}
    for image in images:
        name = image.stem if stems[image.stem] == 1 else image.name
        tries = (name if k == 1 else f"{name}-{k}" for k in range(1, len(images) + 2))
        names[next(t for t in tries if t not in names)] = None
    return list(names)


def _masks(images: Sequence[Path], mask: Path) -> list[Path | None]:
    if mask.is_dir():
        found = {file.stem: file for file in sorted(mask.iterdir()) if file.is_file()}
        missing = [image for image in images if image.stem not in found]
        if missing:
            raise ConfigError(f"mask={mask}: no mask named {missing[0].stem}.* is in that folder")
        return [found[image.stem] for image in images]
    if len(images) > 1:
        raise ConfigError(f"mask={mask}: for several images give a folder of masks of their names")
    return [mask]


def _predict_file(
    job: Job, predictor: Predictor, writer: MeshWriter, config: PredictConfig, digest: str
) -> Outcome:
    key = _key(job, config, digest)
    note = job.folder / "prediction.json"
    if not config.restart and (earlier := _read(note, key)) is not None:
        return Outcome(_line(job, earlier), known=True)
    start = time.perf_counter()
    photo = predictor.frame(job.image, mask=job.mask, background=config.background)
    framed = time.perf_counter()
    selected = predictor.predict_framed([photo])[0]
    seen = time.perf_counter()
    for rank in range(config.top_k):
        folder = job.folder if rank == 0 else job.folder / f"candidate-{rank + 1}"
        _write(selected.candidate(rank), folder, writer, predictor.model.config.data.render, config)
    seconds = {
        "framing": framed - start,
        "network": seen - framed,
        "meshes": time.perf_counter() - seen,
    }
    content = {
        "image_file": str(job.image),
        **record(selected),
        "seconds": {name: round(value, 4) for name, value in seconds.items()},
        "checkpoint": {"run": config.run, "step": predictor.model.step, "sha256": digest},
        "key": key,
    }
    write_json(note, content)  # the last: it says that the others are whole
    return Outcome(_line(job, content), photo.warnings)


def _write(
    reconstruction: Reconstruction,
    folder: Path,
    writer: MeshWriter,
    view: RenderConfig,
    config: PredictConfig,
) -> None:
    writer.write(reconstruction, folder, config.obj)
    write_cloud(reconstruction, folder / "cloud.ply", config.points, config.seed, config.colors)
    if config.preview:
        write_preview(reconstruction, folder / "preview.png", view)


def _key(job: Job, config: PredictConfig, digest: str) -> str:
    """Return what changes when the files would be others."""
    content = [
        FORMAT_VERSION,
        digest,
        *(hashlib.sha256(_bytes(path)).hexdigest() for path in (job.image, job.mask) if path),
        config.background.value,
        config.top_k,
        config.points,
        config.colors.value,
        config.obj,
        config.preview,
        config.seed,
    ]
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()


def _bytes(path: Path) -> bytes:
    try:
        if path.exists() and not path.is_file():
            raise DataError(f"{path} is not a file")  # reading a pipe would wait for ever
        return path.read_bytes()
    except OSError as error:
        raise DataError(f"{path} cannot be read: {error.strerror}") from None


def _read(note: Path, key: str) -> dict[str, Any] | None:
    """Return an earlier record of the same key, None if there is none."""
    try:
        content: dict[str, Any] = json.loads(note.read_text(encoding="utf-8"))
        return content if content["key"] == key else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _line(job: Job, content: dict[str, Any]) -> str:
    template = content["template"]
    return f"{job.image}: {template['id']} ({template['weight']:.2f}) -> {job.folder}"


def _report(job: Job, outcome: Outcome) -> None:
    if outcome.error:
        print(f"error: {outcome.error}", file=sys.stderr)
        return
    print(outcome.line)
    for warning in outcome.warnings:
        print(f"warning: {job.image}: {warning}", file=sys.stderr)
