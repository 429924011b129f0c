import numpy as np

from ffd_lightning.evaluation.figures import cloud_mesh
from ffd_lightning.imaging.rendering import render


def test_a_cloud_becomes_one_octahedron_per_point_at_its_place():
    points = np.array([[0, 0, 0], [0.2, 0.3, -0.1]])
    mesh = cloud_mesh(points, radius=0.01)
    assert mesh.faces.shape == (16, 3)
    centers = mesh.vertices.reshape(2, 6, 3).mean(1)
    np.testing.assert_allclose(centers, points, atol=1e-12)
    assert np.abs(mesh.vertices.reshape(2, 6, 3) - points[:, None]).max() <= 0.01 + 1e-12
    assert (mesh.face_colors[:8] != mesh.face_colors[8:]).any()
    assert (render(mesh, height=48, width=64, samples=2)[..., 3] > 0).any()


def test_a_cloud_of_one_height_has_a_colour():
    mesh = cloud_mesh(np.zeros((3, 3)))
    assert (mesh.face_colors[:, 3] == 255).all()


def test_points_take_the_colours_they_are_given():
    colors = np.array([[9, 8, 7, 255], [1, 2, 3, 255]], np.uint8)
    mesh = cloud_mesh(np.eye(3)[:2], colors=colors)
    np.testing.assert_array_equal(mesh.face_colors, np.repeat(colors, 8, axis=0))
