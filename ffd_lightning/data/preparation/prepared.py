"""Reading a prepared set: mapped clouds, packed images and meshes, all checked on opening."""

from __future__ import annotations

import csv
import hashlib
import json
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.data.preparation.packing import (
    UNKNOWN_PART,
    unpack_camera,
    unpack_image,
    unpack_mesh,
    unpack_points,
)
from ffd_lightning.errors import DataError
from ffd_lightning.files import write_atomic
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera

MANIFEST = "manifest.json"
REJECTED = "rejected.csv"
WARNINGS = "warnings.csv"
ARRAYS = ("points", "images", "image_offsets", "cameras", "meshes", "mesh_offsets")
FILES = frozenset((*(f"{name}.npy" for name in ARRAYS), REJECTED, WARNINGS))
_WORTH_A_WORD = 1 << 30  # bytes whose checking takes seconds


def file_digest(path: Path) -> str:
    """Return the sha256 of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def manifest_digest(manifest: dict[str, Any]) -> str:
    """Return the sha256 of what a manifest says, but for its own checksum."""
    rest = {key: value for key, value in manifest.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class PreparedSet:
    """One category, ready for training; immutable on disk.

    Attributes:
        path: its folder.
        manifest: settings, source, counts, and size and checksum of each file.
        ids: n shape ids, sorted.
        families: structural family of each, "" where unknown.
        part_names: names of the parts, () where unknown.
        image_shape: views, H, W, 4.
        arrays: the files' content, mapped: `points` (n, N, 3) int16 in units of
            `packing.POINT_STEP`; `images` and `meshes`, packed bytes of which `image_offsets`
            (n * views + 1,) and `mesh_offsets` (n + 1,) tell the places; `cameras` (n, views, 7),
            see `packing.pack_cameras`.
    """

    path: Path
    manifest: dict[str, Any]
    ids: tuple[str, ...]
    families: tuple[str, ...]
    part_names: tuple[str, ...]
    image_shape: tuple[int, int, int, int]
    arrays: dict[str, NDArray[Any]]

    @classmethod
    def open(cls, path: Path) -> PreparedSet:
        """Open a prepared set and check that every file is there and as it was written.

        Checksums are compared once, and again when a file's size or time has changed since.

        Raises:
            DataError: a file is missing or damaged; the message names it and how to rebuild.
        """
        if not (path / "manifest.json").exists() and not any(path.glob("*.npy")):
            # Some other folder: nobody shall be told to delete it.
            raise DataError(f"{path} is not a prepared set: it has no manifest.json")
        manifest = _read_manifest(path)
        _check_files(path, manifest)
        ids, families, part_names = (
            tuple(manifest[key]) for key in ("ids", "families", "part_names")
        )
        views, height, width, channels = manifest["image_shape"]
        arrays = {}
        for name in ARRAYS:
            file = path / f"{name}.npy"
            try:
                arrays[name] = np.load(file, mmap_mode="r", allow_pickle=False)
            except (OSError, ValueError) as error:
                raise damaged(path, file, str(error)) from None
        shape = (views, height, width, channels)
        return cls(path, manifest, ids, families, part_names, shape, arrays)

    def __reduce__(self) -> tuple[Any, ...]:
        # Another process maps the files itself: a memory map would travel as a copy of them all.
        return PreparedSet.open, (self.path,)

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def num_points(self) -> int:
        """Points per cloud, N."""
        return int(self.arrays["points"].shape[1])

    @property
    def mapped_clouds(self) -> tuple[NDArray[np.int16], ...]:
        """All clouds in units of `packing.POINT_STEP`, end to end: arrays of (k, N, 3)."""
        return (self.arrays["points"],)

    def category(self, row: int) -> str:
        """Return the category of a shape: the set's, of whichever shape."""
        return str(self.manifest["settings"]["category"])

    def part_names_of(self, row: int) -> tuple[str, ...]:
        """Return the names of the parts that shapes of a shape's category have."""
        return self.part_names

    def cloud(self, row: int, count: int | None = None) -> NDArray[np.float32]:
        """Return a shape's surface samples, (N, 3), in its frame: bounding-box diagonal 1.

        Args:
            row: of the shape.
            count: only the first so many, which cover the surface too: their order is random.
        """
        return unpack_points(self.arrays["points"][row, :count])

    def image(self, row: int, view: int = 0) -> NDArray[np.uint8]:
        """Return one image of a shape, (H, W, 4) uint8: RGB over white and coverage.

        Args:
            row: of the shape.
            view: which of its images.

        Raises:
            DataError: it is damaged.
        """
        views, *shape = self.image_shape
        place = row * views + view
        start, end = self.arrays["image_offsets"][place : place + 2]
        try:
            return unpack_image(self.arrays["images"][start:end].data, tuple(shape))
        except ValueError as error:
            raise damaged(self.path, self.path / "images.npy", f"image {place}: {error}") from None

    def camera(self, row: int, view: int = 0) -> Camera:
        """Return the camera that took an image; where nobody knows it, one that frames the shape.

        Args:
            row: of the shape.
            view: which of its images.
        """
        return unpack_camera(self.arrays["cameras"][row, view])

    def spread_views(
        self, rows: Sequence[int] | NDArray[np.int64], count: int
    ) -> list[tuple[int, int]]:
        """Return row and view of one image each of at most `count` shapes, spread over `rows`.

        Views take turns.

        Args:
            rows: of the shapes to choose from, one or more.
            count: at most so many.
        """
        places = np.linspace(0, len(rows) - 1, min(len(rows), count)).astype(int)
        views = self.image_shape[0]
        return [(int(rows[place]), k % views) for k, place in enumerate(places)]

    def mesh(self, row: int) -> Mesh:
        """Return a shape's normalised mesh; its textures are smaller than the source's.

        Raises:
            DataError: it is damaged.
        """
        return self._model(row)[0]

    def point_parts(self, row: int) -> NDArray[np.uint8] | None:
        """Return the parts of a cloud's points, (N,) index into `part_names`, 255 unknown.

        None where the set has no parts at all.

        Raises:
            DataError: it is damaged.
        """
        return self._model(row)[1] if self.part_names else None

    def index(self, shape_id: str) -> int:
        """Return the row of a shape.

        Raises:
            DataError: no such shape.
        """
        try:
            return self._rows[shape_id]
        except KeyError:
            raise DataError(f"{self.path} holds no shape {shape_id!r}") from None

    @cached_property
    def rejected(self) -> dict[str, str]:
        """Why a shape is not in the set, by its id."""
        with (self.path / REJECTED).open(newline="", encoding="utf-8") as file:
            return {row["id"]: row["reason"] for row in csv.DictReader(file)}

    @cached_property
    def _rows(self) -> dict[str, int]:
        return {shape_id: row for row, shape_id in enumerate(self.ids)}

    def _model(self, row: int) -> tuple[Mesh, NDArray[np.uint8]]:
        """Return a mesh and its points' parts, (N,), numbered as the set numbers them."""
        start, end = self.arrays["mesh_offsets"][row : row + 2]
        try:
            mesh, point_parts = unpack_mesh(self.arrays["meshes"][start:end].tobytes())
        except ValueError as error:
            raise damaged(self.path, self.path / "meshes.npy", f"mesh {row}: {error}") from None
        if not self.part_names:
            return replace(mesh, face_parts=None), point_parts
        numbers = _part_numbers(mesh.part_names, self.part_names)
        assert mesh.face_parts is not None
        mesh = replace(mesh, face_parts=numbers[mesh.face_parts], part_names=self.part_names)
        return mesh, numbers[point_parts]


