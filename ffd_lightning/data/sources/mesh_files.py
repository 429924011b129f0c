"""Mesh files wherever they are, each of them a shape."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path

from ffd_lightning.data.reading.files import digest_of_files, is_hidden
from ffd_lightning.data.reading.mesh_file import EXTENSIONS, matters
from ffd_lightning.data.reading.orientation import Up
from ffd_lightning.data.sources.folder import Category, FolderSource


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
        self._found = Category({i: (f, beside[f.parent]) for i, f in files.items()}, {})

    def categories(self) -> list[str]:
        """Return none: any name will do."""
        return []

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return how shapes are turned, and a hash over what is known of files that matter."""
        found = self._found.files
        known = {(i, file) for i, (file, _) in found.items()}
        known |= {(str(f), f) for _, files in found.values() for f in files if matters(f)}
        facts = [
            (name, f"{(stat := file.stat()).st_size}\0{stat.st_mtime_ns}")
            for name, file in sorted(known)
        ]
        turned = self.usual._asdict()
        return {"source": "mesh_files", "loader": 5, "sha256": digest_of_files(facts), **turned}

    def _of(self, category: str) -> Category:
        return self._found


def name_files(files: Iterable[Path]) -> dict[str, Path]:
    """Name files by their stems; namesakes by their paths below the folder that has all of them.

    >>> list(name_files([Path("/a/b/x.obj"), Path("/a/c/x.obj"), Path("/a/c/y.ply")]))
    ['b/x.obj', 'c/x.obj', 'y']
    """
    paths = [Path(os.path.abspath(file)) for file in dict.fromkeys(files)]
    stems = Counter(path.stem for path in paths)
    top = os.path.commonpath([path.parent for path in paths]) if paths else ""
    return {
        path.stem if stems[path.stem] == 1 else path.relative_to(top).as_posix(): path
        for path in paths
    }


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
