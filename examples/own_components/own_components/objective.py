"""A term of the objective, and a selection."""

import torch
from torch import Tensor

import ffd_lightning as ffd


@ffd.component("term", "smoothness")
class Smoothness:
    """Squared differences between the offsets of neighbouring control points."""

    def __call__(self, inputs: ffd.StepInput) -> Tensor:
        """Return a cost of every template for every query, (q, T)."""
        sides = [degree + 1 for degree in inputs.templates.degrees]
        offsets = inputs.prediction.offsets.unflatten(2, sides)
        steps = (offsets.diff(dim=axis).square().sum((-1, -2, -3, -4)) for axis in (2, 3, 4))
        return sum(steps, torch.zeros(()))


@ffd.component("selection", "taught")
class Taught:
    """Logits learn which template is best; offsets learn from all templates.

    Args:
        temperature: of the softmax over costs, in units of the mean cost.
    """

    def __init__(self, temperature: float = 0.5) -> None:
        self.temperature = temperature

    def __call__(self, inputs: ffd.StepInput, costs: Tensor) -> ffd.Teaching:
        """Return by what each template's cost counts, and a loss of the logits."""
        scale = self.temperature * costs.mean().clamp_min(1e-9)
        posterior = (-costs / scale).softmax(dim=1)
        shares = posterior / 2 + 1 / (2 * costs.shape[1])
        log_probs = inputs.prediction.template_logits.log_softmax(dim=1)
        return ffd.Teaching(shares, -(posterior * log_probs).sum())
