"""Colours and textures of what trimesh loaded, in the form that `Mesh` holds."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

_MAX_TEXTURE = 1024
_NO_COLOR = np.array([178, 178, 178, 255], np.uint8)
_WHITE = np.full(4, 255, np.uint8)

Color = NDArray[np.uint8]
Colored = tuple[NDArray[np.uint8], NDArray[np.int16], NDArray[np.float32]]


def valid_faces(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which faces, (F,), point to vertices that exist."""
    return np.asarray(((faces >= 0) & (faces < len(vertices))).all(axis=1), np.bool_)


class Textures:
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


def face_colors(geometry: trimesh.Trimesh, textures: Textures) -> Colored:
    """Return colours (F, 4), texture indices (F,) and UVs (F, 3, 2) of one geometry's faces."""
    count = len(geometry.faces)
    visual: Any = geometry.visual
    colors = np.tile(_NO_COLOR, (count, 1))
    index = np.full(count, -1, np.int16)
    uvs = np.zeros((count, 3, 2), np.float32)
    faces = np.where(valid_faces(geometry.vertices, geometry.faces)[:, None], geometry.faces, 0)
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
