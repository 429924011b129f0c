"""How a template's weight enters the loss."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor

from ffd_lightning.app.config import Weighting


def weight_function(weights: Float[Tensor, "*shape"], kind: Weighting) -> Float[Tensor, "*shape"]:
    r"""Apply f to template weights: the identity, or :math:`f(\gamma) = -\log(1 - \gamma)`.

    The logarithm's positive curvature punishes overconfident selection. It is cut off where
    1 - gamma falls under the resolution of the dtype.

    Args:
        weights: gamma in [0, 1].
        kind: which f.

    Source: the paper's section 4.1, Table 2.

    >>> weight_function(torch.tensor([0.0, 0.5]), Weighting.log)
    tensor([0.0000, 0.6931])
    """
    if kind is Weighting.identity:
        return weights
    return -torch.log1p(-weights.clamp(max=1 - torch.finfo(weights.dtype).eps))
