"""The clouds that metrics take: numpy or torch, checked, and results of the same kind."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

Points: TypeAlias = Tensor | NDArray[np.floating]
"""Positions in numpy or torch, on any device."""


def as_clouds(points: Points, name: str) -> Tensor:
    """Return clouds as a checked floating tensor without a gradient, where they are.

    Args:
        points: (*batch, N, 3).
        name: what to call them in messages.

    Raises:
        ValueError: another shape, no points, or values that are not finite.
    """
    if isinstance(points, Tensor):
        tensor = points.detach()
    else:
        # A copy where torch could not share it: read-only, strided backwards, foreign byte order.
        array = np.asarray(points)
        array = array.astype(array.dtype.newbyteorder("="))
        tensor = torch.from_numpy(array)
    if tensor.ndim < 2 or tensor.shape[-1] != 3:
        raise ValueError(f"{name} must be (*batch, N, 3), got {tuple(tensor.shape)}")
    if tensor.shape[-2] == 0:
        raise ValueError(f"{name} holds no points")
    if not tensor.is_floating_point():
        tensor = tensor.double()
    if not torch.isfinite(tensor).all():
        raise ValueError(f"{name} holds values that are not finite")
    return tensor


def as_pairs(pred_points: Points, target_points: Points) -> tuple[Tensor, Tensor, torch.Size]:
    """Return clouds as `as_clouds` does, and the shape of the batch of their pairs.

    Args:
        pred_points: (*batch_a, N, 3).
        target_points: (*batch_b, M, 3).

    Raises:
        ValueError: as `as_clouds`, or batches that do not go together or hold no pair.
    """
    pred, target = as_clouds(pred_points, "pred_points"), as_clouds(target_points, "target_points")
    shapes = f"{tuple(pred.shape)} and {tuple(target.shape)}"
    try:
        batch = torch.broadcast_shapes(pred.shape[:-2], target.shape[:-2])
    except RuntimeError as error:
        raise ValueError(f"the batches of {shapes} do not go together") from error
    if 0 in batch:
        raise ValueError(f"there is no pair in {shapes}")
    return pred, target, batch


def as_given(value: Tensor, *inputs: Any) -> Any:
    """Return a result as a tensor if any input was one, else as numpy (a float for one value)."""
    if any(isinstance(x, Tensor) for x in inputs):
        return value
    array = value.cpu().numpy()
    return float(array) if array.ndim == 0 else array
