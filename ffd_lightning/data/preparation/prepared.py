"""Reading prepared sets: folders of a file for each shape, and a manifest."""

from __future__ import annotations

import hashlib
import json
import os
import struct
import zipfile
import zlib
from collections.abc import Callable, Collection, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.data.preparation.packing import (
    HEADERS,
    unpack_camera,
    unpack_image,
    unpack_mesh,
    unpack_points,
)
from ffd_lightning.data.preparation.prepared_shape import shape_file
from ffd_lightning.errors import DataError, is_of_machine
from ffd_lightning.files import atomic_file
from ffd_lightning.geometry.mesh import UNKNOWN_PART, Mesh, renumber_parts
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.parallel import available_cores

MANIFEST = "manifest.json"
FORMAT_VERSION = 4
"""Goes up when the same settings give another set, or `measured` another measurement of it, so that
prepared data is built anew."""

_HELD = 32  # measurements in memory, of a few MB each
_measured: dict[Path, dict[str, Any]] = {}

_Place = tuple[int, int, int, int, tuple[int, ...], np.dtype]
"""Of an array in a file: start, size and checksum, size of the header, shape and type."""


@dataclass(frozen=True)
class PreparedSet:
    """One category or several, ready for training; immutable on disk.

    Rows count the shapes of all categories, one after the other. Where there are several, a shape's
    id is `<category>/<its own>`. A damaged file raises a DataError that names it when it is read.

    Attributes:
        paths: the folder of each category.
        manifests: of each: settings, what is known of all its shapes, checksum.
        taken: which of the folders' shapes are in this set, as `without` chose; None for all.
    """

    paths: tuple[Path, ...]
    manifests: tuple[dict[str, Any], ...]
    taken: tuple[int, ...] | None = None

    @classmethod
    def open(cls, *folders: str | Path) -> PreparedSet:
        """Open prepared sets as one; a DataError says which file is missing or what differs.

        What a file holds is checked when it is read.
        """
        paths = tuple(map(Path, folders))
        found = cls(paths, tuple(map(_read_manifest, paths)))
        sizes = [(*m["image_shape"], m["settings"]["num_points"]) for m in found.manifests]
        for path, size in zip(paths, sizes, strict=True):
            if size != sizes[0]:
                raise DataError(
                    f"{paths[0]} and {path} cannot be joined: views, height, width, channels and "
                    f"points are {sizes[0]} and {size}"
                )
        return found

    def without(self, exclude: Collection[str]) -> PreparedSet:
        """Return the set without the shapes of some ids; nothing is copied."""
        left_out, all_ids = set(exclude), self.whole.ids
        taken = range(len(all_ids)) if self.taken is None else self.taken
        return replace(self, taken=tuple(row for row in taken if all_ids[row] not in left_out))

    @cached_property
    def whole(self) -> PreparedSet:
        """The set of all shapes in the folders."""
        return self if self.taken is None else replace(self, taken=None)

    @cached_property
    def originals(self) -> PreparedSet:
        """The set without variants."""
        return self.without(self.origins) if self.origins else self

    @cached_property
    def path(self) -> Path:
        """The folder; of several categories their folders with a `+` in between."""
        return Path("+".join(map(str, self.paths)))

    @cached_property
    def categories(self) -> tuple[str, ...]:
        """The category of each folder."""
        return tuple(str(m["settings"]["category"]) for m in self.manifests)

    @property
    def members(self) -> tuple[PreparedSet, ...]:
        """The set of each category, of all shapes in its folder."""
        pairs = zip(self.paths, self.manifests, strict=True)
        return tuple(PreparedSet((path,), (manifest,)) for path, manifest in pairs)

    @cached_property
    def digest(self) -> str:
        """What tells sets of other shapes or settings apart, in hexadecimal."""
        digests = [m["sha256"] for m in self.manifests]
        if len(digests) == 1 and self.taken is None:
            return str(digests[0])
        return digest_of([digests, self.ids])

    @cached_property
    def ids(self) -> tuple[str, ...]:
        """The shapes' ids, sorted within each category."""
        return tuple(self._name(k, self.manifests[k]["ids"][place]) for k, place in self._entries)

    @cached_property
    def families(self) -> tuple[str, ...]:
        """The structural family of each shape, "" where unknown."""
        return tuple(self.manifests[k]["families"][place] for k, place in self._entries)

    @cached_property
    def part_names(self) -> tuple[str, ...]:
        """The names of the parts, () where unknown."""
        return tuple(dict.fromkeys(name for m in self.manifests for name in m["part_names"]))

    @cached_property
    def rejected(self) -> dict[str, str]:
        """Why shapes are not in the set, by their ids."""
        return self._joined("rejected")

    @cached_property
    def warnings(self) -> dict[str, list[str]]:
        """What is wrong with shapes that are in the set all the same, by their ids."""
        return self._joined("warnings")

    @cached_property
    def origins(self) -> dict[str, str]:
        """Which shape each variant is of, by their ids; a rejected variant may be among them."""
        return {
            self._name(k, variant): self._name(k, shape_id)
            for k, manifest in enumerate(self.manifests)
            for variant, shape_id in manifest.get("origins", {}).items()
        }

    @property
    def image_shape(self) -> tuple[int, int, int, int]:
        """Views, H, W, 4."""
        views, height, width, channels = self.manifests[0]["image_shape"]
        return views, height, width, channels

    @property
    def num_points(self) -> int:
        """Points per cloud, N."""
        return int(self.manifests[0]["settings"]["num_points"])

    def __len__(self) -> int:
        return len(self.ids)

    def category(self, row: int) -> str:
        """Return the category of a shape."""
        return self.categories[self._entries[row][0]]

    def part_names_of(self, row: int) -> tuple[str, ...]:
        """Return the names of the parts that shapes of a shape's category have."""
        return tuple(self.manifests[self._entries[row][0]]["part_names"])

    def packed_cloud(self, row: int) -> NDArray[np.int16]:
        """Return a shape's surface samples, (N, 3), in units of `packing.POINT_STEP`."""
        return self._read(row, "points")

    def cloud(self, row: int, count: int | None = None) -> NDArray[np.float32]:
        """Return surface samples, (N, 3), of diagonal 1; the first `count` cover it too."""
        return unpack_points(self.packed_cloud(row)[:count])

    def image(self, row: int, view: int = 0) -> NDArray[np.uint8]:
        """Return one image of a shape, (H, W, 4) uint8: RGB over white and object mask."""
        return unpack_image(self._read(row, f"image_{view}"), self.image_shape[1:])

    def images(self, row: int) -> NDArray[np.uint8]:
        """Return all images of a shape, (views, H, W, 4) uint8, see `image`."""
        return np.stack([self.image(row, view) for view in range(self.image_shape[0])])

    def camera(self, row: int, view: int = 0) -> Camera:
        """Return the camera that took an image; where it is unknown, one that frames the shape."""
        return unpack_camera(self._read(row, "cameras")[view])

    def measured(self, name: str, measure: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """Return what `measure` finds out of a set of one category, arrays by name; it runs once.

        They are kept in memory, and in the set's folder unless this is read-only. What they depend
        on besides the set is in `name`.
        """
        file = self.paths[0] / f"{name}-{self.digest[:16]}.npz"
        if file not in _measured:
            try:
                with np.load(file, allow_pickle=False) as arrays:
                    found = dict(arrays)
            except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error):
                found = measure()
                with suppress(OSError), atomic_file(file) as target:
                    np.savez(target, **found)
            if len(_measured) >= _HELD:
                del _measured[next(iter(_measured))]
            _measured[file] = found
        return _measured[file]

    def mesh(self, row: int) -> Mesh:
        """Return a shape's normalised mesh; its textures are smaller than the source's."""
        return self._mesh(row)[0]

    def point_parts(self, row: int) -> NDArray[np.uint8] | None:
        """Return parts of a cloud's points, (N,) of `part_names`, 255 unknown; None without any."""
        return self._mesh(row)[1] if self.part_names else None

    def index(self, shape_id: str) -> int:
        """Return the row of a shape; a DataError where there is none of this id."""
        try:
            return self._rows[shape_id]
        except KeyError:
            raise DataError(f"{self.path} holds no shape {shape_id!r}") from None

    def file(self, row: int) -> Path:
        """Return the file of a shape."""
        member, place = self._entries[row]
        return shape_file(self.paths[member], self.manifests[member]["ids"][place])

    @cached_property
    def _entries(self) -> list[tuple[int, int]]:
        """Of each row the number of the folder that has it, and its place in the manifest."""
        every = [(k, place) for k, m in enumerate(self.manifests) for place in range(len(m["ids"]))]
        return every if self.taken is None else [every[row] for row in self.taken]

    @cached_property
    def _rows(self) -> dict[str, int]:
        return {shape_id: row for row, shape_id in enumerate(self.ids)}

    def _name(self, member: int, shape_id: str) -> str:
        return shape_id if len(self.paths) == 1 else f"{self.categories[member]}/{shape_id}"

    def _joined(self, key: str) -> dict[str, Any]:
        return {
            self._name(k, shape_id): value
            for k, manifest in enumerate(self.manifests)
            for shape_id, value in manifest[key].items()
        }

    @cached_property
    def _places(self) -> dict[tuple[int, str, int], _Place]:
        return {}

    def _read(self, row: int, name: str) -> NDArray[Any]:
        """Return an array of a shape's file; zip's own checksums tell whether it is whole.

        Where it is in the file is looked up once: that takes longer than to read it.
        """
        try:
            with self.file(row).open("rb", buffering=0) as file:
                key = row, name, os.fstat(file.fileno()).st_mtime_ns  # a mended file is another
                if key not in self._places:
                    self._places[key] = _place(file, name)
                start, size, checksum, header, shape, dtype = self._places[key]
                file.seek(start)
                content = file.read(size)
            if zlib.crc32(content) != checksum:
                raise zipfile.BadZipFile(f"bad checksum of {name}")
            return np.frombuffer(content, dtype, offset=header).reshape(shape)
        except (
            *(OSError, zipfile.BadZipFile, zlib.error, EOFError, struct.error),
            *(ValueError, KeyError, NotImplementedError),
        ) as error:
            if is_of_machine(error) and not isinstance(error, FileNotFoundError):
                raise
            raise damaged(self.file(row), error, self.category(row)) from None

    def _mesh(self, row: int) -> tuple[Mesh, NDArray[np.uint8]]:
        """Return a mesh and its points' parts, (N,), numbered as the set numbers them."""
        mesh, point_parts = unpack_mesh(self._read(row, "mesh").tobytes())
        if not self.part_names_of(row):
            return replace(mesh, face_parts=None), np.full_like(point_parts, UNKNOWN_PART)
        assert mesh.face_parts is not None
        face_parts, point_parts = (
            renumber_parts(parts, mesh.part_names, self.part_names)
            for parts in (mesh.face_parts, point_parts)
        )
        return replace(mesh, face_parts=face_parts, part_names=self.part_names), point_parts


