"""Terms of the objective, and selections."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ffd_lightning.app.parts.lazy import class_part, function_part
from ffd_lightning.registry import setting

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
class MeanChamfer:
    """1,000 x the Chamfer distance as a mean over points: the same for any number of points."""


function_part("term", "mean_chamfer", MeanChamfer, f"{_TERMS}:mean_chamfer")


@dataclass
class LatticeBending:
    """Squared second differences of each template's offsets: what bends a template costs."""


function_part("term", "lattice_bending", LatticeBending, f"{_TERMS}:lattice_bending")


@dataclass
class LatticeFolding:
    """What each template's deformation turns inside out, at the places of the control points."""


function_part("term", "lattice_folding", LatticeFolding, f"{_TERMS}:lattice_folding")


@dataclass
class SlicedWasserstein:
    """Sliced Wasserstein distance of each deformed template: what uneven density costs.

    Attributes:
        directions: on which the clouds are sorted, drawn anew in each step.
        points: of each cloud, at most.
    """

    directions: int = setting(8, within="(0, inf)")
    points: int = setting(256, within="(0, inf)")


class_part(
    "term",
    "sliced_wasserstein",
    SlicedWasserstein,
    "ffd_lightning.losses.transport:SlicedWasserstein",
)


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


@dataclass
class Posterior:
    """Selection learns which template costs least; all templates learn.

    Attributes:
        temperature: differences of costs far below it do not matter to the selection.
        uniform: share of the weights of costs that all templates have alike.
        within_category: with category=joint, images deform templates of their own category alone.
        weight: of what the logits learn from, beside the costs.
    """

    temperature: float = setting(0.5, within="(0, inf)")
    uniform: float = setting(0.5, within="[0, 1]")
    within_category: bool = True
    weight: float = setting(1.0, within="(0, inf)")


class_part("selection", "posterior", Posterior, "ffd_lightning.losses.selection:PosteriorTaught")
