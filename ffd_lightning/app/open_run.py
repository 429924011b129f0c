"""From a run folder to its settings, its network and its data."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from omegaconf import DictConfig, OmegaConf

from ffd_lightning.app.build import build_data
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.schema import typed_config
from ffd_lightning.checkpoint import load_model
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.errors import ConfigError
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.run_folder import RunFolder


class OpenRun(NamedTuple):
    """A run folder opened: its settings, network and data, and the step that the weights are of."""

    config: TrainConfig
    network: TemplateFfdNetwork
    data: FfdDataModule
    step: int


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
        loaded = OmegaConf.load(run.config)
        assert isinstance(loaded, DictConfig)
    except Exception as error:  # a YAML parser meets anything in a damaged file
        reason = str(error).split("\n")[0]
        raise ConfigError(f"{run.config} is damaged ({reason})") from None
    try:
        config = typed_config(loaded, TrainConfig)
    except ConfigError as error:
        raise ConfigError(f"{run.config} cannot be used here: {error}") from None
    if data_root is not None:
        config.paths.data = str(data_root)
    return config


def open_run(
    run: RunFolder, data_root: str | Path | None = None, checkpoint: Path | None = None
) -> OpenRun:
    """Open a run, finished or not, to look at what it predicts.

    Args:
        run: its folder.
        data_root: see `read_config`.
        checkpoint: another one than the run's newest.

    Raises:
        ConfigError: no run, no checkpoint, or one that does not fit.
        DataError: data that is missing or damaged.
    """
    config = read_config(run, data_root)
    model = load_model(checkpoint or run.checkpoint)
    data = build_data(config)
    data.setup()
    return OpenRun(config, model.network, data, model.step)
