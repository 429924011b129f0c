"""Against automatic and numeric differentiation of the deformation itself."""

import pytest
import torch

from ffd_lightning.geometry import jacobian
from ffd_lightning.geometry.ffd import Lattice, deformation_matrix, num_control_points
from ffd_lightning.geometry.jacobian import deformation_jacobian, lattice_determinants

DEGREES = [(3, 3, 3), (1, 2, 4), (1, 1, 1)]


def case(degrees=(3, 3, 3), seed=0, points=40):
    generator = torch.Generator().manual_seed(seed)
    size = torch.tensor([0.3, 2.0, 1.1], dtype=torch.float64)
    lattice = Lattice(torch.randn(3, dtype=torch.float64, generator=generator), size, degrees)
    stu = torch.rand(points, 3, dtype=torch.float64, generator=generator) * 1.4 - 0.2
    stu[0], stu[1] = 0, 1  # corners of the box too
    offsets = torch.randn(num_control_points(degrees), 3, dtype=torch.float64, generator=generator)
    return lattice.origin + stu * size, lattice, offsets


def deformed(points, lattice, offsets):
    return points + deformation_matrix(points, lattice) @ offsets


@pytest.mark.parametrize("degrees", DEGREES)
def test_is_what_autograd_finds(monkeypatch, degrees):
    monkeypatch.setattr(jacobian, "_CHUNK", 7)
    points, lattice, offsets = case(degrees)
    expected = [
        torch.autograd.functional.jacobian(lambda x: deformed(x[None], lattice, offsets)[0], point)
        for point in points
    ]
    torch.testing.assert_close(
        deformation_jacobian(points, lattice, offsets), torch.stack(expected)
    )


@pytest.mark.parametrize("thin", [0.0, 1e-12])
def test_a_flat_box_bends_within_its_plane_and_carries_the_rest(thin):
    generator = torch.Generator().manual_seed(1)
    points = torch.rand(20, 3, dtype=torch.float64, generator=generator)
    points[:, 1] = 0.25
    size = torch.tensor([1.0, thin, 1.0], dtype=torch.float64)
    lattice = Lattice(torch.tensor([0.0, 0.25, 0.0], dtype=torch.float64), size, (2, 2, 2))
    offsets = torch.randn(27, 3, dtype=torch.float64, generator=generator)
    got = deformation_jacobian(points, lattice, offsets)
    if thin == 0:
        assert torch.equal(got[:, :, 1], torch.eye(3).double()[1].expand(20, 3))
    # Within the plane it is the deformation's slope, by central differences.
    step = torch.tensor([1e-6, 0, 0], dtype=torch.float64)
    slope = deformed(points + step, lattice, offsets) - deformed(points - step, lattice, offsets)
    torch.testing.assert_close(got[:, :, 0], slope / 2e-6, rtol=1e-6, atol=1e-6)
    assert torch.isfinite(got).all()


@pytest.mark.parametrize("degrees", DEGREES)
def test_determinants_on_a_lattice_are_those_of_the_jacobian_there(degrees):
    generator = torch.Generator().manual_seed(0)
    count = num_control_points(degrees)
    boxes = torch.rand(4, 2, 3, dtype=torch.float64, generator=generator)
    boxes[3, :, 1] = 0.5  # flat
    lattice = Lattice.bounding(boxes, degrees)
    places = lattice.control_points()
    offsets = torch.randn(2, 4, count, 3, dtype=torch.float64, generator=generator)
    layers = offsets.unflatten(-2, [degree + 1 for degree in degrees])
    layers[:, 3] = layers[:, 3, :, :1]  # all layers of the flat one alike: see `Lattice`
    expected = torch.linalg.det(deformation_jacobian(places, lattice, offsets))
    found = lattice_determinants(offsets, places, degrees)
    torch.testing.assert_close(found, expected)
    assert (found < 0).any(), "else nothing was folded"


@pytest.mark.parametrize("thin", [3e-17, 1e-21])
def test_a_sheet_that_rounding_has_made_thick_is_flat(thin):
    generator = torch.Generator().manual_seed(0)
    points = Lattice.bounding(torch.rand(9, 3, generator=generator), (1, 2, 2)).control_points()
    offsets = torch.randn(len(points), 3, generator=generator)
    flat, sheet = (points * torch.tensor([extent, 1, 1]) for extent in (0, thin))
    found, expected = (lattice_determinants(offsets, p, (1, 2, 2)) for p in (sheet, flat))
    assert torch.equal(found, expected)
