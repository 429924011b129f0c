import math

import numpy as np
import pytest
import torch

from ffd_lightning.geometry.ffd import (
    Lattice,
    bernstein_basis,
    deform,
    deformation_matrix,
    mirrored_offsets,
    num_control_points,
)

DEGREES = [(3, 3, 3), (1, 2, 4), (1, 1, 1), (5, 3, 2)]


def cloud(n=40, dtype=torch.float64, seed=0):
    return torch.randn(n, 3, dtype=dtype, generator=torch.Generator().manual_seed(seed))


def closed_form(degree, i, t):
    return math.comb(degree, i) * t**i * (1 - t) ** (degree - i)


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 5, 9])
def test_polynomials_match_the_closed_form(degree):
    t = torch.linspace(0, 1, 23, dtype=torch.float64)
    closed = np.stack([closed_form(degree, i, t.numpy()) for i in range(degree + 1)], axis=-1)
    np.testing.assert_allclose(bernstein_basis(t, degree).numpy(), closed, atol=1e-14)
    if degree:
        t = t[::11].requires_grad_()  # both ends too
        assert torch.autograd.gradcheck(bernstein_basis, (t, degree))
        assert torch.autograd.gradgradcheck(bernstein_basis, (t, degree))


def naive(points, lattice, control):
    """The paper's triple sum, point by point, in float64."""
    stu = ((points - lattice.origin) / lattice.size).numpy()
    grid = control.numpy().reshape(*(d + 1 for d in lattice.degrees), 3)
    out = np.zeros((len(points), 3))
    for p, place in enumerate(stu):
        for index in np.ndindex(grid.shape[:3]):
            basis = [
                closed_form(d, i, t) for d, i, t in zip(lattice.degrees, index, place, strict=True)
            ]
            out[p] += math.prod(basis) * grid[index]
    return out


@pytest.mark.parametrize("degrees", DEGREES)
def test_matches_the_triple_sum(degrees):
    points = cloud()
    lattice = Lattice.bounding(points, degrees)
    offsets = 0.3 * cloud(num_control_points(degrees), seed=2)
    control = lattice.control_points() + offsets
    result = deform(deformation_matrix(points, lattice), lattice.control_points(), offsets)
    np.testing.assert_allclose(result.numpy(), naive(points, lattice, control), atol=1e-12)


@pytest.mark.parametrize("flat", [[0], [1], [2], [0, 2], [0, 1, 2]])
def test_flat_templates_are_reproduced_and_can_be_moved(flat):
    points = cloud(30, torch.float32)
    points[:, flat] = 0.125
    lattice = Lattice.bounding(points)
    matrix = deformation_matrix(points, lattice)
    assert torch.isfinite(matrix).all()
    torch.testing.assert_close(matrix @ lattice.control_points(), points, atol=1e-5, rtol=0)
    lifted = deform(matrix, lattice.control_points(), torch.full((64, 3), 0.5))
    torch.testing.assert_close(lifted, points + 0.5, atol=1e-5, rtol=0)


def test_queries_and_templates_broadcast_and_mixed_precision_changes_nothing():
    matrix, control, offsets = torch.rand(3, 9, 8), torch.rand(3, 8, 3), torch.rand(2, 3, 8, 3)
    result = deform(matrix, control, offsets)
    for q, t in np.ndindex(2, 3):
        torch.testing.assert_close(result[q, t], matrix[t] @ (control[t] + offsets[q, t]))
    with torch.autocast("cpu", torch.bfloat16):
        assert torch.equal(deform(matrix, control, offsets), result)


def test_mirrored_offsets_deform_the_mirrored_points():
    """For a lattice that lies symmetrically, mirroring and deforming change places."""
    degrees, mirror = (3, 2, 4), torch.tensor([-1.0, 1, 1]).double()
    points = cloud()
    points = torch.cat([points, points * mirror])
    lattice = Lattice.bounding(points, degrees)
    matrix, control = deformation_matrix(points, lattice), lattice.control_points()
    offsets = cloud(len(control), seed=1)
    moved = deform(matrix, control, mirrored_offsets(offsets, degrees))
    swapped = points * mirror
    expected = deform(deformation_matrix(swapped, lattice), control, offsets) * mirror
    torch.testing.assert_close(moved, expected)
    again = mirrored_offsets(mirrored_offsets(offsets, degrees), degrees)
    torch.testing.assert_close(again, offsets)
