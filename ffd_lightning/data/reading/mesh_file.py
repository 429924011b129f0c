"""One mesh file of any common format, with its materials, as a `Mesh`.

trimesh reads; what it would read wrongly without a word is mended or rejected here. A name that a
file gives for another file (a material library, a texture, a glTF buffer) is looked up among the
files that belong to the shape and nowhere else, so nothing outside is read or fetched.
"""

from __future__ import annotations

import io
import logging
import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from pathlib import Path, PurePath
from typing import Any
from urllib.parse import unquote

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from trimesh.resolvers import Resolver

from ffd_lightning.data.reading.materials import ABSENT, Textures, face_colors
from ffd_lightning.errors import RejectedShapeError, is_bug, is_of_machine
from ffd_lightning.geometry.mesh import Mesh

EXTENSIONS = (".glb", ".gltf", ".obj", ".ply", ".off", ".stl")
"""Formats that can be read, the best at carrying colours first."""
MAX_BYTES = 1 << 31
"""Of one file; reading a mesh takes several times its size in memory."""

_NAMED = 5  # files and materials that a note names; a shape may lack hundreds
_UNSUPPORTED = {
    rb"KHR_draco_mesh_compression": "is compressed by Draco",
    rb'"sparse"\s*:': "stores geometry in sparse accessors",
}  # of which trimesh makes nothing, or something else

Read = Callable[[PurePath], bytes]


def read_file(path: PurePath) -> bytes:
    """Return the content of a file in a folder.

    Raises:
        RejectedShapeError: it is larger than 2 GB.
        OSError: it cannot be read.
    """
    if Path(path).stat().st_size > MAX_BYTES:
        raise RejectedShapeError(f"{path.name} is larger than {MAX_BYTES / 1e9:.1f} GB")
    return Path(path).read_bytes()


def read_mesh(
    path: PurePath, side_files: Iterable[PurePath] = (), read: Read = read_file
) -> tuple[Mesh, tuple[str, ...]]:
    """Read a mesh with its colours and textures, and say what of its materials could not be had.

    Convention:
        Coordinates are taken as they are, y up: OBJ and glTF say so; PLY, OFF and STL have no
        rule.

    Args:
        path: the mesh file; its extension is one of `EXTENSIONS`, in any case.
        side_files: the only other files that may be read for it.
        read: returns a file's content.

    Returns:
        The mesh without faces that are degenerate, not finite or point to no vertex; and a note
        "what: which" for each kind of fault, absent textures, say.

    Raises:
        RejectedShapeError: the file is damaged or has no surface; the message is the reason.
        OSError, MemoryError: of the system, see `errors.is_of_machine`.
    """
    kind = path.suffix.lower().lstrip(".")
    files, textures = SideFiles(side_files, read, kind == "obj"), Textures()
    try:
        data = _mended(read(path), kind, path.name)
        with np.errstate(all="ignore"), _quiet():
            scene = trimesh.load_scene(
                io.BytesIO(data), file_type=kind, resolver=files, process=False
            )
            mesh = _merge(path.name, scene, textures)
        if files.failure is not None:
            raise files.failure
        return mesh, _notes(files, textures, data if kind == "obj" else b"")
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


