"""Meshes on disk: in a tree of a folder per category, or single files wherever they are."""

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from ffd_lightning.data.categories import SYNSETS, name_of
from ffd_lightning.data.reading.files import digest_of_files, files_below, is_hidden, printable
from ffd_lightning.data.reading.materials import shown_on_white
from ffd_lightning.data.reading.mesh_file import EXTENSIONS, FOREIGN, matters, read_mesh, unread
from ffd_lightning.data.reading.orientation import (
    ORIENTATIONS,
    Orientation,
    Up,
    check_orientation,
    orient,
    read_orientations,
)
from ffd_lightning.data.source import Source, SourceShape
from ffd_lightning.errors import DataError, RejectedShapeError

_LOADER_VERSION = 6  # part of the fingerprint: raise it when the same files give another mesh
_STEMS = ("model_normalized", "model")  # of mesh files that are preferred

_Files = dict[str, tuple[Path, list[Path]]]
"""By id: a shape's mesh file, and all files that may be read for it."""


class _Category(NamedTuple):
    """What a category's folder holds; orientations are of the shapes in the table alone."""

    files: _Files
    orientations: dict[str, Orientation]


class FolderSource(Source):
    """A tree of meshes: ROOT/<category>/<shape>/*.obj|glb|... or ROOT/<category>/<shape>.<ext>.

    Both may be mixed. The category's folder bears its name or its ShapeNet v1 synset. A shape's
    folder may be nested (`<shape>/models/x.obj`). Of several mesh files of one shape the one taken
    is, in this order: named `model_normalized`, `model` or as the shape; the first format of glb,
    gltf, obj, ply, off, stl; the first by path. Folders without any mesh file (`textures`) serve
    the mesh files next to them. Names that begin with a dot and `__MACOSX` are passed over. A shape
    that has meshes of other formats alone is rejected with what converts them, and one that is
    white all over drawn in grey.

    Args:
        root: its folder.
        up: the axis of the meshes that points up.
        yaw: degrees about the vertical, anticlockwise from above, until they face -z. Single shapes
            can have their own in ROOT/<category>/orientations.csv, with columns id, yaw, up.
    """

    def __init__(self, root: Path, up: Up = "y", yaw: float = 0.0) -> None:
        check_orientation(up, yaw)
        self.root, self.usual = Path(root), Orientation(up, yaw)
        self._shapes: dict[str, _Category] = {}

    def categories(self) -> list[str]:
        """Return the categories that have a folder, sorted: synsets by the project's names."""
        return sorted({name_of(folder) for folder in self._folders()})

    def shape_ids(self, category: str) -> list[str]:
        """Return the ids of all shapes of `category`, sorted: names of folders or files."""
        self._shapes.pop(category, None)
        return sorted(self._of(category).files)

    def load(self, category: str, shape_id: str) -> SourceShape:
        """Return one shape; see `Source.load`."""
        files, orientations = self._of(category)
        if shape_id not in files:
            raise RejectedShapeError(f"there is no shape {shape_id!r} of category {category!r}")
        file, beside = files[shape_id]
        mesh, warnings = read_mesh(file, beside)
        mesh, warning = shown_on_white(mesh)
        mesh = orient(mesh, *orientations.get(shape_id, self.usual))
        alike = [x for x in beside if x.suffix.lower() == file.suffix.lower()]
        if len(alike) > 1 and file.stem not in (*_STEMS, shape_id):
            warnings += (f"folders of several meshes, of which one is taken: {file.name}",)
        return SourceShape(mesh).warned(*warnings, warning)

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return how shapes are turned, and a hash over what is known of their files.

        That is names, sizes and times of those that `matters`. Times, since people edit their own
        files and an edit may leave the size as it was. A copy that does not keep the times is
        prepared anew.
        """
        folder = self._folder(category)
        found = [
            (file.relative_to(folder).as_posix(), stat)
            for _, files in _entries(folder)
            for file, stat in files.items()
            if matters(file)
        ]
        own = {}
        if (folder / ORIENTATIONS).is_file():
            self._shapes.pop(category, None)
            own = {"orientations": self._of(category).orientations}
        return self._fingerprint("folder", found, files=len(found)) | own

    def rejected(self, category: str) -> dict[str, str]:
        """Return the shapes whose mesh files are empty or of a format that is not read."""
        meshes = {i: mesh for i, (mesh, _) in self._of(category).files.items()}
        found = {i: unread(m) for i, m in meshes.items() if m.suffix.lower() in FOREIGN}
        return found | {i: f"{m.name} is empty" for i, m in meshes.items() if not m.stat().st_size}

    def _fingerprint(
        self, source: str, found: Iterable[tuple[str, os.stat_result]], **more: int
    ) -> dict[str, object]:
        """Return how shapes are turned, and a hash over names, sizes and times of files."""
        facts = [(name, f"{stat.st_size}\0{stat.st_mtime_ns}") for name, stat in found]
        known = {"source": source, "loader": _LOADER_VERSION, **more}
        return {**known, "sha256": digest_of_files(facts), **self.usual._asdict()}

    def _of(self, category: str) -> _Category:
        """Return a category's shapes, looked for once."""
        if category not in self._shapes:
            folder = self._folder(category)
            files = _find_shapes(folder)
            if not files:
                raise DataError(
                    f"{folder} holds no shapes: expected <shape>/... or <shape>.<extension>, where "
                    f"the extension is one of {', '.join(e.lstrip('.') for e in EXTENSIONS)}"
                )
            own = read_orientations(folder / ORIENTATIONS, files, self.usual)
            self._shapes[category] = _Category(files, own)
        return self._shapes[category]

    def _folders(self) -> list[str]:
        if not self.root.is_dir():
            raise DataError(
                f"the folder of shapes {self.root} does not exist: set data.root to a folder of "
                "the form <root>/<category>/<shape>"
            )
        return sorted(p.name for p in self.root.iterdir() if p.is_dir() and not is_hidden(p.name))

    def _folder(self, category: str) -> Path:
        there = self._folders()
        names = [category, *([SYNSETS[category]] if category in SYNSETS else [])]
        if found := [name for name in names if name in there]:
            return self.root / found[0]
        if self.root.absolute().name in names:
            raise DataError(
                f"{self.root} is the folder of one category, and data.root that of all: set "
                f"data.root={self.root.absolute().parent}"
            )
        known = ", ".join(
            name if name_of(name) == name else f"{name_of(name)} ({name})" for name in there
        )
        wanted = " or ".join(repr(name) for name in names)
        raise DataError(f"{self.root} has no folder {wanted}; it has: {known or 'nothing'}")


