"""One mesh file of any common format, with its materials, as a `Mesh`.

Real shapes are messy: what can be mended is, what can't is rejected with a plain reason. A name
that a file gives for another file (a material library, a texture, a glTF buffer) is looked up
among the files that belong to the model and nowhere else, so nothing outside is read or fetched.
"""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.resolvers import Resolver

from ffd_lightning.data.reading.files import MAX_BYTES, File
from ffd_lightning.data.reading.mesh_colors import Textures, face_colors, valid_faces
from ffd_lightning.data.reading.mesh_gltf import mend_gltf
from ffd_lightning.data.reading.mesh_notes import material_notes, used_materials
from ffd_lightning.data.reading.mesh_text import mended_mtl, read_mended
from ffd_lightning.errors import RejectedShapeError, is_bug, is_of_machine
from ffd_lightning.geometry.mesh import Mesh

EXTENSIONS = (".glb", ".gltf", ".obj", ".ply", ".off", ".stl")
"""Formats that can be read, the best at carrying colours first."""

_MAX_FACES = 10_000_000
_MAX_DEPTH = 100
_BLOCK = 1 << 18  # faces whose areas are computed at a time


def read_mesh(path: File, side_files: Sequence[File] = ()) -> Mesh:
    """Read a mesh with its colours and textures.

    Convention:
        Coordinates are taken as they are, y up: OBJ and glTF say so; PLY, OFF and STL have no
        rule, so shapes in those formats that are z up must be turned beforehand.

    Args:
        path: the mesh file; its extension is one of `EXTENSIONS`, in any case.
        side_files: the only other files that may be read for it.

    Returns:
        The mesh without faces that are degenerate, not finite or point to no vertex.

    Raises:
        RejectedShapeError: the file is damaged or has no surface; the message is the reason.
        OSError, MemoryError: of the system, see `errors.is_of_machine`.
    """
    return read_with_notes(path, side_files)[0]


def read_with_notes(path: File, side_files: Sequence[File] = ()) -> tuple[Mesh, tuple[str, ...]]:
    """Read a mesh as `read_mesh` does, and say what of its materials could not be had.

    Returns:
        The mesh, and a note for each kind of fault: absent textures, say. See `mesh_notes`.

    Raises:
        RejectedShapeError, OSError, MemoryError: as `read_mesh`.
    """
    files, textures = SideFiles(side_files), Textures()
    try:
        with np.errstate(all="ignore"), _quiet():
            scene, used = _load(path, files)
            mesh = _merge(path.name, scene, textures)
            notes = material_notes(files.missing, files.found(), textures.undecodable, used)
        if files.failure is not None:
            raise files.failure
        return mesh, notes
    except Exception as error:  # trimesh meets anything in a damaged file
        if files.failure is not None:
            raise files.failure from None
        if isinstance(error, RejectedShapeError) or is_bug(error) or is_of_machine(error):
            raise
        reason = " ".join(str(error).split())[:200]
        if isinstance(error, ImportError):  # trimesh reaches for a decoder of unknown text
            reason = "its content is not of this format"
        message = f"{path.name} cannot be read ({type(error).__name__}: {reason})"
        raise RejectedShapeError(message) from error


@contextmanager
def _quiet() -> Iterator[None]:
    """Let readers say nothing meanwhile: what they make of a damaged file is judged here."""
    logger = logging.getLogger("trimesh")  # it prints tracebacks about textures that are absent
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(level)


class _Once(io.BytesIO):
    """A file that is forgotten when it has been read to its end, to save its size in memory."""

    def read(self, size: int | None = -1) -> bytes:
        data = super().read(size)
        if size is None or size < 0:
            self.close()
        return data


def _load(path: File, side_files: SideFiles) -> tuple[trimesh.Scene, set[str]]:
    """Return what trimesh makes of a file, and the materials that an OBJ asks for."""
    if isinstance(path, Path) and path.stat().st_size > MAX_BYTES:
        raise RejectedShapeError(f"{path.name} is larger than {MAX_BYTES / 1e9:.1f} GB")
    kind = path.suffix.lower().lstrip(".")
    data = read_mended(path)
    if kind in ("glb", "gltf"):
        data = mend_gltf(path.name, data, kind == "glb", side_files)
    used = used_materials(data) if kind == "obj" else set()
    with _Once(data) as file:
        del data
        scene = trimesh.load_scene(file, file_type=kind, resolver=side_files, process=False)
        return scene, used


