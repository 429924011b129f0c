"""A run folder opened: what looking at its predictions needs."""

from collections.abc import Callable
from dataclasses import dataclass

from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.run_folder import RunFolder


@dataclass(frozen=True)
class OpenRun:
    """A run with its network, on the CPU, its data, and the training step of its weights."""

    folder: RunFolder
    network: TemplateFfdNetwork
    data: FfdDataModule
    step: int


RunOpener = Callable[[RunFolder], OpenRun]
"""Opens a run; raises a `UserError` where something of it is missing or does not fit."""
