"""Keras' MobileNet weight files: the published ones and those that Keras 2 and 3 write."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from ffd_lightning.errors import ConfigError
from ffd_lightning.nn.encoders.mobilenet import STEM_CHANNELS, MobileNetV1

if TYPE_CHECKING:
    import h5py

# (layer, weight) in Keras' names.
_Key = tuple[str, str]

_KERNEL = ("kernel",)
_NORM = ("gamma", "beta", "moving_mean", "moving_variance")


def load_keras_weights(encoder: MobileNetV1, path: str | Path) -> None:
    """Copy a Keras MobileNet's weights and moving statistics into the encoder.

    Read are Keras 2's layout (the published ``mobilenet_2_5_192_tf_no_top.h5``), whole models
    saved as ``.h5``, and Keras 3's ``.weights.h5``. Other layers in the file, a top say, are
    ignored. Either everything is copied or nothing.

    Keras' ImageNet weights were trained on images scaled to [-1, 1]; here, as in the paper, images
    are standardised one by one, and the network adapts while it trains.

    Args:
        encoder: of the width that the file was written for.
        path: the HDF5 file.

    Raises:
        ConfigError: no such file, not HDF5, layers missing or of another shape; no h5py.
    """
    path = Path(path)
    if not path.is_file():
        raise ConfigError(f"encoder.weights: there is no file {path}")
    targets = dict(_keras_views(encoder))
    try:
        import h5py
    except ImportError:
        raise ConfigError(
            "encoder.weights: Keras' files need h5py: pip install 'ffd_lightning[keras]'"
        ) from None
    try:
        with h5py.File(path) as file:
            weights = _read_weights(file, encoder)
    except OSError as error:
        hint = " (of a .keras archive take model.weights.h5)" if path.suffix == ".keras" else ""
        raise ConfigError(f"encoder.weights: {path} is not a readable HDF5 file{hint}") from error
    _check(weights, targets, path)
    with torch.no_grad():
        for key, target in targets.items():
            target.copy_(torch.from_numpy(weights[key]))


def _keras_views(encoder: MobileNetV1) -> Iterator[tuple[_Key, Tensor]]:
    """Yield the encoder's tensors as views with Keras' order of axes."""
    for layer, module in encoder.layers.named_children():
        if isinstance(module, nn.Conv2d):
            # (h, w, channels, 1) for depthwise kernels, (h, w, in, out) for the others.
            axes = (2, 3, 0, 1) if module.groups > 1 else (2, 3, 1, 0)
            yield (layer, "kernel"), module.weight.detach().permute(axes)
        elif isinstance(module, nn.BatchNorm2d):
            tensors = (module.weight, module.bias, module.running_mean, module.running_var)
            for weight, tensor in zip(_NORM, tensors, strict=True):
                assert tensor is not None
                yield (layer, weight), tensor.detach()


def _read_weights(file: h5py.File, encoder: MobileNetV1) -> dict[_Key, NDArray[np.float32]]:
    """Return what the file holds for layers with the encoder's names, in any of the layouts."""
    layers = dict(encoder.layers.named_children())
    positions = _keras3_containers(layers)
    weights: dict[_Key, NDArray[np.float32]] = {}

    def visit(path: str, node: h5py.Group | h5py.Dataset) -> None:
        *groups, leaf = path.split("/")
        if not hasattr(node, "dtype") or not groups:  # a group
            return
        if groups[-1] == "vars":  # Keras 3: layers/<class>_<count>/vars/<number>
            layer = node.parent.attrs.get("name", positions.get("/".join(groups[-3:-1])))
            names = _NORM if str(layer).endswith("_bn") else _KERNEL
            weight = names[int(leaf)] if int(leaf) < len(names) else ""
        else:  # Keras 2: <layer>/<name scope>/<weight>:0; the scope may bear a number
            layer = next((group for group in reversed(groups) if group in layers), None)
            weight = leaf.removesuffix(":0").removeprefix("depthwise_")
        if layer in layers and weight:
            weights[layer, weight] = np.asarray(node, dtype=np.float32)

    # Beside the weights of a whole model lie the optimizer's, which bear the same names.
    file.get("model_weights", file).visititems(visit)
    return weights


def _keras3_containers(layers: dict[str, nn.Module]) -> dict[str, str]:
    """Map Keras 3's `layers/<class>_<count>` to layer names: early versions state no names."""
    counts: dict[str, int] = {}
    containers = {}
    for layer, module in layers.items():
        if isinstance(module, nn.Conv2d):
            kind = "depthwise_conv2d" if module.groups > 1 else "conv2d"
        elif isinstance(module, nn.BatchNorm2d):
            kind = "batch_normalization"
        else:
            continue
        count = counts.get(kind, 0)
        counts[kind] = count + 1
        containers[f"layers/{kind}_{count}" if count else f"layers/{kind}"] = layer
    return containers


def _check(
    weights: dict[_Key, NDArray[np.float32]], targets: dict[_Key, Tensor], path: Path
) -> None:
    if not weights:
        raise ConfigError(
            f"encoder.weights: {path} holds no layer of a MobileNet (conv1, conv_dw_1, ...): "
            "it takes a file that keras.applications.MobileNet wrote"
        )
    missing = [f"{layer}/{weight}" for layer, weight in targets if (layer, weight) not in weights]
    if missing:
        more = f" and {len(missing) - 4} more" if len(missing) > 4 else ""
        raise ConfigError(f"encoder.weights: {path} lacks {', '.join(missing[:4])}{more}")
    for (layer, weight), target in targets.items():
        found, expected = weights[layer, weight].shape, tuple(target.shape)
        if found != expected:
            hint = ""
            if layer == "conv1" and len(found) == 4:
                hint = f"; the file's width seems to be {found[-1] / STEM_CHANNELS:g}: "
                hint += "set encoder.width to it"
            raise ConfigError(
                f"encoder.weights: {path} has {weight} of layer {layer} as {found}, "
                f"the encoder needs {expected}{hint}"
            )
