"""Any meshes as templates of a trained network: prepared as training shapes are."""

import glob
import io
import os
import sys
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
import trimesh
from numpy.typing import NDArray

from ffd_lightning import __version__
from ffd_lightning.checkpoint import TrainedModel
from ffd_lightning.data.categories import SYNSETS, name_of
from ffd_lightning.data.preparation.overview import count_warnings, sheet_of, some_reasons
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.preparation.prepared import PreparedSet, digest_of
from ffd_lightning.data.reading.files import is_hidden
from ffd_lightning.data.reading.mesh_file import EXTENSIONS, FOREIGN, mesh_of, unread
from ffd_lightning.data.reading.orientation import Up, check_orientation, orient
from ffd_lightning.data.source import Source
from ffd_lightning.data.sources.folder import FolderSource, MeshFiles, name_files
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import ConfigError, DataError, RejectedShapeError
from ffd_lightning.evaluation.evaluator import bank_digest, weights_digest
from ffd_lightning.evaluation.samples import Subset
from ffd_lightning.files import write_bytes_atomic
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.rendering import render
from ffd_lightning.inference.pose import better_turn
from ffd_lightning.progress import CountProgress
from ffd_lightning.terminal import counted

AnyMesh = Mesh | trimesh.Trimesh | trimesh.Scene
Places = str | Path | Sequence[str | Path]


@dataclass(frozen=True, eq=False)
class OwnTemplates:
    """Templates to `tell` a model.

    Attributes:
        bank: the templates.
        pictures: of each, (views, H, W, 4) uint8, as the model's training images are rendered.
        digest: what tells them from others, in hexadecimal.
        shapes: the same, as prepared shapes; None of meshes in memory.
        root: what the network makes of them is kept in `root/codes`; None to make it each time.
    """

    bank: TemplateBank
    pictures: Iterable[NDArray[np.uint8]]
    digest: str
    shapes: Subset | None = None
    root: Path | None = None


def of_files(
    model: TrainedModel,
    places: Places,
    *,
    up: Up = "y",
    yaw: float = 0.0,
    root: str | Path = "data",
    progress: bool = True,
) -> OwnTemplates:
    """Take mesh files as templates; they are prepared once, and kept, see `Preparation`.

    Args:
        model: whose templates they are to be.
        places: folders, mesh files, patterns of those. In a folder each mesh file is a template,
            and each folder with a mesh file somewhere in it (`FolderSource` says which of
            several); a folder of categories gives those that the model knows.
        up: the axis of the meshes that points up.
        yaw: degrees about the vertical, anticlockwise from above, until they face -z.
        root: they are kept in `root/prepared`.
        progress: show on stderr how far it is, and draw a contact sheet.

    Raises:
        ConfigError: there is nothing, or nothing that is a mesh; or `root` is among the meshes.
        DataError: none of the meshes can be used.
    """
    model.check_conditioned()
    listed = [places] if isinstance(places, str) or not isinstance(places, Sequence) else places
    if wrong := [place for place in listed if not isinstance(place, str | Path)]:
        raise ConfigError(
            "templates: give files, folders or patterns, or meshes by name, {'mine': mesh}; this "
            f"is a {type(wrong[0]).__name__} without a name"
        )
    found = _sources(model, listed, up, float(yaw))
    check_apart(listed, data_root=root)
    points, preparations = model.bank.points.shape[1], []
    for category, source in found.items():
        given = (source, category, points, model.render, Path(root).expanduser())
        preparations.append(Preparation(*given, progress=progress))
    new = progress and not all(preparation.target.exists() for preparation in preparations)
    prepared = PreparedSet.open(*(preparation.run().path for preparation in preparations))
    own = of_prepared(model, prepared, prepared.ids)
    category, *others = found
    if not others and len(model.categories) > 1 and category in model.categories:
        ids = tuple(f"{category}/{i}" for i in own.bank.ids)  # as sets of several categories have
        own = replace(own, bank=replace(own.bank, ids=ids))
    if not new:  # else the preparation has said it
        _warn_of_rejected(prepared.rejected)
        if kinds := count_warnings(prepared):
            _warn(f"templates: {kinds}")
    sheets = [str(sheet) for path in prepared.paths if (sheet := sheet_of(path)).is_file()]
    _warn_of_turn(model.bank, own.bank, up, yaw, sheets)
    return own


