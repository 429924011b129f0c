"""Reconstruct what photographs show.

    ffd predict                                     photographs that come with a checkout
    ffd predict image=photo.png                     by the model that comes with the package
    ffd predict image=photo.png category=chair      a known category is not guessed
    ffd predict run=runs/demo/table/r/t16/seed0 image=photos out=predictions
    ffd predict run=last.ckpt 'image=photos/*.jpg' mask=masks
    ffd predict image=[a.png,b.png] points=200000 top_k=3 obj=true colors=parts
    ffd predict run=RUN image=photo.png templates=my_meshes up=z yaw=180

Writes for each image a folder below `out`: mesh.glb (the deformed template, subdivided),
template.glb, lattice.glb (control cage before and after), cloud.ply, prediction.json and
preview.png; with top_k=3 the next candidates too. An object is cut out by a mask, by
transparency, or by the border's colour. A network of heads=conditioned takes any meshes as
templates: a folder, files or a pattern (obj, glb, gltf, ply, off, stl). The same command again
makes only what is not there yet. The exit code is 1 if a photograph failed.
"""

from __future__ import annotations

import glob
import hashlib
import json
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from PIL import Image

from ffd_lightning.app.config import TemplateSettings
from ffd_lightning.app.configuration import config_folder
from ffd_lightning.components import NotNegative, Positive
from ffd_lightning.data.reading.files import is_hidden
from ffd_lightning.errors import ConfigError, DataError, UserError
from ffd_lightning.files import lock_folder, read_json, write_json
from ffd_lightning.imaging.framing import Background, Box, FramedPhoto
from ffd_lightning.imaging.photos import FORMATS
from ffd_lightning.inference.files import (
    record,
    write_cloud,
    write_meshes,
    write_preview,
)
from ffd_lightning.inference.own_templates import check_apart
from ffd_lightning.inference.pieces import MeshColors
from ffd_lightning.inference.predictor import Predictor, checkpoint_of
from ffd_lightning.inference.scenes import OBJ_TEXTURES
from ffd_lightning.parallel import available_cores, in_threads
from ffd_lightning.progress import CountProgress

MAIN = "image"
_PHOTOS = config_folder("examples/photos")
ALONE = _PHOTOS.is_dir()  # only in a checkout
FORMAT_VERSION = 8
"""Goes up when the same photograph and settings give other files."""

_SUFFIXES = {".heic", *(x for x, kind in Image.registered_extensions().items() if kind in FORMATS)}
"""What is taken for an image in a folder; what of it cannot be read is named."""
_RECORD, _UNFINISHED = "prediction.json", "unfinished.json"
_MESHES = ("mesh.glb", "template.glb", "lattice.glb", "cloud.ply")
_OBJ = ("mesh.obj", "mesh.mtl", OBJ_TEXTURES)
_PREVIEW = ("preview.png",)
_ELSEWHERE = (
    *("run", "image", "out", "mask", "workers", "device", "progress_bar", "restart"),
    *("templates", "up", "yaw", "data_root"),  # the templates' own digest says more
)
"""Settings that do not decide what is written of a photograph."""


@dataclass
class Settings(TemplateSettings):
    """Settings of `ffd predict`.

    Attributes:
        run: a run folder or a checkpoint file; null for the model that comes with the package.
        image: a file, a folder, a pattern such as `photos/*.png`, or a list of those; null for
            examples/photos.
        category: of the objects in all images, one that the model knows; null lets it guess.
        out: each image has a folder below it.
        mask: a file, or for several images a folder of masks with the images' names.
        box: left,top,right,bottom of the object in pixels of the one photograph, with a little room
            around it: GrabCut finds the object in it (needs the extra `photos`).
        together: all images show one object, from several sides; they give one reconstruction, in a
            folder named after the first.
        background: what separates the object from its background, where no mask is given: `auto`,
            the alpha channel, else the colour of the border; `rembg`, the package of that name.
        data_root: the meshes of templates= are prepared once, and kept there.
        top_k: how many templates are deformed, the selected one first.
        points: how many `cloud.ply` has.
        colors: of meshes: `photo`, the photograph's; `material`, the template's; `parts`, one for
            each part. By default photo, where the network tells from which side a photograph was
            taken, or was trained on images from one side; else material.
        obj: writes `mesh.obj` too.
        preview: draws a picture of each.
        seed: decides which points are drawn.
        workers: threads, 0 for one per core.
        device: auto, cpu, cuda, cuda:1, ...
        progress_bar: shows how far it is.
        restart: makes again what is there.
    """

    run: str | None = None
    image: list[str] | None = None
    category: str | None = None
    out: str = "predictions"
    mask: str | None = None
    box: Box | None = None
    together: bool = False
    background: Background = "auto"
    data_root: str = "data"
    top_k: Positive = 1
    points: Positive = 16384
    colors: MeshColors | None = None
    obj: bool = False
    preview: bool = True
    seed: NotNegative = 0
    workers: NotNegative = 0
    device: str = "auto"
    progress_bar: bool = True
    restart: bool = False


