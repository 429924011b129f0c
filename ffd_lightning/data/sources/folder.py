"""Real shapes in a folder tree: one folder per category, one folder or file per shape."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.data.reading.files import files_below, is_hidden
from ffd_lightning.data.reading.mesh_file import EXTENSIONS, read_mesh
from ffd_lightning.data.reading.orientation import Up, check_orientation, orient
from ffd_lightning.data.source import Source, SourceShape
from ffd_lightning.errors import DataError, RejectedShapeError

_LOADER_VERSION = 2  # part of the fingerprint: raise it when the same files give another mesh
_PREFERRED_STEMS = ("model_normalized", "model")


@dataclass(frozen=True)
class _ShapeFiles:
    """A shape's mesh file and all files that may be read for it."""

    mesh: Path
    side_files: tuple[Path, ...]


class FolderSource(Source):
    """A tree of meshes: ROOT/<category>/<shape>/*.obj|glb|... or ROOT/<category>/<shape>.<ext>.

    Both may be mixed. The category's folder bears its name or its ShapeNet v1 synset. A shape's
    folder may be nested (`<shape>/models/x.obj`). Of several mesh files of one shape the one taken
    is, in this order: named `model_normalized`, `model` or as the shape; the first format of glb,
    gltf, obj, ply, off, stl; the first by path. Folders without any mesh file (`textures`) serve
    the mesh files next to them. Names that begin with a dot and `__MACOSX` are passed over.

    Args:
        root: its folder.
        up: the axis of the meshes that points up.
        yaw: degrees about the vertical, anticlockwise from above, until they face -z.
    """

    def __init__(self, root: Path, up: Up = "y", yaw: float = 0.0) -> None:
        check_orientation(up, yaw)
        self.root, self.up, self.yaw = Path(root), up, yaw
        self._shapes: dict[str, dict[str, _ShapeFiles]] = {}

    def categories(self) -> list[str]:
        """Return what the folders in `root` stand for, sorted: synsets by the project's names."""
        names = {synset: name for name, synset in SYNSETS.items()}
        return sorted({names.get(folder, folder) for folder in self._folders()})

    def shape_ids(self, category: str) -> list[str]:
        """Return the ids of all shapes of `category`, sorted: names of folders or files.

        Raises:
            DataError: there is no such folder, or no shape in it.
        """
        folder = self._category_folder(category)
        shapes = self._shapes[category] = _find_shapes(folder)
        if not shapes:
            formats = ", ".join(e.lstrip(".") for e in EXTENSIONS)
            raise DataError(
                f"{folder} holds no shapes: expected <shape>/... or <shape>.<extension>, where "
                f"the extension is one of {formats}"
            )
        return sorted(shapes)

    def load(self, category: str, shape_id: str) -> SourceShape:
        """Return one shape; see `Source.load`."""
        if category not in self._shapes:
            self._shapes[category] = _find_shapes(self._category_folder(category))
        files = self._shapes[category].get(shape_id)
        if files is None:
            raise RejectedShapeError(f"there is no shape {shape_id!r} of category {category!r}")
        mesh, notes = read_mesh(files.mesh, files.side_files)
        return SourceShape(orient(mesh, self.up, self.yaw)).warned(*notes)

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return how shapes are turned, and a hash over names, sizes and times of all files.

        Times, since people edit their own files and an edit may leave the size as it was. A copy
        that does not keep the times is prepared anew.
        """
        folder = self._category_folder(category)
        digest, count = hashlib.sha256(), 0
        for _, files in _entries(folder):
            for file, stat in files.items():
                digest.update(os.fsencode(file.relative_to(folder).as_posix()))
                digest.update(f"\0{stat.st_size}\0{stat.st_mtime_ns}\n".encode())
            count += len(files)
        return {
            "source": "folder",
            "loader": _LOADER_VERSION,
            "files": count,
            "sha256": digest.hexdigest(),
            "up": self.up,
            "yaw": self.yaw,
        }

    def rejected(self, category: str) -> dict[str, str]:
        """Return the shapes whose mesh files are empty."""
        meshes = {i: self._shapes[category][i].mesh for i in self.shape_ids(category)}
        return {i: f"{m.name} is empty" for i, m in meshes.items() if m.stat().st_size == 0}

    def _folders(self) -> list[str]:
        """Return the names of the folders in `root`, sorted."""
        if not self.root.is_dir():
            raise DataError(
                f"the folder of shapes {self.root} does not exist: set data.root to a folder of "
                "the form <root>/<category>/<shape>"
            )
        return sorted(p.name for p in self.root.iterdir() if p.is_dir() and not is_hidden(p.name))

    def _category_folder(self, category: str) -> Path:
        """Return the folder of a category."""
        found = self._folders()
        names = [category, *([SYNSETS[category]] if category in SYNSETS else [])]
        for name in names:
            if name in found:
                return self.root / name
        if self.root.absolute().name in names:
            raise DataError(
                f"{self.root} is the folder of one category, and data.root that of all: set "
                f"data.root={self.root.absolute().parent}"
            )
        by_synset = {synset: f"{name} ({synset})" for name, synset in SYNSETS.items()}
        there = ", ".join(by_synset.get(name, name) for name in found) or "nothing"
        wanted = " or ".join(repr(name) for name in names)
        raise DataError(f"{self.root} has no folder {wanted}; it has: {there}")


def _entries(folder: Path) -> Iterator[tuple[Path, dict[Path, os.stat_result]]]:
    """Yield what a category's folder holds: each file, or folder with all files below it."""
    for entry in sorted(folder.iterdir()):
        if not is_hidden(entry.name):
            yield entry, {entry / path: stat for path, stat in files_below(entry).items()}


def _find_shapes(folder: Path) -> dict[str, _ShapeFiles]:
    """Return the shapes in a category's folder by id."""
    shapes: dict[str, _ShapeFiles] = {}
    single: dict[str, list[Path]] = {}
    shared: list[Path] = []
    for entry, files in _entries(folder):
        meshes = [file for file in files if file.suffix.lower() in EXTENSIONS]
        if not meshes or entry in files:
            shared += files
            for mesh in meshes:
                single.setdefault(entry.stem, []).append(mesh)
        else:
            shapes[entry.name] = _ShapeFiles(_preferred(meshes, entry.name), tuple(files))
    for name, meshes in single.items():
        shapes.setdefault(name, _ShapeFiles(_preferred(meshes, name), tuple(shared)))
    return shapes


def _preferred(meshes: list[Path], shape_id: str) -> Path:
    """Return the mesh file to take, by the order that `FolderSource` documents."""
    stems = [*_PREFERRED_STEMS, shape_id]

    def rank(file: Path) -> tuple[int, int, str]:
        stem = stems.index(file.stem) if file.stem in stems else len(stems)
        return stem, EXTENSIONS.index(file.suffix.lower()), str(file)

    return min(meshes, key=rank)
