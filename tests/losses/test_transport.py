from types import SimpleNamespace

import numpy as np
import pytest
import torch
from scipy.optimize import linear_sum_assignment

from ffd_lightning.losses.terms import SlicedWasserstein


def clouds(queries=2, templates=3, points=40):
    g = torch.Generator().manual_seed(0)
    pred = torch.rand(queries, templates, points, 3, generator=g) - 0.5
    target = torch.rand(queries, points, 3, generator=g) - 0.5
    return SimpleNamespace(pred_points=pred, target_points=target)


def test_moving_a_cloud_costs_the_square_of_the_way(unchecked):
    inputs = clouds(1, 1)
    way = torch.tensor([0.1, -0.2, 0.05])
    inputs.target_points = inputs.pred_points[:, 0] + way
    found = SlicedWasserstein(directions=20_000, points=41)(inputs)  # of 40, all
    assert float(found) == pytest.approx(1000 * float(way.square().sum()), rel=0.05)
    inputs.target_points = inputs.pred_points[:, 0].flip(1)
    assert float(SlicedWasserstein(8, 40)(inputs)) == pytest.approx(0, abs=1e-9)


def test_it_is_below_transport_in_space_and_sees_density_where_chamfer_does_not(unchecked):
    """Sliced W2 is at most W2; half of the points doubled up keep the Chamfer distance at 0."""
    inputs = clouds(1, 1, 60)
    inputs.target_points = inputs.pred_points[:, 0].clone()
    inputs.target_points[0, :30] = inputs.pred_points[0, 0, 30:]
    found = float(SlicedWasserstein(2000, 60)(inputs))
    a, b = inputs.pred_points[0, 0].double().numpy(), inputs.target_points[0].double().numpy()
    squared = ((a[:, None] - b[None]) ** 2).sum(-1)
    exact = 3000 * squared[linear_sum_assignment(squared)].mean()
    assert 0.02 * exact < found < exact


def test_every_template_has_a_cost_and_a_gradient(unchecked):
    inputs = clouds()
    inputs.pred_points.requires_grad_()
    torch.manual_seed(3)
    costs = SlicedWasserstein(4, 16)(inputs)
    assert costs.shape == (2, 3)
    costs.sum().backward()
    moved = inputs.pred_points.grad.abs().sum(-1) > 0
    assert moved.sum(-1).eq(16).all(), "as many points of each cloud as were asked for"
    torch.manual_seed(3)
    axes = torch.nn.functional.normalize(torch.empty(3, 4).normal_(), dim=0).numpy()
    every = 40 // 16
    a = np.sort(inputs.pred_points.detach().numpy()[1, 2, ::every][:16] @ axes, axis=0)
    b = np.sort(inputs.target_points.numpy()[1, ::every][:16] @ axes, axis=0)
    assert float(costs[1, 2].detach()) == pytest.approx(3000 * ((a - b) ** 2).mean(), rel=1e-4)
