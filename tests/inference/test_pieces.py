from dataclasses import replace

import numpy as np

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.inference.pieces import pieces
from ffd_lightning.palette import part_colors


def textured_mesh(seed=0):
    """Faces of two parts, with one of two textures or one of two colours each."""
    rng = np.random.default_rng(seed)
    return Mesh(
        vertices=rng.normal(size=(20, 3)),
        faces=np.sort(rng.permuted(np.tile(np.arange(20), (60, 1)), axis=1)[:, :3]),
        face_colors=np.array([(9, 8, 7, 255), (1, 2, 3, 90)], np.uint8)[rng.integers(0, 2, 60)],
        face_parts=rng.integers(0, 2, 60).astype(np.uint8),
        part_names=("leg", "top"),
        textures=tuple(rng.integers(0, 256, (4, 4, 4), np.uint8) for _ in range(2)),
        face_textures=rng.integers(-1, 2, 60).astype(np.int16),
        face_uvs=rng.integers(0, 3, (60, 3, 2)).astype(np.float32) / 2,
    )


def corners_of(piece, mesh):
    """Each face as its corners' places and UVs."""
    places = mesh.vertices[piece.vertices[piece.faces]]
    return {
        tuple(row) for row in np.concatenate([places, piece.uvs[piece.faces]], 2).reshape(-1, 15)
    }


def test_textured_pieces_have_the_uvs_of_their_corners():
    mesh = textured_mesh()
    found = pieces(mesh, "material", 16)
    expected = np.concatenate([mesh.vertices[mesh.faces], mesh.face_uvs], 2).reshape(-1, 15)
    for texture in (0, 1):
        for part, name in enumerate(mesh.part_names):
            (piece,) = (p for p in found if p.texture == texture and p.name == name)
            own = (mesh.face_textures == texture) & (mesh.face_parts == part)
            assert corners_of(piece, mesh) == {tuple(row) for row in expected[own]}
            assert piece.rgba == (255, 255, 255, 255)
            pairs = np.column_stack([piece.vertices, piece.uvs])
            assert len(np.unique(pairs, axis=0)) == len(pairs), "no pair is there twice"
    plain = [piece for piece in found if piece.texture < 0]
    assert all(piece.uvs is None for piece in plain)
    assert found[-len(plain) :] == plain
    assert {piece.rgba for piece in plain} == {(9, 8, 7, 255), (1, 2, 3, 90)}
    assert sum(len(piece.faces) for piece in found) == 60


def test_colours_of_parts_stand_above_textures():
    mesh = textured_mesh()
    found = {piece.rgba: len(piece.faces) for piece in pieces(mesh, "parts", 16)}
    colors = part_colors(np.array([0, 1], np.uint8)).tolist()
    assert found == dict(zip(map(tuple, colors), np.bincount(mesh.face_parts), strict=True))
    assert {piece.texture for piece in pieces(mesh, "parts", 16)} == {-1}
    unknown = replace(mesh, face_parts=None)
    assert {piece.texture for piece in pieces(unknown, "parts", 16)} == {-1, 0, 1}


def test_many_colours_become_few_like_ones_and_glass_stays_glass():
    rng = np.random.default_rng(2)
    shades = np.array([(120, 70, 30), (30, 60, 200)])[rng.integers(2, size=400)]
    rgb = np.clip(shades + rng.integers(-12, 13, (400, 3)), 0, 255)
    alpha = np.where(np.arange(400) < 40, 100, 255)
    rgba = np.column_stack([rgb, alpha]).astype(np.uint8)
    mesh = Mesh(rng.normal(size=(1200, 3)), np.arange(1200).reshape(400, 3), rgba)
    found = pieces(mesh, "material", 16)
    assert len({piece.rgba[:3] for piece in found}) <= 16
    drawn = np.zeros_like(rgba)
    for piece in found:
        drawn[piece.vertices[piece.faces[:, 0]] // 3] = piece.rgba
    assert np.abs(drawn[:, :3].astype(int) - rgb).max() < 40
    np.testing.assert_array_equal(drawn[:, 3] < 255, alpha < 255)