def _part_numbers(own: Sequence[str], all_names: Sequence[str]) -> NDArray[np.uint8]:
    """Return the table from a model's own part labels to the set's, (256,)."""
    table = np.full(256, UNKNOWN_PART, np.uint8)
    table[: len(own)] = [all_names.index(name) for name in own]
    return table


# --- checking ------------------------------------------------------------------------------------


def _read_manifest(folder: Path) -> dict[str, Any]:
    file = folder / MANIFEST
    try:
        manifest: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        if manifest["sha256"] != manifest_digest(manifest):
            raise ValueError("its checksum does not fit")
        missing = sorted(FILES - set(manifest["files"]))
        if missing:
            raise ValueError(f"it does not list {', '.join(missing)}")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise damaged(folder, file, f"{type(error).__name__}: {error}") from None
    return manifest


def _check_files(folder: Path, manifest: dict[str, Any]) -> None:
    """Compare sizes, and checksums unless the very same files were found good before."""
    found = {}
    for name, facts in manifest["files"].items():
        try:
            stat = (folder / name).stat()
        except OSError as error:
            raise damaged(folder, folder / name, str(error.strerror)) from None
        if stat.st_size != facts["bytes"]:
            reason = f"{stat.st_size} bytes, {facts['bytes']} were written"
            raise damaged(folder, folder / name, reason)
        found[name] = [facts["sha256"], stat.st_mtime_ns, stat.st_ctime_ns]
    note = _note(folder)
    try:
        if json.loads(note.read_text(encoding="utf-8")) == found:
            return
    except (OSError, ValueError):
        pass
    size = sum(facts["bytes"] for facts in manifest["files"].values())
    if size > _WORTH_A_WORD:
        print(f"comparing the checksums of {folder} ({size / 1e9:.1f} GB)", file=sys.stderr)
    for name, facts in manifest["files"].items():
        if file_digest(folder / name) != facts["sha256"]:
            raise damaged(folder, folder / name, "its checksum has changed")
    with suppress(OSError):  # a folder that only others may write to: compared again next time
        write_atomic(note, json.dumps(found))


def _note(folder: Path) -> Path:
    """Return where it is noted which files, of which time, had the right checksums."""
    return folder.with_name(f".{folder.name}.checked")


def damaged(folder: Path, file: Path, why: str) -> DataError:
    """Return the error for a file that is not as it was written.

    Args:
        folder: of the set.
        file: that is damaged.
        why: in words.
    """
    category = folder.name.rpartition("-")[0] or "NAME"
    return DataError(
        f"{file} is damaged ({why}): delete the folder {folder} and run the same command again, "
        f"or ffd prepare category={category} with the data settings of the run"
    )