def of_prepared(model: TrainedModel, prepared: PreparedSet, ids: Sequence[str]) -> OwnTemplates:
    """Take shapes of a prepared set as templates."""
    bank = TemplateBank.of(prepared, ids, model.bank.degrees, model.bank.max_edge)
    rows = [prepared.index(i) for i in ids]
    pictures, digest = map(prepared.images, rows), digest_of([prepared.digest, list(ids)])
    shapes = Subset(prepared, np.array(rows))
    return OwnTemplates(bank, pictures, digest, shapes, prepared.paths[0].parents[1])


def of_meshes(
    model: TrainedModel, meshes: Mapping[str, AnyMesh], *, up: Up = "y", yaw: float = 0.0
) -> OwnTemplates:
    """Take meshes in memory as templates, rendered here and now.

    Args:
        model: whose templates they are to be.
        meshes: by id, of any size.
        up: see `of_files`.
        yaw: see `of_files`.

    Raises:
        ConfigError: there are none.
        DataError: none of them can be used.
    """
    model.check_conditioned()
    check_orientation(up, yaw)
    if not meshes:
        raise ConfigError("templates: there are no meshes")
    if files := [name for name, given in meshes.items() if isinstance(given, str | Path)]:
        raise ConfigError(f"templates: {files[0]} is a file: give files as a list, without names")
    points, usable, rejected = model.bank.points.shape[1], {}, {}
    for name, given in ((str(name), given) for name, given in meshes.items()):
        try:
            mesh = orient(given if isinstance(given, Mesh) else mesh_of(given, name), up, yaw)
            TemplateBank.of_meshes({name: mesh}, num_points=1)
        except (RejectedShapeError, ValueError) as error:
            rejected[name] = str(error)
        else:
            usable[name] = mesh
    if not usable:
        raise DataError(f"no usable template: {some_reasons(rejected)}")
    bank = TemplateBank.of_meshes(usable, points, model.bank.degrees, model.bank.max_edge)
    _warn_of_rejected(rejected)
    _warn_of_turn(model.bank, bank, up, yaw)
    to = model.render
    size = {"height": to.height, "width": to.width, "samples": to.samples}
    pictures = (
        np.stack([render(mesh, camera, **size) for camera in to.cameras(name)])
        for name, mesh in zip(bank.ids, bank.meshes, strict=True)
    )
    return OwnTemplates(bank, pictures, bank_digest(bank))


def tell(
    model: TrainedModel, own: OwnTemplates, progress: bool = True, beside: bool = False
) -> TrainedModel:
    """Return the same network with other templates.

    Args:
        model: what is told.
        own: the templates, for this model; once.
        progress: show on stderr how far it is.
        beside: the model's templates stay, see `TrainedModel.with_codes`.

    Raises:
        ConfigError: the network knows the templates of its training only.
    """
    key = digest_of([__version__, weights_digest(model.network), own.digest])[:20]
    file = None if own.root is None else own.root / "codes" / f"{key}.npz"
    if file is not None:
        with suppress(OSError, ValueError, EOFError, LookupError, zipfile.BadZipFile):
            with np.load(file) as kept:
                codes, boxes = (torch.from_numpy(kept[name]) for name in ("codes", "boxes"))
            return model.with_codes(replace(own.bank, boxes=boxes), codes, beside)
    with CountProgress("looking at templates", len(own.bank), 0, progress) as bar:

        def seen() -> Iterator[NDArray[np.uint8]]:
            for picture in own.pictures:
                yield picture
                bar.advance()

        model.check_conditioned()
        codes = model.network.codes(own.bank.points, seen())
    if file is not None:
        content = io.BytesIO()
        boxes = torch.stack([torch.stack([b.origin, b.size]) for b in own.bank.lattices])
        np.savez(content, codes=codes.cpu().numpy(), boxes=boxes.numpy())
        with suppress(OSError):  # of a folder that cannot be written to
            write_bytes_atomic(file, content.getvalue())
    return model.with_codes(own.bank, codes, beside)


