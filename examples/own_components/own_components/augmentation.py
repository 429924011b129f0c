"""An augmentation: a change of training images."""

import torch
from torch import Tensor

import ffd_lightning as ffd


@ffd.component("augmentation", "specks")
class Specks:
    """Black specks on objects.

    Args:
        share: of the pixels.
    """

    def __init__(self, share: float = 0.02) -> None:
        if not 0 <= share <= 1:
            raise ValueError(f"share={share} must lie in [0, 1]")
        self.share = share

    def __call__(self, images: Tensor) -> Tensor:
        """Return (q, 4, H, W) uint8, RGB over white and coverage, of the same objects."""
        rgb, coverage = images[:, :3], images[:, 3:]
        black = (torch.rand(coverage.shape, device=images.device) < self.share).to(images.dtype)
        return torch.cat([torch.minimum(rgb, 255 - black * coverage), coverage], dim=1)
