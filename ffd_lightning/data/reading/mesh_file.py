"""One mesh file of any common format, with its materials, as a `Mesh`.

trimesh reads; what it would read wrongly without a word is mended or rejected here. A name that a
file gives for another file (a material library, a texture, a glTF buffer) is looked up among the
files that belong to the shape and nowhere else, so nothing outside is read or fetched.
"""

from __future__ import annotations

import codecs
import io
import logging
import re
import shlex
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count, takewhile
from pathlib import Path, PurePath
from typing import Any
from urllib.parse import unquote

import numpy as np
import trimesh
from PIL import Image
from trimesh.resolvers import Resolver

from ffd_lightning.data.reading import gltf
from ffd_lightning.data.reading.materials import ABSENT, UNDECODABLE, Textures, face_colors
from ffd_lightning.data.reading.polygons import check_count, concave, cut_ply, read_off
from ffd_lightning.errors import RejectedShapeError, is_bug, is_of_machine
from ffd_lightning.geometry.mesh import Mesh

EXTENSIONS = (".glb", ".gltf", ".obj", ".ply", ".off", ".stl")
"""Formats that can be read, the best at carrying colours first."""

_ASSIMP = (".ac", ".acc", ".dae", ".fbx", ".3ds", ".lwo", ".x3d", ".3mf")
FOREIGN = (
    *(*_ASSIMP, ".blend", ".skp", ".max", ".c4d", ".ma", ".mb", ".3dm", ".step", ".stp"),
    *(".usd", ".usda", ".usdc", ".usdz", ".wrl"),
)
"""Formats of meshes that cannot be read; `read_mesh` says how to convert them."""

_NO_LIBRARY = "material files are absent"
_NO_MATERIAL = "materials that faces name are in no material file"
_NO_TEXTURE = "textures that the materials name are absent"
_MISPLACED = "textures are misplaced"
_COMMENT = re.compile(rb"(?<=\S) +#(?: .*)?$", re.MULTILINE)  # "Material #25" is a name
_NAMED = 5  # files that a warning names; a shape may lack hundreds

Problems = dict[str, dict[str, None]]
Read = Callable[[Any], bytes]


def read_mesh(
    path: PurePath, side_files: Iterable[PurePath] = (), read: Read = Path.read_bytes
) -> tuple[Mesh, tuple[str, ...]]:
    """Read a mesh with its colours and textures, its coordinates as they are.

    Args:
        path: the mesh file; its extension is one of `EXTENSIONS`, in any case. One of `FOREIGN` is
            rejected with what converts it.
        side_files: the only other files that may be read for it.
        read: returns a file's content.

    Returns:
        The mesh without faces that are degenerate, not finite or point to no vertex; and a warning
        "what: which" for each kind of problem, absent textures, say.

    Raises:
        RejectedShapeError: the file is damaged or has no surface; the message is the reason.
        OSError, MemoryError: of the system, see `errors.is_of_machine`.
    """
    if path.suffix.lower() in FOREIGN:
        raise RejectedShapeError(unread(path))
    kind = path.suffix.lower().lstrip(".")
    kinds = (_NO_LIBRARY, _NO_MATERIAL, _NO_TEXTURE, UNDECODABLE, _MISPLACED)
    problems: Problems = {kind: {} for kind in kinds}
    files = SideFiles(side_files, read, problems)
    content = read(path)
    with np.errstate(all="ignore"), _quiet():
        try:
            if kind in ("glb", "gltf"):
                content, misplaced = gltf.mended(content, path.name)
                problems[_MISPLACED] = dict.fromkeys(misplaced)
            content = _mended(content, kind, path.name)
            if kind == "off":
                scene = trimesh.Scene(read_off(content, path.name))
            else:
                data = io.BytesIO(content)
                scene = trimesh.load_scene(data, file_type=kind, resolver=files, process=False)
            if kind == "ply":
                scene.geometry |= {name: cut_ply(part) for name, part in scene.geometry.items()}
            if kind == "obj" and (files.materials or not problems[_NO_LIBRARY]):
                used = dict.fromkeys(re.findall(rb"^usemtl +(.*\S)", content, re.MULTILINE))
                others = [name for name in used if name not in files.materials]
                problems[_NO_MATERIAL] = dict.fromkeys(x.decode("utf-8", "replace") for x in others)
            mesh = _merge(path.name, scene, Textures(problems[UNDECODABLE]))
        except Exception as error:  # trimesh meets anything in a damaged file
            if isinstance(error, RejectedShapeError | MemoryError) or is_bug(error):
                raise
            reason = " ".join(str(error).split())[:200]
            if isinstance(error, ImportError):  # trimesh reaches for a decoder of unknown text
                reason = "its content is not of this format"
            message = f"{path.name} cannot be read ({type(error).__name__}: {reason})"
            raise (files.failure or RejectedShapeError(message)) from error
    if files.failure is not None:
        raise files.failure
    return mesh, tuple(_warning(what, list(which)) for what, which in problems.items() if which)


