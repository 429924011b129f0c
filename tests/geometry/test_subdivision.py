import numpy as np
import pytest
import trimesh
from trees import textured_box

from ffd_lightning.geometry.subdivision import subdivide, subdivide_mesh


def test_short_edges_same_surface_and_origin_of_faces():
    box = trimesh.creation.box((1, 0.3, 0.02))
    vertices, faces, index = subdivide(box.vertices, box.faces, 0.1)
    corners = vertices[faces]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
    assert edges.max() <= 0.1
    assert trimesh.Trimesh(vertices, faces).area == pytest.approx(box.area)
    origins = box.vertices[box.faces[index, 0]]
    offsets = ((corners.mean(1) - origins) * box.face_normals[index]).sum(-1)
    np.testing.assert_allclose(offsets, 0, atol=1e-9)


def test_textures_stay_where_they_are():
    """The UV of each new corner is what lies there, by its areas within the face it came from."""
    uvs = np.random.default_rng(0).uniform(-2, 3, (12, 3, 2))  # torn apart at every edge
    parts = {"face_parts": np.arange(12, dtype=np.uint8), "part_names": tuple("abcdefghijkl")}
    mesh = textured_box(tuple(np.zeros((2, 3, 5, 4), np.uint8)), [0, 1, -1] * 4, uvs, **parts)
    fine = subdivide_mesh(mesh, 0.06)
    index = subdivide(mesh.vertices, mesh.faces, 0.06)[2]
    assert len(fine.faces) > 20 * len(mesh.faces)
    for name in ("face_colors", "face_parts", "face_textures"):
        np.testing.assert_array_equal(getattr(fine, name), getattr(mesh, name)[index])
    whole = mesh.vertices[mesh.faces[index]]
    for corner in range(3):
        point = fine.vertices[fine.faces[:, corner]]
        weights = trimesh.triangles.points_to_barycentric(whole, point)
        expected = np.einsum("fc,fcd->fd", weights, mesh.face_uvs[index])
        textured = mesh.face_textures[index] >= 0
        np.testing.assert_allclose(fine.face_uvs[textured, corner], expected[textured], atol=1e-5)
