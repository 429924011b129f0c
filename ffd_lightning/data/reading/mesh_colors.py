"""Colours and textures of what trimesh loaded, in the form that `Mesh` holds."""

from __future__ import annotations

import hashlib
import io
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.data.reading.mesh_gltf import TEXTURED
from ffd_lightning.errors import is_bug
from ffd_lightning.imaging.pictures import to_rgba

_REFUSED = ("EPS", "IPTC")  # Pillow runs Ghostscript on PostScript, and IPTC may hold some
_MAX_TEXTURE = 1024
_MAX_PIXELS = 8192 * 8192  # of a file; decoding takes four bytes for each
_MAX_TEXELS = 128 * _MAX_TEXTURE**2  # of a shape's textures together: 512 MB
_MAX_INDEX = np.iinfo(np.int16).max
_NO_COLOR = np.array([178, 178, 178, 255], np.uint8)
_WHITE = np.full(4, 255, np.uint8)

Color = NDArray[np.uint8]
Colored = tuple[NDArray[np.uint8], NDArray[np.int16], NDArray[np.float32] | None]


def valid_faces(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which faces, (F,), point to vertices that exist."""
    return np.asarray(((faces >= 0) & (faces < len(vertices))).all(axis=1), np.bool_)


class Textures:
    """The textures of one shape, each file decoded once and kept once per tint.

    Attributes:
        images: RGBA, (h, w, 4) uint8 each.
        means: the mean colour of each, (4,) uint8.
        undecodable: names of those that could not be decoded or were too large.
    """

    def __init__(self) -> None:
        self.images: list[NDArray[np.uint8]] = []
        self.means: list[Color] = []
        self.undecodable: list[str] = []
        self._texels = 0
        self._known: dict[tuple[str, bytes, float | None], int] = {}
        self._decoded: dict[str, NDArray[np.uint8] | None] = {}
        self._contents: dict[int, str] = {}

    def add(self, image: Image.Image, tint: Color, cutoff: float | None) -> int:
        """Return the index of `image` times `tint`, -1 if it cannot be decoded or is too large.

        Where `cutoff` is given, alpha becomes all or nothing about it; alpha that is zero
        everywhere is an exporter's slip and means opaque.
        """
        if id(image) not in self._contents:
            self._contents[id(image)] = _content(image)
        content = self._contents[id(image)]
        key = (content, tint.tobytes(), cutoff)
        if key not in self._known:
            if content not in self._decoded:
                self._decoded[content] = _decode(image)
            self._known[key] = self._tinted(self._decoded[content], tint, cutoff)
            if self._known[key] < 0:
                named = str(image.info.get("file_path", "one without a name"))
                self.undecodable.append(named.replace("\\", "/").rpartition("/")[2])
        return self._known[key]

    def _tinted(self, decoded: NDArray[np.uint8] | None, tint: Color, cutoff: float | None) -> int:
        """Keep a texture, unless there are too many, and return its index or -1."""
        texels = 0 if decoded is None else decoded.shape[0] * decoded.shape[1]
        full = len(self.images) > _MAX_INDEX or self._texels + texels > _MAX_TEXELS
        if decoded is None or full:
            return -1
        pixels = np.round(decoded * (tint / 255.0)).astype(np.uint8)
        if cutoff is not None:
            pixels[..., 3] = np.where(pixels[..., 3] >= 255 * cutoff, 255, 0)
        self._texels += texels
        self.images.append(pixels)
        self.means.append(np.round(pixels.mean(axis=(0, 1))).astype(np.uint8))
        return len(self.images) - 1


def _content(image: Image.Image) -> str:
    """Return what tells images of different content apart, without decoding them."""
    stream = getattr(image, "fp", None)
    if isinstance(stream, io.BytesIO) and not stream.closed:
        return hashlib.sha256(stream.getbuffer()).hexdigest()
    return str(id(image))


def _decode(image: Image.Image) -> NDArray[np.uint8] | None:
    """Return an image as RGBA of at most 1024 x 1024, None if it is damaged or too large."""
    try:
        if image.width * image.height > _MAX_PIXELS or image.format in _REFUSED:
            return None
        small = to_rgba(image)
        small.thumbnail((_MAX_TEXTURE, _MAX_TEXTURE))
        pixels = np.array(small)
        if pixels[..., 3].max() == 0:
            pixels[..., 3] = 255
        return pixels
    except Exception as error:  # Pillow raises many kinds on damaged images
        if is_bug(error):
            raise
        return None
    finally:
        image.close()  # trimesh holds on to it, and it to all its pixels


def face_colors(geometry: trimesh.Trimesh, textures: Textures) -> Colored:
    """Return colours (F, 4), texture indices (F,) and UVs (F, 3, 2), if any, of a geometry.

    A material whose texture cannot be shown is grey: the colour beside it is white as a rule, and
    would not be seen on white.
    """
    count = len(geometry.faces)
    visual: Any = geometry.visual
    colors = np.tile(_NO_COLOR, (count, 1))
    index = np.full(count, -1, np.int16)
    faces = np.where(valid_faces(geometry.vertices, geometry.faces)[:, None], geometry.faces, 0)
    if isinstance(visual, trimesh.visual.ColorVisuals):
        if visual.kind == "face" and len(visual.face_colors) == count:
            colors = _opaque_if_unseen(np.asarray(visual.face_colors))
        elif visual.kind == "vertex" and len(visual.vertex_colors) == len(geometry.vertices):
            colors = _opaque_if_unseen(_mean_colors(visual.vertex_colors, faces))
        return colors, index, None
    color, image, tint, cutoff = _material(visual.material)
    colors[:] = color
    uv = None if visual.uv is None else np.asarray(visual.uv, np.float32)
    if isinstance(image, Image.Image) and uv is not None and _fits(uv, geometry, 2):
        texture = textures.add(image, tint, cutoff)
        if texture >= 0:
            index[:] = texture
            colors[:] = textures.means[texture]
            return colors, index, np.nan_to_num(uv[faces, :2], posinf=0, neginf=0)
    painted = visual.vertex_attributes.get("color")
    if painted is not None and _fits(painted, geometry, 3):
        rgba = trimesh.visual.color.to_rgba(np.array(painted))
        colors = np.round(_mean_colors(rgba, faces) * (color / 255.0)).astype(np.uint8)
    return colors, index, None


def _fits(values: NDArray[Any], geometry: trimesh.Trimesh, columns: int) -> bool:
    """Return whether there are at least so many values of each vertex."""
    return values.ndim == 2 and len(values) == len(geometry.vertices) and values.shape[1] >= columns


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
    """Return a material's colour without texture, the texture, its tint, and where alpha is cut."""
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
        plain = np.round(_NO_COLOR * (color / 255.0)).astype(np.uint8)
        named = material.name == TEXTURED
        return plain if named else color, material.baseColorTexture, color, cutoff
    options = getattr(material, "kwargs", {})
    known = "kd" in options and "textured" not in options
    color = np.array(material.diffuse, np.uint8) if known else _NO_COLOR.copy()
    color[3] = round(255 * _mtl_alpha(options))
    image = material.image
    if getattr(image, "format", None) is None:
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
