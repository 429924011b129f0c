"""Batch norm over the images of all devices, so that several train what one would."""

from typing import Any

import torch
from torch import Tensor, distributed
from torch.distributed.nn.functional import all_reduce
from torch.nn import functional
from torch.overrides import TorchFunctionMode


class SharedBatchStatistics(TorchFunctionMode):
    """Within it, batch norm in training takes mean and variance over all devices' images.

    Unlike `torch.nn.SyncBatchNorm` it works on CPUs, and for layers of any class: some encoders
    have batch norms of their own. Every device must have equally many images.
    """

    def __torch_function__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        function = _batch_norm if func is functional.batch_norm else func
        return function(*args, **(kwargs or {}))


def _batch_norm(
    images: Tensor,
    running_mean: Tensor | None,
    running_var: Tensor | None,
    weight: Tensor | None = None,
    bias: Tensor | None = None,
    training: bool = False,
    momentum: float = 0.1,
    eps: float = 1e-5,
) -> Tensor:
    """Stand for `torch.nn.functional.batch_norm`."""
    if not training:
        return functional.batch_norm(
            images, running_mean, running_var, weight, bias, False, momentum, eps
        )
    exact = images.to(torch.promote_types(images.dtype, torch.float32))
    own = torch.stack(torch.var_mean(exact, [0, *range(2, images.ndim)], correction=0))
    every = own.new_zeros(distributed.get_world_size(), *own.shape)
    every[distributed.get_rank()] = own
    variances, means = all_reduce(every).unbind(1)  # so is the gradient, of all devices' results
    mean = means.mean(0)
    variance = variances.mean(0) + (means - mean).square().mean(0)
    if running_mean is not None and running_var is not None:
        count = len(every) * images.numel() // images.shape[1]
        with torch.no_grad():
            running_mean.lerp_(mean.to(running_mean), momentum)
            running_var.lerp_((variance * (count / (count - 1))).to(running_var), momentum)
    scale = (variance + eps).rsqrt()
    scale = scale if weight is None else scale * weight
    shape = (1, -1, *[1] * (images.ndim - 2))
    result = (exact - mean.view(shape)) * scale.view(shape)
    result = result if bias is None else result + bias.view(shape)
    return result.to(images.dtype)