class SideFiles(Resolver):
    r"""Finds the files that a mesh names, by their base names, among those that belong to it.

    So `C:\textures\wood.png`, `../maps/WOOD.PNG` and `-s 1 1 1 wood.png` all find `wood.png`,
    and no name leads outside. Of several namesakes the one that shares most of the named path is
    taken, then the first.

    Attributes:
        missing: the base names that were asked for in vain.
        failure: of the system, over a file that is there: trimesh passes over errors of any kind.
    """

    def __init__(self, files: Iterable[File]) -> None:
        self.missing: list[str] = []
        self.failure: Exception | None = None
        self._files: dict[str, list[File]] = {}
        self._contents: dict[int, tuple[str, bytes]] = {}
        self._parts = count()
        for file in sorted(files, key=lambda f: (len(f.parts), str(f))):
            self._files.setdefault(file.name.casefold(), []).append(file)

    @property
    def file_name(self) -> str:
        """Another name each time, for parts of an OBJ: trimesh is slow to tell namesakes apart."""
        return f"part{next(self._parts)}"

    def get(self, key: str) -> bytes:
        """Return the content of the file meant by `key`.

        Raises:
            FileNotFoundError: the model has no such file.
            OSError, MemoryError: the file cannot be read.
        """
        words = unquote(key).replace("\\", "/").strip().strip('"').casefold().split()
        # A name may hold spaces and may follow options: try all of it, then less and less.
        for start in range(len(words)):
            parts = " ".join(words[start:]).split("/")
            namesakes = self._files.get(parts[-1], [])
            if namesakes:
                file = max(namesakes, key=lambda f: _common_end(f, parts))
                if id(file) not in self._contents:  # a hundred materials may name one texture
                    try:
                        data = file.read_bytes()
                    except (OSError, MemoryError) as error:
                        if is_of_machine(error):
                            self.failure = error
                        raise
                    text = file.suffix.lower() == ".mtl"
                    self._contents[id(file)] = file.name, mended_mtl(data) if text else data
                return self._contents[id(file)][1]
        self.missing.append(key.replace("\\", "/").strip().strip('"').rpartition("/")[2])
        raise FileNotFoundError(key)

    def found(self) -> dict[str, bytes]:
        """Return the contents of all files that were asked for and found, by base name."""
        return dict(self._contents.values())

    def write(self, name: str, data: Any) -> None:
        """Refuse: shapes are only read."""
        raise PermissionError(name)

    def namespaced(self, namespace: str) -> SideFiles:
        """Return itself: names are looked up by their ends anyway."""
        return self

    def keys(self) -> list[str]:
        """Return the base names that can be found."""
        return list(self._files)


def _common_end(file: File, parts: Sequence[str]) -> int:
    """Return how many trailing components two paths share."""
    count = 0
    for a, b in zip(reversed(file.parts), reversed(parts), strict=False):
        if a.casefold() != b:
            break
        count += 1
    return count


def _merge(name: str, scene: trimesh.Scene, textures: Textures) -> Mesh:
    """Put all geometry of a scene in place and into one clean mesh, its textures in `textures`."""
    vertices, faces, colors, face_textures, uvs = [], [], [], [], []
    offset = total = 0
    for geometry, matrix in _placed(scene):
        total += len(geometry.faces)
        if total > _MAX_FACES:
            raise RejectedShapeError(f"{name} has more than {_MAX_FACES:,} faces")
        points = np.asarray(geometry.vertices, np.float64)
        index = np.asarray(geometry.faces, np.int64)
        valid = valid_faces(points, index)
        # Without the vertices of no face, of which each instance of a part would hold its own.
        used, index = _compact(index[valid], len(points))
        vertices.append(points[used] @ matrix[:3, :3].T + matrix[:3, 3])
        faces.append(index + offset)
        color, texture, uv = face_colors(geometry, textures)
        colors.append(color[valid])
        face_textures.append(texture[valid])
        uvs.append(None if uv is None else uv[valid])
        offset += len(used)
    if total == 0:
        raise RejectedShapeError(f"{name} has no faces")
    corners, triangles = np.concatenate(vertices), np.concatenate(faces)
    keep = _has_area(corners, triangles)
    if not keep.any():
        raise RejectedShapeError(f"{name} has no face with a finite area above zero")
    used, triangles = _compact(triangles[keep], len(corners))
    texture = np.concatenate(face_textures)[keep]
    textured = bool((texture >= 0).any())
    return Mesh(
        vertices=corners[used],
        faces=triangles,
        face_colors=np.concatenate(colors)[keep],
        textures=tuple(textures.images) if textured else (),
        face_textures=texture if textured else None,
        face_uvs=_joined(uvs, faces)[keep] if textured else None,
    )


def _compact(
    faces: NDArray[np.int64], num_vertices: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the vertices that faces (F, 3) use, (U,) in order, and the faces in terms of them."""
    seen = np.zeros(num_vertices, np.bool_)
    seen[faces] = True
    return np.flatnonzero(seen), (np.cumsum(seen) - 1)[faces]


def _joined(
    uvs: list[NDArray[np.float32] | None], faces: list[NDArray[np.int64]]
) -> NDArray[np.float32]:
    """Return all texture coordinates, (F, 3, 2), zero for parts of the mesh without any."""
    parts = [
        np.zeros((len(f), 3, 2), np.float32) if uv is None else uv
        for uv, f in zip(uvs, faces, strict=True)
    ]
    return np.concatenate(parts)


def _placed(scene: trimesh.Scene) -> Iterator[tuple[trimesh.Trimesh, NDArray[np.float64]]]:
    """Yield every mesh in the scene with its (4, 4) transform, in the file's order."""
    for node in scene.graph.nodes_geometry:
        # trimesh takes time cubic in the depth to multiply the transforms down to one node.
        path = scene.graph.transforms.shortest_path(scene.graph.base_frame, node)
        if len(path) > _MAX_DEPTH:
            raise RejectedShapeError(f"its scene nests more than {_MAX_DEPTH} levels deep")
        matrix, name = scene.graph[node]
        geometry = scene.geometry[name]
        if isinstance(geometry, trimesh.Trimesh) and len(geometry.faces):
            yield geometry, np.asarray(matrix, np.float64)


def _has_area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which faces, (F,), have a finite area above zero."""
    result = np.empty(len(faces), np.bool_)
    for start in range(0, len(faces), _BLOCK):
        a, b, c = (vertices[faces[start : start + _BLOCK, i]] for i in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        result[start : start + _BLOCK] = np.isfinite(area) & (area > 0)
    return result
