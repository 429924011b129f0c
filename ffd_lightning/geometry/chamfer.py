"""The Chamfer distance between clouds, for training and the choice of templates."""

from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor

from ffd_lightning.geometry.nearest import nearest_neighbors


def chamfer_distance(
    pred_points: Float[Tensor, "*batch_a num_pred 3"],
    target_points: Float[Tensor, "*batch_b num_target 3"],
    reduction: Literal["sum", "mean"] = "sum",
) -> Float[Tensor, "*batch"]:
    r"""Return the squared Chamfer distance of each pair of clouds, both directions added.

    $$ \lambda_c(A, B) = \sum_{a \in A} \min_{b \in B} \|a - b\|^2
              + \sum_{b \in B} \min_{a \in A} \|b - a\|^2 $$

    Args:
        pred_points: (*batch_a, N, 3).
        target_points: (*batch_b, M, 3); batch shapes broadcast without copies.
        reduction: over points only. "sum" as the paper trains, "mean" per direction as it reports.

    Returns:
        One value per pair, (*batch,), in squared units of the points.

    Source: the paper's equation 1.

    >>> chamfer_distance(torch.zeros(1, 3), torch.tensor([[0.0, 0, 3], [0, 0, 1]]))
    tensor(11.)
    """
    if reduction not in ("sum", "mean"):
        raise ValueError(f"reduction={reduction!r} must be 'sum' or 'mean'")
    reduce = torch.sum if reduction == "sum" else torch.mean
    nearest = nearest_neighbors(pred_points, target_points)
    return reduce(nearest.a_to_b, -1) + reduce(nearest.b_to_a, -1)
