"""Count what a training step of the paper's configuration asks of a processor.

    python docs/tools/step_cost.py

32 images of 192 x 256, 30 templates, 1,024 points. Of the network, forward and backward, and Adam,
with a sum in the place of the loss, it prints how many operations torch is asked for, the memory
that these read and write (each its arguments and results, views left out), and the floating-point
operations of convolutions and matrix products. To these come those of the nearest neighbours: 8
for each of 32 x 30 x 1,024 x 1,024 distances, both directions found at once. Deforming the clouds
and drawing the batch, 2% of a step on a processor, are left out. docs/findings/shapenet.md reckons
from all this what a GPU takes.
"""

from typing import Any

import torch
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves
from torch.utils.flop_counter import FlopCounterMode

from ffd_lightning.nn.encoders.mobilenet import MobileNetV1
from ffd_lightning.nn.network import TemplateFfdNetwork

IMAGES, TEMPLATES, POINTS = 32, 30, 1024
_PER_DISTANCE = 8


class _Traffic(TorchDispatchMode):
    """Counts operations and the bytes of their tensors."""

    def __init__(self) -> None:
        super().__init__()
        self.calls, self.bytes = 0, 0

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        result = func(*args, **(kwargs or {}))
        if not func.is_view:
            tensors = [x for x in tree_leaves((args, kwargs, result)) if torch.is_tensor(x)]
            self.calls += 1
            self.bytes += sum(x.numel() * x.element_size() for x in tensors)
        return result


def main() -> None:
    """See the top of this file."""
    network = TemplateFfdNetwork(MobileNetV1(), (192, 256), TEMPLATES, 64)
    adam = torch.optim.Adam(network.parameters(), fused=True)
    images = torch.randint(0, 256, (IMAGES, 3, 192, 256), dtype=torch.uint8)
    with FlopCounterMode(display=False) as flops, _Traffic() as traffic:
        found = network(images)
        (found.offsets.square().sum() + found.template_logits.square().sum()).backward()
        adam.step()
    nearest = _PER_DISTANCE * IMAGES * TEMPLATES * POINTS**2
    print(f"operations: {traffic.calls:,}")
    print(f"memory: {traffic.bytes / 1e9:.2f} GB")
    print(f"convolutions and products: {flops.get_total_flops() / 1e9:.1f} GFLOP")
    print(f"nearest neighbours: {nearest / 1e9:.1f} GFLOP")


if __name__ == "__main__":
    main()
