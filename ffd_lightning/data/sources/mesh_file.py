"""One mesh file of any common format, with its materials, as a `Mesh`.

Real models are messy: what can be mended is, what can't is rejected with a plain reason. A name
that a file gives for another file (a material library, a texture, a glTF buffer) is looked up
among the files that belong to the model and nowhere else, so nothing outside is read or fetched.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from trimesh.resolvers import Resolver

from ffd_lightning.data.mesh import Mesh
from ffd_lightning.errors import RejectedModelError

EXTENSIONS = (".glb", ".gltf", ".obj", ".ply", ".off", ".stl")
"""Formats that can be read, the best at carrying colours first."""

_MAX_TEXTURE = 1024
_MAX_FACES = 10_000_000
_NO_COLOR = np.array([178, 178, 178, 255], np.uint8)
_WHITE = np.full(4, 255, np.uint8)

Color = NDArray[np.uint8]
Colored = tuple[NDArray[np.uint8], NDArray[np.int16], NDArray[np.float32]]


def read_mesh(path: Path, side_files: Sequence[Path] = ()) -> Mesh:
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
            io.BytesIO(_readable(path)),
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
        message = f"{path.name} cannot be read ({type(error).__name__}: {reason})"
        raise RejectedModelError(message) from error


def _readable(path: Path) -> bytes:
    """Return the content of a mesh file in the form that trimesh reads rightly."""
    data = path.read_bytes()
    if not data.strip():
        raise RejectedModelError(f"{path.name} is empty")
    if b"KHR_draco_mesh_compression" in data:
        raise RejectedModelError(
            f"{path.name} is compressed by Draco, which is not supported: export it without"
        )
    if path.suffix.lower() in (".obj", ".off"):
        data = _as_utf8(data)
    return _absolute_indices(data) if path.suffix.lower() == ".obj" else data


def _as_utf8(data: bytes) -> bytes:
    """Return text in UTF-8, whatever it was in: older exporters write the system's encoding."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace").encode()
    try:
        data.decode()
    except UnicodeDecodeError:
        return data.decode("latin-1").encode()
    return data.removeprefix(b"\xef\xbb\xbf")


class SideFiles(Resolver):
    r"""Finds the files that a mesh names, by their base names, among those that belong to it.

    So `C:\textures\wood.png`, `../maps/WOOD.PNG` and `-s 1 1 1 wood.png` all find `wood.png`,
    and no name leads outside. Of several namesakes the one that shares most of the named path is
    taken, then the first.
    """

    def __init__(self, files: Iterable[Path]) -> None:
        self._files: dict[str, list[Path]] = {}
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
                return _as_utf8(data) if file.suffix.lower() == ".mtl" else data
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


def _common_end(file: Path, parts: Sequence[str]) -> int:
    """Return how many trailing components two paths share."""
    count = 0
    for a, b in zip(reversed(file.parts), reversed(parts), strict=False):
        if a.casefold() != b:
            break
        count += 1
    return count


def _absolute_indices(data: bytes) -> bytes:
    """Replace an OBJ's negative indices, which count back from the line they stand in.

    trimesh takes them to count back from the end of the file.
    """
    if not re.search(rb"^f[^\n]*[ \t/]-\d", data, re.MULTILINE):
        return data
    lines = re.sub(rb"\\\r?\n", b" ", data).splitlines()
    seen: Counter[bytes] = Counter()
    for i, line in enumerate(lines):
        words = line.split()
        if not words:
            continue
        if words[0] != b"f":
            seen[words[0]] += 1
            continue
        counts = (seen[b"v"], seen[b"vt"], seen[b"vn"])
        for k, word in enumerate(words[1:], 1):
            pairs = zip(word.split(b"/"), counts, strict=False)
            words[k] = b"/".join(
                b"%d" % (int(x) + n + 1) if x.startswith(b"-") else x for x, n in pairs
            )
        lines[i] = b" ".join(words)
    return b"\n".join(lines)


def _merge(name: str, scene: trimesh.Scene) -> Mesh:
    """Put all geometry of a scene in place and into one clean mesh."""
    textures = _Textures()
    vertices, faces, colored = [], [], []
    offset = total = 0
    for geometry, matrix in _placed(scene):
        total += len(geometry.faces)
        if total > _MAX_FACES:
            raise RejectedModelError(f"{name} has more than {_MAX_FACES:,} faces")
        points = np.asarray(geometry.vertices, np.float64)
        index = np.asarray(geometry.faces, np.int64)
        valid = _valid(points, index)
        vertices.append(points @ matrix[:3, :3].T + matrix[:3, 3])
        faces.append(index[valid] + offset)
        colored.append([part[valid] for part in _colors(geometry, textures)])
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
        matrix, name = scene.graph[node]
        geometry = scene.geometry[name]
        if isinstance(geometry, trimesh.Trimesh) and len(geometry.faces):
            yield geometry, np.asarray(matrix, np.float64)


