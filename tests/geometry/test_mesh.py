import numpy as np
import pytest

from ffd_lightning.geometry.mesh import Mesh, mean_colors, normalize


def random_points(seed):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(50, 3)) * rng.uniform(0.01, 100, 3) + rng.normal(size=3) * 1e3


def test_the_box_is_centred_with_diagonal_one_whatever_the_unit_and_place():
    points = normalize(random_points(0))
    low, high = points.min(0), points.max(0)
    np.testing.assert_allclose(low + high, 0, atol=1e-12)
    assert np.linalg.norm(high - low) == pytest.approx(1, abs=1e-12)
    moved = normalize(random_points(0) * 254.0 + [10, -20, 30])
    np.testing.assert_allclose(moved, points, atol=1e-9)


def test_vertices_that_no_face_uses_do_not_count():
    corners = np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0]], float)
    stray = np.vstack([corners, [[1e6, 0, 0]], np.full((1, 3), np.nan)])
    points = normalize(stray, [[0, 1, 2]])
    np.testing.assert_allclose(points[:3], normalize(corners))
    assert points.shape == stray.shape


@pytest.mark.parametrize("divisions", [2, 7])
def test_a_face_has_the_mean_of_its_texture(divisions):
    """Left half red, right half blue: faces in one half, the other, across both, and in none."""
    texture = np.zeros((4, 8, 4), np.uint8)
    texture[..., 3] = 255
    texture[:, :4, 0] = texture[:, 4:, 2] = 200
    uv = np.array([(0.1, 0.2), (0.4, 0.2), (0.2, 0.8)])
    across = [(0, 0.5), (0.99, 0.2), (0.5, 0.9)]
    mesh = Mesh(
        vertices=np.eye(3),
        faces=np.array([[0, 1, 2]] * 4),
        face_colors=np.full((4, 4), 77, np.uint8),
        textures=(texture,),
        face_textures=np.array([0, 0, 0, -1], np.int16),
        face_uvs=np.stack([uv, uv + np.array([0.5, 3]), across, uv]).astype("f4"),
    )
    colors = mean_colors(mesh, divisions).astype(int)
    np.testing.assert_array_equal(colors[[0, 1, 3]], [(200, 0, 0, 255), (0, 0, 200, 255), [77] * 4])
    assert colors[2, 0] + colors[2, 2] == pytest.approx(200, abs=1)
    assert abs(colors[2, 0] - colors[2, 2]) < 80
    plain = mesh.without_textures()
    np.testing.assert_array_equal(mean_colors(plain, divisions), mesh.face_colors)
