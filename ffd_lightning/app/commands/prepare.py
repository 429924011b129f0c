"""`ffd prepare`: prepared data, without training."""

from __future__ import annotations

from collections.abc import Sequence

from ffd_lightning.app.config import PrepareConfig
from ffd_lightning.app.hydra_app import run_hydra

SCHEMA = PrepareConfig


def main(arguments: Sequence[str]) -> None:
    """Prepare what the command line names."""
    run_hydra("prepare", PrepareConfig, prepare, arguments)


def prepare(cfg: PrepareConfig) -> None:
    """Prepare a category, or several.

    Raises:
        ConfigError: settings that cannot work.
        DataError: no usable shape, or a disk that is full or not writable.
    """
    from ffd_lightning.app.checks import validate

    validate(cfg)
    from ffd_lightning.app.build import build_preparations

    for preparation in build_preparations(cfg):
        preparation.run()
