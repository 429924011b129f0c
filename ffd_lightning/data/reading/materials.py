"""Colours and textures of what trimesh loaded, in the form that `Mesh` holds."""

import io
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.photos import to_rgba

UNDECODABLE = "textures cannot be decoded"
"""The kind of warning about textures that are no pictures, or damaged ones."""

_REFUSED = ("EPS", "IPTC")  # Pillow runs Ghostscript on PostScript, and IPTC may hold some
_MAX_TEXTURE = 1024
_NO_COLOR = np.array([178, 178, 178, 255], np.uint8)
_OPAQUE = np.full(4, 255, np.uint8)

Color = NDArray[np.uint8]


_absent = io.BytesIO()
Image.new("RGB", (1, 1)).save(_absent, "gif", comment=b"absent")
ABSENT = _absent.getvalue()
"""The picture that stands for a texture that cannot be had, for `face_colors` to know."""


class Textures:
    """The textures of one shape, each picture kept once per tint.

    `undecodable` gets the names of those that cannot be decoded.

    Attributes:
        images: RGBA, (h, w, 4) uint8 each.
        means: the mean colour of each, (4,) uint8.
    """

    def __init__(self, undecodable: dict[str, None]) -> None:
        self.images: list[NDArray[np.uint8]] = []
        self.means: list[Color] = []
        self._undecodable = undecodable
        self._known: dict[tuple[object, bytes, float | None], int] = {}

    def add(self, image: Image.Image, tint: Color, cutoff: float | None) -> int:
        """Return the index of `image` times `tint`, -1 if it cannot be decoded.

        Where `cutoff` is given, alpha becomes all or nothing about it.
        """
        name = image.info.get("file_path")
        key = (name or id(image), tint.tobytes(), cutoff)
        if key not in self._known:
            self._known[key] = -1
            try:
                if image.format in _REFUSED:
                    raise OSError("it may hold a program")
                small = to_rgba(image)
                small.thumbnail((_MAX_TEXTURE, _MAX_TEXTURE))
            except Exception:  # Pillow raises many kinds on damaged images
                what = str(name or "one without a name").replace("\\", "/").rpartition("/")[2]
                self._undecodable[what] = None
                return -1
            pixels = _opaque_if_unseen(np.array(small))
            pixels = np.round(pixels * (tint / 255.0)).astype(np.uint8)
            if cutoff is not None:
                pixels[..., 3] = np.where(pixels[..., 3] >= 255 * cutoff, 255, 0)
            self._known[key] = len(self.images)
            self.images.append(pixels)
            self.means.append(np.round(pixels.mean(axis=(0, 1))).astype(np.uint8))
        return self._known[key]


def face_colors(
    geometry: trimesh.Trimesh, faces: NDArray[np.int64], textures: Textures
) -> tuple[Color, NDArray[np.int16], NDArray[np.float32]]:
    """Return colours (F, 4), texture indices (F,) and UVs (F, 3, 2) of a geometry's faces (F, 3).

    All faces point to vertices. A material whose texture cannot be shown is grey: the colour beside
    it is white as a rule, and would not be seen on white.
    """
    visual: Any = geometry.visual
    colors = np.tile(_NO_COLOR, (len(faces), 1))
    index, uvs = np.full(len(faces), -1, np.int16), np.zeros((len(faces), 3, 2), np.float32)
    if isinstance(visual, trimesh.visual.ColorVisuals):
        if visual.kind == "face" and len(visual.face_colors) == len(faces):
            colors = _opaque_if_unseen(np.array(visual.face_colors))
        elif visual.kind == "vertex" and len(visual.vertex_colors) == len(geometry.vertices):
            colors = _opaque_if_unseen(_mean_colors(visual.vertex_colors, faces))
        return colors, index, uvs
    color, image, tint, cutoff = _material(visual.material)
    colors[:] = color
    if image is not None and _fits(visual.uv, geometry, 2):
        texture = textures.add(image, tint, cutoff)
        if texture >= 0:
            index[:] = texture
            colors[:] = textures.means[texture]
            uv = np.asarray(visual.uv, np.float32)
            return colors, index, np.nan_to_num(uv[faces, :2], posinf=0, neginf=0)
    painted = visual.vertex_attributes.get("color")
    if _fits(painted, geometry, 3):
        painted = np.array(painted)
        if painted.dtype == np.uint16:  # glTF may have them as parts of 65535
            painted = np.round(painted / 257).astype(np.uint8)
        rgba = trimesh.visual.color.to_rgba(painted)
        colors = np.round(_mean_colors(rgba, faces) * (color / 255.0)).astype(np.uint8)
    return colors, index, uvs


