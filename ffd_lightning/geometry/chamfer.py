"""The Chamfer distance between clouds, for training, metrics and the choice of templates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, TypeAlias

from jaxtyping import Float
from torch import Tensor

from ffd_lightning.geometry.nearest import NearestNeighbors, nearest_neighbors

Reduction: TypeAlias = Literal["sum", "mean"] | Callable[[Tensor], Tensor]
"""What becomes of one direction's squared distances, (*batch, N): one value a pair, (*batch,)."""


def chamfer_distance(
    pred_points: Float[Tensor, "*batch_a num_pred 3"],
    target_points: Float[Tensor, "*batch_b num_target 3"],
    reduction: Reduction = "sum",
) -> Float[Tensor, "*batch"]:
    r"""Squared Chamfer distance of each pair of clouds, both directions added.

    .. math:: \lambda_c(A, B) = \sum_{a \in A} \min_{b \in B} \|a - b\|^2
              + \sum_{b \in B} \min_{a \in A} \|b - a\|^2

    Args:
        pred_points: (*batch_a, N, 3).
        target_points: (*batch_b, M, 3); batch shapes broadcast without copies.
        reduction: over points only. "sum" as the paper trains, "mean" per direction as it reports,
            or a function of the squared distances of one direction.

    Returns:
        One value per pair, (*batch,), in squared units of the points.

    Raises:
        ValueError: unknown reduction, or clouds that `nearest_neighbors` refuses.

    Source: the paper's equation 1.

    >>> import torch
    >>> chamfer_distance(torch.zeros(1, 3), torch.tensor([[0.0, 0, 3], [0, 0, 1]]))
    tensor(11.)
    """
    if not callable(reduction) and reduction not in ("sum", "mean"):
        raise ValueError(f"reduction must be 'sum' or 'mean', got {reduction!r}")
    return chamfer_of(nearest_neighbors(pred_points, target_points), reduction)


def chamfer_of(nearest: NearestNeighbors, reduction: Reduction) -> Float[Tensor, "*batch"]:
    """Return the Chamfer distance of clouds whose nearest neighbours are known.

    Args:
        nearest: of both clouds.
        reduction: see `chamfer_distance`.

    Returns:
        One value per pair, (*batch,).
    """
    if reduction == "sum":
        return nearest.a_to_b.sum(-1) + nearest.b_to_a.sum(-1)
    if reduction == "mean":
        return nearest.a_to_b.mean(-1) + nearest.b_to_a.mean(-1)
    return reduction(nearest.a_to_b) + reduction(nearest.b_to_a)
