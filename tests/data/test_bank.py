from dataclasses import replace

import numpy as np
import pytest
import torch

from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.geometry.mesh import Mesh


def test_the_bank_holds_the_prepared_models(prepared):
    rows = (7, 3, 11)
    bank = TemplateBank.of(prepared, [prepared.ids[row] for row in rows])
    np.testing.assert_array_equal(bank.points, [prepared.cloud(r) for r in rows])
    np.testing.assert_array_equal(bank.point_parts, [prepared.point_parts(r) for r in rows])
    assert bank.families == tuple(prepared.families[r] for r in rows)
    np.testing.assert_array_equal(bank.meshes[1].faces, prepared.mesh(rows[1]).faces)
    assert bank.deformation_matrix.dtype == bank.control_points.dtype == torch.float32
    reproduced = bank.deformation_matrix @ bank.control_points
    torch.testing.assert_close(reproduced, bank.points, atol=1e-5, rtol=0)


@pytest.mark.parametrize("parts", [True, False])
def test_a_bank_comes_back_from_its_state(prepared, tmp_path, parts):
    if not parts:
        prepared = replace(prepared, manifests=({**prepared.manifests[0], "part_names": []},))
    bank = TemplateBank.of(prepared, prepared.ids[:2], (2, 3, 4), 0.08)
    torch.save(bank.state(), tmp_path / "bank.pt")
    again = TemplateBank.from_state(torch.load(tmp_path / "bank.pt", weights_only=True))
    for name in ("ids", "families", "part_names", "degrees", "max_edge"):
        assert getattr(again, name) == getattr(bank, name)
    for name in ("points", "control_points", "deformation_matrix"):
        assert torch.equal(getattr(again, name), getattr(bank, name))
    np.testing.assert_array_equal(again.point_parts, bank.point_parts)
    for one, other in zip(again.meshes, bank.meshes, strict=True):
        for name in ("vertices", "faces", "face_colors", "face_parts", "face_textures", "face_uvs"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert one.part_names == other.part_names
        for mine, theirs in zip(one.textures, other.textures, strict=True):
            assert np.abs(mine.astype(int) - theirs).mean() < 4  # packed twice
    assert any(mesh.textures for mesh in again.meshes)
    offsets = torch.randn(bank.control_points[1].shape) / 10
    one, other = again.deformed_mesh(1, offsets), bank.deformed_mesh(1, offsets)
    np.testing.assert_array_equal(one.vertices, other.vertices)


SQUARE = np.array([(-0.5, 0, -0.5), (0.5, 0, -0.5), (0.5, 0, 0.5), (-0.5, 0, 0.5)])


def square(vertices=SQUARE, **parts):
    return Mesh(vertices, np.array([(0, 1, 2), (0, 2, 3)]), np.full((2, 4), 255, np.uint8), **parts)


def test_a_bank_of_any_meshes():
    """Normalised, with clouds on their surfaces, and parts of both under common names."""
    half = {"face_parts": np.array([0, 1], np.uint8), "part_names": ("low", "high")}
    other = square(SQUARE + 1, face_parts=np.array([0, 0], np.uint8), part_names=("high",))
    meshes = {"plain": square(), "a": square(7 * SQUARE, **half), "b": other}
    bank = TemplateBank.of_meshes(meshes, num_points=200, max_edge=0.2)
    assert (bank.ids, bank.part_names, len(bank)) == (("plain", "a", "b"), ("low", "high"), 3)
    for points, mesh in zip(bank.points, bank.meshes, strict=True):
        np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), (0.5**0.5, 0, 0.5**0.5))
        assert points[:, 1].abs().max() == 0
        assert points.abs().max() <= 0.5**0.5 / 2 + 1e-4
    low = bank.points[1, :, 0] > bank.points[1, :, 2]  # the first triangle's side of the diagonal
    np.testing.assert_array_equal(bank.point_parts[1], np.where(low, 0, 1))
    assert set(bank.point_parts[0]) == {255}
    assert set(bank.point_parts[2]) == {1}
    again = TemplateBank.from_state(bank.state())
    assert torch.equal(again.points, bank.points)