def shown_on_white(mesh: Mesh) -> tuple[Mesh, str]:
    """Return a mesh that can be seen on white, and a warning where that took another colour.

    White all over and without a picture is what exporters write for no colour.
    """
    if mesh.textures or mesh.face_colors[:, :3].min() < 255:
        return mesh, ""
    colors = mesh.face_colors.copy()
    colors[:, :3] = _NO_COLOR[:3]
    return replace(mesh, face_colors=colors), "shapes that are white all over are drawn in grey"


def _fits(values: NDArray[Any] | None, geometry: trimesh.Trimesh, columns: int) -> bool:
    """Return whether there are at least so many values of each vertex."""
    shape = np.shape(() if values is None else values)
    return len(shape) == 2 and shape[0] == len(geometry.vertices) and shape[1] >= columns


def _mean_colors(vertex_colors: Color, faces: NDArray[np.int64]) -> Color:
    """Average vertex colours (V, 4) to the faces, (F, 4)."""
    return np.round(np.asarray(vertex_colors)[faces].mean(axis=1)).astype(np.uint8)


def _opaque_if_unseen(colors: Color) -> Color:
    """Make colours opaque, in place, if all have alpha 0, which is an exporter's slip."""
    if colors[..., 3].max() == 0:
        colors[..., 3] = 255
    return colors


def _material(material: Any) -> tuple[Color, Image.Image | None, Color, float | None]:
    """Return a material's colour without texture, the texture, its tint, and where alpha is cut."""
    cutoff = None
    if isinstance(material, trimesh.visual.material.PBRMaterial):
        color = _OPAQUE.copy()
        if material.baseColorFactor is not None:
            # The factor is linear light; the product of encoded values is close to the encoded
            # product, so the encoded factor tints the texture as well.
            color = np.array(material.baseColorFactor, np.uint8)
            encoded = trimesh.visual.color.linear_to_srgb(color[:3] / 255.0)
            color[:3] = np.round(255 * np.clip(encoded, 0, 1))
        if material.alphaMode == "MASK":
            cutoff = 0.5 if material.alphaCutoff is None else float(material.alphaCutoff)
        elif material.alphaMode != "BLEND":
            cutoff = 0.0  # opaque, whatever the alpha
        if cutoff is not None:
            color[3] = 255
        image, tint = material.baseColorTexture, color
        if isinstance(image, Image.Image):
            color = np.round(_NO_COLOR * (tint / 255.0)).astype(np.uint8)
    else:
        options, image = getattr(material, "kwargs", {}), material.image
        if getattr(image, "format", None) is None:
            image = None  # not from a file: the placeholder that trimesh puts beside UVs
        known = "kd" in options and image is None
        color = np.array(material.diffuse, np.uint8) if known else _NO_COLOR.copy()
        color[3] = round(255 * _mtl_alpha(options))
        tint = np.array([255, 255, 255, color[3]], np.uint8)
    there = isinstance(image, Image.Image) and image.info.get("comment") != b"absent"
    return color, image if there else None, tint, cutoff


def _mtl_alpha(options: dict[str, Any]) -> float:
    """Return the alpha that an MTL's `d` or `Tr` means; 0 is an exporter's slip for opaque."""
    for key in ("d", "tr"):
        with suppress(KeyError, IndexError, TypeError, ValueError):
            value = float(options[key][-1])
            alpha = value if key == "d" else 1 - value
            return alpha if 0 < alpha <= 1 else 1.0
    return 1.0
