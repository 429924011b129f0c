from types import SimpleNamespace

import numpy as np
import pytest
import torch

from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import TemplateSample
from ffd_lightning.losses.terms import (
    Chamfer,
    LatticeBending,
    LatticeFolding,
    MeanChamfer,
    SlicedWasserstein,
    StepInput,
    UniformPenalty,
)
from ffd_lightning.nn.network import FfdPrediction


def step_input(weights, offsets=None, batch_weights=None, sample=None, targets=None, queries=None):
    """A step of which what is not given does not matter."""
    if offsets is None:
        offsets = torch.zeros(*weights.shape, 1, 3)
    _, templates, count, _ = offsets.shape
    if sample is None:
        matrix, control = torch.ones(templates, 5, count), torch.zeros(templates, count, 3)
        sample = TemplateSample(matrix, control, (1, 1, 1))
    targets = torch.zeros(len(weights), 5, 3) if targets is None else targets
    given = weights if batch_weights is None else batch_weights
    prediction = FfdPrediction(weights, weights, offsets, weights)
    return StepInput(prediction, targets, sample, 0, given, queries or len(given))


def test_mean_chamfer_is_in_thousandths_and_distances_are_computed_once():
    g = torch.Generator().manual_seed(0)
    offsets, targets = torch.randn(2, 3, 4, 3, generator=g), torch.randn(2, 6, 3, generator=g)
    matrix, control = torch.rand(3, 6, 4, generator=g), torch.randn(3, 4, 3, generator=g)
    sample = TemplateSample(matrix, control, (1, 1, 0))
    weights = torch.full((2, 3), 1 / 3)
    inputs = step_input(weights, offsets, sample=sample, targets=targets)
    assert inputs.chamfer is inputs.chamfer is Chamfer()(inputs)
    mean = MeanChamfer()(inputs)
    for q in range(2):
        for t in range(3):
            points = matrix[t] @ (control[t] + offsets[q, t])
            thousandths = 1000 * chamfer_distance(points, targets[q], "mean")
            torch.testing.assert_close(mean[q, t], thousandths)


@pytest.mark.parametrize("degrees", [(3, 3, 3), (1, 3, 7), (7, 3, 1)])
def test_bending_is_of_a_lattices_degrees_and_not_of_others_with_as_many_points(degrees):
    g = torch.Generator().manual_seed(0)
    offsets = torch.randn(2, 3, 64, 3, generator=g, dtype=torch.float64)
    sample = TemplateSample(torch.rand(3, 5, 64), torch.rand(3, 64, 3), degrees)
    inputs = step_input(torch.full((2, 3), 1 / 3), offsets, sample=sample)
    grid = offsets.reshape(2, 3, *(degree + 1 for degree in degrees), 3).numpy()
    bends = [(np.diff(grid, n=2, axis=axis) ** 2).sum((2, 3, 4, 5)) for axis in (2, 3, 4)]
    np.testing.assert_allclose(LatticeBending()(inputs), sum(bends))


def test_folding_is_what_is_turned_inside_out():
    cube = torch.stack(torch.meshgrid(*[torch.linspace(0, 1, 4)] * 3, indexing="ij"), -1)
    control_points = torch.stack([cube.reshape(-1, 3), cube.reshape(-1, 3) * torch.rand(3)])
    stretch = torch.tensor([[4.0, 1, 1], [-0.5, 1, 1], [-2.0, -1, -1], [-1, -1, 1]])
    offsets = (control_points[None] * (stretch[:, None, None] - 1)).requires_grad_()
    sample = TemplateSample(torch.rand(2, 5, 64), control_points, (3, 3, 3))
    found = LatticeFolding()(step_input(torch.full((4, 2), 0.5), offsets, sample=sample))
    # Stretched and turned by half a turn: nothing; through itself: what is turned.
    expected = torch.tensor([0.0, 0.25, 4.0, 0.0]).log1p()[:, None].expand(4, 2)
    torch.testing.assert_close(found, expected)
    (gradient,) = torch.autograd.grad(found.sum(), offsets)
    assert (gradient.abs().amax((1, 2, 3)) > 0).tolist() == [False, True, True, False]


def test_the_uniform_penalty_is_of_squares_and_asks_for_no_weights():
    g = torch.Generator().manual_seed(0)
    weights, offsets = torch.rand(2, 3, generator=g), torch.randn(2, 3, 4, 3, generator=g)
    inputs, squares = step_input(weights, offsets), (offsets.numpy() ** 2).sum((2, 3))
    assert float(UniformPenalty()(inputs)) == pytest.approx(squares.sum(), rel=1e-5)


def test_transport_costs_and_gradients_are_of_points_sorted_along_each_direction(unchecked):
    g = torch.Generator().manual_seed(0)
    pred, target = torch.rand(2, 3, 40, 3, generator=g), torch.rand(2, 40, 3, generator=g)
    inputs = SimpleNamespace(pred_points=pred.requires_grad_(), target_points=target)
    for asked, count, every in ((16, 16, 2), (41, 40, 1)):
        torch.manual_seed(3)
        costs = SlicedWasserstein(4, asked)(inputs)
        assert costs.shape == (2, 3)
        (gradient,) = torch.autograd.grad(costs.sum(), pred)
        moved = gradient.abs().sum(-1) > 0
        assert moved.sum(-1).eq(count).all(), "as many points of each cloud as were asked for"
        torch.manual_seed(3)
        axes = torch.nn.functional.normalize(torch.empty(3, 4).normal_(), dim=0).numpy()
        a = np.sort(pred.detach().numpy()[1, 2, ::every][:count] @ axes, axis=0)
        b = np.sort(target.numpy()[1, ::every][:count] @ axes, axis=0)
        assert float(costs[1, 2].detach()) == pytest.approx(3000 * ((a - b) ** 2).mean(), rel=1e-4)
