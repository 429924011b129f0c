"""What every image encoder offers."""

from __future__ import annotations

from torch import nn

from ffd_lightning.registry import Part

BATCH_NORM_EPS = 1e-3
"""TensorFlow's."""


class ImageEncoder(nn.Module):
    """Turns standardised images into one feature map.

    Attributes:
        out_channels: channels of the feature map.
        part: what it was built from, where the registry built it; checkpoints name it.
    """

    out_channels: int
    part: Part | None = None

    def output_size(self, image_size: tuple[int, int]) -> tuple[int, int]:
        """Return (h, w) of the feature map for images of (height, width) pixels.

        Raises:
            ConfigError: the encoder cannot take images of this size.
        """
        raise NotImplementedError
