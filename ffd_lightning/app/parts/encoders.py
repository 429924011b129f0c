"""Encoders: images to a feature map."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from omegaconf import MISSING

from ffd_lightning.errors import ConfigError
from ffd_lightning.registry import register, setting

KERAS_FILES: dict[float, str] = {
    0.25: "mobilenet_2_5_192_tf_no_top.h5",
    0.5: "mobilenet_5_0_192_tf_no_top.h5",
    0.75: "mobilenet_7_5_192_tf_no_top.h5",
    1.0: "mobilenet_1_0_192_tf_no_top.h5",
}
"""Keras' published ImageNet weights by width, of images of 192 x 192; the paper's is the first."""

KERAS_ADDRESS = "https://github.com/fchollet/deep-learning-models/releases/download/v0.6/"
"""Where they are; a file's name follows."""


@dataclass
class MobileNet:
    """MobileNet v1 without its top (the paper: width 0.25, ImageNet weights).

    Attributes:
        width: the width multiplier.
        weights: a Keras .h5 file, such as mobilenet_2_5_192_tf_no_top.h5; none trains from scratch,
            and is what is meant where nothing is said, but under schedule=paper, which asks.
    """

    width: float = 0.25
    weights: str | None = setting(None, only_start=True, default_said="none")

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        if not self.width > 0:
            raise ConfigError(f"encoder.width={self.width} must be above 0")
        if self.weights is not None and not Path(self.weights).expanduser().is_file():
            raise ConfigError(f"encoder.weights={self.weights} is not a file")
        if self.weights is not None and find_spec("h5py") is None:
            raise ConfigError(
                "encoder.weights: Keras' files need h5py: pip install 'ffd_lightning[keras]'"
            )


@register("encoder", "mobilenet", MobileNet)
def mobilenet(
    settings: MobileNet, image_size: tuple[int, int], batch_norm_momentum: float = 0.1
) -> Any:
    """Build MobileNet v1."""
    from ffd_lightning.nn.encoders.mobilenet import MobileNetV1

    encoder = MobileNetV1(settings.width, batch_norm_momentum)
    if settings.weights is not None:
        from ffd_lightning.nn.encoders.keras_weights import load_keras_weights

        load_keras_weights(encoder, Path(settings.weights).expanduser())
    return encoder


@dataclass
class Timm:
    """Any timm backbone: pip install 'ffd_lightning[timm]'.

    Attributes:
        model: its name there, resnet18 say.
        pretrained: downloads timm's weights.
    """

    model: str = MISSING
    pretrained: bool = setting(False, only_start=True)


@register("encoder", "timm", Timm)
def timm(settings: Timm, image_size: tuple[int, int], batch_norm_momentum: float = 0.1) -> Any:
    """Build a timm model, whose batch norms keep their own momentum."""
    from ffd_lightning.nn.encoders.timm import TimmEncoder

    return TimmEncoder(settings.model, settings.pretrained, image_size)
