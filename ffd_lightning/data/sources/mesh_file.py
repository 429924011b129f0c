"""One mesh file of any common format, with its materials, as a `Mesh`.

Real models are messy: what can be mended is, what can't is rejected with a plain reason. A name
that a file gives for another file (a material library, a texture, a glTF buffer) is looked up
among the files that belong to the model and nowhere else, so nothing outside is read or fetched.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Sequence
from typing import Any
from urllib.parse import unquote

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.resolvers import Resolver

from ffd_lightning.data.mesh import Mesh
from ffd_lightning.data.sources.files import File
from ffd_lightning.data.sources.mesh_colors import Textures, face_colors, valid_faces
from ffd_lightning.data.sources.mesh_text import as_utf8, read_mended
from ffd_lightning.errors import RejectedModelError

EXTENSIONS = (".glb", ".gltf", ".obj", ".ply", ".off", ".stl")
"""Formats that can be read, the best at carrying colours first."""

_MAX_FACES = 10_000_000
_MAX_DEPTH = 100


def read_mesh(path: File, side_files: Sequence[File] = ()) -> Mesh:
    """Read a mesh with its colours and textures.

    Convention:
        Coordinates are taken as they are, y up: OBJ and glTF say so; PLY, OFF and STL have no
        rule, so models in those formats that are z up must be turned beforehand.

    Args:
        path: the mesh file; its extension is one of `EXTENSIONS`, in any case.
        side_files: the only other files that may be read for it.

    Returns:
        The mesh without faces that are degenerate, not finite or point to no vertex.

    Raises:
        RejectedModelError: the file cannot be read or has no surface; the message is the reason.
    """
    try:
        scene = trimesh.load_scene(
            io.BytesIO(read_mended(path)),
            file_type=path.suffix.lower().lstrip("."),
            resolver=SideFiles(side_files),
            process=False,
        )
        with np.errstate(all="ignore"):
            return _merge(path.name, scene)
    except RejectedModelError:
        raise
    except Exception as error:  # a reader meets anything in a damaged file
        reason = " ".join(str(error).split())[:200]
        if isinstance(error, ImportError):  # trimesh reaches for a decoder of unknown text
            reason = "its content is not of this format"
        message = f"{path.name} cannot be read ({type(error).__name__}: {reason})"
        raise RejectedModelError(message) from error


class SideFiles(Resolver):
    r"""Finds the files that a mesh names, by their base names, among those that belong to it.

    So `C:\textures\wood.png`, `../maps/WOOD.PNG` and `-s 1 1 1 wood.png` all find `wood.png`,
    and no name leads outside. Of several namesakes the one that shares most of the named path is
    taken, then the first.
    """

    def __init__(self, files: Iterable[File]) -> None:
        self._files: dict[str, list[File]] = {}
        for file in sorted(files, key=lambda f: (len(f.parts), str(f))):
            self._files.setdefault(file.name.casefold(), []).append(file)

    def get(self, key: str) -> bytes:
        """Return the content of the file meant by `key`.

        Raises:
            FileNotFoundError: the model has no such file.
        """
        words = unquote(key).replace("\\", "/").strip().strip('"').casefold().split()
        # A name may hold spaces and may follow options: try all of it, then less and less.
        for start in range(len(words)):
            parts = " ".join(words[start:]).split("/")
            namesakes = self._files.get(parts[-1], [])
            if namesakes:
                file = max(namesakes, key=lambda f: _common_end(f, parts))
                data = file.read_bytes()
                return as_utf8(data) if file.suffix.lower() == ".mtl" else data
        raise FileNotFoundError(key)

    def write(self, name: str, data: Any) -> None:
        """Refuse: models are only read."""
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


def _merge(name: str, scene: trimesh.Scene) -> Mesh:
    """Put all geometry of a scene in place and into one clean mesh."""
    textures = Textures()
    vertices, faces, colored = [], [], []
    offset = total = 0
    for geometry, matrix in _placed(scene):
        total += len(geometry.faces)
        if total > _MAX_FACES:
            raise RejectedModelError(f"{name} has more than {_MAX_FACES:,} faces")
        points = np.asarray(geometry.vertices, np.float64)
        index = np.asarray(geometry.faces, np.int64)
        valid = valid_faces(points, index)
        vertices.append(points @ matrix[:3, :3].T + matrix[:3, 3])
        faces.append(index[valid] + offset)
        colored.append([part[valid] for part in face_colors(geometry, textures)])
        offset += len(points)
    if total == 0:
        raise RejectedModelError(f"{name} has no faces")
    colors, face_textures, uvs = (np.concatenate(c) for c in zip(*colored, strict=True))
    corners, triangles = np.concatenate(vertices), np.concatenate(faces)
    keep = _has_area(corners, triangles)
    if not keep.any():
        raise RejectedModelError(f"{name} has no face with a finite area above zero")
    used, triangles = np.unique(triangles[keep], return_inverse=True)
    textured = bool((face_textures[keep] >= 0).any())
    return Mesh(
        vertices=corners[used],
        faces=triangles.reshape(-1, 3).astype(np.int64),
        face_colors=colors[keep],
        textures=tuple(textures.images) if textured else (),
        face_textures=face_textures[keep] if textured else None,
        face_uvs=uvs[keep] if textured else None,
    )


def _placed(scene: trimesh.Scene) -> Iterator[tuple[trimesh.Trimesh, NDArray[np.float64]]]:
    """Yield every mesh in the scene with its (4, 4) transform, in the file's order."""
    for node in scene.graph.nodes_geometry:
        # trimesh takes time cubic in the depth to multiply the transforms down to one node.
        path = scene.graph.transforms.shortest_path(scene.graph.base_frame, node)
        if len(path) > _MAX_DEPTH:
            raise RejectedModelError(f"its scene nests more than {_MAX_DEPTH} levels deep")
        matrix, name = scene.graph[node]
        geometry = scene.geometry[name]
        if isinstance(geometry, trimesh.Trimesh) and len(geometry.faces):
            yield geometry, np.asarray(matrix, np.float64)


def _has_area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which faces, (F,), have a finite area above zero."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.asarray(np.isfinite(area) & (area > 0), np.bool_)
