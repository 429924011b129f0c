"""An augmentation: a change of training images."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

import ffd_lightning as ffd


@dataclass
class Specks:
    """Black specks on objects.

    Attributes:
        share: of the pixels.
    """

    share: float = 0.02


@ffd.register("augmentation", "specks", Specks)
def specks(settings: Specks) -> Callable[[Tensor], Tensor]:
    """Return the augmentation."""

    def change(images: Tensor) -> Tensor:  # (q, 4, H, W) uint8: RGB over white, and coverage
        rgb, coverage = images[:, :3], images[:, 3:]
        black = (torch.rand(coverage.shape, device=images.device) < settings.share).to(images.dtype)
        return torch.cat([torch.minimum(rgb, 255 - black * coverage), coverage], dim=1)

    return change
