from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from box_source import RENDER, box_mesh
from trees import textured_box

from ffd_lightning.data.preparation import prepared_shape
from ffd_lightning.data.preparation.packing import unpack_mesh
from ffd_lightning.data.preparation.prepared_shape import MAX_TEXELS, ShapeMaker, shrink_textures
from ffd_lightning.data.source import SourceShape
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.rendering import render


def maker(folder, mesh, **more):
    """What makes this shape, whichever is asked for; a source that gives None without a mesh."""
    shape = None if mesh is None else SourceShape(mesh, **more)
    return ShapeMaker(SimpleNamespace(load=lambda *_: shape), "box", 40, RENDER, folder)


def test_odd_ids_do_not_leave_the_folder(tmp_path):
    folder = tmp_path / "work"
    folder.mkdir()
    assert maker(folder, box_mesh(0)).make("../a/b: ü" + 300 * "x") is None
    assert len(list(folder.iterdir())) == 1
    assert list(tmp_path.iterdir()) == [folder]


def test_what_a_source_gives_wrongly_is_rejected_with_the_reason(tmp_path, monkeypatch):
    flat = Mesh(np.eye(3), np.array([[0, 1, 1]]), np.full((1, 4), 255, np.uint8))
    parts = replace(flat, face_parts=np.zeros(2, np.uint8), part_names=("a",))
    listed, three = replace(flat, faces=[[0, 1, 2]]), replace(flat, face_colors=np.ones((1, 3)))
    image = np.zeros((8, 8, 3), np.uint8)
    for made, words in (
        (maker(tmp_path, flat), "no area"),
        (maker(tmp_path, listed), "faces as integer (F, 3); it gives a list"),
        (maker(tmp_path, three), "face_colors as uint8 (F, 4); it gives float64 (1, 3)"),
        (maker(tmp_path, parts), "gives 2 face_parts for 1 faces"),
        (maker(tmp_path, box_mesh(0), images=[image]), "gives [('uint8', (8, 8, 3))]"),
        (maker(tmp_path, box_mesh(0), images=[]), "gives []"),
        (maker(tmp_path, None), "gives a NoneType"),
    ):
        failure = made.make("a")
        assert failure.kind == "rejected"
        assert words in failure.reason
    monkeypatch.setattr(prepared_shape, "normalize", None)
    reason = maker(tmp_path, box_mesh(0)).make("a").reason
    assert reason.endswith("a bug of ffd_lightning: please report it)")


def soft(shift, height, width):
    """A picture of waves."""
    u, v = np.meshgrid(np.arange(width) / width, np.arange(height) / height)
    waves = [120 + 100 * np.sin(7 * u + k + shift) * np.cos(5 * v - k) for k in range(3)]
    return np.dstack([*waves, np.full_like(u, 255)]).astype(np.uint8)


def test_a_shape_looks_as_before_in_few_texels():
    mesh = textured_box((soft(0, 500, 700), soft(1, 500, 700)), [0, 1] * 6)
    small = shrink_textures(mesh)
    assert sum(t.shape[0] * t.shape[1] for t in small.textures) <= MAX_TEXELS
    seen = [render(m, height=96, width=128).astype(int) for m in (mesh, small)]
    assert np.abs(seen[0] - seen[1]).mean() < 0.6


def test_small_textures_are_kept_exactly_and_those_of_no_face_left_out():
    mesh = textured_box(tuple(soft(k, 30, 20) for k in range(3)), [2, -1, 0] * 4)
    small = shrink_textures(mesh)
    np.testing.assert_array_equal(small.face_textures, [1, -1, 0] * 4)
    for found, own in zip(small.textures, (mesh.textures[0], mesh.textures[2]), strict=True):
        np.testing.assert_array_equal(found, own)
    none = replace(mesh, face_textures=np.full(12, -1, np.int16))
    assert shrink_textures(none).textures == ()


def test_plain_colours_are_of_all_texels_that_came(tmp_path):
    texture = np.full((1000, 1000, 4), 255, np.uint8)
    texture[::2, ::2, :3] = 55
    mesh = Mesh(
        vertices=np.eye(3),
        faces=np.array([[0, 1, 2]] * 2),
        face_colors=np.full((2, 4), 77, np.uint8),
        textures=(texture,),
        face_textures=np.array([0, -1], np.int16),
        face_uvs=np.array([[(0, 0), (1, 0), (0, 1)]] * 2, np.float32),
    )
    found, parts = unpack_mesh(maker(tmp_path, mesh).arrays("a")["mesh"].tobytes())
    assert [t.shape for t in found.textures] == [(256, 256, 4)]
    np.testing.assert_array_equal(found.face_colors[1], [77] * 4)
    assert set(parts) == {255}
