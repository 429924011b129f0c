from types import SimpleNamespace

import numpy as np
import pytest
import torch

from ffd_lightning.losses.terms import SlicedWasserstein


def test_costs_and_gradients_are_of_points_sorted_along_each_direction(unchecked):
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
