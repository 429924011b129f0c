"""Splitting long edges, so that a deformed mesh bends where its template had large faces."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.geometry.mesh import Mesh


class SubdividedMesh(NamedTuple):
    """Vertices (V, 3), faces (F, 3), and for each face the original one it came from (F,)."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    face_index: NDArray[np.int64]


def subdivide(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], max_edge: float
) -> SubdividedMesh:
    """Split faces (F, 3) until no edge is longer than `max_edge`, in units of the vertices, (V, 3).

    The paper: 0.02 for meshes of diagonal 1.

    Raises:
        ValueError: `max_edge` is not above 0.

    Source: the paper's section 4.2.
    """
    import trimesh  # takes 0.4 s, and a run on prepared data needs it at its end only

    if not max_edge > 0:
        raise ValueError(f"max_edge must be above 0, got {max_edge}")
    found = trimesh.remesh.subdivide_to_size(
        vertices, faces, max_edge=max_edge, max_iter=40, return_index=True
    )
    return SubdividedMesh(*found)


def subdivide_mesh(mesh: Mesh, max_edge: float) -> Mesh:
    """Split a mesh's faces as `subdivide` does; colours, parts and textures stay where they are."""
    vertices, faces, index = subdivide(mesh.vertices, mesh.faces, max_edge)
    fine = replace(
        mesh,
        vertices=vertices,
        faces=faces,
        face_colors=mesh.face_colors[index],
        face_parts=None if mesh.face_parts is None else mesh.face_parts[index],
    )
    if mesh.face_textures is None or mesh.face_uvs is None:
        return fine
    textures = mesh.face_textures[index]
    uvs = np.zeros((len(faces), 3, 2), np.float32)
    textured = mesh.face_textures >= 0
    uvs[textures >= 0] = _subdivided_uvs(
        mesh.vertices[mesh.faces[textured]], mesh.face_uvs[textured], max_edge
    )
    return replace(fine, face_textures=textures, face_uvs=uvs)


def _subdivided_uvs(
    corners: NDArray[np.float64], uvs: NDArray[np.float32], max_edge: float
) -> NDArray[np.float32]:
    """Return the UVs (f, 3, 2) of what faces (F, 3, 3) with UVs (F, 3, 2) are split into."""
    import trimesh

    # Faces that share no vertex are split in the same way and order. Only the first three columns
    # are taken for places, and all are halved: the UVs of faces that met still do, to the bit.
    rows = np.concatenate([corners, uvs], axis=2).reshape(-1, 5)
    fine, faces = trimesh.remesh.subdivide_to_size(
        rows, np.arange(len(rows)).reshape(-1, 3), max_edge=max_edge, max_iter=40
    )
    return np.asarray(fine[faces][..., 3:], np.float32)
