"""Reading a prepared set: memory-mapped arrays, checked on opening."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.data.mesh import Mesh
from ffd_lightning.errors import DataError

MANIFEST = "manifest.json"
REJECTED = "rejected.csv"
UNKNOWN_PART = 255
_REQUIRED = frozenset(
    ("images", "points", "face_ids", "vertices", "faces", "face_colors", "mesh_offsets")
)
_PER_MODEL = ("images", "points", "face_ids", "point_parts")


def file_digest(path: Path) -> str:
    """Return the sha256 of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@dataclass(frozen=True)
class PreparedSet:
    """One category, ready for training; immutable on disk.

    Attributes:
        path: its folder.
        manifest: settings, source, counts, and size, shape, dtype and checksum of each array.
        ids: n model ids, sorted.
        families: structural family of each, "" where unknown.
        part_names: names of the parts, () where unknown.
        images: (n, views, H, W, 4) uint8, RGB over white and coverage.
        points: (n, N, 3) float32 surface samples, bounding box diagonal 1.
        face_ids: (n, N) int32, the face each point lies on.
        point_parts: (n, N) uint8 index into `part_names`, 255 unknown; None without any parts.
    """

    path: Path
    manifest: dict[str, Any]
    ids: tuple[str, ...]
    families: tuple[str, ...]
    part_names: tuple[str, ...]
    arrays: dict[str, NDArray[Any]]

    @classmethod
    def open(cls, path: Path) -> PreparedSet:
        """Open a prepared set and check that every file is there, whole, and of the right shape.

        Raises:
            DataError: a file is missing or damaged; the message names it and how to rebuild.
        """
        file = path / MANIFEST
        try:
            manifest = json.loads(file.read_text(encoding="utf-8"))
            ids, families, part_names = (
                tuple(manifest[key]) for key in ("ids", "families", "part_names")
            )
            missing = sorted(_REQUIRED - set(manifest["files"]))
            if missing:
                raise ValueError(f"it does not list {', '.join(missing)}")
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise _damaged(path, file, f"{type(error).__name__}: {error}") from None
        arrays = {name: _open_array(path, name, facts) for name, facts in manifest["files"].items()}
        for name in _PER_MODEL:
            if name in arrays and len(arrays[name]) != len(ids):
                raise _damaged(path, path / f"{name}.npy", f"{len(ids)} models are listed")
        if not (path / REJECTED).is_file():
            raise _damaged(path, path / REJECTED, "it is missing")
        return cls(path, manifest, ids, families, part_names, arrays)

    def __reduce__(self) -> tuple[Any, ...]:
        # Another process maps the files itself: a memory map would travel as a copy of them all.
        return PreparedSet.open, (self.path,)

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def images(self) -> NDArray[np.uint8]:
        """See the class."""
        return self.arrays["images"]

    @property
    def points(self) -> NDArray[np.float32]:
        """See the class."""
        return self.arrays["points"]

    @property
    def face_ids(self) -> NDArray[np.int32]:
        """See the class."""
        return self.arrays["face_ids"]

    @property
    def point_parts(self) -> NDArray[np.uint8] | None:
        """See the class."""
        return self.arrays.get("point_parts")

    @cached_property
    def _rows(self) -> dict[str, int]:
        return {model_id: row for row, model_id in enumerate(self.ids)}

    def index(self, model_id: str) -> int:
        """Return the row of a model.

        Raises:
            DataError: no such model.
        """
        try:
            return self._rows[model_id]
        except KeyError:
            raise DataError(f"{self.path} holds no model {model_id!r}") from None

    def mesh(self, row: int) -> Mesh:
        """Return a model's normalised mesh, one colour per face (textures averaged)."""
        (v0, f0), (v1, f1) = self.arrays["mesh_offsets"][row : row + 2]
        parts = self.arrays.get("face_parts")
        return Mesh(
            vertices=np.asarray(self.arrays["vertices"][v0:v1], np.float64),
            faces=np.asarray(self.arrays["faces"][f0:f1], np.int64),
            face_colors=np.array(self.arrays["face_colors"][f0:f1]),
            face_parts=None if parts is None else np.array(parts[f0:f1]),
            part_names=self.part_names,
        )

    def verify(self) -> None:
        """Compare every file's checksum with the manifest's.

        Raises:
            DataError: a file has changed since it was written.
        """
        for name, facts in self.manifest["files"].items():
            file = self.path / f"{name}.npy"
            if file_digest(file) != facts["sha256"]:
                raise _damaged(self.path, file, "its checksum has changed")


def _open_array(folder: Path, name: str, facts: dict[str, Any]) -> NDArray[Any]:
    file = folder / f"{name}.npy"
    try:
        size = file.stat().st_size
        if size != facts["bytes"]:
            raise ValueError(f"{size} bytes, {facts['bytes']} were written")
        array = np.load(file, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError) as error:
        raise _damaged(folder, file, str(error)) from None
    if list(array.shape) != facts["shape"] or str(array.dtype) != facts["dtype"]:
        raise _damaged(folder, file, f"{array.dtype} {array.shape} is not what was written")
    return array


def _damaged(folder: Path, file: Path, why: str) -> DataError:
    return DataError(
        f"{file} is damaged ({why}): delete the folder {folder} and run the same command again"
    )
