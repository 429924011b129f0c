"""MobileNet weights in files that Keras wrote, the published ones among them."""

import os
from pathlib import Path

import torch
from torch import nn

from ffd_lightning.errors import ConfigError
from ffd_lightning.nn.encoders.mobilenet import MobileNetV1

_SIZE = 64  # pixels; no weight depends on it
_OF_LAYER = ("weight", "bias", "running_mean", "running_var")  # as Keras has them


def load_keras_weights(encoder: MobileNetV1, path: str | Path) -> None:
    """Copy a Keras MobileNet's weights and moving statistics into the encoder.

    Keras itself reads the file into its own MobileNet without a top: the published
    `mobilenet_2_5_192_tf_no_top.h5`, whole models (`.h5`, `.keras`) and `.weights.h5`. Its ImageNet
    weights were trained on images scaled to [-1, 1]; here, as in the paper, images are
    standardised one by one, and the network adapts while it trains.

    Raises:
        ConfigError: Keras is not installed, or the file is damaged or of another network; the
            encoder is then as it was.
    """
    os.environ.setdefault("KERAS_BACKEND", "torch")
    try:
        import keras
    except ImportError:
        raise ConfigError(
            "encoder.weights: Keras reads this file: pip install 'ffd_lightning[keras]'"
        ) from None
    model = keras.applications.MobileNet(
        input_shape=(_SIZE, _SIZE, 3), alpha=encoder.width, include_top=False, weights=None
    )
    try:
        model.load_weights(str(path))
    except Exception as error:  # whatever Keras and HDF5 raise on other files
        reason = " ".join(str(error).split())[:300]
        raise ConfigError(
            f"encoder.weights: {path} holds no MobileNet of width {encoder.width:g} without a top "
            f"(encoder.width must be the file's): {reason}"
        ) from None
    for name, module in encoder.layers.named_children():
        if isinstance(module, nn.Conv2d | nn.BatchNorm2d):
            weights = [torch.from_numpy(w) for w in model.get_layer(name).get_weights()]
            if isinstance(module, nn.Conv2d):
                # (h, w, channels, 1) for depthwise kernels, (h, w, in, out) for the others.
                axes = (2, 3, 0, 1) if module.groups > 1 else (3, 2, 0, 1)
                weights = [weights[0].permute(axes)]
            # Keras does not count batches, which the module does.
            module.load_state_dict(dict(zip(_OF_LAYER, weights, strict=False)), strict=False)