class SideFiles(Resolver):
    r"""Finds the files that a mesh names, by their base names, among those that belong to it.

    So `C:\textures\wood.png`, `../maps/WOOD.PNG` and `-s 1 1 1 wood.png` all find `wood.png`,
    and no name leads outside. Of several namesakes the one that shares most of the named path is
    taken, then the first. Textures that are absent or no pictures are given as `ABSENT`, since
    trimesh would forget that a material has one.

    Attributes:
        missing: the base names that were asked for in vain.
        undecodable: names of textures that are no pictures.
        libraries: the contents of the material libraries that were read.
        failure: of the system, over a file that is there: trimesh passes over errors of any kind.
    """

    def __init__(self, files: Iterable[PurePath], read: Read, obj: bool) -> None:
        self.missing: list[str] = []
        self.undecodable: list[str] = []
        self.libraries: list[bytes] = []
        self.failure: Exception | None = None
        self._read, self._obj, self._parts = read, obj, count()
        self._files: dict[str, list[PurePath]] = {}
        self._contents: dict[PurePath, bytes] = {}
        for file in sorted(files, key=lambda f: (len(f.parts), str(f))):
            self._files.setdefault(file.name.casefold(), []).append(file)

    @property
    def file_name(self) -> str:
        """Another name each time, for parts of an OBJ: trimesh is slow to tell namesakes apart."""
        return f"part{next(self._parts)}"

    def get(self, key: str) -> bytes:
        """Return the content of the file meant by `key`.

        Raises:
            FileNotFoundError: the shape has no such file.
            OSError, MemoryError: the file cannot be read.
        """
        words = unquote(key).replace("\\", "/").strip().strip('"').casefold().split()
        # A name may hold spaces and may follow options: try all of it, then less and less.
        for start in range(len(words)):
            parts = " ".join(words[start:]).split("/")
            if namesakes := self._files.get(parts[-1]):
                return self._content(max(namesakes, key=lambda f: _common_end(f, parts)))
        name = key.replace("\\", "/").strip().strip('"').rpartition("/")[2]
        self.missing.append(name)
        if self._is_texture(PurePath(name)):
            return ABSENT
        raise FileNotFoundError(key)

    def _content(self, file: PurePath) -> bytes:
        if file not in self._contents:  # a hundred materials may name one texture
            try:
                data = self._read(file)
            except (OSError, MemoryError) as error:
                if is_of_machine(error):
                    self.failure = error
                raise
            if file.suffix.lower() == ".mtl":
                self.libraries.append(data := _as_utf8(data))
            elif self._is_texture(file) and not _is_picture(data):
                self.undecodable.append(file.name)
                data = ABSENT
            self._contents[file] = data
        return self._contents[file]

    def _is_texture(self, file: PurePath) -> bool:
        suffix = file.suffix.lower()
        return suffix != ".mtl" if self._obj else suffix in Image.registered_extensions()

    def write(self, name: str, data: Any) -> None:
        """Refuse: shapes are only read."""
        raise PermissionError(name)

    def namespaced(self, namespace: str) -> SideFiles:
        """Return itself: names are looked up by their ends anyway."""
        return self

    def keys(self) -> list[str]:
        """Return the base names that can be found."""
        return list(self._files)


def _common_end(file: PurePath, parts: Sequence[str]) -> int:
    """Return how many trailing components two paths share."""
    pairs = list(zip(reversed(file.parts), reversed(parts), strict=False))
    return next((k for k, (a, b) in enumerate(pairs) if a.casefold() != b), len(pairs))


def _is_picture(data: bytes) -> bool:
    """Return whether a picture's header can be read; what follows it is seen when it is used."""
    try:
        with Image.open(io.BytesIO(data)):
            return True
    except Exception:  # Pillow raises many kinds on damaged images
        return False


def _notes(files: SideFiles, textures: Textures, obj: bytes) -> tuple[str, ...]:
    """Return what a user should know of a mesh's materials, a note a kind."""
    absent = dict.fromkeys(files.missing)
    libraries = [name for name in absent if name.lower().endswith(".mtl")]
    used = re.findall(rb"(?m)^usemtl[ \t]+(\S.*)$", obj)
    defined = re.findall(rb"(?im)^[ \t]*newmtl[ \t]+(\S.*)$", b"\n".join(files.libraries))
    nowhere = {b" ".join(name.split()) for name in used}
    nowhere -= {b" ".join(name.split()) for name in defined}
    kinds = {
        "material files are absent": libraries,
        "textures that the materials name are absent": [n for n in absent if n not in libraries],
        "textures cannot be decoded": list(dict.fromkeys(files.undecodable + textures.undecodable)),
        "materials are defined nowhere": sorted(n.decode("utf-8", "replace") for n in nowhere),
    }
    if libraries:
        del kinds["materials are defined nowhere"]
    return tuple(
        f"{kind}: {', '.join(which[:_NAMED])}"
        + (f" and {len(which) - _NAMED} more" if len(which) > _NAMED else "")
        for kind, which in kinds.items()
        if which
    )


# --- text that trimesh would misread --------------------------------------------------------------


def _mended(data: bytes, kind: str, name: str) -> bytes:
    """Return a mesh file's content in the form that trimesh reads rightly."""
    if not data or data.isspace():
        raise RejectedShapeError(f"{name} is empty")
    if kind in ("glb", "gltf"):
        for mark, why in _UNSUPPORTED.items():
            if re.search(mark, data):
                raise RejectedShapeError(f"{name} {why}, which is not supported: export it without")
    if kind in ("obj", "off") or (kind == "stl" and b"endfacet" in data):
        data = _as_utf8(data)
    if kind == "ply" and not data[: (end := data.find(b"end_header"))].isascii():
        data = _as_utf8(data[:end]) + data[end:]
    if kind == "off":
        _check_off(data, name)
    return _absolute_indices(data) if kind == "obj" else data


