import numpy as np
import pytest
from box_source import box_mesh
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from ffd_lightning.data.preparation.packing import (
    POINT_STEP,
    pack_image,
    pack_mesh,
    pack_points,
    unpack_image,
    unpack_mesh,
    unpack_points,
)
from ffd_lightning.geometry.mesh import Mesh


@given(hnp.arrays(np.float64, (7, 3), elements=st.floats(-0.5, 0.5)))
def test_points_lose_half_a_step_at_most(points):
    back = unpack_points(pack_points(points))
    assert back.dtype == np.float32
    np.testing.assert_allclose(back, points, atol=0.5001 * POINT_STEP)


def test_points_of_a_plane_stay_in_it():
    assert unpack_points(pack_points(np.zeros((2, 3)))).tolist() == [[0, 0, 0]] * 2
    extremes = np.array([-0.5, 0.5])
    assert unpack_points(pack_points(extremes)).tolist() == [-0.5, 0.5]
    assert unpack_points(pack_points(1.001 * extremes)).tolist() == [-0.5, 0.5]


@given(hnp.arrays(np.uint8, (5, 4, 4)))
def test_images_come_back(image):
    np.testing.assert_array_equal(unpack_image(pack_image(image), (5, 4, 4)), image)
    np.testing.assert_array_equal(unpack_image(pack_image(image[:, ::2]), (5, 2, 4)), image[:, ::2])


@pytest.mark.parametrize("parts", [True, False])
def test_meshes_come_back(parts):
    mesh = box_mesh(3)
    if not parts:
        mesh = Mesh(mesh.vertices, mesh.faces[::-1], mesh.face_colors)
    point_parts = np.array([0, 1, 255, 1], np.uint8)
    back, back_parts = unpack_mesh(pack_mesh(mesh, point_parts))
    np.testing.assert_array_equal(back.vertices, mesh.vertices.astype(np.float32))
    np.testing.assert_array_equal(back.faces, mesh.faces)
    np.testing.assert_array_equal(back.face_colors, mesh.face_colors)
    unknown = np.full(len(mesh.faces), 255)
    np.testing.assert_array_equal(back.face_parts, mesh.face_parts if parts else unknown)
    assert back.part_names == mesh.part_names
    assert (back.vertices.dtype, back.faces.dtype) == (np.float64, np.int64)
    np.testing.assert_array_equal(back_parts, point_parts)


def test_large_indices_come_back():
    """Differences of int32 wrap around where they must not be summed as such."""
    faces = np.array([(0, 2**30, 5), (2**31 - 1, 0, 2**31 - 2)])
    mesh = Mesh(np.zeros((1, 3)), faces, np.zeros((2, 4), np.uint8))
    back, _ = unpack_mesh(pack_mesh(mesh, np.zeros(0, np.uint8)))
    np.testing.assert_array_equal(back.faces, faces)


def test_what_repeats_takes_little_room():
    """A background, and a grid's faces, at a small fraction of their size."""
    image = np.full((192, 256, 4), 255, np.uint8)
    assert len(pack_image(image)) < image.nbytes / 200
    i, j = np.divmod(np.arange(10_000), 100)
    corner = 101 * i + j
    faces = np.stack([corner, corner + 1, corner + 102], 1)
    mesh = Mesh(np.zeros((10_202, 3)), faces, np.full((10_000, 4), 9, np.uint8))
    assert len(pack_mesh(mesh, np.zeros(10, np.uint8))) < 12 * 10_000 / 50


@pytest.mark.parametrize("unpack", [lambda b: unpack_image(b, (5, 4, 4)), unpack_mesh])
@pytest.mark.parametrize("damage", [lambda b: b"", lambda b: b[:-5], lambda b: b[:20] + b"?" * 20])
def test_damage_is_a_value_error(unpack, damage):
    rng = np.random.default_rng(0)
    packed = (
        pack_mesh(box_mesh(0), np.zeros(3, np.uint8))
        if unpack is unpack_mesh
        else pack_image(rng.integers(0, 255, (5, 4, 4), np.uint8))
    )
    unpack(packed)
    with pytest.raises(ValueError, match=r"\w"):
        unpack(damage(packed))
