import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from ffd_lightning import registry
from ffd_lightning.losses.selection import WeightedCosts, log_weights


def test_log_weights_are_the_formula_and_stay_finite():
    weights = torch.tensor([0.1, 0.9, 1.0], requires_grad=True)
    value = log_weights(weights)
    assert value[:2].tolist() == pytest.approx([-math.log(0.9), -math.log(0.1)], rel=1e-5)
    value.sum().backward()
    assert torch.isfinite(value).all()
    assert torch.isfinite(weights.grad).all()


def test_costs_count_by_a_function_of_the_weights(unchecked):
    weights = torch.tensor([[0.25, 0.75]])
    prediction = SimpleNamespace(template_weights=weights)
    costs = torch.tensor([[5.0, 7.0]])
    same, loss = WeightedCosts()(prediction, costs)
    assert same is weights
    assert loss is None
    logs, loss = WeightedCosts("log")(prediction, costs)
    assert torch.equal(logs, log_weights(weights))
    assert loss is None
    squares, loss = WeightedCosts("square")(prediction, costs)
    np.testing.assert_array_equal(squares, np.array([[0.0625, 0.5625]]))
    assert loss is None
    with pytest.raises(ValueError, match="function=root must be one of identity, log, square"):
        WeightedCosts("root")


def test_it_is_registered():
    from ffd_lightning.app.parts.objective import Weighting

    assert registry.part("selection", "weighted").function == "identity"
    for function in Weighting:
        found = registry.part("selection", "weighted", function=function).function
        assert found == function.value
    assert [function.value for function in Weighting] == list(WeightedCosts.FUNCTIONS)
