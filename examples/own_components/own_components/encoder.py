"""An encoder: two convolutions on patches."""

from torch import Tensor, nn

import ffd_lightning as ffd


@ffd.component("encoder", "patches")
class Patches(ffd.ImageEncoder):
    """Two convolutions on patches of the image.

    Args:
        channels: of the feature map.
        size: of a patch, in pixels.
    """

    def __init__(self, channels: int = 16, size: int = 16) -> None:
        super().__init__()
        self.out_channels, self.size = channels, size
        self.layers = nn.Sequential(
            nn.Conv2d(3, channels, size, stride=size),
            nn.ReLU(),
            nn.Conv2d(channels, channels, 3, padding=1),
            nn.ReLU(),
        )

    def output_size(self, image_size: tuple[int, int]) -> tuple[int, int]:
        """Return (h, w) of the feature map."""
        return image_size[0] // self.size, image_size[1] // self.size

    def forward(self, images: Tensor) -> Tensor:
        """Return the feature map of standardised images, (q, 3, H, W)."""
        return self.layers(images)
