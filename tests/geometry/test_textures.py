import numpy as np
import pytest

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.geometry.textures import mean_colors


@pytest.mark.parametrize("divisions", [2, 7])
def test_a_face_has_the_mean_of_its_texture(divisions):
    """Left half red, right half blue: faces in one half, the other, across both, and in none."""
    texture = np.zeros((4, 8, 4), np.uint8)
    texture[..., 3] = 255
    texture[:, :4, 0] = texture[:, 4:, 2] = 200
    uv = np.array([(0.1, 0.2), (0.4, 0.2), (0.2, 0.8)])
    mesh = Mesh(
        vertices=np.eye(3),
        faces=np.array([[0, 1, 2]] * 4),
        face_colors=np.full((4, 4), 77, np.uint8),
        textures=(texture,),
        face_textures=np.array([0, 0, 0, -1], np.int16),
        face_uvs=np.stack(
            [uv, uv + np.array([0.5, 3]), [(0, 0.5), (0.99, 0.2), (0.5, 0.9)], uv]
        ).astype("f4"),
    )
    colors = mean_colors(mesh, divisions).astype(int)
    np.testing.assert_array_equal(colors[[0, 1, 3]], [(200, 0, 0, 255), (0, 0, 200, 255), [77] * 4])
    assert colors[2, 0] + colors[2, 2] == pytest.approx(200, abs=1)
    assert abs(colors[2, 0] - colors[2, 2]) < 80
    plain = mesh.without_textures()
    np.testing.assert_array_equal(mean_colors(plain, divisions), mesh.face_colors)