def _valid(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which faces, (F,), point to vertices that exist."""
    return np.asarray(((faces >= 0) & (faces < len(vertices))).all(axis=1), np.bool_)


def _has_area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which faces, (F,), have a finite area above zero."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.asarray(np.isfinite(area) & (area > 0), np.bool_)


class _Textures:
    """The textures of one model, each decoded once per tint."""

    def __init__(self) -> None:
        self.images: list[NDArray[np.uint8]] = []
        self._known: dict[tuple[int, bytes, float | None], int] = {}

    def add(self, image: Image.Image, tint: Color, cutoff: float | None) -> int:
        """Return the index of `image` times `tint`, -1 if it cannot be decoded.

        Where `cutoff` is given, alpha becomes all or nothing about it; alpha that is zero
        everywhere is an exporter's slip and means opaque.
        """
        key = (id(image), tint.tobytes(), cutoff)
        if key not in self._known:
            try:
                small = image.convert("RGBA")
                small.thumbnail((_MAX_TEXTURE, _MAX_TEXTURE))
            except Exception:  # Pillow raises many kinds on damaged images
                self._known[key] = -1
                return -1
            pixels = np.array(small)
            if pixels[..., 3].max() == 0:
                pixels[..., 3] = 255
            pixels = np.round(pixels * (tint / 255.0)).astype(np.uint8)
            if cutoff is not None:
                pixels[..., 3] = np.where(pixels[..., 3] >= 255 * cutoff, 255, 0)
            self._known[key] = len(self.images)
            self.images.append(pixels)
        return self._known[key]


def _colors(geometry: trimesh.Trimesh, textures: _Textures) -> Colored:
    """Return colours (F, 4), texture indices (F,) and UVs (F, 3, 2) of one geometry's faces."""
    count = len(geometry.faces)
    visual: Any = geometry.visual
    colors = np.tile(_NO_COLOR, (count, 1))
    index = np.full(count, -1, np.int16)
    uvs = np.zeros((count, 3, 2), np.float32)
    faces = np.where(_valid(geometry.vertices, geometry.faces)[:, None], geometry.faces, 0)
    if isinstance(visual, trimesh.visual.ColorVisuals):
        if visual.kind == "face" and len(visual.face_colors) == count:
            colors = _opaque_if_unseen(np.asarray(visual.face_colors))
        elif visual.kind == "vertex" and len(visual.vertex_colors) == len(geometry.vertices):
            colors = _opaque_if_unseen(_mean_colors(visual.vertex_colors, faces))
        return colors, index, uvs
    color, image, tint, cutoff = _material(visual.material)
    colors[:] = color
    uv = None if visual.uv is None else np.asarray(visual.uv, np.float32)
    if image is not None and uv is not None and len(uv) == len(geometry.vertices):
        texture = textures.add(image, tint, cutoff)
        if texture >= 0:
            index[:] = texture
            uvs = np.nan_to_num(uv[faces, :2], posinf=0, neginf=0)
            colors[:] = np.round(textures.images[texture].mean(axis=(0, 1)))
            return colors, index, uvs
    painted = visual.vertex_attributes.get("color")
    if painted is not None and len(painted) == len(geometry.vertices):
        rgba = trimesh.visual.color.to_rgba(np.array(painted))
        colors = np.round(_mean_colors(rgba, faces) * (color / 255.0)).astype(np.uint8)
    return colors, index, uvs


def _mean_colors(vertex_colors: Color, faces: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Average vertex colours (V, 4) to the faces, (F, 4)."""
    return np.round(np.asarray(vertex_colors)[faces].mean(axis=1)).astype(np.uint8)


def _opaque_if_unseen(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Make colours opaque if all of them have alpha 0, which is an exporter's slip."""
    colors = colors.copy()
    if colors[:, 3].max() == 0:
        colors[:, 3] = 255
    return colors


def _material(material: Any) -> tuple[Color, Image.Image | None, Color, float | None]:
    """Return a material's colour, texture, the texture's tint, and where alpha is cut off."""
    if isinstance(material, trimesh.visual.material.PBRMaterial):
        color = _WHITE.copy()
        if material.baseColorFactor is not None:
            # The factor is linear light; the product of encoded values is close to the encoded
            # product, so the encoded factor tints the texture as well.
            color = np.array(material.baseColorFactor, np.uint8)
            encoded = trimesh.visual.color.linear_to_srgb(color[:3] / 255.0)
            color[:3] = np.round(255 * np.clip(encoded, 0, 1))
        cutoff = None
        if material.alphaMode == "MASK":
            cutoff = 0.5 if material.alphaCutoff is None else float(material.alphaCutoff)
        elif material.alphaMode != "BLEND":
            cutoff = 0.0  # opaque, whatever the alpha
        if cutoff is not None:
            color[3] = 255
        return color, material.baseColorTexture, color, cutoff
    options = getattr(material, "kwargs", {})
    color = np.array(material.diffuse, np.uint8) if "kd" in options else _NO_COLOR.copy()
    color[3] = round(255 * _mtl_alpha(options))
    image = material.image
    if image is not None and image.format is None:
        image = None  # not from a file: the placeholder that trimesh puts beside UVs
    return color, image, np.array([255, 255, 255, color[3]], np.uint8), None


def _mtl_alpha(options: dict[str, Any]) -> float:
    """Return the alpha that an MTL's `d` or `Tr` means; 0 is an exporter's slip for opaque."""
    for key in ("d", "tr"):
        try:
            value = float(options[key][-1])
        except (KeyError, IndexError, TypeError, ValueError):
            continue
        alpha = value if key == "d" else 1 - value
        return alpha if 0 < alpha <= 1 else 1.0
    return 1.0