class MeshFiles(FolderSource):
    """Mesh files by their ids, see `name_files`, of one category, whatever it is called.

    Materials and textures are looked for beside a file and in the folders there.

    Args:
        files: by id.
        up: the axis of the meshes that points up.
        yaw: degrees about the vertical, anticlockwise from above, until they face -z.
    """

    def __init__(self, files: Mapping[str, Path], up: Up = "y", yaw: float = 0.0) -> None:
        super().__init__(Path(), up, yaw)
        beside = {folder: _beside(folder) for folder in {f.parent for f in files.values()}}
        self._found = _Category({i: (f, beside[f.parent]) for i, f in files.items()}, {})

    def categories(self) -> list[str]:
        """Return none: any name will do."""
        return []

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return how shapes are turned, and a hash over what is known of files that matter."""
        found = self._found.files
        known = {(i, file) for i, (file, _) in found.items()}
        known |= {(str(f), f) for _, files in found.values() for f in files if matters(f)}
        stats = [(name, file.stat()) for name, file in sorted(known)]
        return self._fingerprint("mesh_files", stats)

    def _of(self, category: str) -> _Category:
        return self._found


def name_files(files: Iterable[Path]) -> dict[str, Path]:
    """Name files by their stems; namesakes by their paths below the folder that has all of them.

    >>> list(name_files([Path("/a/b/x.obj"), Path("/a/c/x.obj"), Path("/a/c/y.ply")]))
    ['b/x.obj', 'c/x.obj', 'y']
    """
    paths = list(dict.fromkeys(Path(os.path.abspath(file)) for file in files))
    stems = Counter(path.stem for path in paths)
    top = os.path.commonpath([path.parent for path in paths]) if paths else ""
    return {
        printable(path.stem if stems[path.stem] == 1 else path.relative_to(top).as_posix()): path
        for path in paths
    }


def _entries(folder: Path) -> Iterator[tuple[Path, dict[Path, os.stat_result]]]:
    """Yield what a category's folder holds: each file, or folder with all files below it."""
    for entry in sorted(folder.iterdir()):
        if not is_hidden(entry.name) and entry.name != ORIENTATIONS:
            yield entry, {entry / path: stat for path, stat in files_below(entry).items()}


def _find_shapes(folder: Path) -> _Files:
    shapes: _Files = {}
    single: dict[str, list[Path]] = {}
    shared: list[Path] = []
    for entry, files in _entries(folder):
        meshes = [file for file in files if file.suffix.lower() in EXTENSIONS]
        if meshes and entry not in files:
            shapes[printable(entry.name)] = _preferred(meshes, entry.name), list(files)
            continue
        shared += [file for file in files if file not in meshes]
        name = printable(entry.stem if entry in files else entry.name)
        if meshes := meshes or [file for file in files if file.suffix.lower() in FOREIGN]:
            single.setdefault(name, []).extend(meshes)
    for name, meshes in single.items():
        mesh = _preferred(meshes, name)  # by its whole name where a folder has the short one
        shapes[mesh.name if name in shapes else name] = mesh, shared
    return shapes


def _preferred(meshes: list[Path], shape_id: str) -> Path:
    """Return the mesh file to take, by the order that `FolderSource` documents."""
    stems, formats = [*_STEMS, shape_id], (*EXTENSIONS, *FOREIGN)

    def rank(file: Path) -> tuple[bool, int, int, str]:
        stem = stems.index(file.stem) if file.stem in stems else len(stems)
        kind = file.suffix.lower()
        return kind in FOREIGN, stem, formats.index(kind), str(file)

    return min(meshes, key=rank)


def _beside(folder: Path) -> list[Path]:
    """Return the files in a folder, and in those in it, that are no meshes themselves."""
    found = (path for pattern in ("*", "*/*") for path in folder.glob(pattern))
    return [
        path
        for path in sorted(found)
        if path.suffix.lower() not in EXTENSIONS
        and not any(map(is_hidden, path.relative_to(folder).parts))
        and path.is_file()
    ]
