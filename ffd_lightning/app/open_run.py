"""From a run folder to its settings, its network and its data."""

from __future__ import annotations

from pathlib import Path

import yaml

from ffd_lightning.app.build import build_data
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.configuration import typed_config
from ffd_lightning.checkpoint import load_model
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.opened import OpenRun
from ffd_lightning.run_folder import RunFolder


def read_config(run: RunFolder, data_root: str | Path | None = None) -> TrainConfig:
    """Read the settings of a run.

    Args:
        run: its folder.
        data_root: where its prepared data is (`paths.data`), if not where it was.

    Raises:
        ConfigError: it is no run folder, its `config.yaml` is damaged or of another version, or a
            part of it comes from a package that is not here.
    """
    if not run.config.is_file():
        raise ConfigError(f"{run.path} is not a run folder: it has no config.yaml")
    try:
        loaded = yaml.safe_load(run.config.read_text(encoding="utf-8"))
        if not isinstance(loaded, dict):
            raise ValueError("it is no mapping")
    except (OSError, ValueError, yaml.YAMLError) as error:
        reason = str(error).split("\n")[0]
        raise ConfigError(f"{run.config} is damaged ({reason})") from None
    try:
        config = typed_config(loaded, TrainConfig)
    except ConfigError as error:
        raise ConfigError(f"{run.config} cannot be used here: {error}") from None
    if data_root is not None:
        config.paths.data = str(data_root)
    return config


def missing_data(run: RunFolder, data: FfdDataModule) -> DataError | None:
    """Return the error for prepared data that is not where a run has it, None if all is there."""
    for preparation in data.preparations:
        if not preparation.target.is_dir():
            return DataError(
                f"the prepared data of {run.path} is not there: {preparation.target}. "
                "data_root=DIR names the folder that it is in; ffd prepare makes it"
            )
    return None


def open_run(
    run: RunFolder,
    data_root: str | Path | None = None,
    checkpoint: Path | None = None,
    prepare: bool = False,
) -> OpenRun:
    """Open a run, finished or not, to look at what it predicts.

    Args:
        run: its folder.
        data_root: see `read_config`.
        checkpoint: another one than the run's newest.
        prepare: prepare its data anew where it is not there, instead of raising.

    Raises:
        ConfigError: no run, no checkpoint, or one that does not fit.
        DataError: data that is missing or damaged.
    """
    config = read_config(run, data_root)
    data = build_data(config)
    if not prepare and (missing := missing_data(run, data)) is not None:
        raise missing
    file = checkpoint or run.checkpoint
    model = load_model(file)
    data.setup()
    if model.bank.ids != data.bank.ids:
        raise ConfigError(
            f"the checkpoint {file} is of another network: its templates are not {run.path}'s"
        )
    return OpenRun(run, model.network, data, model.step)
