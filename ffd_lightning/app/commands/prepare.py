"""`ffd prepare`: prepared data, without training."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from ffd_lightning.app.config import PrepareConfig
from ffd_lightning.app.configuration import run_hydra

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
    from ffd_lightning.data.templates.summary import outlier_note, outlier_rows

    for preparation in build_preparations(cfg):
        prepared = preparation.run()
        if note := outlier_note(prepared, outlier_rows(prepared)):
            print(f"{preparation.category}: {note}", file=sys.stderr)
