"""What becomes of the learning rate over a training, step by step."""

from torch.optim import Optimizer
from torch.optim.lr_scheduler import CosineAnnealingLR, LRScheduler, OneCycleLR

from ffd_lightning.components import check_ranges, component


@component("lr_schedule", "none")
def constant(optimizer: Optimizer) -> None:
    """It stays as it is."""


@component("lr_schedule", "cosine")
def cosine(optimizer: Optimizer, total_steps: int) -> LRScheduler:
    """It falls to 0 along half a cosine."""
    return CosineAnnealingLR(optimizer, T_max=total_steps)


@component("lr_schedule", "one_cycle")
def one_cycle(optimizer: Optimizer, total_steps: int, warm_up: float = 0.1) -> LRScheduler:
    """It rises once, to schedule.learning_rate, and falls to almost nothing.

    Args:
        optimizer: whose rate it is.
        total_steps: of the training.
        warm_up: share of the steps until the highest rate.
    """
    check_ranges(locals(), warm_up="[0, 1)")
    highest = [group["lr"] for group in optimizer.param_groups]
    # OneCycleLR divides by the steps of the warm-up less one; of fewer steps it makes no warm-up.
    share = 0.0 if total_steps * warm_up == 1 else warm_up
    return OneCycleLR(
        optimizer, highest, total_steps=total_steps, pct_start=share, cycle_momentum=False
    )
