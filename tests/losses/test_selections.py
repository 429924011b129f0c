import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from ffd_lightning.errors import ConfigError
from ffd_lightning.losses.selection import PosteriorTaught, WeightedCosts, log_weights


def step(**prediction):
    return SimpleNamespace(prediction=SimpleNamespace(**prediction))


def test_log_weights_are_the_formula_and_stay_finite():
    weights = torch.tensor([0.1, 0.9, 1.0], requires_grad=True)
    value = log_weights(weights)
    assert value[:2].tolist() == pytest.approx([-math.log(0.9), -math.log(0.1)], rel=1e-5)
    value.sum().backward()
    assert torch.isfinite(value).all()
    assert torch.isfinite(weights.grad).all()


def test_costs_count_by_a_function_of_the_weights(unchecked):
    weights = torch.tensor([[0.25, 0.75]])
    inputs = step(template_weights=weights)
    costs = torch.tensor([[5.0, 7.0]])
    same, loss = WeightedCosts()(inputs, costs)
    assert same is weights
    assert loss is None
    logs, loss = WeightedCosts("log")(inputs, costs)
    assert torch.equal(logs, log_weights(weights))
    assert loss is None
    squares, loss = WeightedCosts("square")(inputs, costs)
    np.testing.assert_array_equal(squares, np.array([[0.0625, 0.5625]]))
    assert loss is None
    with pytest.raises(ConfigError, match="function=root must be one of identity, log, square"):
        WeightedCosts("root")


def test_the_posterior_teaches_the_logits_and_shares_the_costs_out(unchecked):
    rng = np.random.default_rng(0)
    logits, costs = rng.normal(size=(5, 4)), rng.uniform(0, 9, size=(5, 4))
    given = torch.tensor(logits, requires_grad=True)
    select = PosteriorTaught(temperature=2.0, uniform=0.25)
    weights, loss = select(step(template_logits=given), torch.tensor(costs))
    posterior = np.exp(-costs / 2)
    posterior /= posterior.sum(1, keepdims=True)
    np.testing.assert_allclose(weights, 0.75 * posterior + 0.25 / 4)
    log_probs = logits - np.log(np.exp(logits).sum(1, keepdims=True))
    assert float(loss.detach()) == pytest.approx(-(posterior * log_probs).sum())
    loss.backward()
    probs = np.exp(log_probs)
    np.testing.assert_allclose(given.grad, probs - posterior, atol=1e-12)
    assert not weights.requires_grad, "costs teach the logits through the loss alone"


def test_the_temperature_says_which_differences_matter(unchecked):
    costs = torch.tensor([[1.0, 1.1, 50.0]])
    inputs = step(template_logits=torch.zeros(1, 3))
    cold, _ = PosteriorTaught(0.001, 0)(inputs, costs)
    warm, _ = PosteriorTaught(1.0, 0)(inputs, costs)
    np.testing.assert_allclose(cold, [[1, 0, 0]], atol=1e-6)
    assert warm[0, 0] - warm[0, 1] < 0.06
    assert warm[0, 2] < 1e-20
    for temperature, uniform in ((0, 0.5), (-1, 0.5), (1, 1.5), (1, -0.1)):
        with pytest.raises(ValueError, match="must"):
            PosteriorTaught(temperature, uniform)


def test_the_cross_entropy_has_a_weight(unchecked):
    costs, inputs = torch.rand(3, 4), step(template_logits=torch.rand(3, 4))
    plain, heavy = (PosteriorTaught(weight=weight)(inputs, costs) for weight in (1, 3))
    assert torch.equal(plain.cost_weights, heavy.cost_weights)
    torch.testing.assert_close(heavy.loss, 3 * plain.loss)
    with pytest.raises(ValueError, match="weight=0 must be above 0"):
        PosteriorTaught(weight=0)