def _place(file: IO[bytes], name: str) -> _Place:
    """Return where an array is in a file that stores arrays as they are, without compression."""
    with zipfile.ZipFile(file) as archive:
        entry = archive.getinfo(f"{name}.npy")
        with archive.open(entry) as array:
            np.lib.format.read_magic(array)
            with HEADERS:
                shape, _, dtype = np.lib.format.read_array_header_1_0(array)
            header = array.tell()
    file.seek(entry.header_offset + 26)  # the lengths of the entry's name and extra field
    name_size, extra_size = struct.unpack("<HH", file.read(4))
    start = entry.header_offset + 30 + name_size + extra_size
    return start, entry.file_size, entry.CRC, header, shape, dtype


def spread_rows(count: int, size: int) -> NDArray[np.int64]:
    """Return `size` rows, evenly spread over `count`; all where there are no more."""
    return np.linspace(0, count - 1, min(count, size)).astype(np.int64)


def read_in_threads(read: Callable[[int], None], numbers: Iterable[int]) -> None:
    """Read of many shapes at once: unpacking them frees the interpreter."""
    with ThreadPoolExecutor(min(available_cores(), 8)) as pool:
        list(pool.map(read, numbers))


def damaged(file: Path, why: Exception | str, category: str = "NAME") -> DataError:
    """Return the error for a file of a category's set that is not as it was written."""
    reason = f"{type(why).__name__}: {why}" if isinstance(why, Exception) else why
    return DataError(
        f"{file} is damaged ({reason}): delete it and run the same command again, or ffd prepare "
        f"category={category} with the data settings of the run"
    )


def digest_of(value: Any) -> str:
    """Return the sha256 of what JSON can hold, in hexadecimal."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def _read_manifest(folder: Path) -> dict[str, Any]:
    file = folder / MANIFEST
    try:
        manifest: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        if manifest["settings"]["format"] != FORMAT_VERSION:
            raise DataError(f"{folder} was prepared by another version: ffd prepare makes it anew")
        if manifest["sha256"] != digest_of([manifest["settings"], manifest["ids"]]):
            raise ValueError("its checksum does not fit")
    except FileNotFoundError:
        raise DataError(f"{folder} is not a prepared set: it has no {MANIFEST}") from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise damaged(file, error) from None
    if missing := without_file(folder, manifest):
        category = manifest["settings"]["category"]
        raise damaged(shape_file(folder, missing[0]), "it is missing", category)
    return manifest


def without_file(folder: Path, manifest: Mapping[str, Any]) -> list[str]:
    """Return the ids in a set's manifest of which there is no file in its folder."""
    there = {path.name for path in folder.iterdir()}
    return [i for i in manifest["ids"] if shape_file(folder, i).name not in there]
