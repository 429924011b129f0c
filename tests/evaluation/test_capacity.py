import numpy as np
import torch

from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation.capacity import fitted_template
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import deform
from ffd_lightning.geometry.mesh import Mesh


def bank_of(clouds):
    corners = np.array([[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5], [0.5, -0.5, 0.5]])
    meshes = (Mesh(corners, np.array([[0, 1, 2]]), np.full((1, 4), 255, np.uint8)),) * len(clouds)
    names = tuple("abc"[: len(clouds)])
    return TemplateBank(names, names, torch.from_numpy(np.stack(clouds)), meshes)


def test_a_deformed_template_is_found_and_fitted_again():
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(2048, 3))
    ball *= 0.4 / np.linalg.norm(ball, axis=1, keepdims=True)
    rod = rng.uniform(-0.5, 0.5, (2048, 3)) * [1, 0.05, 0.05]
    bank = bank_of([ball.astype(np.float32), rod.astype(np.float32)])
    offsets = torch.from_numpy(0.1 * rng.normal(size=(64, 3))).float()
    truth = deform(bank.deformation_matrix[1], bank.control_points[1], offsets)
    index, found = fitted_template(bank, truth.numpy(), seed=0)
    assert index == 1
    moved = deform(bank.deformation_matrix[1], bank.control_points[1], torch.from_numpy(found))
    before = chamfer_distance(bank.points[1], truth, "mean")
    assert chamfer_distance(moved, truth, "mean") < 0.1 * before
    again = fitted_template(bank, truth.numpy(), seed=0)
    np.testing.assert_array_equal(found, again[1])
