from dataclasses import replace

import numpy as np
import pytest
import trimesh

from ffd_lightning.data.preparation.texture_reduction import MAX_TEXELS, reduce_textures
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.rendering import render


def textured(textures, uvs, scale=(0.6, 0.5, 0.4)):
    """A box whose faces take turns with the textures; UVs of the places of its corners."""
    box = trimesh.creation.box(scale)
    corners = box.vertices[box.faces] / np.array(scale)
    corners = corners[..., :2] * 0.8 + corners[..., 2:] * 0.2 + 0.5  # no side is of one line
    return Mesh(
        vertices=np.asarray(box.vertices, float),
        faces=np.asarray(box.faces, np.int64),
        face_colors=np.full((12, 4), 99, np.uint8),
        textures=tuple(textures),
        face_textures=(np.arange(12) % len(textures)).astype(np.int16),
        face_uvs=uvs(corners).astype(np.float32),
    )


def picture(height, width, seed=0, alpha=255):
    """Soft random colours, (height, width, 4)."""
    rng = np.random.default_rng(seed)
    waves = [
        np.sin(rng.uniform(2, 9) * np.arange(height)[:, None] / height + rng.uniform(0, 6))
        * np.sin(rng.uniform(2, 9) * np.arange(width) / width + rng.uniform(0, 6))
        for _ in range(3)
    ]
    rgb = np.stack(waves, axis=-1) * 120 + 128
    return np.dstack([rgb, np.full((height, width), alpha)]).astype(np.uint8)


def unchanged(uvs):
    return uvs


def difference(one, other):
    images = [render(mesh, height=96, width=128).astype(int) for mesh in (one, other)]
    return np.abs(images[0] - images[1]).mean()


def texels(mesh):
    return sum(texture.shape[0] * texture.shape[1] for texture in mesh.textures)


@pytest.mark.parametrize(
    "uvs",
    [
        unchanged,
        lambda uv: 0.3 * uv + (0.5, 0.2),  # a part of it
        lambda uv: 0.2 * uv + (7.0, -3.2),  # at the borders of a repeat
        lambda uv: 3 * uv - 0.7,  # repeats
        lambda uv: uv * (0.1, 3),  # a part of it one way, repeats the other
        lambda uv: 0.4 * uv - 0.2,  # across a border
    ],
)
def test_a_shape_looks_as_before_in_few_texels(uvs):
    mesh = textured([picture(500, 700), picture(900, 300, 1)], uvs)
    reduced = reduce_textures(mesh)
    assert texels(reduced) <= MAX_TEXELS < texels(mesh)
    assert difference(mesh, reduced) < 0.6
    assert difference(mesh, mesh.without_textures()) > 8


@pytest.mark.parametrize("shape", [(1, 5000), (5000, 1), (3, 900), (400, 400)])
def test_many_textures_of_any_form_are_bounded(shape):
    count = 40
    mesh = textured([picture(*shape, seed) for seed in range(count)], unchanged)
    many = Mesh(
        vertices=mesh.vertices,
        faces=np.tile(mesh.faces, (4, 1)),
        face_colors=np.tile(mesh.face_colors, (4, 1)),
        textures=mesh.textures,
        face_textures=(np.arange(48) % count).astype(np.int16),
        face_uvs=np.tile(mesh.face_uvs, (4, 1, 1)),
    )
    reduced = reduce_textures(many)
    assert len(reduced.textures) == count
    assert count <= texels(reduced) <= MAX_TEXELS + count
    assert max(max(texture.shape) for texture in reduced.textures) <= 2048


def test_small_textures_are_kept_exactly():
    texture = np.random.default_rng(0).integers(0, 256, (30, 20, 4), np.uint8)
    mesh = textured([texture], unchanged)
    reduced = reduce_textures(mesh)
    np.testing.assert_array_equal(reduced.textures[0], texture)
    np.testing.assert_allclose(reduced.face_uvs, mesh.face_uvs, atol=1e-6)


def test_a_large_surface_gets_more_texels():
    mesh = textured([picture(600, 600), picture(600, 600, 1)], unchanged, (0.8, 0.01, 0.5))
    face = np.argsort(np.linalg.norm(np.cross(*edges(mesh)), axis=1))
    mesh = replace(mesh, face_textures=np.isin(np.arange(12), face[:4]).astype(np.int16))
    large, small = reduce_textures(mesh).textures
    assert len(large) > 5 * len(small)


def edges(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return b - a, c - a


def test_what_no_face_has_is_left_out_and_faces_keep_theirs():
    mesh = textured([picture(8, 8, seed) for seed in range(4)], unchanged)
    mesh = replace(mesh, face_textures=np.array([3, -1, 1] * 4, np.int16))
    reduced = reduce_textures(mesh)
    assert len(reduced.textures) == 2
    np.testing.assert_array_equal(reduced.face_textures, [1, -1, 0] * 4)
    for index, texture in ((0, mesh.textures[1]), (1, mesh.textures[3])):
        assert np.abs(reduced.textures[index].astype(int) - texture).mean() < 3
    none = replace(mesh, face_textures=np.full(12, -1, np.int16))
    assert reduce_textures(none).textures == ()
    plain = mesh.without_textures()
    assert reduce_textures(plain) is plain


def test_holes_stay_holes():
    texture = picture(512, 512)
    texture[128:256, 64:400, 3] = 0
    mesh = textured([texture], unchanged)
    assert difference(mesh, reduce_textures(mesh)) < 0.8
    assert set(np.unique(reduce_textures(mesh).textures[0][..., 3])) == {0, 255}
