"""From a run's configuration and checkpoint to what can be evaluated."""

from __future__ import annotations

import pickle
import zipfile
from pathlib import Path
from typing import NamedTuple

import torch
from omegaconf import DictConfig, OmegaConf

from ffd_lightning.config import TrainConfig, typed_config
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.data.run import build_preparations
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.lattice import num_control_points
from ffd_lightning.nn.network import TemplateFfdNetwork, build_encoder
from ffd_lightning.run_folder import RunFolder


def build_network(cfg: TrainConfig) -> TemplateFfdNetwork:
    """Build the network that a configuration describes, weights drawn from the global seed."""
    image_size = (cfg.data.render.height, cfg.data.render.width)
    encoder = build_encoder(
        kind=cfg.encoder.kind,
        name=cfg.encoder.name,
        width=cfg.encoder.width,
        weights=cfg.encoder.weights,
        pretrained=cfg.encoder.pretrained,
        batch_norm_momentum=cfg.network.batch_norm_momentum,
        image_size=image_size,
    )
    return TemplateFfdNetwork(
        encoder,
        image_size=image_size,
        num_templates=cfg.templates.count,
        num_control_points=num_control_points(cfg.network.degrees),
        bottleneck=cfg.network.bottleneck,
        hidden=cfg.network.hidden,
        min_weight=cfg.regime.min_weight,
        offset_std=cfg.network.offset_std,
        batch_norm_momentum=cfg.network.batch_norm_momentum,
    )


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


class OpenRun(NamedTuple):
    """A run folder opened: its settings, network and data, and the step that the weights are of."""

    config: TrainConfig
    network: TemplateFfdNetwork
    data: FfdDataModule
    step: int


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
    network = build_network(config)
    step = load_weights(network, checkpoint or run.checkpoint)
    data = build_data(config)
    data.setup()
    return OpenRun(config, network, data, step)


def load_weights(network: TemplateFfdNetwork, checkpoint: Path) -> int:
    """Load a checkpoint of training into a network and return the step it was made at.

    Raises:
        ConfigError: there is no such file, or it is of another network.
        DataError: it is damaged.
    """
    try:
        state = torch.load(checkpoint, map_location="cpu", weights_only=True)
        weights = {
            name.removeprefix("network."): value
            for name, value in state["state_dict"].items()
            if name.startswith("network.")
        }
        step = int(state["global_step"])
    except FileNotFoundError:
        raise ConfigError(
            f"there is no checkpoint {checkpoint}: train the run, or name one with checkpoint=FILE"
        ) from None
    except (OSError, RuntimeError, EOFError, KeyError, pickle.PickleError, zipfile.BadZipFile):
        raise DataError(f"the checkpoint {checkpoint} is damaged or no checkpoint") from None
    try:
        network.load_state_dict(weights)
    except RuntimeError as error:
        reason = str(error).splitlines()[1].strip() if "\n" in str(error) else str(error)
        raise ConfigError(f"the checkpoint {checkpoint} is of another network ({reason})") from None
    return step