def check_apart(places: Places, **written: str | Path) -> None:
    """Make sure that what is written does not become a template of the next time.

    Args:
        places: see `of_files`.
        written: folders, by the names of their settings.

    Raises:
        ConfigError: one of them lies in a folder of templates.
    """
    for place in [places] if isinstance(places, str | Path) else places:
        for setting, folder in written.items():
            inside = _absolute(folder).is_relative_to(_absolute(place))
            if inside and _absolute(place).is_dir():
                raise ConfigError(
                    f"{setting}={folder} lies in templates={place}, all of whose meshes are taken: "
                    f"choose another {setting}=, or work in another folder"
                )


def _absolute(path: str | Path) -> Path:
    """Return a path without "." and ".."; links keep their names."""
    return Path(os.path.abspath(Path(path).expanduser()))


def _sources(
    model: TrainedModel, places: Sequence[str | Path], up: Up, yaw: float
) -> dict[str, Source]:
    """Return where the shapes of each category come from, a category being a folder's name."""
    found: dict[str, Source] = {}
    files = []
    for place in places:
        path = Path(place).expanduser()
        if path.is_dir():
            for folder in _categories(_absolute(path), model.categories):
                name = name_of(folder.name)
                name = folder.name if folder.with_name(name).is_dir() else name
                if name in found:
                    raise ConfigError(f"templates: two folders are called {name}: rename one")
                found[name] = FolderSource(folder.parent, up, yaw)
        elif path.is_file():
            if path.suffix.lower() in FOREIGN:
                raise ConfigError(f"templates={path}: {unread(path)}")
            if path.suffix.lower() not in EXTENSIONS:
                known = ", ".join(extension.lstrip(".") for extension in EXTENSIONS)
                raise ConfigError(f"templates={path} is no mesh file: {known}")
            files.append(path)
        else:
            matches = map(Path, sorted(glob.glob(str(path), recursive=True)))
            meshes = [m for m in matches if m.suffix.lower() in EXTENSIONS and m.is_file()]
            if not meshes:
                raise ConfigError(f"templates={place}: no mesh files there")
            files += meshes
    if files:
        if "files" in found:
            raise ConfigError("templates: files beside a folder called files: rename the folder")
        found["files"] = MeshFiles(name_files(files), up, yaw)
    if not found:
        raise ConfigError("templates=[] names no meshes")
    return found


def _categories(folder: Path, of_model: Sequence[str]) -> list[Path]:
    """Return a folder, or those in it that bear names of categories: the model's if it can be."""
    inside = sorted(folder.iterdir())
    flat = any(path.suffix.lower() in EXTENSIONS for path in inside)
    for names in () if flat else (of_model, SYNSETS):
        if found := [path for path in inside if path.is_dir() and name_of(path.name) in names]:
            folders = [p for p in inside if p.is_dir() and not is_hidden(p.name)]
            if others := [p.name for p in folders if p not in found]:
                taken = ", ".join(p.name for p in found)
                _warn(
                    f"templates of {folder} are those of {taken}; left out: {', '.join(others)} "
                    f"('templates={folder}/**/*.*' takes all)"
                )
            return found
    return [folder]


def _warn(text: str) -> None:
    print(f"warning: {text}", file=sys.stderr)


def _warn_of_rejected(rejected: Mapping[str, str]) -> None:
    if rejected:
        _warn(f"{counted(len(rejected), 'template')} cannot be used: {some_reasons(rejected)}")


def _warn_of_turn(
    known: TemplateBank, own: TemplateBank, up: Up, yaw: float, sheets: Sequence[str] = ()
) -> None:
    """Say if the meshes seem to stand wrongly."""
    better = better_turn(own, known, up, yaw)
    if better != (up, yaw):
        seen = f"; {', '.join(sheets)} shows them" if sheets else ""
        _warn(
            f"the templates seem to stand wrongly: with up={better[0]} yaw={better[1]:g} they are "
            f"more like those of the network's training{seen}"
        )
