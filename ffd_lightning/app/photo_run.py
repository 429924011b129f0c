"""From photographs on the disk to folders of what was made of them."""

from __future__ import annotations

import hashlib
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ffd_lightning.app.config import PredictConfig
from ffd_lightning.app.photo_jobs import Job, find_jobs
from ffd_lightning.checkpoint import TrainedModel
from ffd_lightning.errors import ConfigError, DataError, UserError
from ffd_lightning.files import lock_folder
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.inference.files import (
    MeshWriter,
    record,
    write_cloud,
    write_json,
    write_preview,
)
from ffd_lightning.inference.predictor import Predictor, checkpoint_of
from ffd_lightning.inference.reconstruction import Reconstruction
from ffd_lightning.inference.scenes import OBJ_TEXTURES
from ffd_lightning.parallel import available_cores, in_threads
from ffd_lightning.progress import CountProgress
from ffd_lightning.registry import range_problems

FORMAT_VERSION = 5
"""Goes up when the same photograph and settings give other files."""


@dataclass(frozen=True)
class Outcome:
    """What came of one photograph: a line about it, its warnings, or why there is nothing."""

    line: str = ""
    warnings: tuple[str, ...] = ()
    error: str = ""
    known: bool = False


def predict_files(config: PredictConfig) -> list[Outcome]:
    """Reconstruct photographs, each into its own folder below `out`.

    A photograph that cannot be used does not stop the others. What is there already, from the same
    photograph, checkpoint and settings, is not made again.

    Raises:
        ConfigError: settings that cannot work, no run or checkpoint, or no photographs.
        DataError: the checkpoint is damaged.
    """
    _check(config)
    out = Path(config.out).expanduser()
    jobs = find_jobs(config.image, config.mask, out)
    checkpoint = checkpoint_of(config.run)
    predictor = Predictor.load(checkpoint, config.device)
    model = predictor.model
    _check_candidates(model, config)
    print(f"network of {', '.join(model.categories)}; rendered images: {model.render.views}")
    writer = MeshWriter(model.bank, config.colors.value)
    digest = hashlib.sha256(checkpoint.read_bytes()).hexdigest()

    def work(job: Job) -> Outcome:
        try:
            return _predict_file(job, predictor, writer, config, digest)
        except UserError as error:
            named = str(job.image) in str(error) or str(job.folder) in str(error)
            return Outcome(error=str(error) if named else f"{job.image}: {error}")
        except Exception as error:  # the others go on
            return Outcome(error=f"{job.image}: {type(error).__name__}: {error}")

    done: dict[Path, Outcome] = {}
    show = config.progress_bar and len(jobs) > 1
    taken = f"another process writes to {out}: wait for it, or choose another out="
    with lock_folder(out, taken), CountProgress("reconstructing", len(jobs), 0, show) as bar:
        for job, outcome in in_threads(work, jobs, config.workers or available_cores()):
            done[job.folder] = outcome
            bar.advance()
            _report(job, outcome)
    return [done[job.folder] for job in jobs]


def _check(config: PredictConfig) -> None:
    """Refuse settings that cannot work."""
    if problems := range_problems(config):
        raise ConfigError("; ".join(problems))
    for name in ("run", "image", "out", "mask"):
        if getattr(config, name) == "":
            raise ConfigError(f"{name}= is empty: name a file or a folder")


def _check_candidates(model: TrainedModel, config: PredictConfig) -> None:
    """Refuse a category that the model does not know, or more candidates than it has templates."""
    asked = model.categories if config.category is None else (config.category,)
    name, most = min(
        ((name, len(model.templates_of(name))) for name in asked), key=lambda item: item[1]
    )
    if config.top_k > most:
        raise ConfigError(f"top_k={config.top_k}: the model has {most} templates of {name}")


