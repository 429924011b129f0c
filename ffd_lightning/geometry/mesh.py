"""The mesh that every source returns and every later stage reads, and the frame all share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

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

    def moments(self) -> NDArray[np.float64]:
        r"""Return the surface's moments of order 0 (its area), 1 and 2, (13,), about the origin.

        Those of order 2 are a sum over triangles of area A and corners v_i, row by row:

        $$ \int x x^T dA = \sum \frac{A}{12} \Big(\sum_i v_i v_i^T
                  + \big(\sum_i v_i\big) \big(\sum_i v_i\big)^T\Big) $$

        They are the same of one surface in any file, whatever the order of its vertices.
        """
        corners = self.vertices[self.faces]  # (F, 3, 3)
        a, b, c = corners.swapaxes(0, 1)
        areas, sums = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2, corners.sum(1)
        second = np.einsum("f,fki,fkj->ij", areas, corners, corners)
        second += np.einsum("f,fi,fj->ij", areas, sums, sums)
        return np.concatenate([[areas.sum()], areas @ sums / 3, second.ravel() / 12])

    def parts(self) -> NDArray[np.uint8]:
        """Return the part of each face, (F,), `UNKNOWN_PART` where parts are unknown."""
        unknown = np.full(len(self.faces), UNKNOWN_PART, np.uint8)
        return unknown if self.face_parts is None else self.face_parts

    def without_textures(self) -> Mesh:
        """Return the same mesh with its plain colours alone."""
        return replace(self, textures=(), face_textures=None, face_uvs=None)


def normalize(vertices: ArrayLike, faces: ArrayLike | None = None) -> NDArray[np.float64]:
    """Move the bounding box's centre to the origin and scale its diagonal to 1; nothing is turned.

    Arguments and errors are those of `bounding_box`; vertices that no face uses are moved along.

    >>> normalize([[0, 0, 0], [2, 0, 0], [2, 0, 0]])
    array([[-0.5,  0. ,  0. ],
           [ 0.5,  0. ,  0. ],
           [ 0.5,  0. ,  0. ]])
    """
    center, diagonal = bounding_box(vertices, faces)
    return (np.asarray(vertices, np.float64) - center) / diagonal


def bounding_box(
    vertices: ArrayLike, faces: ArrayLike | None = None
) -> tuple[NDArray[np.float64], float]:
    """Return the centre, (3,), and the diagonal of the bounding box.

    Args:
        vertices: (V, 3) positions.
        faces: (F, 3) vertex indices; where given, only vertices that a face uses count.

    Raises:
        ValueError: no vertices, not finite, or the box has no extent.
    """
    points = np.asarray(vertices, np.float64)
    used = points if faces is None else points[np.unique(np.asarray(faces, np.int64))]
    if len(used) == 0:
        raise ValueError("there are no vertices to normalise")
    low, high = used.min(axis=0), used.max(axis=0)
    diagonal = float(np.linalg.norm(high - low))
    if not np.isfinite(diagonal):
        raise ValueError("the vertices are not all finite")
    if diagonal == 0:
        raise ValueError("the bounding box has no extent: all vertices are the same point")
    return low / 2 + high / 2, diagonal


def renumber_parts(
    parts: NDArray[np.uint8], names: Sequence[str], among: Sequence[str]
) -> NDArray[np.uint8]:
    """Return parts, indices into `names` of any shape, as indices into `among`; 255 is unknown.

    >>> renumber_parts(np.uint8([0, 1, 255]), ["leg", "top"], ["arm", "top", "leg"]).tolist()
    [2, 1, 255]
    """
    table = np.full(256, UNKNOWN_PART, np.uint8)
    table[: len(names)] = [among.index(name) for name in names]
    return table[parts]


def mean_colors(mesh: Mesh, divisions: int) -> NDArray[np.uint8]:
    """Return one colour per face, (F, 4) uint8: the mean of its texture at places all over it.

    Its edges are divided; the places are the corners of the small triangles. Faces without a
    texture keep their colour.
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
