import io
from dataclasses import replace

import numpy as np
import pytest
from box_source import box_mesh
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from ffd_lightning.data.preparation import packing
from ffd_lightning.data.preparation.packing import (
    POINT_STEP,
    UV_STEP,
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


def soft_texture(height, width, seed):
    """A picture of slow waves, and of alpha that is all or nothing."""
    u, v = np.meshgrid(np.arange(width) / 40, np.arange(height) / 40)
    waves = [np.sin(u + k + seed) * np.cos(v - k) for k in range(3)]
    return np.dstack([*(120 + 100 * w for w in waves), 255 * (u < 0.5)]).astype(np.uint8)


def textured_mesh(seed=0, shift=0.0):
    """Two textures, and faces of which some have none."""
    rng = np.random.default_rng(seed)
    return Mesh(
        vertices=rng.normal(size=(9, 3)).astype(np.float32).astype(np.float64),
        faces=rng.integers(0, 9, (40, 3)),
        face_colors=rng.integers(0, 256, (40, 4), np.uint8),
        textures=(soft_texture(1, 1, 0), soft_texture(37, 60, 1)),
        face_textures=rng.integers(-1, 2, 40).astype(np.int16),
        face_uvs=(shift + rng.normal(0, 3, (40, 3, 2))).astype(np.float32),
    )


@pytest.mark.parametrize("shift", [0, -1000, 1e30])
def test_textures_come_back(shift):
    mesh = textured_mesh(shift=shift)
    back, _ = unpack_mesh(pack_mesh(mesh, np.zeros(3, np.uint8)))
    again, _ = unpack_mesh(pack_mesh(back, np.zeros(3, np.uint8)))
    assert len(back.textures) == len(mesh.textures)
    for one, other in ((mesh, back), (back, again)):
        for before, after in zip(one.textures, other.textures, strict=True):
            assert after.shape == before.shape
            assert after.dtype == np.uint8
            seen = before[..., 3] > 0
            assert np.abs(before.astype(int) - after)[seen].mean() < 3
            np.testing.assert_array_equal(after[..., 3], before[..., 3])
    np.testing.assert_array_equal(back.face_textures, mesh.face_textures)
    np.testing.assert_array_equal(again.face_uvs, back.face_uvs)
    textured = mesh.face_textures >= 0
    assert back.face_uvs.dtype == np.float32
    assert np.isfinite(back.face_uvs).all()
    assert not back.face_uvs[~textured].any()
    if shift < 1e6:
        off = 0.5001 * UV_STEP + 1e-7 * abs(shift)
        np.testing.assert_allclose(back.face_uvs[textured], mesh.face_uvs[textured], atol=off)


def test_textures_take_room_only_where_they_are():
    mesh = textured_mesh()
    with np.load(io.BytesIO(pack_mesh(mesh.without_textures(), np.zeros(3, np.uint8)))) as plain:
        assert len(plain.files) == 6
    uvs = np.random.default_rng(1).uniform(size=(9, 2)).astype(np.float32)
    many = replace(mesh, faces=np.tile(mesh.faces, (500, 1)))
    many = replace(
        many,
        face_colors=np.tile(mesh.face_colors, (500, 1)),
        face_textures=np.zeros(20_000, np.int16),
        face_uvs=uvs[many.faces],
    )
    sizes = [len(pack_mesh(m, np.zeros(3, np.uint8))) for m in (many, many.without_textures())]
    assert sizes[0] - sizes[1] < 5000, "faces that share their vertices' UVs need none of their own"


def test_a_face_of_a_texture_that_is_not_there_is_damage():
    mesh = replace(textured_mesh(), face_textures=np.full(40, 2, np.int16))
    with pytest.raises(ValueError, match="texture 2 of 2"):
        unpack_mesh(pack_mesh(mesh, np.zeros(3, np.uint8)))


def test_pictures_of_another_format_and_size_are_damage(monkeypatch):
    """No other decoder than WebP's sees the bytes, and no more memory is taken than is right."""
    mesh, save = textured_mesh(), Image.Image.save
    with monkeypatch.context() as patch:
        patch.setattr(Image.Image, "save", lambda i, to, *_, **__: save(i, to, "PNG"))
        other = pack_mesh(mesh, np.zeros(3, np.uint8))
    with pytest.raises(ValueError, match="UnidentifiedImageError"):
        unpack_mesh(other)
    monkeypatch.setattr(packing, "_MAX_TEXELS", 37 * 60)
    with pytest.raises(ValueError, match="more than 2,220 texels"):
        unpack_mesh(pack_mesh(mesh, np.zeros(3, np.uint8)))


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
        pack_mesh(box_mesh(1), np.zeros(3, np.uint8))
        if unpack is unpack_mesh
        else pack_image(rng.integers(0, 255, (5, 4, 4), np.uint8))
    )
    unpack(packed)
    with pytest.raises(ValueError, match=r"\w"):
        unpack(damage(packed))
