import itertools

import numpy as np
import pytest
import torch

from ffd_lightning.geometry.lattice import Lattice, lattice_edges, num_control_points


def rotation(seed=0):
    q, _ = torch.linalg.qr(
        torch.randn(3, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))
    )
    return q


def oriented(degrees=(3, 2, 1)):
    axes = rotation() * torch.tensor([[2.0], [0.5], [1.0]], dtype=torch.float64)
    return Lattice(torch.tensor([1.0, -2.0, 0.5], dtype=torch.float64), axes, degrees)


def test_control_points_run_fastest_along_the_last_axis():
    lattice = Lattice(torch.zeros(3), torch.eye(3), (1, 2, 3))
    points = lattice.control_points()
    assert points.shape == (num_control_points((1, 2, 3)), 3)
    torch.testing.assert_close(points[1], torch.tensor([0, 0, 1 / 3]))
    torch.testing.assert_close(points[4], torch.tensor([0, 1 / 2, 0]))
    torch.testing.assert_close(points[12], torch.tensor([1.0, 0, 0]))


def test_stu_inverts_the_oriented_frame():
    lattice = oriented()
    stu = torch.rand(20, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(1))
    torch.testing.assert_close(lattice.to_stu(lattice.origin + stu @ lattice.axes), stu)


def test_translation_moves_control_points_and_keeps_stu():
    lattice, shift = oriented(), torch.tensor([3.0, 4.0, -5.0], dtype=torch.float64)
    moved = Lattice(lattice.origin + shift, lattice.axes, lattice.degrees)
    torch.testing.assert_close(moved.control_points(), lattice.control_points() + shift)
    points = torch.rand(7, 3, dtype=torch.float64)
    torch.testing.assert_close(moved.to_stu(points + shift), lattice.to_stu(points))


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_the_faces_of_the_box_are_inside(dtype):
    corners = torch.cartesian_prod(*[torch.tensor([0.0, 1.0])] * 3).to(dtype)
    axes = (rotation() * torch.tensor([[0.1], [0.7], [30.0]])).to(dtype)
    lattice = Lattice(torch.tensor([0.3, -7.1, 2.2], dtype=dtype), axes)
    assert lattice.contains(lattice.origin + corners @ axes).all()
    outside = torch.cat([corners, corners]) * 1.01 - 0.005
    assert not lattice.contains(lattice.origin + outside @ axes).any()


def test_bounding_box_holds_its_points_batched():
    points = torch.randn(4, 50, 3, generator=torch.Generator().manual_seed(0))
    lattice = Lattice.bounding(points)
    assert lattice.control_points().shape == (4, 64, 3)
    assert lattice.contains(points).all()
    assert lattice.to_stu(points).amin() == 0
    assert lattice.to_stu(points).amax() == pytest.approx(1)


def test_flat_box_contains_only_its_plane():
    points = torch.rand(30, 3, generator=torch.Generator().manual_seed(0))
    points[:, 1] = 0.25
    lattice = Lattice.bounding(points)
    assert lattice.contains(points).all()
    assert not lattice.contains(points + torch.tensor([0, 0.01, 0])).any()


@pytest.mark.parametrize(
    ("origin", "axes", "degrees", "match"),
    [
        (torch.zeros(2), torch.eye(3), (3, 3, 3), "origin"),
        (torch.zeros(3), torch.eye(3), (3, 0, 3), "degrees"),
        (
            torch.zeros(3),
            torch.tensor([[1.0, 0, 0], [1, 1, 0], [0, 0, 1]]),
            (3, 3, 3),
            "orthogonal",
        ),
        (torch.tensor([0, 0, torch.nan]), torch.eye(3), (3, 3, 3), "finite"),
    ],
)
def test_refuses_what_is_no_box(unchecked, origin, axes, degrees, match):
    with pytest.raises(ValueError, match=match):
        Lattice(origin, axes, degrees)


def test_bounding_refuses_nothing_and_nan():
    with pytest.raises(ValueError, match="no points"):
        Lattice.bounding(torch.zeros(0, 3))
    with pytest.raises(ValueError, match="finite"):
        Lattice.bounding(torch.tensor([[0.0, torch.nan, 0]]))


@pytest.mark.parametrize("degrees", [(3, 3, 3), (1, 2, 4)])
def test_edges_join_control_points_that_are_one_index_apart(degrees):
    indices = list(itertools.product(*(range(degree + 1) for degree in degrees)))
    edges = lattice_edges(degrees)
    found = {tuple(sorted(indices[k] for k in edge)) for edge in edges.tolist()}
    expected = {
        (a, b)
        for a, b in itertools.combinations(indices, 2)
        if np.abs(np.subtract(a, b)).sum() == 1
    }
    assert found == expected
    assert len(edges) == len(expected)
