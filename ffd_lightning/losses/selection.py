"""How template weights are taught: what costs of templates come to, and what logits learn."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor

from ffd_lightning.losses.terms import Prediction


class Teaching(NamedTuple):
    """What a selection makes of the templates' costs.

    Attributes:
        cost_weights: by which each template's cost counts, (q, T); gradients may flow through them.
        loss: a further loss of the logits, (), or None.
    """

    cost_weights: Float[Tensor, "queries templates"]
    loss: Tensor | None = None


Selection = Callable[[Prediction, Tensor], Teaching]
"""From a prediction and the templates' costs, (q, T) without gradients, to a `Teaching`."""


class WeightedCosts:
    r"""The paper's selection: costs count by f of the template weights, which learn through them.

    Args:
        function: `identity`, :math:`f(\gamma) = \gamma`; `log`,
            :math:`f(\gamma) = -\log(1 - \gamma)`, whose positive curvature punishes overconfident
            selection; or `square`, :math:`f(\gamma) = \gamma^2`.

    Raises:
        ValueError: another function.

    Source: the paper's equation 7; f of its section 4.1 and Table 2. `square` is in the authors'
    released code, and not used in the paper.
    """

    FUNCTIONS = ("identity", "log", "square")

    def __init__(self, function: str = "identity") -> None:
        if function not in self.FUNCTIONS:
            raise ValueError(f"function={function} must be one of {', '.join(self.FUNCTIONS)}")
        self.function = function

    def __call__(
        self, prediction: Prediction, costs: Float[Tensor, "queries templates"]
    ) -> Teaching:
        """Return f of the weights, (q, T)."""
        weights = prediction.template_weights
        if self.function == "identity":
            return Teaching(weights)
        return Teaching(log_weights(weights) if self.function == "log" else weights.square())


def log_weights(weights: Float[Tensor, "*shape"]) -> Float[Tensor, "*shape"]:
    r"""Return :math:`-\log(1 - \gamma)`, cut off where 1 - gamma is below the dtype's resolution.

    >>> log_weights(torch.tensor([0.0, 0.5]))
    tensor([0.0000, 0.6931])
    """
    return -torch.log1p(-weights.clamp(max=1 - torch.finfo(weights.dtype).eps))
