"""An optimizer of torch's, and what becomes of its learning rate."""

import torch
from torch.optim.lr_scheduler import LambdaLR

import ffd_lightning as ffd

ffd.component("optimizer", "rmsprop")(torch.optim.RMSprop)


@ffd.component("lr_schedule", "linear")
class Linear(LambdaLR):
    """It falls in a straight line.

    Args:
        last: share of the learning rate that is left at the end.
    """

    def __init__(
        self, optimizer: torch.optim.Optimizer, total_steps: int, last: float = 0.1
    ) -> None:
        if not 0 <= last <= 1:
            raise ValueError(f"last={last} must lie in [0, 1]")
        super().__init__(optimizer, lambda step: 1 - (1 - last) * min(step / total_steps, 1))
