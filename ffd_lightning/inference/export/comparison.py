"""An exported graph held against the network that it was made of."""

from __future__ import annotations

import copy
from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor

from ffd_lightning.checkpoint import TrainedModel
from ffd_lightning.errors import DataError
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.rendering import render
from ffd_lightning.inference.export.graph import DTYPES, OUTPUTS, in_order

_BATCHES = (1, 3, 8)


def check_images(model: TrainedModel) -> dict[str, Tensor]:
    """Return images to compare on, eight of each kind, (8, 3, H, W) uint8.

    Noise, white, one grey, and the templates seen from all sides.
    """
    height, width = model.network.image_size
    shape = (max(_BATCHES), 3, height, width)
    noise = torch.randint(0, 256, shape, generator=torch.Generator().manual_seed(0))
    meshes = model.bank.meshes
    pictures = [
        render(meshes[k % len(meshes)], Camera(45 * k), height=height, width=width, samples=1)
        for k in range(max(_BATCHES))
    ]
    return {
        "noise": noise.to(torch.uint8),
        "white": torch.full(shape, 255, dtype=torch.uint8),
        "grey": torch.full(shape, 101, dtype=torch.uint8),
        "templates": torch.from_numpy(np.stack(pictures)[..., :3]).permute(0, 3, 1, 2),
    }


@torch.no_grad()
def compare(
    model: TrainedModel,
    content: bytes,
    dtype: str = "uint8",
    images: Mapping[str, Tensor] | None = None,
) -> dict[str, float]:
    """Hold an ONNX graph, as onnxruntime runs it on the CPU, against torch in float64.

    Args:
        model: what the graph was made of.
        content: the graph's bytes.
        dtype: of its images.
        images: (8, 3, H, W) by kind; by default `check_images`.

    Returns:
        Largest absolute difference of each output, over all images in batches of 1, 3 and 8.

    Raises:
        DataError: outputs that are not finite.
    """
    import onnxruntime

    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    exact = copy.deepcopy(model.network).double()
    largest = dict.fromkeys(OUTPUTS, 0.0)
    for kind in (check_images(model) if images is None else images).values():
        truth = [output.numpy() for output in in_order(exact(kind.double()))]
        for size in _BATCHES:
            batch = kind[:size].to(DTYPES[dtype]).contiguous().numpy()
            outputs = session.run(list(OUTPUTS), {"images": batch})
            for name, output, expected in zip(OUTPUTS, outputs, truth, strict=True):
                difference = float(np.abs(output - expected[:size]).max())
                if not np.isfinite(difference):
                    raise DataError(f"the network's {name} are not finite: its training diverged")
                largest[name] = max(largest[name], difference)
    return largest
