"""MobileNet v1 as Keras defines it."""

from pathlib import Path

from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from ffd_lightning.components import component
from ffd_lightning.errors import ConfigError
from ffd_lightning.nn.encoders.base import BATCH_NORM_EPS, ImageEncoder

# (output channels at width 1, stride) of the depthwise separable blocks 1 to 13.
_BLOCKS = (
    (64, 1),
    (128, 2),
    (128, 1),
    (256, 2),
    (256, 1),
    (512, 2),
    *((512, 1),) * 5,
    (1024, 2),
    (1024, 1),
)
STEM_CHANNELS = 32


class SamePadConv2d(nn.Conv2d):
    """A 3 x 3 convolution of stride 2 padded as TensorFlow's "same": ceil(n / 2) outputs.

    An even size is padded by one at the end only, an odd size by one on both sides. Symmetric
    padding on even sizes, PyTorch's habit, would move every feature by half an output pixel.
    """

    def forward(self, input: Float[Tensor, "q c h w"]) -> Float[Tensor, "q d h2 w2"]:
        """Pad, then convolve."""
        top, left = (size % 2 for size in input.shape[2:])
        return super().forward(functional.pad(input, (left, 1, top, 1)))


class EndPadConv2d(nn.Conv2d):
    """A 3 x 3 convolution of stride 2 padded by one at the end whatever the size: n // 2 outputs.

    Keras' MobileNet does this in front of its strided depthwise layers (`ZeroPadding2D`).
    """

    def forward(self, input: Float[Tensor, "q c h w"]) -> Float[Tensor, "q d h2 w2"]:
        """Pad, then convolve."""
        return super().forward(functional.pad(input, (0, 1, 0, 1)))


@component("encoder", "mobilenet")
class MobileNetV1(ImageEncoder):
    """MobileNet v1 without its top (the paper: width 0.25, ImageNet weights).

    It is `keras.applications.MobileNet`, layer for layer.

    Convention:
        Children of `layers` bear Keras' layer names (``conv1``, ``conv_dw_1``, ``conv_pw_1_bn``,
        ...), so that a weight file's names are the state dict's names. Keras counts batch norm's
        momentum the other way round: its 0.99 is 0.01 here.

    Convolutions start from Glorot's uniform distribution, Keras' default, not PyTorch's.

    Args:
        width: the width multiplier alpha; a layer has int(alpha * c) channels.
        batch_norm_momentum: share of a new batch in the moving statistics.

    Raises:
        ValueError: a width that leaves a layer without channels.

    Source: Howard et al. 2017, "MobileNets", table 1; Keras for padding and epsilon.
    """

    def __init__(self, width: float = 0.25, batch_norm_momentum: float = 0.1) -> None:
        super().__init__()
        channels = int(STEM_CHANNELS * width)
        if channels < 1:
            least = 1 / STEM_CHANNELS
            raise ValueError(f"width={width:g} leaves no channels: use {least} or more")
        self.width, self.layers = width, nn.Sequential()

        def add(name: str, conv: nn.Conv2d) -> None:
            nn.init.xavier_uniform_(conv.weight)
            norm = nn.BatchNorm2d(conv.out_channels, BATCH_NORM_EPS, batch_norm_momentum)
            self.layers.add_module(name, conv)
            self.layers.add_module(f"{name}_bn", norm)
            # Not in place: autograd would then clone the input first, one pass over memory more.
            self.layers.add_module(f"{name}_relu", nn.ReLU6())

        add("conv1", SamePadConv2d(3, channels, 3, stride=2, bias=False))
        for i, (base, stride) in enumerate(_BLOCKS, start=1):
            depthwise = (
                nn.Conv2d(channels, channels, 3, padding=1, groups=channels, bias=False)
                if stride == 1
                else EndPadConv2d(channels, channels, 3, stride=2, groups=channels, bias=False)
            )
            add(f"conv_dw_{i}", depthwise)
            add(f"conv_pw_{i}", nn.Conv2d(channels, int(base * width), 1, bias=False))
            channels = int(base * width)
        self.out_channels = channels

    def output_size(self, image_size: tuple[int, int]) -> tuple[int, int]:
        """Return (h, w) of the feature map; `conv1` rounds a half pixel up, the others down.

        Raises:
            ConfigError: images so small that nothing is left of them.

        >>> MobileNetV1().output_size((192, 256))
        (6, 8)
        """
        height, width = ((size + 1) // 2 // 16 for size in image_size)
        if min(height, width) < 1:
            raise ConfigError(
                f"images of {image_size[0]}x{image_size[1]} pixels are too small for MobileNet: "
                "use 31x31 or more"
            )
        return height, width

    def load_weights(self, source: str) -> None:
        """Take the weights of a Keras file, see `load_keras_weights`."""
        from ffd_lightning.nn.encoders.keras_weights import load_keras_weights

        file = Path(source).expanduser()
        if not file.is_file():
            raise ConfigError(f"encoder.weights={source} is not a file")
        load_keras_weights(self, file)

    def forward(self, images: Float[Tensor, "q 3 height width"]) -> Float[Tensor, "q c h w"]:
        """Return the last feature map of standardised images."""
        return self.layers(images)