def matters(file: PurePath) -> bool:
    """Return whether a file may decide how a mesh looks: a mesh, materials, a picture, a buffer."""
    known = (*EXTENSIONS, *FOREIGN, ".mtl", ".bin")
    return file.suffix.lower() in known or _is_texture(file.name)


def unread(path: PurePath) -> str:
    """Return why a file of one of the formats `FOREIGN` is not read, and the way out.

    >>> unread(PurePath("cars/mini.ac"))
    '.ac is not read: `assimp export mini.ac mini.obj` makes an OBJ of it'
    """
    kind, name = path.suffix.lower(), path.name
    command = shlex.join(["assimp", "export", name, path.with_suffix(".obj").name])
    way = f"`{command}` makes an OBJ of it" if kind in _ASSIMP else f"export {name} as .glb or .obj"
    return f"{kind} is not read: {way}"


def mesh_of(geometry: trimesh.Trimesh | trimesh.Scene, name: str) -> Mesh:
    """Return what trimesh has loaded or made as a mesh, with its colours and textures.

    Raises:
        RejectedShapeError: it has no surface.
    """
    with np.errstate(all="ignore"), _quiet():
        scene = geometry if isinstance(geometry, trimesh.Scene) else trimesh.Scene(geometry)
        return _merge(name, scene, Textures({}))


def _warning(what: str, which: Sequence[str]) -> str:
    more = f" and {len(which) - _NAMED} more" if len(which) > _NAMED else ""
    return f"{what}: {', '.join(which[:_NAMED])}{more}"


@contextmanager
def _quiet() -> Iterator[None]:
    """Let readers say nothing meanwhile: what they make of a damaged file is judged here."""
    logger = logging.getLogger("trimesh")  # it prints tracebacks about textures that are absent
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings(action="ignore"):
            yield
    finally:
        logger.setLevel(level)


class SideFiles(Resolver):
    r"""Finds the files that a mesh names, by their base names, among those that belong to it.

    So `C:\textures\wood.png`, `../maps/WOOD.PNG` and `-s 1 1 1 wood.png` all find `wood.png`,
    and no name leads outside. Of several namesakes the one that shares most of the named path is
    taken, then the first. Textures that are absent or no pictures are given as `ABSENT`, since
    trimesh would forget that a material has one. `problems` gets the names of what cannot be had.

    Attributes:
        failure: of the system, over a file that is there: trimesh passes over errors of any kind.
        materials: the names of those in the material files that were read.
    """

    def __init__(self, files: Iterable[PurePath], read: Read, problems: Problems) -> None:
        self.failure: Exception | None = None
        self.materials: set[bytes] = set()
        self._read, self._problems, self._parts = read, problems, count()
        self._files: dict[str, list[PurePath]] = {}
        self._contents: dict[PurePath, bytes] = {}
        for file in sorted(files, key=lambda f: (len(f.parts), str(f))):
            self._files.setdefault(file.name.casefold(), []).append(file)

    @property
    def file_name(self) -> str:
        """Another name each time, for parts of an OBJ: trimesh is slow to tell namesakes apart."""
        return f"part{next(self._parts)}"

    def get(self, key: str) -> bytes:
        """Return the content of the file meant by `key`; a FileNotFoundError if there is none."""
        if len(several := re.findall(r"\S.*?\.mtl(?=\s|$)", key, re.IGNORECASE)) > 1:
            return self._together(several)
        words = unquote(key).replace("\\", "/").strip().strip('"').casefold().split()
        # A name may hold spaces and may follow options: try all of it, then less and less.
        for start in range(len(words)):
            parts = " ".join(words[start:]).split("/")
            if namesakes := self._files.get(parts[-1]):
                return self._content(max(namesakes, key=lambda f: _common_end(f, parts)))
        name = key.replace("\\", "/").strip().strip('"').rpartition("/")[2]
        kind = _NO_LIBRARY if name.lower().endswith(".mtl") else _NO_TEXTURE
        self._problems[kind][name] = None
        if _is_texture(name):
            return ABSENT
        raise FileNotFoundError(key)

    def _together(self, libraries: Iterable[str]) -> bytes:
        """Return material libraries, as far as they are there, as one."""
        found = []
        for name in libraries:
            with suppress(FileNotFoundError):
                found.append(self.get(name))
        return b"\n".join(found)

    def _content(self, file: PurePath) -> bytes:
        if file not in self._contents:  # a hundred materials may name one texture
            try:
                data = self._read(file)
            except (OSError, MemoryError) as error:
                if is_of_machine(error):
                    self.failure = error
                raise
            if file.suffix.lower() == ".mtl":
                data = _mended_materials(_as_utf8(data))
                self.materials |= set(re.findall(rb"^\s*newmtl +(.*\S)", data, re.MULTILINE))
                if _moves_textures(data):
                    self._problems[_MISPLACED][file.name] = None
            elif _is_texture(file.name):
                try:
                    Image.open(io.BytesIO(data))  # its header; the rest is read when it is used
                except Exception:  # Pillow raises many kinds on damaged images
                    self._problems[UNDECODABLE][file.name] = None
                    data = ABSENT
            self._contents[file] = data
        return self._contents[file]

    def write(self, name: str, data: Any) -> None:
        """Refuse: shapes are only read."""
        raise PermissionError(name)

    def namespaced(self, namespace: str) -> SideFiles:
        """Return itself: names are looked up by their ends anyway."""
        return self

    def keys(self) -> list[str]:
        """Return the base names that can be found."""
        return list(self._files)


