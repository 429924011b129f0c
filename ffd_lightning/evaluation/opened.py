"""A run folder opened: what looking at its predictions needs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.run_folder import RunFolder


@dataclass(frozen=True)
class OpenRun:
    """A run with its network and data.

    Attributes:
        folder: that it was opened from.
        network: with the weights of a checkpoint, on the CPU.
        data: set up: prepared shapes, templates and split.
        step: of the training that the weights are from.
    """

    folder: RunFolder
    network: TemplateFfdNetwork
    data: FfdDataModule
    step: int


RunOpener = Callable[[RunFolder], OpenRun]
"""Opens a run; raises a `UserError` where something of it is missing or does not fit."""
