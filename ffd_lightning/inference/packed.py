"""A checkpoint made small, to be handed on: what predictions need, and no more."""

from __future__ import annotations

import io
from pathlib import Path

import torch

from ffd_lightning.checkpoint import TrainedModel, load_model, read_checkpoint
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.inference.files import write_file

NUM_POINTS = 2048
"""So many points of each template's cloud are kept. Predictions are of the meshes, kept whole."""


def write_packed(checkpoint: Path, out: Path, model: TrainedModel | None = None) -> None:
    """Write a checkpoint without the optimizer's state and with weights of half the size.

    Matrices and kernels are rounded to float16; vectors stay as they are: they are few, and the
    variances of batch norm may be larger than float16 holds. `load_model` reads the file as it
    reads any other, and computes in float32. A file that is there is replaced, and never left half
    written.

    Args:
        checkpoint: the file.
        out: the file to write.
        model: what `load_model` gives of the checkpoint, told other templates if that is wanted.

    Raises:
        ConfigError: `out` is the checkpoint itself, or the checkpoint cannot be used.
        DataError: it is damaged, its weights are too large, or the file cannot be written.
    """
    if out.exists() and out.samefile(checkpoint):
        raise ConfigError(f"out={out} is the checkpoint itself: name another file")
    model, content = model or load_model(checkpoint), read_checkpoint(checkpoint)
    weights = {n: v for n, v in content["state_dict"].items() if n.startswith("network.")}
    network = {name: value.half() if value.ndim > 1 else value for name, value in weights.items()}
    for name, value in network.items():
        if not value.isfinite().all():
            raise DataError(f"{name} has values that float16 cannot hold: its training diverged")
    templates = model.bank.lighter(NUM_POINTS).state()
    entry = {**content["model"], "templates": templates}
    if model.network.heads.conditioned:
        entry["template_codes"] = model.network.template_codes.cpu()
        entry["strangers"] = model.network.strangers
    packed = {
        "global_step": model.step,
        "state_dict": network,
        "model": entry,
    }
    buffer = io.BytesIO()
    torch.save(packed, buffer)
    write_file(out, buffer.getvalue())
