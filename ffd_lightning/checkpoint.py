"""Checkpoints: the network of a configuration, its weights, and all that inference needs.

A checkpoint of training is one file that works alone: beside Lightning's own entries it holds
`model`, with the configuration, the templates and what the training images looked like.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from omegaconf import DictConfig, OmegaConf

from ffd_lightning.app.config import PathsConfig, TrainConfig, typed_config
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.lattice import num_control_points
from ffd_lightning.imaging.appearance import TrainingAppearance
from ffd_lightning.nn.network import TemplateFfdNetwork, build_encoder

_ENTRY = "model"


@dataclass(frozen=True)
class TrainedModel:
    """What a checkpoint holds.

    Attributes:
        config: of its training, but for `paths`.
        network: with the checkpoint's weights, in evaluation mode, on the CPU.
        bank: its templates.
        looks: of the images it was trained on.
        step: of the training.
    """

    config: TrainConfig
    network: TemplateFfdNetwork
    bank: TemplateBank
    looks: TrainingAppearance
    step: int


def model_entry(
    config: TrainConfig, bank: TemplateBank, looks: TrainingAppearance
) -> dict[str, dict[str, Any]]:
    """Return what a checkpoint needs beside the weights, for `load_model`."""
    settings = OmegaConf.structured(config)
    settings.paths = PathsConfig()  # it may be handed to others
    content = {
        "config": OmegaConf.to_yaml(settings),
        "templates": bank.state(),
        "looks": looks.state(),
    }
    return {_ENTRY: content}


def load_model(checkpoint: Path) -> TrainedModel:
    """Load a checkpoint, which needs nothing else.

    Raises:
        ConfigError: there is no such file, or it is of another version.
        DataError: it is damaged.
    """
    state = _load(checkpoint)
    if _ENTRY not in state:
        raise ConfigError(
            f"the checkpoint {checkpoint} holds no templates: it was made by an earlier version. "
            "The command of its training, with restart=true, trains it again"
        )
    try:
        content = state[_ENTRY]
        settings = OmegaConf.create(content["config"])
        assert isinstance(settings, DictConfig)
        config = typed_config(settings, TrainConfig)
        bank = TemplateBank.from_state(content["templates"])
        looks = TrainingAppearance.from_state(content["looks"])
    except Exception as error:
        reason = str(error).split("\n")[0]
        raise ConfigError(
            f"the checkpoint {checkpoint} is of another version or damaged ({reason})"
        ) from None
    config.encoder.weights, config.encoder.pretrained = None, False
    network = build_network(config)
    step = _put_weights(network, state, checkpoint)
    return TrainedModel(config, network.eval(), bank, looks, step)


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


def load_weights(network: TemplateFfdNetwork, checkpoint: Path) -> int:
    """Load a checkpoint of training into a network and return the step it was made at.

    Raises:
        ConfigError: there is no such file, or it is of another network.
        DataError: it is damaged.
    """
    return _put_weights(network, _load(checkpoint), checkpoint)


def _load(checkpoint: Path) -> dict[str, Any]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore"
            )  # of what may be wrong with a file that is no checkpoint
            state: dict[str, Any] = torch.load(checkpoint, map_location="cpu", weights_only=True)
        int(state["global_step"]), dict(state["state_dict"])
    except FileNotFoundError:
        raise ConfigError(
            f"there is no checkpoint {checkpoint}: train the run, or name one with checkpoint=FILE"
        ) from None
    except Exception:  # unpickling meets anything in a damaged file
        raise DataError(f"the checkpoint {checkpoint} is damaged or no checkpoint") from None
    return state


def _put_weights(network: TemplateFfdNetwork, state: dict[str, Any], checkpoint: Path) -> int:
    """Give a network a checkpoint's weights and return the step they are of."""
    weights = {
        name.removeprefix("network."): value
        for name, value in state["state_dict"].items()
        if name.startswith("network.")
    }
    try:
        network.load_state_dict(weights)
    except RuntimeError as error:
        reason = str(error).splitlines()[1].strip() if "\n" in str(error) else str(error)
        raise ConfigError(f"the checkpoint {checkpoint} is of another network ({reason})") from None
    return int(state["global_step"])
