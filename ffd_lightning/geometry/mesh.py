"""The mesh that every source returns and every later stage reads."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

UNKNOWN_PART = 255
"""The label of what belongs to no part that is known."""


@dataclass(frozen=True)
class Mesh:
    """A triangle soup with a colour per face and, where known, textures and part labels.

    Convention:
        y is up and the object faces -z (ShapeNet's frame), so +x is its own right. Nothing is
        assumed about winding, closedness or connectivity.

    Attributes:
        vertices: (V, 3) float64 positions.
        faces: (F, 3) int64 vertex indices.
        face_colors: (F, 4) uint8 RGBA; alpha below 255 is see-through. Where a face has a
            texture this is the colour to fall back on (its mean, say).
        face_parts: (F,) uint8 index into `part_names`, or None where parts are unknown.
        part_names: names of the parts, () where unknown.
        textures: RGBA images, each (h, w, 4) uint8, row 0 at the top (v = 1).
        face_textures: (F,) int16 index into `textures`, -1 for none; None = no textures at all.
        face_uvs: (F, 3, 2) float32 texture coordinates per face corner (u right, v up, both
            wrap around); None = no textures at all.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    face_colors: NDArray[np.uint8]
    face_parts: NDArray[np.uint8] | None = None
    part_names: tuple[str, ...] = ()
    textures: tuple[NDArray[np.uint8], ...] = ()
    face_textures: NDArray[np.int16] | None = None
    face_uvs: NDArray[np.float32] | None = None

    def used_vertices(self) -> NDArray[np.float64]:
        """Return the vertices that faces use, (U, 3), in their order."""
        used = np.zeros(len(self.vertices), np.bool_)
        used[self.faces] = True
        return self.vertices[used]

    def with_vertices(self, vertices: NDArray[np.float64]) -> Mesh:
        """Return the same faces and materials on other vertices of the same count, (V, 3).

        Raises:
            ValueError: another count.
        """
        if vertices.shape != self.vertices.shape:
            raise ValueError(f"expected vertices {self.vertices.shape}, got {vertices.shape}")
        return replace(self, vertices=vertices)

    def without_textures(self) -> Mesh:
        """Return the same mesh with its plain colours alone."""
        return replace(self, textures=(), face_textures=None, face_uvs=None)
