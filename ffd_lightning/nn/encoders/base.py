"""What every image encoder offers."""

from abc import abstractmethod

from torch import nn

from ffd_lightning.components import Component
from ffd_lightning.errors import ConfigError

BATCH_NORM_EPS = 1e-3
"""TensorFlow's."""


class ImageEncoder(nn.Module):
    """Turns standardised images into one feature map.

    Attributes:
        out_channels: channels of the feature map.
        component: what it was made of, if its class is a component; checkpoints name it.
    """

    out_channels: int
    component: Component | None = None

    @abstractmethod
    def output_size(self, image_size: tuple[int, int]) -> tuple[int, int]:
        """Return (h, w) of the feature map for images of (height, width) pixels.

        Raises:
            ConfigError: the encoder cannot take images of this size.
        """
        raise NotImplementedError

    def load_weights(self, source: str) -> None:
        """Take the first weights that `encoder.weights` names: a file, say.

        Raises:
            ConfigError: there are none of that name, or they are of another encoder.
        """
        raise ConfigError(
            f"encoder.weights={source}: {type(self).__name__} takes none: leave it out"
        )
