"""Textures as prepared shapes keep them: small, but good enough to look at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.geometry.mesh import Mesh

MAX_TEXELS = 256 * 256
"""Of a shape's textures together, but that each has one at least."""
_MAX_SIDE = 2048  # WebP has an end at 16,383


def reduce_textures(mesh: Mesh) -> Mesh:
    """Return a mesh with textures of few texels, and none that no face has.

    A texture is cut to what its faces show of it, and gets texels by the area of its faces, so
    that they are equally fine all over the shape. None becomes larger.
    """
    if mesh.face_textures is None or mesh.face_uvs is None:
        return mesh
    used, numbers = np.unique(mesh.face_textures, return_inverse=True)
    if used[-1] < 0:
        return mesh.without_textures()
    face_textures = numbers.reshape(-1) - int(used[0] < 0)
    areas = _areas(mesh)
    textured = face_textures >= 0
    total = max(float(areas[textured].sum()), 1e-30)
    textures, uvs = [], mesh.face_uvs.astype(np.float64)
    for number, index in enumerate(used[used >= 0]):
        faces = face_textures == number
        texture, uvs[faces] = _cut(mesh.textures[index], uvs[faces])
        textures.append(_shrunk(texture, MAX_TEXELS * float(areas[faces].sum()) / total))
    return replace(
        mesh,
        textures=tuple(textures),
        face_textures=face_textures.astype(np.int16),
        face_uvs=uvs.astype(np.float32),
    )


def _areas(mesh: Mesh) -> NDArray[np.float64]:
    """Return the area of each face, (F,)."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2, np.float64)


def _cut(
    texture: NDArray[np.uint8], uvs: NDArray[np.float64]
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Cut a texture to what faces with UVs (f, 3, 2) show of it, and fit the UVs to that.

    An axis along which they show nearly all, or repeats of it, stays as it is.
    """
    uvs = uvs.copy()
    for axis, size in ((0, texture.shape[1]), (1, texture.shape[0])):
        places = uvs[..., axis]
        places -= np.floor(places.min())
        # Some texels more, so that what becomes a texel beside them is of the same neighbours.
        margin = 1 + int(min(np.ptp(places), 1) * size) // 64
        first = int(places.min() * size) - margin
        end = int(min(places.max(), 2) * size) + 1 + margin
        if end - first >= size:
            continue
        uvs[..., axis] = (places * size - first) / (end - first)
        rows = np.arange(first, end) if axis == 0 else np.arange(size - end, size - first)
        texture = np.take(texture, rows % size, axis=1 - axis)
    return texture, uvs


def _shrunk(texture: NDArray[np.uint8], texels: float) -> NDArray[np.uint8]:
    """Return a texture of at most so many texels, or of one."""
    height, width = (min(side, _MAX_SIDE) for side in texture.shape[:2])
    scale = min(1.0, np.sqrt(texels / (height * width)))
    most = max(1, int(texels))
    # Of a narrow one, what the one side cannot give up the other must.
    new_width = min(max(1, int(width * scale)), most)
    new_height = min(max(1, int(height * scale)), most // new_width)
    picture = Image.fromarray(np.ascontiguousarray(texture))
    return np.array(picture.resize((new_width, new_height), Image.Resampling.BOX))
