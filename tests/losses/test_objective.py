import math
from typing import NamedTuple

import pytest
import torch

from ffd_lightning.app.config import Weighting
from ffd_lightning.geometry.deformation import TemplateSample
from ffd_lightning.losses.objective import Objective


class Prediction(NamedTuple):
    template_weights: torch.Tensor
    offsets: torch.Tensor


Q, T, N, M = 3, 2, 6, 8


@pytest.fixture
def case():
    g = torch.Generator().manual_seed(0)

    def rand(*shape):
        return torch.rand(*shape, generator=g, dtype=torch.float64)

    weights = rand(Q, T)
    weights = weights / weights.sum(1, keepdim=True)
    prediction = Prediction(weights.requires_grad_(), (rand(Q, T, M, 3) - 0.5).requires_grad_())
    matrix = rand(T, N, M)
    matrix = matrix / matrix.sum(-1, keepdim=True)
    return prediction, rand(Q, N, 3), TemplateSample(matrix, rand(T, M, 3))


def by_hand(case, f, entropy_weight, offset_weight, fade):
    """The paper's equations with plain loops."""
    prediction, target, (matrix, control) = case
    weights, offsets = (x.detach() for x in prediction)
    chamfer = torch.zeros(Q, T, dtype=torch.float64)
    total = 0.0
    for q in range(Q):
        for t in range(T):
            points = matrix[t] @ (control[t] + offsets[q, t])
            d = ((points[:, None] - target[q][None]) ** 2).sum(-1)
            chamfer[q, t] = d.min(1).values.sum() + d.min(0).values.sum()
            total += f(float(weights[q, t])) * float(chamfer[q, t])
            penalty = float(weights[q, t] * (offsets[q, t] ** 2).sum())
            total += fade * offset_weight * penalty
    for t in range(T):
        mean = float(weights[:, t].mean())
        total += fade * entropy_weight * mean * math.log(mean)
    return total, chamfer


@pytest.mark.parametrize(
    ("kind", "f"),
    [(Weighting.identity, lambda g: g), (Weighting.log, lambda g: -math.log(1 - g))],
)
@pytest.mark.parametrize("weights", [(0, 0), (100, 0), (0, 1), (3, 2)])
@pytest.mark.parametrize("step", [0, 7])
def test_total_is_the_papers_sum(case, kind, f, weights, step):
    objective = Objective(kind, *weights, annealing_steps=5)
    total, terms = objective(*case, step)
    expected, chamfer = by_hand(case, f, *weights, math.exp(-step / 5))
    assert float(total.detach()) == pytest.approx(expected, rel=1e-9)
    best = case[0].template_weights.argmax(1)
    assert float(terms["chamfer"]) == pytest.approx(
        float(chamfer[torch.arange(Q), best].mean()) / N
    )


def test_terms_are_unweighted_and_carry_no_graph(case):
    _, plain = Objective(Weighting.identity, 0, 0, 1)(*case, 0)
    total, weighted = Objective(Weighting.identity, 50, 3, 1)(*case, 0)
    assert total.requires_grad
    for name, term in plain.items():
        torch.testing.assert_close(weighted[name], term)
        assert not term.requires_grad


def test_gradients_reach_weights_and_offsets(case):
    prediction, target, templates = case
    objective = Objective(Weighting.log, 2.0, 0.5, 10)

    def f(weights, offsets):
        return objective(Prediction(weights, offsets), target, templates, 3)[0]

    assert torch.autograd.gradcheck(f, tuple(prediction))
