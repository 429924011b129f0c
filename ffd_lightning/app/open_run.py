"""From a run folder to what can be evaluated: its network, its templates and its data."""

from __future__ import annotations

from pathlib import Path

from omegaconf import DictConfig, OmegaConf

from ffd_lightning.app.config import TrainConfig, typed_config
from ffd_lightning.app.prepare import build_preparations
from ffd_lightning.checkpoint import build_network, load_weights
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.opened import OpenRun
from ffd_lightning.run_folder import RunFolder


def build_data(cfg: TrainConfig) -> FfdDataModule:
    """Build the data module that a configuration describes; nothing is read yet."""
    return FfdDataModule(
        preparations=build_preparations(cfg),
        split=cfg.data.split,
        split_file=cfg.data.split_file,
        train_fraction=cfg.data.train_fraction,
        num_templates=cfg.templates.count,
        template_strategy=cfg.templates.strategy,
        template_file=cfg.templates.file,
        template_seed=cfg.templates.seed,
        hold_out=cfg.templates.hold_out,
        degrees=cfg.network.degrees,
        max_edge=cfg.templates.max_edge,
        batch_size=cfg.schedule.batch_size,
        num_points=cfg.schedule.num_points,
        steps=cfg.schedule.steps,
        seed=cfg.seed,
        residency=cfg.data.residency,
        num_workers=cfg.trainer.num_workers,
    )


def read_config(run: RunFolder, data_root: str | Path | None = None) -> TrainConfig:
    """Read the settings of a run, without the encoder's first weights: a checkpoint brings all.

    Args:
        run: its folder.
        data_root: where its prepared data is (`paths.data`), if not where it was.

    Raises:
        ConfigError: it is no run folder, or its `config.yaml` is damaged or of another version.
    """
    if not run.config.is_file():
        raise ConfigError(f"{run.path} is not a run folder: it has no config.yaml")
    try:
        loaded = OmegaConf.load(run.config)
        assert isinstance(loaded, DictConfig)
        config = typed_config(loaded, TrainConfig)
    except Exception as error:
        reason = str(error).split("\n")[0]
        raise ConfigError(f"{run.config} is of another version or damaged ({reason})") from None
    if data_root is not None:
        config.paths.data = str(data_root)
    config.encoder.weights, config.encoder.pretrained = None, False
    return config


def open_run(
    run: RunFolder, data_root: str | Path | None = None, checkpoint: Path | None = None
) -> OpenRun:
    """Open a run, finished or not, to look at what it predicts; its data is not prepared anew.

    Args:
        run: its folder.
        data_root: see `read_config`.
        checkpoint: another one than the run's newest.

    Raises:
        ConfigError: no run, no checkpoint, or one that does not fit.
        DataError: data that is missing or damaged.
    """
    config = read_config(run, data_root)
    data = build_data(config)
    for preparation in data.preparations:
        if not preparation.target.is_dir():
            raise DataError(
                f"the prepared data of {run.path} is not there: {preparation.target}. "
                "data_root=DIR names the folder that it is in; ffd prepare makes it"
            )
    network = build_network(config)
    step = load_weights(network, checkpoint or run.checkpoint)
    data.setup()
    return OpenRun(run, config.data.render, network, data, step)