def _is_texture(name: str) -> bool:
    return PurePath(name).suffix.lower() in Image.registered_extensions()


def _common_end(file: PurePath, parts: Sequence[str]) -> int:
    """Return how many trailing components a path shares with another, in lower case."""
    pairs = zip(reversed(file.parts), reversed(parts), strict=False)
    return len(list(takewhile(lambda pair: pair[0].casefold() == pair[1], pairs)))


# --- text that trimesh would misread --------------------------------------------------------------


def _mended(data: bytes, kind: str, name: str) -> bytes:
    """Return a mesh file's content in the form that trimesh reads rightly."""
    if not data or data.isspace():
        raise RejectedShapeError(f"{name} is empty")
    if kind in ("obj", "off") or (kind == "stl" and b"endfacet" in data):
        data = _as_utf8(data)
    if kind == "ply":
        header, end, rows = data.partition(b"end_header")
        if re.search(rb"^format ascii", header, re.MULTILINE):
            counts = re.findall(rb"^element\s+\S+\s+(\d+)", header, re.MULTILINE)
            check_count(name, sum(map(int, counts)), len(rows.splitlines()) - 1)
        data = _as_utf8(header) + end + rows
    if kind != "obj":
        return data
    data = re.sub(rb"\r\n?", b"\n", data).replace(b"\\\n", b" ").replace(b"\t", b" ")
    data = re.sub(rb"^ +", b"", data, flags=re.MULTILINE)
    data = re.sub(rb"^((?:v|vt|vn|f) [^#\n]*)#.*", rb"\1", data, flags=re.MULTILINE)
    data = _COMMENT.sub(b"", data) if b" #" in data else data
    libraries = dict.fromkeys(re.findall(rb"^mtllib +(.+)", data, re.MULTILINE))
    if len(libraries) > 1:  # one line is read
        data = b"mtllib " + b" ".join(libraries) + b"\n" + data
    return _without_concave_faces(_of_one_form(_absolute_indices(data)))


def _mended_materials(data: bytes) -> bytes:
    """Return an MTL without comments behind values, and with three values in each colour.

    What it lacks of a colour is as what it has; trimesh would read no material at all.
    """
    data = re.sub(rb"\r\n?", b"\n", data)
    data = _COMMENT.sub(b"", data.replace(b"\t", b" "))
    data = re.sub(rb"^( *(?:K[ads]|d|Tr) [^#\n]*)#.*", rb"\1", data, flags=re.MULTILINE)
    data = re.sub(rb"^( *K[ads] +\S+ +(\S+)) *$", rb"\1 \2", data, flags=re.MULTILINE)
    return re.sub(rb"^( *K[ads] +(\S+)) *$", rb"\1 \2 \2", data, flags=re.MULTILINE)


