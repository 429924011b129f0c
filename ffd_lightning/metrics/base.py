"""What the metrics share: checked input of either kind, and means over pairs for torchmetrics."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torchmetrics import Metric

Points: TypeAlias = Tensor | NDArray[np.floating]
"""Positions in numpy or torch, on any device."""


def as_clouds(points: Points, name: str) -> Tensor:
    """Return clouds as a checked floating tensor, where they are.

    Args:
        points: (*batch, N, 3).
        name: what to call them in messages.

    Raises:
        ValueError: another shape, no points, or values that are not finite.
    """
    if isinstance(points, Tensor):
        tensor = points
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


def as_given(value: Tensor, *inputs: Any) -> Any:
    """Return a result as a tensor if any input was one, else as numpy (a float for one value)."""
    if any(isinstance(x, Tensor) for x in inputs):
        return value
    array = value.cpu().numpy()
    return float(array) if array.ndim == 0 else array


class MeanOverPairs(Metric):
    """Mean over all pairs seen; subclasses say in `score` what one batch of pairs scores.

    States are summed over processes, so any number of devices gives the mean over all pairs.
    """

    higher_is_better = False
    full_state_update = False
    total: Tensor
    count: Tensor

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        # float64: sums of many small values must not depend on the order of batches noticeably.
        self.add_state("total", torch.zeros((), dtype=torch.float64), dist_reduce_fx="sum")
        self.add_state("count", torch.zeros((), dtype=torch.float64), dist_reduce_fx="sum")

    def score(self, pred: Any, target: Any) -> Tensor:
        """Return the values of a batch of pairs, (*batch,)."""
        raise NotImplementedError

    def update(self, pred: Any, target: Any) -> None:
        """Add a batch of pairs."""
        values = self.score(pred, target)
        self.total += values.double().sum().to(self.total.device)
        self.count += values.numel()

    def compute(self) -> Tensor:
        """Return the mean.

        Raises:
            ValueError: no pair was added.
        """
        if self.count == 0:
            raise ValueError("no pairs were added: call update first")
        return self.total / self.count
