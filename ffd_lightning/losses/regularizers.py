"""The terms that promote variety and small deformations."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor


def negative_entropy(weights: Float[Tensor, "queries templates"]) -> Float[Tensor, ""]:
    r"""Negative entropy of the batch's mean weights, in nats.

    .. math:: \lambda_e = \sum_t \bar\gamma^{(t)} \log \bar\gamma^{(t)}

    Lowest, -log T, when the batch as a whole uses all templates evenly; single queries may still
    be confident.

    Args:
        weights: template weights, (q, T).

    Source: the paper's section 4.1, explicit entropy penalty.
    """
    mean = weights.mean(0)
    return torch.xlogy(mean, mean).sum()


def offset_penalty(
    weights: Float[Tensor, "queries templates"],
    offsets: Float[Tensor, "queries templates num_control_points 3"],
) -> Float[Tensor, ""]:
    r"""Weighted squared norm of the offsets.

    .. math:: \lambda_r = \sum_{q,t} \gamma^{(qt)} |\Delta P^{(qt)}|^2

    Args:
        weights: template weights, (q, T).
        offsets: control point offsets, (q, T, M, 3), in units of the templates.

    Source: the paper's section 4.1, deformation regularization.
    """
    return (weights * offsets.square().sum((-1, -2))).sum()
