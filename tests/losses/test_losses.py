import math

import numpy as np
import pytest
import torch
from ffd_lightning.losses.regularizers import negative_entropy, offset_penalty
from ffd_lightning.losses.weighting import weight_function

from ffd_lightning.app.config import Weighting
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.losses.annealing import exponential_annealing


def naive_chamfer(a, b):
    total = 0.0
    for x, y in ((a, b), (b, a)):
        for p in x:
            total += min(float(((p - q) ** 2).sum()) for q in y)
    return total


def test_chamfer_matches_loops():
    g = torch.Generator().manual_seed(0)
    a = torch.randn(2, 7, 3, generator=g, dtype=torch.float64)
    b = torch.randn(2, 5, 3, generator=g, dtype=torch.float64)
    expected = [naive_chamfer(x, y) for x, y in zip(a, b, strict=True)]
    np.testing.assert_allclose(chamfer_distance(a, b), expected)
    np.testing.assert_allclose(chamfer_distance(a, a), 0)


def test_chamfer_mean_is_per_direction_and_points_may_be_reordered(unchecked):
    g = torch.Generator().manual_seed(1)
    a, b = torch.randn(8, 3, generator=g), torch.randn(8, 3, generator=g)
    mean = chamfer_distance(a, b, "mean")
    torch.testing.assert_close(mean, chamfer_distance(a, b) / 8)
    torch.testing.assert_close(chamfer_distance(a.flip(0), b, "mean"), mean)
    torch.testing.assert_close(chamfer_distance(b, a, "mean"), mean)
    with pytest.raises(ValueError, match="reduction"):
        chamfer_distance(a, b, "max")


def test_log_weighting_is_the_formula_and_stays_finite():
    weights = torch.tensor([0.1, 0.9, 1.0], requires_grad=True)
    value = weight_function(weights, Weighting.log)
    assert value[:2].tolist() == pytest.approx([-math.log(0.9), -math.log(0.1)], rel=1e-5)
    value.sum().backward()
    assert torch.isfinite(value).all()
    assert torch.isfinite(weights.grad).all()
    assert weight_function(weights, Weighting.identity) is weights


def test_negative_entropy_bounds():
    even, one = torch.full((4, 5), 0.2), torch.eye(5)[[2, 2, 2, 2]]
    assert float(negative_entropy(even)) == pytest.approx(-math.log(5))
    assert float(negative_entropy(one)) == pytest.approx(0)
    # Confident but different choices are as even, over the batch, as indifferent ones.
    assert float(negative_entropy(torch.eye(5))) == pytest.approx(-math.log(5))


def test_offset_penalty_matches_loops():
    g = torch.Generator().manual_seed(0)
    weights, offsets = torch.rand(2, 3, generator=g), torch.randn(2, 3, 4, 3, generator=g)
    expected = sum(
        float(weights[q, t]) * float((offsets[q, t] ** 2).sum()) for q in range(2) for t in range(3)
    )
    assert float(offset_penalty(weights, offsets)) == pytest.approx(expected, rel=1e-5)


def test_annealing_falls_by_e_every_annealing_steps():
    assert exponential_annealing(0, 10) == 1
    assert exponential_annealing(30, 10) == pytest.approx(math.exp(-3))
    assert exponential_annealing(10**9, math.inf) == 1
