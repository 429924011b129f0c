import numpy as np
import pytest
import trimesh

from ffd_lightning.geometry.subdivision import subdivide


def test_short_edges_same_surface_and_origin_of_faces():
    box = trimesh.creation.box((1, 0.3, 0.02))
    fine = subdivide(box.vertices, box.faces, 0.1)
    corners = fine.vertices[fine.faces]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
    assert edges.max() <= 0.1
    mesh = trimesh.Trimesh(fine.vertices, fine.faces)
    assert mesh.area == pytest.approx(box.area)
    centers = corners.mean(1)
    normals = box.face_normals[fine.face_index]
    offsets = ((centers - box.vertices[box.faces[fine.face_index, 0]]) * normals).sum(-1)
    np.testing.assert_allclose(offsets, 0, atol=1e-9)


def test_refuses_no_length():
    with pytest.raises(ValueError, match="max_edge"):
        subdivide(np.eye(3), np.array([[0, 1, 2]]), 0)
