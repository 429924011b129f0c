"""What the paper's figures are drawn with: voxels as meshes, and edges of meshes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.evaluation.figures import bars, rgba, united
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.grid import Color

_TEXELS = 64
_SEAM, _SEAM_SHADE = 0.07, 0.55  # of a voxel's side, the rim that tells it from its neighbours

# The six sides of a cube: their corners, and the way to the voxel beside them.
_AROUND = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
_SIDES = np.array([np.insert(_AROUND, axis, end, axis=1) for axis in range(3) for end in (0, 1)])
_BESIDE = np.array(
    [(2 * end - 1) * np.eye(3, dtype=int)[axis] for axis in range(3) for end in (0, 1)]
)


def with_bars(mesh: Mesh, radius: float, color: Color) -> Mesh:
    """Return a mesh without textures with a bar along each of its edges; see `bars`."""
    pairs = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return united([mesh, bars(mesh.vertices[np.unique(pairs, axis=0)], radius, color)])


def with_rims(mesh: Mesh, width: float, shade: float, square: bool = False) -> Mesh:
    """Return a mesh whose faces have darker rims, as a texture: they cost no triangle.

    Args:
        mesh: without textures.
        width: of a rim, as a share of its triangle's height, so that thin faces don't turn black.
        shade: of a rim, times the face's colour.
        square: whether two triangles are a square, with no rim between the two: opposite the first
            corner of each.
    """
    colors, kind = np.unique(mesh.face_colors, axis=0, return_inverse=True)
    v, u = (np.indices((_TEXELS, _TEXELS)) + 0.5) / _TEXELS
    inside = np.minimum(u, v) if square else np.minimum(np.minimum(u, v), 1 - u - v)
    tones = np.where(inside[::-1, :, None] < width, [shade, shade, shade, 1], 1)
    corners = np.array([[0, 0], [1, 0], [0, 1]], np.float32)
    return replace(
        mesh,
        textures=tuple(np.round(tones * color).astype(np.uint8) for color in colors),
        face_textures=kind.reshape(-1).astype(np.int16),
        face_uvs=np.broadcast_to(corners, (len(mesh.faces), 3, 2)).copy(),
    )


def voxel_mesh(kinds: NDArray[np.integer], colors: Sequence[Color]) -> Mesh:
    """Turn voxels into cubes with darker rims; of these only sides that touch no other voxel.

    Args:
        kinds: of a grid from -0.5 to 0.5, (R, R, R) indexed [x, y, z]: 0 for an empty voxel, k for
            one of the k-th colour.
        colors: of the kinds from 1 on.
    """
    cells = np.argwhere(kinds > 0)
    beside = (cells[:, None] + _BESIDE + 1).transpose(2, 0, 1)
    cell, side = np.nonzero(np.pad(kinds, 1)[tuple(beside)] == 0)
    corners = (cells[cell][:, None] + _SIDES[side]).reshape(-1, 3)
    pair = np.array([[0, 1, 3], [2, 3, 1]])  # their right angles first
    faces = (4 * np.arange(len(side))[:, None, None] + pair).reshape(-1, 3)
    tones = np.asarray(colors, np.uint8)[kinds[tuple(cells[cell].T)] - 1]
    mesh = Mesh(corners / len(kinds) - 0.5, faces, rgba(tones.repeat(2, axis=0)))
    return with_rims(mesh, _SEAM, _SEAM_SHADE, square=True)
