import math
from typing import NamedTuple

import numpy as np
import pytest
import torch

from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.deformation import TemplateSample, bending_energy
from ffd_lightning.losses.terms import (
    LatticeBending,
    LatticeFolding,
    StepInput,
    chamfer,
    mean_chamfer,
    negative_entropy,
    offset_penalty,
    uniform_penalty,
)


class Prediction(NamedTuple):
    template_weights: torch.Tensor
    offsets: torch.Tensor
    template_logits: torch.Tensor


def step_input(weights, offsets=None, batch_weights=None):
    """A step of which only the prediction matters."""
    queries, templates = weights.shape
    prediction = Prediction(
        weights, torch.zeros(queries, templates, 1, 3) if offsets is None else offsets, weights
    )
    control = torch.zeros(templates, prediction.offsets.shape[2], 3)
    sample = TemplateSample(torch.ones(templates, 5, control.shape[1]), control)
    given = weights if batch_weights is None else batch_weights
    return StepInput(prediction, torch.zeros(queries, 5, 3), sample, 0, given)


def test_chamfer_is_that_of_each_template_deformed_for_each_query():
    g = torch.Generator().manual_seed(0)
    offsets, targets = torch.randn(2, 3, 4, 3, generator=g), torch.randn(2, 7, 3, generator=g)
    sample = TemplateSample(torch.rand(3, 6, 4, generator=g), torch.randn(3, 4, 3, generator=g))
    weights = torch.full((2, 3), 1 / 3)
    found = chamfer(StepInput(Prediction(weights, offsets, weights), targets, sample, 0, weights))
    for q in range(2):
        for t in range(3):
            points = sample.deformation_matrix[t] @ (sample.control_points[t] + offsets[q, t])
            torch.testing.assert_close(found[q, t], chamfer_distance(points, targets[q]))


@pytest.mark.parametrize("points", [4, 8])
def test_the_mean_chamfer_distance_is_in_thousandths_of_points(points):
    g = torch.Generator().manual_seed(0)
    sample = TemplateSample(torch.rand(1, points, 4, generator=g), torch.rand(1, 4, 3, generator=g))
    weights, offsets = torch.ones(2, 1), torch.zeros(2, 1, 4, 3)
    targets = torch.rand(2, points, 3, generator=g)
    inputs = StepInput(Prediction(weights, offsets, weights), targets, sample, 0, weights)
    expected = [
        [1000 * chamfer_distance(inputs.pred_points[q, 0], targets[q], "mean")] for q in range(2)
    ]
    torch.testing.assert_close(mean_chamfer(inputs), torch.tensor(expected))


def test_bending_is_that_of_each_templates_offsets():
    offsets = torch.randn(2, 3, 24, 3, generator=torch.Generator().manual_seed(0))
    inputs = step_input(torch.full((2, 3), 1 / 3), offsets)
    expected = bending_energy(offsets, (1, 2, 3))
    torch.testing.assert_close(LatticeBending([1, 2, 3])(inputs), expected)
    cube = step_input(torch.full((2, 3), 1 / 3), torch.zeros(2, 3, 64, 3))
    assert LatticeBending()(cube).shape == (2, 3)
    with pytest.raises(ConfigError, match=r"set the term's degrees to network\.degrees"):
        LatticeBending()(inputs)


def test_folding_is_what_is_turned_inside_out():
    cube = torch.stack(torch.meshgrid(*[torch.linspace(0, 1, 4)] * 3, indexing="ij"), -1)
    control_points = torch.stack([cube.reshape(-1, 3), cube.reshape(-1, 3) * torch.rand(3)])
    stretch = torch.tensor([[4.0, 1, 1], [-0.5, 1, 1], [-2.0, -1, -1], [-1, -1, 1]])
    offsets = (control_points[None] * (stretch[:, None, None] - 1)).requires_grad_()
    weights = torch.full((4, 2), 0.5)
    sample = TemplateSample(torch.rand(2, 5, 64), control_points)
    prediction = Prediction(weights, offsets, weights)
    found = LatticeFolding()(StepInput(prediction, torch.rand(4, 5, 3), sample, 0, weights))
    # Stretched and turned by half a turn: nothing; through itself: what is turned.
    expected = torch.tensor([0.0, 0.25, 4.0, 0.0]).log1p()[:, None].expand(4, 2)
    torch.testing.assert_close(found, expected)
    (gradient,) = torch.autograd.grad(found.sum(), offsets)
    assert (gradient.abs().amax((1, 2, 3)) > 0).tolist() == [False, True, True, False]


def test_what_is_costly_is_computed_once():
    inputs = step_input(torch.full((2, 3), 1 / 3))
    assert inputs.chamfer is inputs.chamfer is chamfer(inputs)
    assert inputs.pred_points is inputs.pred_points


def test_negative_entropy_bounds():
    even, one = torch.full((4, 5), 0.2), torch.eye(5)[[2, 2, 2, 2]]
    assert float(negative_entropy(step_input(even))) == pytest.approx(-math.log(5))
    assert float(negative_entropy(step_input(one))) == pytest.approx(0)
    # Confident but different choices are as even, over the batch, as indifferent ones.
    assert float(negative_entropy(step_input(torch.eye(5)))) == pytest.approx(-math.log(5))


def test_negative_entropy_is_of_the_whole_batch_where_devices_share_it():
    share, batch = torch.eye(4)[:2], torch.eye(4)
    found = negative_entropy(step_input(share, batch_weights=batch))
    assert float(found) == pytest.approx(-math.log(4))


def test_offset_penalty_matches_loops():
    g = torch.Generator().manual_seed(0)
    weights, offsets = torch.rand(2, 3, generator=g), torch.randn(2, 3, 4, 3, generator=g)
    expected = sum(
        float(weights[q, t]) * float((offsets[q, t] ** 2).sum()) for q in range(2) for t in range(3)
    )
    assert float(offset_penalty(step_input(weights, offsets))) == pytest.approx(expected, rel=1e-5)


def test_the_uniform_penalty_does_not_ask_for_weights():
    g = torch.Generator().manual_seed(1)
    weights, offsets = torch.rand(2, 3, generator=g), torch.randn(2, 3, 4, 3, generator=g)
    expected = np.linalg.norm(offsets.numpy().reshape(-1)) ** 2
    for given in (weights, torch.zeros_like(weights)):
        found = float(uniform_penalty(step_input(given, offsets)))
        assert found == pytest.approx(expected, rel=1e-5)