def _predict_file(
    job: Job, predictor: Predictor, writer: MeshWriter, config: PredictConfig, digest: str
) -> Outcome:
    key = _key(job, config, digest)
    note = job.folder / "prediction.json"
    wanted = _files(job.folder, config)
    earlier = _read(note, key)
    if not config.restart and earlier is not None and all(file.is_file() for file in wanted):
        return Outcome(_line(job, earlier), tuple(earlier["image"]["warnings"]), known=True)
    start = time.perf_counter()
    photo = predictor.frame(job.image, mask=job.mask, background=config.background.value)
    framed = time.perf_counter()
    selected = predictor.predict_framed([photo], config.category)[0]
    seen = time.perf_counter()
    _clear(job.folder, wanted)
    for rank in range(config.top_k):
        place = _place(job.folder, rank)
        _write(selected.candidate(rank), place, writer, predictor.model.render, config)
    seconds = {
        "framing": framed - start,
        "network": seen - framed,
        "meshes": time.perf_counter() - seen,
    }
    content = {
        "image_file": str(job.image),
        "asked_category": config.category,
        **record(selected),
        "seconds": {name: round(value, 4) for name, value in seconds.items()},
        "trained_on": {
            "categories": list(predictor.model.categories),
            "views": predictor.model.render.views,
        },
        "checkpoint": {"run": config.run, "step": predictor.model.step, "sha256": digest},
        "key": key,
    }
    write_json(note, content)  # the last: it says that the others are whole
    return Outcome(_line(job, content), selected.warnings)


def _files(folder: Path, config: PredictConfig) -> list[Path]:
    """Return the files that are written beside the record."""
    names = ["mesh.glb", "template.glb", "lattice.glb", "cloud.ply"]
    names += ["mesh.obj", "mesh.mtl"] if config.obj else []
    names += ["preview.png"] if config.preview else []
    return [_place(folder, rank) / name for rank in range(config.top_k) for name in names]


def _place(folder: Path, rank: int) -> Path:
    """Return where the files of a candidate go."""
    return folder if rank == 0 else folder / f"candidate-{rank + 1}"


def _clear(folder: Path, wanted: Sequence[Path]) -> None:
    """Remove what other settings left, the record first: it says that the rest is whole."""
    names = {file.name for file in _files(folder, PredictConfig(obj=True))}
    (folder / "prediction.json").unlink(missing_ok=True)
    for place in (folder, *filter(Path.is_dir, folder.glob("candidate-*"))):
        for name in names:
            if place / name not in wanted:
                (place / name).unlink(missing_ok=True)
        for texture in place.glob(OBJ_TEXTURES):
            texture.unlink()
        if place != folder and not any(place.iterdir()):
            place.rmdir()


def _write(
    reconstruction: Reconstruction,
    folder: Path,
    writer: MeshWriter,
    view: RenderSettings,
    config: PredictConfig,
) -> None:
    writer.write(reconstruction, folder, config.obj)
    write_cloud(
        reconstruction, folder / "cloud.ply", config.points, config.seed, config.colors.value
    )
    if config.preview:
        write_preview(reconstruction, folder / "preview.png", view)


def _key(job: Job, config: PredictConfig, digest: str) -> str:
    """Return what changes when the files would be others."""
    content = [
        FORMAT_VERSION,
        digest,
        *(hashlib.sha256(_bytes(path)).hexdigest() for path in (job.image, job.mask) if path),
        config.background.value,
        config.category,
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
    template, category = content["template"], content["category"]
    found = f"{template['id']} ({template['weight']:.2f})"
    others = [name for name in category["weights"] if name != category["name"]]
    if others:  # the first is the runner-up, or what the network would have said
        own, other = (category["weights"][name] for name in (category["name"], others[0]))
        found = f"{category['name']} ({own:.2f}; {others[0]} {other:.2f}), {found}"
    return f"{job.image}: {found} -> {job.folder}"


def _report(job: Job, outcome: Outcome) -> None:
    if outcome.error:
        print(f"error: {outcome.error}", file=sys.stderr)
        return
    print(outcome.line)
    for warning in outcome.warnings:
        print(f"warning: {job.image}: {warning}", file=sys.stderr)
