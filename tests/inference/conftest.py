"""A tiny trained run, whose checkpoint is all that inference is given."""

from pathlib import Path

import pytest
import torch

from ffd_lightning.run_folder import RunFolder
from ffd_lightning.training.run import train


@pytest.fixture(scope="session")
def tiny_run(tiny_config, tmp_path_factory):
    """A run of a few steps: its folder."""
    run = RunFolder(Path(tmp_path_factory.mktemp("runs")) / "run")
    train(tiny_config("regime=r", "templates=t4"), run)
    return run


@pytest.fixture(scope="session")
def checkpoint(tiny_run, tmp_path_factory):
    """The run's checkpoint, alone in a folder, with deformations large enough to be seen."""
    content = torch.load(tiny_run.checkpoint, weights_only=True)
    bias = content["state_dict"]["network.heads.offsets.bias"]
    bias.copy_(0.05 * torch.randn(bias.shape, generator=torch.Generator().manual_seed(0)))
    path = tmp_path_factory.mktemp("given") / "model.ckpt"
    torch.save(content, path)
    return path
