from types import SimpleNamespace

import numpy as np
import pytest
import torch

from ffd_lightning.errors import ConfigError
from ffd_lightning.losses.selection import PosteriorTaught, WeightedCosts


def step(**prediction):
    return SimpleNamespace(prediction=SimpleNamespace(**prediction))


def test_costs_count_by_a_function_of_the_weights(unchecked):
    weights = torch.tensor([[0.25, 0.75, 1.0]], requires_grad=True)
    inputs, costs = step(template_weights=weights), torch.tensor([[5.0, 7.0, 9.0]])
    found, loss = WeightedCosts("square")(inputs, costs)
    assert found.tolist() == [[0.0625, 0.5625, 1]]
    assert loss is None
    found, _ = WeightedCosts("log")(inputs, costs)
    found.sum().backward()
    assert torch.isfinite(found).all()
    assert torch.isfinite(weights.grad).all()
    with pytest.raises(ConfigError, match="function=root must be one of identity, log, square"):
        WeightedCosts("root")


def test_the_posterior_teaches_the_logits_and_shares_the_costs_out(unchecked):
    rng = np.random.default_rng(0)
    logits, costs = rng.normal(size=(5, 3)), rng.uniform(0, 9, size=(5, 3))
    given = torch.tensor(logits, requires_grad=True)
    select = PosteriorTaught(temperature=2.0, uniform=0.25, weight=3)
    weights, loss = select(step(template_logits=given), torch.tensor(costs))
    posterior = np.exp(-costs / 2)
    posterior /= posterior.sum(1, keepdims=True)
    np.testing.assert_allclose(weights, 0.75 * posterior + 0.25 / 3, rtol=1e-12)
    log_probs = logits - np.log(np.exp(logits).sum(1, keepdims=True))
    assert float(loss.detach()) == pytest.approx(-3 * (posterior * log_probs).sum())
    loss.backward()
    probs = np.exp(log_probs)
    np.testing.assert_allclose(given.grad, 3 * (probs - posterior), atol=1e-12)
    assert not weights.requires_grad, "costs teach the logits through the loss alone"
