"""How template weights are taught: what costs of templates come to, and what logits learn."""

from collections.abc import Callable
from typing import Literal, NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor

from ffd_lightning.components import check_ranges, component, typed
from ffd_lightning.losses.terms import StepInput


class Teaching(NamedTuple):
    """What a selection makes of the templates' costs.

    Attributes:
        cost_weights: by which each template's cost counts, (q, T); gradients may flow through them.
        loss: a further loss of the logits, (), or None.
    """

    cost_weights: Float[Tensor, "queries templates"]
    loss: Tensor | None = None


Selection = Callable[[StepInput, Tensor], Teaching]
"""From a step, of all templates, and their costs, (q, T) without gradients, to a `Teaching`.

Selections that are an `nn.Module` may have parameters and buffers, as terms may."""


Function = Literal["identity", "log", "square"]
"""f of the template weights."""


@component("selection", "weighted")
class WeightedCosts:
    r"""Costs count by a function of the template weights, which learn through them (the paper).

    Args:
        function: `identity`, $f(\gamma) = \gamma$; `log`,
            $f(\gamma) = -\log(1 - \gamma)$, whose positive curvature punishes overconfident
            selection; or `square`, $f(\gamma) = \gamma^2$.

    Raises:
        ConfigError: another function.

    Source: the paper's equation 7; f of its section 4.1 and Table 2. `square` is in the authors'
    released code, and not used in the paper.
    """

    def __init__(self, function: Function = "identity") -> None:
        self.function: Function = typed(Function, function, "function")

    def __call__(self, inputs: StepInput, costs: Float[Tensor, "queries templates"]) -> Teaching:
        """Return f of the weights, (q, T)."""
        weights = inputs.prediction.template_weights
        if self.function == "log":  # cut off where 1 - gamma is below the dtype's resolution
            limit = 1 - torch.finfo(weights.dtype).eps
            return Teaching(-torch.log1p(-weights.clamp(max=limit)))
        return Teaching(weights.square() if self.function == "square" else weights)


@component("selection", "posterior")
class PosteriorTaught:
    r"""Selection learns which template costs least; all templates learn.

    $$ \pi^{(qt)} = \frac{e^{-c^{(qt)} / \tau}}{\sum_s e^{-c^{(qs)} / \tau}}, \quad
              w^{(qt)} = (1 - u) \pi^{(qt)} + u / T, \quad
              \lambda_s = -\sum_{q,t} \pi^{(qt)} \log \gamma_0^{(qt)} $$

    The posterior pi says how well each template serves an image, given what it costs now. The
    logits learn it by cross entropy; costs count by w, so that no template is left behind. No
    gradient flows from the costs to the logits, nor from the logits to the offsets.

    Args:
        temperature: tau, in the unit of the costs: differences far below it do not matter.
        uniform: u, the share of the weights that all templates have alike, in [0, 1].
        within_category: with category=joint, images deform templates of their own category alone;
            the logits, of all, learn the category too.
        weight: of what the logits learn from (lambda_s), beside the costs.

    Raises:
        ValueError: a temperature or weight that is not above 0, or a share outside [0, 1].
    """

    def __init__(
        self,
        temperature: float = 0.5,
        uniform: float = 0.5,
        within_category: bool = True,
        weight: float = 1.0,
    ) -> None:
        check_ranges(locals(), temperature="(0, inf)", uniform="[0, 1]", weight="(0, inf)")
        self.temperature, self.uniform = temperature, uniform
        self.within_category, self.weight = within_category, weight

    def __call__(self, inputs: StepInput, costs: Float[Tensor, "queries templates"]) -> Teaching:
        """Return weights from the posterior, (q, T), and the cross entropy, a sum over queries.

        Templates of infinite cost have weight 0.
        """
        posterior = (-costs / self.temperature).softmax(dim=1)
        possible = costs.isfinite().to(costs)  # quotients of bools are float32
        even = possible / possible.sum(1, keepdim=True)
        weights = (1 - self.uniform) * posterior + self.uniform * even
        log_probs = inputs.prediction.template_logits.log_softmax(dim=1)
        return Teaching(weights, -self.weight * (posterior * log_probs).sum())