def _moves_textures(data: bytes) -> bool:
    """Return whether an MTL scales or moves a texture, which is not followed."""
    found = re.findall(rb"(?i)^\s*map_Kd [^\n]*?-([os])((?: +-?\d*\.?\d+)+)", data, re.MULTILINE)
    return any(float(x) != (kind == b"s") for kind, values in found for x in values.split())


def _as_utf8(data: bytes) -> bytes:
    """Return text in UTF-8: older exporters write the system's encoding."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16", "replace").encode()
    try:
        return data.decode("utf-8-sig").encode()
    except UnicodeDecodeError:
        return data.decode("latin-1").encode()


def _absolute_indices(data: bytes) -> bytes:
    """Replace an OBJ's negative indices: they count back from their line, trimesh from the end."""
    if not re.search(rb"^f[^\n]*[ \t/]-\d", data, re.MULTILINE):
        return data
    lines = data.split(b"\n")
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


def _of_one_form(data: bytes) -> bytes:
    """Give an OBJ's faces one form, `v` or `v/vt`, where they have several.

    trimesh takes lines of as many numbers for faces of one form: six may be a triangle of `v/vt`,
    one of `v//vn`, or a hexagon.
    """
    firsts = set(re.findall(rb"^f +(\S+)", data, re.MULTILINE))
    forms = {re.sub(rb"\d+", b"0", first) for first in firsts}
    if len(forms) < 2:
        return data
    textured = any(b"0/0" in form for form in forms)
    spare = len(re.findall(rb"^vt ", data, re.MULTILINE)) + 1  # for corners without one
    lines = data.split(b"\n")
    for i, line in enumerate(lines):
        if line.startswith(b"f "):
            corners = [(*corner.split(b"/"), b"")[:2] for corner in line.split()[1:]]
            kept = (b"%b/%b" % (v, vt or b"%d" % spare) if textured else v for v, vt in corners)
            lines[i] = b"f " + b" ".join(kept)
    return b"\n".join([*lines, b"vt 0 0"])


def _without_concave_faces(data: bytes) -> bytes:
    """Cut an OBJ's concave faces into triangles: trimesh cuts every face from its first corner."""
    lines = data.split(b"\n")
    faces = [(i, line.split()[1:]) for i, line in enumerate(lines) if line.startswith(b"f ")]
    large = [(i, corners) for i, corners in faces if len(corners) > 3]
    if not large:
        return data
    polygons = [[int(c.partition(b"/")[0]) - 1 for c in corners] for _, corners in large]
    places = np.array([line.split()[1:4] for line in lines if line.startswith(b"v ")], np.float64)
    for k, cut in concave(polygons, places).items():
        place, corners = large[k]
        lines[place] = b"\n".join(b"f " + b" ".join(corners[c] for c in t) for t in cut)
    return b"\n".join(lines)


# --- a scene as one mesh --------------------------------------------------------------------------


def _merge(name: str, scene: trimesh.Scene, textures: Textures) -> Mesh:
    """Put all geometry of a scene in place and into one clean mesh, its textures in `textures`."""
    vertices, of_faces, offset = [], [], 0
    for node in scene.graph.nodes_geometry:
        matrix, part = scene.graph[node]
        geometry = scene.geometry[part]
        if not isinstance(geometry, trimesh.Trimesh) or not len(geometry.faces):
            continue
        points = np.asarray(geometry.vertices, np.float64)
        index = np.asarray(geometry.faces, np.int64)
        valid = np.asarray(((index >= 0) & (index < len(points))).all(axis=1), np.bool_)
        paint = face_colors(geometry, np.where(valid[:, None], index, 0), textures)
        vertices.append(points @ matrix[:3, :3].T + matrix[:3, 3])
        of_faces.append([values[valid] for values in (index + offset, *paint)])
        offset += len(points)
    if not vertices:
        raise RejectedShapeError(f"{name} has no faces")
    corners = np.concatenate(vertices)
    faces, colors, texture, uvs = map(np.concatenate, zip(*of_faces, strict=True))
    a, b, c = corners[faces].swapaxes(0, 1)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    keep = np.asarray(np.isfinite(area) & (area > 0))
    if not keep.any():
        raise RejectedShapeError(f"{name} has no face with a finite area above zero")
    used, faces = np.unique(faces[keep], return_inverse=True)
    textured = bool((texture[keep] >= 0).any())
    return Mesh(
        vertices=corners[used],
        faces=faces.reshape(-1, 3),
        face_colors=colors[keep],
        textures=tuple(textures.images) if textured else (),
        face_textures=texture[keep] if textured else None,
        face_uvs=uvs[keep] if textured else None,
    )
