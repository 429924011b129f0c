"""Terms of the objective, and selections."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ffd_lightning.app.parts.lazy import class_part, function_part

_TERMS = "ffd_lightning.losses.terms"


class Weighting(Enum):
    """f of the weighted costs."""

    identity = "identity"
    log = "log"
    square = "square"


@dataclass
class Chamfer:
    """Chamfer distance of each deformed template."""


function_part("term", "chamfer", Chamfer, f"{_TERMS}:chamfer")


@dataclass
class NegativeEntropy:
    """Negative entropy of the batch's mean template weights."""


function_part("term", "negative_entropy", NegativeEntropy, f"{_TERMS}:negative_entropy")


@dataclass
class OffsetPenalty:
    """Squared norm of the offsets under the template weights."""


function_part("term", "offset_penalty", OffsetPenalty, f"{_TERMS}:offset_penalty")


@dataclass
class UniformPenalty:
    """Squared norm of the offsets of all templates alike, whatever their weights."""


function_part(
    "term",
    "uniform_penalty",
    UniformPenalty,
    f"{_TERMS}:uniform_penalty",
)


@dataclass
class Weighted:
    """Costs count by a function of the template weights, which learn through them (the paper).

    Attributes:
        function: `identity`, `log`, which punishes overconfident selection, or `square`.
    """

    function: Weighting = Weighting.identity


class_part("selection", "weighted", Weighted, "ffd_lightning.losses.selection:WeightedCosts")
