import gc
import sys
import time

import numpy as np
import pytest
from box_source import box_mesh
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from ffd_lightning.data.preparation.packing import (
    POINT_STEP,
    UV_STEP,
    pack_mesh,
    pack_points,
    unpack_mesh,
    unpack_points,
)
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.parallel import in_threads

NO_PARTS = np.zeros(3, np.uint8)


@given(hnp.arrays(np.float64, (7, 3), elements=st.floats(-0.5001, 0.5001)))
def test_points_lose_half_a_step_at_most_and_stay_within_their_box(points):
    back = unpack_points(pack_points(points))
    assert back.dtype == np.float32
    np.testing.assert_allclose(back, np.clip(points, -0.5, 0.5), atol=0.5001 * POINT_STEP)
    assert np.abs(back).max() <= 0.5
    np.testing.assert_array_equal(back[points == 0], 0)


def soft_texture(height, width):
    """A picture of slow waves, and of alpha that is all or nothing."""
    u, v = np.meshgrid(np.arange(width) / 40, np.arange(height) / 40)
    waves = [np.sin(u + k) * np.cos(v - k) for k in range(3)]
    return np.dstack([*(120 + 100 * w for w in waves), 255 * (u < 0.5)]).astype(np.uint8)


def textured_mesh(shift=0.0):
    """Two textures, and faces of which some have none."""
    rng = np.random.default_rng(0)
    return Mesh(
        vertices=rng.normal(size=(9, 3)).astype(np.float32).astype(np.float64),
        faces=rng.integers(0, 9, (40, 3)),
        face_colors=rng.integers(0, 256, (40, 4), np.uint8),
        textures=(soft_texture(1, 1), soft_texture(37, 60)),
        face_textures=rng.integers(-1, 2, 40).astype(np.int16),
        face_uvs=(shift + rng.normal(0, 3, (40, 3, 2))).astype(np.float32),
    )


@pytest.mark.parametrize("shift", [0, -1000, 1e30])
def test_textures_come_back(shift):
    mesh = textured_mesh(shift)
    back, _ = unpack_mesh(pack_mesh(mesh, NO_PARTS))
    again, _ = unpack_mesh(pack_mesh(back, NO_PARTS))
    for one, other in ((mesh, back), (back, again)):
        for before, after in zip(one.textures, other.textures, strict=True):
            assert (after.shape, after.dtype) == (before.shape, np.uint8)
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


def test_no_other_decoder_than_webps_sees_the_bytes(monkeypatch):
    save = Image.Image.save
    monkeypatch.setattr(Image.Image, "save", lambda i, to, *_, **__: save(i, to, "PNG"))
    with pytest.raises(ValueError, match="UnidentifiedImageError"):
        unpack_mesh(pack_mesh(textured_mesh(), NO_PARTS))


def test_large_indices_come_back():
    """Differences of int32 wrap around where they must not be summed as such."""
    faces = np.array([(0, 2**30, 5), (2**31 - 1, 0, 2**31 - 2)])
    mesh = Mesh(np.zeros((1, 3)), faces, np.zeros((2, 4), np.uint8))
    np.testing.assert_array_equal(unpack_mesh(pack_mesh(mesh, NO_PARTS))[0].faces, faces)


@pytest.mark.parametrize("damage", [lambda b: b"", lambda b: b[:-5], lambda b: b[:20] + b"?" * 20])
def test_damage_is_a_value_error(damage):
    with pytest.raises(ValueError, match=r"\w"):
        unpack_mesh(damage(pack_mesh(box_mesh(1), NO_PARTS)))


class Collected:
    """Garbage whose end lets another thread run: in the middle of what this one does."""

    def __init__(self):
        self.circle = self

    def __del__(self):
        time.sleep(0)


def test_several_threads_may_unpack_at_once():
    packed = pack_mesh(box_mesh(1), NO_PARTS)
    interval, threshold = sys.getswitchinterval(), gc.get_threshold()
    sys.setswitchinterval(1e-6)
    gc.set_threshold(30, 2, 2)
    try:
        found = in_threads(lambda _: (Collected(), unpack_mesh(packed)), range(1000), 8)
        assert sum(1 for _ in found) == 1000
    finally:
        sys.setswitchinterval(interval)
        gc.set_threshold(*threshold)
