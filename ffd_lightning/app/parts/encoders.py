"""Encoders: images to a feature map."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from omegaconf import MISSING

from ffd_lightning.errors import ConfigError
from ffd_lightning.pretrained import pretrained_digest, pretrained_model
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


EMBEDDED_WIDTH = 0.25
"""Of the encoder that comes with the package."""


def meant_weights(said: str | None, settings: Any) -> str:
    """Return what first weights are meant; `embedded` is followed by which those are."""
    if said not in (None, "embedded"):
        return str(said)
    if said is None and settings.width != EMBEDDED_WIDTH:
        return "none"
    try:
        return f"embedded-{pretrained_digest()}"
    except ConfigError:
        return said or "none"  # what is said and cannot be had, `check` refuses


@dataclass
class MobileNet:
    """MobileNet v1 without its top (the paper: width 0.25, ImageNet weights).

    Attributes:
        width: the width multiplier.
        weights: a Keras .h5 file, such as mobilenet_2_5_192_tf_no_top.h5; embedded, the encoder of
            the trained model that comes with the package, which was trained on 13 categories of the
            embedded dataset, its shapes to test on left out; none trains from scratch. Where
            nothing is said, embedded is meant, of another width none; schedule=paper asks.
    """

    width: float = setting(0.25, within="(0, inf)")
    weights: str | None = setting(None, only_start=True, meaning=meant_weights)

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        if _is_embedded(self.weights):
            _embedded_weights(self)
            return
        if self.weights in (None, "none"):
            return
        if not Path(self.weights).expanduser().is_file():
            raise ConfigError(f"encoder.weights={self.weights} is not a file")
        if find_spec("h5py") is None:
            raise ConfigError(
                "encoder.weights: Keras' files need h5py: pip install 'ffd_lightning[keras]'"
            )

    def checkpoint(self) -> Path | None:
        """Return the checkpoint that the first weights are of, None where there is none."""
        return pretrained_model() if _is_embedded(self.weights) else None


@register("encoder", "mobilenet", MobileNet)
def mobilenet(
    settings: MobileNet, image_size: tuple[int, int], batch_norm_momentum: float = 0.1
) -> Any:
    """Build MobileNet v1."""
    from ffd_lightning.nn.encoders.mobilenet import MobileNetV1

    encoder = MobileNetV1(settings.width, batch_norm_momentum)
    if _is_embedded(settings.weights):
        encoder.load_state_dict(_embedded_weights(settings))
    elif settings.weights not in (None, "none"):
        from ffd_lightning.nn.encoders.keras_weights import load_keras_weights

        load_keras_weights(encoder, Path(settings.weights).expanduser())
    return encoder


def _is_embedded(weights: str | None) -> bool:
    return weights is not None and re.fullmatch(r"embedded(-[0-9a-f]{8})?", weights) is not None


def _embedded_weights(settings: MobileNet) -> dict[str, Any]:
    """Return the encoder's weights of the trained model that comes with the package.

    Raises:
        ConfigError: there is none, or another one, or its encoder is of another width.
    """
    from ffd_lightning.checkpoint import read_checkpoint

    here = meant_weights("embedded", settings)
    if here == "embedded":
        raise ConfigError(
            "encoder.weights=embedded: this installation has no trained model: leave it out"
        )
    if settings.weights != here:
        raise ConfigError(f"encoder.weights={settings.weights}: the model here is {here}")
    content = read_checkpoint(pretrained_model())
    encoder = content["model"]["encoder"]
    width = encoder["settings"].get("width")
    if encoder["name"] != "mobilenet" or width != settings.width:
        raise ConfigError(
            f"encoder.weights=embedded is of encoder={encoder['name']} of width {width}, not of "
            f"{settings.width:g}: leave encoder.width out"
        )
    weights, prefix = content["state_dict"], "network.encoder."
    return {k.removeprefix(prefix): v for k, v in weights.items() if k.startswith(prefix)}


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
