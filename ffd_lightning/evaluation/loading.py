"""From a run's configuration and checkpoint to what can be evaluated."""

from __future__ import annotations

import pickle
import zipfile
from pathlib import Path

import torch

from ffd_lightning.config import TrainConfig
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.data.run import build_preparations
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.lattice import num_control_points
from ffd_lightning.nn.network import TemplateFfdNetwork, build_encoder


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
