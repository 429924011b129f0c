"""A term of the objective, and a selection."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

import ffd_lightning as ffd


@dataclass
class Smoothness:
    """Squared differences between the offsets of neighbouring control points."""


@ffd.register("term", "smoothness", Smoothness)
def smoothness(settings: Smoothness) -> Callable[[ffd.StepInput], Tensor]:
    """Return the term: a cost of every template for every query, (q, T)."""

    def term(inputs: ffd.StepInput) -> Tensor:
        sides = [degree + 1 for degree in inputs.templates.degrees]
        offsets = inputs.prediction.offsets.unflatten(2, sides)
        steps = (offsets.diff(dim=axis).square().sum((-1, -2, -3, -4)) for axis in (2, 3, 4))
        return sum(steps, torch.zeros(()))

    return term


@dataclass
class Taught:
    """Logits learn which template is best; offsets learn from all templates.

    Attributes:
        temperature: of the softmax over costs, in units of the mean cost.
    """

    temperature: float = 0.5


@ffd.register("selection", "taught", Taught)
def taught(settings: Taught) -> Callable[[ffd.StepInput, Tensor], ffd.Teaching]:
    """Return the selection."""

    def teach(inputs: ffd.StepInput, costs: Tensor) -> ffd.Teaching:
        scale = settings.temperature * costs.mean().clamp_min(1e-9)
        posterior = (-costs / scale).softmax(dim=1)
        shares = posterior / 2 + 1 / (2 * costs.shape[1])
        log_probs = inputs.prediction.template_logits.log_softmax(dim=1)
        return ffd.Teaching(shares, -(posterior * log_probs).sum())

    return teach
