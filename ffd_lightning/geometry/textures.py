"""Plain colours in the place of textures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.geometry.mesh import Mesh


def mean_colors(mesh: Mesh, divisions: int) -> NDArray[np.uint8]:
    """Return one colour per face, (F, 4) uint8: the mean of its texture at places all over it.

    Args:
        mesh: faces without a texture keep their colour.
        divisions: of a face's edges; the places are the corners of the small triangles.
    """
    colors = mesh.face_colors.copy()
    if mesh.face_textures is None or mesh.face_uvs is None:
        return colors
    n = divisions
    places = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    for index, texture in enumerate(mesh.textures):
        textured = mesh.face_textures == index
        height, width = texture.shape[:2]
        corners = mesh.face_uvs[textured]
        total = np.zeros((len(corners), 4))
        for place in places:  # not all at once: a face costs memory for each place
            u, v = np.einsum("c,fcd->df", place, corners) % 1.0
            rows = np.minimum(((1 - v) * height).astype(int), height - 1)
            columns = np.minimum((u * width).astype(int), width - 1)
            total += texture[rows, columns]
        colors[textured] = np.round(total / len(places))
    return colors
