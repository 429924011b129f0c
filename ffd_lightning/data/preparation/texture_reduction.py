"""Textures as prepared shapes keep them: small, but good enough to look at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from PIL import Image

from ffd_lightning.geometry.mesh import Mesh

MAX_TEXELS = 256 * 256
"""Of a shape's textures together, but that each has one at least."""


def shrink_textures(mesh: Mesh) -> Mesh:
    """Return a mesh with textures of few texels, all shrunk alike, and none that no face has."""
    if mesh.face_textures is None or mesh.face_uvs is None:
        return mesh
    used, numbers = np.unique(mesh.face_textures, return_inverse=True)
    if used[-1] < 0:
        return mesh.without_textures()
    textures = [mesh.textures[index] for index in used[used >= 0]]
    scale = min(1.0, np.sqrt(MAX_TEXELS / sum(t.shape[0] * t.shape[1] for t in textures)))
    small = []
    for texture in textures:
        width, height = (max(1, int(side * scale)) for side in (texture.shape[1], texture.shape[0]))
        picture = Image.fromarray(np.ascontiguousarray(texture))
        small.append(np.array(picture.resize((width, height), Image.Resampling.BOX)))
    face_textures = (numbers.reshape(-1) - int(used[0] < 0)).astype(np.int16)
    return replace(mesh, textures=tuple(small), face_textures=face_textures)