def _as_utf8(data: bytes) -> bytes:
    """Return text in UTF-8, whatever it was in: older exporters write the system's encoding."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace").encode()
    try:
        return data.decode("utf-8-sig").encode()
    except UnicodeDecodeError:
        return data.decode("latin-1").encode()


def _absolute_indices(data: bytes) -> bytes:
    """Replace an OBJ's negative indices, which count back from the line they stand in.

    trimesh takes them to count back from the end of the file.
    """
    if not re.search(rb"^f[^\n]*[ \t/]-\d", data, re.MULTILINE):
        return data
    lines = re.sub(rb"\\\r?\n", b" ", data).splitlines()
    seen: Counter[bytes] = Counter()
    for i, line in enumerate(lines):
        first, *corners = line.split() or [b""]
        seen[first] += 1
        if first == b"f":
            counts = seen[b"v"], seen[b"vt"], seen[b"vn"]
            for k, corner in enumerate(corners):
                pairs = zip(corner.split(b"/"), counts, strict=False)
                corners[k] = b"/".join(
                    b"%d" % (int(x) + n + 1) if x.startswith(b"-") else x for x, n in pairs
                )
            lines[i] = b" ".join([first, *corners])
    return b"\n".join(lines)


def _check_off(data: bytes, name: str) -> None:
    """Reject an OFF that ends before its last face: trimesh reads what there is without a word."""
    rows = [row for line in data.splitlines() if (row := line.split(b"#")[0].strip())]
    header = re.fullmatch(rb"(?:ST)?C?N?OFF\s*((?:\d+\s*)*)", rows[0]) if rows else None
    if header is None:
        raise RejectedShapeError(f"{name} is not of a kind of OFF that can be read")
    counts, start = header[1].split(), 1
    while len(counts) < 2 and start < len(rows):
        counts, start = counts + rows[start].split(), start + 1
    promised, there = sum(map(int, counts[:2])), len(rows) - start
    if len(counts) < 2 or there < promised:
        raise RejectedShapeError(
            f"{name} is incomplete: it has {there:,} of {promised:,} vertices and faces"
        )


# --- a scene as one mesh --------------------------------------------------------------------------


def _merge(name: str, scene: trimesh.Scene, textures: Textures) -> Mesh:
    """Put all geometry of a scene in place and into one clean mesh, its textures in `textures`."""
    vertices, faces, colors, face_textures, uvs = [], [], [], [], []
    offset = 0
    for node in scene.graph.nodes_geometry:
        matrix, part = scene.graph[node]
        geometry = scene.geometry[part]
        if not isinstance(geometry, trimesh.Trimesh) or not len(geometry.faces):
            continue
        points = np.asarray(geometry.vertices, np.float64)
        index = np.asarray(geometry.faces, np.int64)
        valid = np.asarray(((index >= 0) & (index < len(points))).all(axis=1), np.bool_)
        color, texture, uv = face_colors(geometry, np.where(valid[:, None], index, 0), textures)
        vertices.append(points @ matrix[:3, :3].T + matrix[:3, 3])
        faces.append(index[valid] + offset)
        colors.append(color[valid])
        face_textures.append(texture[valid])
        uvs.append(uv[valid])
        offset += len(points)
    if not faces:
        raise RejectedShapeError(f"{name} has no faces")
    corners, triangles = np.concatenate(vertices), np.concatenate(faces)
    a, b, c = corners[triangles].swapaxes(0, 1)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    keep = np.asarray(np.isfinite(area) & (area > 0))
    if not keep.any():
        raise RejectedShapeError(f"{name} has no face with a finite area above zero")
    seen, triangles = _compact(triangles[keep], len(corners))
    texture = np.concatenate(face_textures)[keep]
    textured = bool((texture >= 0).any())
    return Mesh(
        vertices=corners[seen],
        faces=triangles,
        face_colors=np.concatenate(colors)[keep],
        textures=tuple(textures.images) if textured else (),
        face_textures=texture if textured else None,
        face_uvs=np.concatenate(uvs)[keep] if textured else None,
    )


def _compact(
    faces: NDArray[np.int64], num_vertices: int
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Return which vertices (V,) faces (F, 3) use, and the faces in terms of those."""
    seen = np.zeros(num_vertices, np.bool_)
    seen[faces] = True
    return seen, (np.cumsum(seen) - 1)[faces]