@dataclass(frozen=True)
class Job:
    """One photograph, the mask of its object if there is one, and where its files go.

    `others` show the same object.
    """

    image: Path
    mask: Path | None
    folder: Path
    others: tuple[Job, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """What came of one photograph: a line about it, its warnings, or why there is nothing."""

    line: str = ""
    warnings: tuple[str, ...] = ()
    error: str = ""
    known: bool = False


def main(settings: Settings) -> int:
    """Reconstruct photographs, and say how many."""
    outcomes = predict_files(settings)
    failed = sum(bool(outcome.error) for outcome in outcomes)
    known = sum(outcome.known for outcome in outcomes)
    if len(outcomes) > 1 or known:
        there = f", {known} of them there already (restart=true does them again)" if known else ""
        done = f"{len(outcomes) - failed} of {len(outcomes)}"
        print(f"{done} photographs done{there}: {settings.out}")
    return int(failed > 0)


def predict_files(settings: Settings) -> list[Outcome]:
    """Reconstruct photographs, each into its own folder below `out`.

    A photograph that cannot be used does not stop the others. What is there already, from the same
    photograph, checkpoint and settings, is not made again.
    """
    out = Path(settings.out)
    if settings.image is None and not ALONE:
        raise ConfigError("image= names no photograph: give a file, a folder or a pattern")
    jobs = find_jobs(settings.image or [str(_PHOTOS)], settings.mask, out)
    if settings.background != "auto" and (settings.mask or settings.box) is not None:
        raise ConfigError("background= is of photographs without mask= and box=: leave it out")
    if settings.box is not None and (settings.mask is not None or len(jobs) > 1):
        raise ConfigError("box= is of one photograph, and takes the place of mask=: give one each")
    if settings.together:
        if len(jobs) < 2:
            raise ConfigError("together=true needs two or more images of one object")
        jobs = [replace(jobs[0], others=tuple(jobs[1:]))]
    if not any(job.image.is_file() for job in jobs):  # before templates are prepared
        raise ConfigError(f"image={jobs[0].image}: there is no such file")
    checkpoint = checkpoint_of(settings.run)
    predictor = Predictor.load(checkpoint, settings.device)
    check_apart(settings.templates or (), out=out)
    own = settings.named_templates(predictor.model, settings.data_root, settings.progress_bar)
    if own is not None:
        predictor = predictor.told(own, settings.progress_bar, settings.beside)
    model = predictor.model
    asked = model.template_categories if settings.category is None else (settings.category,)
    most, name = min((len(model.templates_of(name)), name) for name in set(asked))
    if settings.top_k > most:
        raise ConfigError(f"top_k={settings.top_k}: the model has {most} templates of {name}")
    print(f"network of {', '.join(model.categories)}; training images: {model.views}")
    if settings.colors is None:
        settings = replace(settings, colors="photo" if predictor.knows_side else "material")
    elif settings.colors == "photo" and not predictor.knows_side:
        raise ConfigError(
            "colors=photo: this network does not tell from which side a photograph was taken; use "
            "colors=material, or train one that does (data.render.random_views=8)"
        )
    elif settings.colors == "parts" and not model.bank.part_names:
        raise DataError("colors=parts: the templates have no part labels; use colors=material")
    digest = hashlib.sha256(checkpoint.read_bytes()).hexdigest()
    maker = _Maker(settings, predictor, digest, [] if own is None else [own.digest])
    done: dict[Path, Outcome] = {}
    show = settings.progress_bar and len(jobs) > 1
    taken = f"another process writes to {out}: wait for it, or choose another out="
    with lock_folder(out, taken), CountProgress("reconstructing", len(jobs), 0, show) as bar:
        for job, outcome in in_threads(maker, jobs, settings.workers or available_cores()):
            done[job.folder] = outcome
            bar.advance()
            if outcome.error:
                print(f"error: {outcome.error}", file=sys.stderr)
                continue
            print(outcome.line)
            for warning in outcome.warnings:
                print(f"warning: {job.image}: {warning}", file=sys.stderr)
    return [done[job.folder] for job in jobs]


class _Maker:
    """Makes the files of one photograph."""

    def __init__(
        self, settings: Settings, predictor: Predictor, digest: str, templates: list[str]
    ) -> None:
        self._settings, self._predictor, self._digest = settings, predictor, digest
        self._templates = templates  # the digest of those that the network does not bring
        self._colors: MeshColors = settings.colors or "material"

    def __call__(self, job: Job) -> Outcome:
        try:
            return self._made(job)
        except UserError as error:
            places = job.folder, job.image, *(other.image for other in job.others)
            named = any(str(place) in str(error) for place in places)
            return Outcome(error=str(error) if named else f"{job.image}: {error}")
        except Exception as error:  # one failure does not stop the others
            name = "" if isinstance(error, OSError) else f"{type(error).__name__}: "
            return Outcome(error=f"{job.image}: {name}{error}")

    def _made(self, job: Job) -> Outcome:
        settings, model, folder = self._settings, self._predictor.model, job.folder
        key, earlier = self._key(job), read_json(folder / _RECORD)
        same = not settings.restart and earlier.get("key") == key
        if same and all((folder / name).is_file() for name in earlier["files"]):
            return Outcome(_line(job, earlier), tuple(earlier["image"]["warnings"]), known=True)
        before = Path(earlier.get("image_file", job.image))
        if not settings.restart and before.is_file() and not before.samefile(job.image):
            way = "name another folder with out=, or replace it with restart=true"
            raise DataError(f"{folder} holds what was made of {before}: {way}")
        start = time.perf_counter()
        photos = [self._framed(one) for one in (job, *job.others)]
        framed = time.perf_counter()
        if job.others:
            pairs = zip(job.others, photos[1:], strict=True)
            more = [f"of {one.image}: {text}" for one, photo in pairs for text in photo.warnings]
            photos[0] = replace(photos[0], warnings=(*photos[0].warnings, *more))
            selected = self._predictor.predict_together(photos, settings.category)
        else:
            (selected,) = self._predictor.predict_framed(photos, settings.category)
        predicted = time.perf_counter()
        names = [*_MESHES, *(_OBJ if settings.obj else ()), *(_PREVIEW if settings.preview else ())]
        places = ["", *(f"candidate-{rank + 1}/" for rank in range(1, settings.top_k))]
        files = [place + name for place in places for name in names]
        for left in (earlier, read_json(folder / _UNFINISHED)):
            _remove(folder, [_RECORD, *left.get("files", [])])
        write_json(folder / _UNFINISHED, {"files": files})
        for rank, place in enumerate(places):
            found, into = selected.candidate(rank), folder / place
            write_meshes(found, into, self._colors, settings.obj)
            cloud = into / "cloud.ply"
            write_cloud(found, cloud, settings.points, settings.seed, self._colors)
            if settings.preview:
                write_preview(found, into / "preview.png", model.render, self._colors)
        seconds = {
            "framing": framed - start,
            "network": predicted - framed,
            "meshes": time.perf_counter() - predicted,
        }
        content = {
            "image_file": str(job.image),
            **({"other_images": [str(o.image) for o in job.others]} if job.others else {}),
            "asked_category": settings.category,
            **record(selected),
            "seconds": {name: round(value, 4) for name, value in seconds.items()},
            "trained_on": {"categories": list(model.categories), "views": model.views},
            "checkpoint": {"run": settings.run, "step": model.step, "sha256": self._digest},
            **({"templates": settings.templates} if self._templates else {}),
            "files": [file.relative_to(folder).as_posix() for file in _there(folder, files)],
            "key": key,
        }
        write_json(folder / _RECORD, content)  # the last: it says that the others are whole
        (folder / _UNFINISHED).unlink()
        return Outcome(_line(job, content), selected.warnings)

    def _framed(self, job: Job) -> FramedPhoto:
        how: Any = {"box": self._settings.box, "background": self._settings.background}
        try:
            return self._predictor.frame(job.image, mask=job.mask, **how)
        except UserError as error:
            named = str(job.image) in str(error)
            raise error if named else type(error)(f"{job.image}: {error}") from error

    def _key(self, job: Job) -> str:
        """Return what changes when the files would be others."""
        read = [
            hashlib.sha256(file_bytes(path)).hexdigest()
            for one in (job, *job.others)
            for path in (one.image, one.mask)
            if path
        ]
        chosen = {k: v for k, v in asdict(self._settings).items() if k not in _ELSEWHERE}
        content = [FORMAT_VERSION, self._digest, *self._templates, read, chosen]
        return hashlib.sha256(json.dumps(content).encode()).hexdigest()


def _there(folder: Path, files: Sequence[str]) -> list[Path]:
    """Return those of a photograph's files that are there; a name may be a pattern."""
    return [file for name in files for file in sorted(folder.glob(name))]


def _remove(folder: Path, files: Sequence[str]) -> None:
    """Remove files, and the folders of candidates that they leave empty."""
    there = _there(folder, files)
    for file in there:
        file.unlink(missing_ok=True)
    for place in {file.parent for file in there} - {folder}:
        if not any(place.iterdir()):
            place.rmdir()


def file_bytes(path: Path) -> bytes:
    """Return what a file holds."""
    try:
        if path.exists() and not path.is_file():
            raise DataError(f"{path} is not a file")  # reading a pipe would wait for ever
        return path.read_bytes()
    except OSError as error:
        raise DataError(f"{path} cannot be read: {error.strerror}") from None


def _line(job: Job, content: dict[str, Any]) -> str:
    template, category = content["template"], content["category"]
    found = f"{template['id']} ({template['weight']:.2f})"
    others = [name for name in category["weights"] if name != category["name"]]
    if others:  # the first is the runner-up, or what the network would have said
        own, other = (category["weights"][name] for name in (category["name"], others[0]))
        found = f"{category['name']} ({own:.2f}; {others[0]} {other:.2f}), {found}"
    return f"{job.image}: {found} -> {job.folder}"


def find_jobs(image: str | Sequence[str], mask: str | None, out: Path) -> list[Job]:
    """Return the photographs that `image` names, sorted within a folder or pattern."""
    entries = [image] if isinstance(image, str) else image
    try:
        images = list(dict.fromkeys(path for entry in entries for path in _expand(entry)))
        if not images:
            raise ConfigError(f"image={','.join(entries)}: no images there")
        masks = [None for _ in images] if mask is None else _masks(images, Path(mask))
    except OSError as error:  # a name may be too long, or a folder closed
        name = str(error.filename)
        short = name if len(name) < 200 else f"{name[:100]}..."
        raise ConfigError(f"{short} cannot be looked at: {error.strerror}") from None
    folders = [out / name for name in _names(images)]
    return [Job(*job) for job in zip(images, masks, folders, strict=True)]


def _expand(entry: str) -> list[Path]:
    path = Path(entry)
    if path.is_dir():
        shown = (file for file in path.iterdir() if not is_hidden(file.name))
        return sorted(file for file in shown if file.suffix.lower() in _SUFFIXES)
    if path.exists() or not glob.has_magic(entry):
        return [path]
    found = (p for p in map(Path, glob.glob(str(path), recursive=True)) if p.is_file())
    return sorted(p for p in found if not _is_result(p))


def _is_result(path: Path) -> bool:
    """Tell whether a file is one that this command has written, such as a preview."""
    places = (path.parent, path.parent.parent)  # a candidate's folder lies in its photograph's
    return any((place / name).is_file() for place in places for name in (_RECORD, _UNFINISHED))


def _names(images: Sequence[Path]) -> list[str]:
    """Return a folder's name for each image: its stem, with its suffix or a number if need be."""
    stems = Counter(image.stem for image in images)
    names: dict[str, None] = {}
    for image in images:
        plain = stems[image.stem] == 1 and image.stem.strip(".")  # "..png" is no place to write to
        name = image.stem if plain else image.name
        tries = (name if k == 1 else f"{name}-{k}" for k in range(1, len(images) + 2))
        names[next(t for t in tries if t not in names)] = None
    return list(names)


def _masks(images: Sequence[Path], mask: Path) -> list[Path]:
    by_stem: dict[str, list[Path]] = {}
    if mask.is_dir():
        for file in mask.iterdir():
            by_stem.setdefault(file.stem, []).append(file)
    elif len(images) > 1:
        raise ConfigError(f"mask={mask}: for several images give a folder of masks of their names")
    masks = []
    for image in images:
        found = by_stem.get(image.stem, []) if mask.is_dir() else [mask]
        if len(found) != 1:
            raise ConfigError(
                f"mask={mask}: {len(found) or 'no'} masks named {image.stem}.* are in that folder"
            )
        if image.exists() and found[0].exists() and image.samefile(found[0]):
            raise ConfigError(f"mask={found[0]} is the photograph itself")
        masks += found
    return masks
