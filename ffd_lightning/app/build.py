"""Composition: from typed settings to objects. Nothing else knows both."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import torch
from torch.optim import Optimizer
from torch.optim.lr_scheduler import CosineAnnealingLR, LRScheduler, OneCycleLR

from ffd_lightning import registry
from ffd_lightning.app.config import (
    GROUPS,
    LearningRateDecay,
    PrepareConfig,
    RegimeConfig,
    TrainConfig,
)
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.source import Source
from ffd_lightning.errors import ConfigError
from ffd_lightning.evaluation.protocols import EvaluationProtocol
from ffd_lightning.geometry.lattice import num_control_points
from ffd_lightning.losses.annealing import make_annealing
from ffd_lightning.losses.objective import Objective, WeightedTerm
from ffd_lightning.nn.encoders.base import ImageEncoder
from ffd_lightning.nn.network import TemplateFfdNetwork, shrunk_size
from ffd_lightning.training.module import FfdModule

_WARM_UP = 0.1  # of a training, to the highest rate of one_cycle


def build_part(group: str, node: Any, **context: Any) -> Any:
    """Build what a group of the configuration chooses."""
    return registry.get(GROUPS[group], node.name).build(node, **context)


def category_names(cfg: PrepareConfig) -> tuple[str, ...]:
    """Return the categories that are trained on together, mostly one."""
    return tuple(cfg.category.members or [cfg.category.name])


def build_source(cfg: PrepareConfig) -> Source:
    """Return the source of shapes; nothing is read yet."""
    size = (cfg.data.render.height, cfg.data.render.width)
    source: Source = build_part("data", cfg.data, image_size=size)
    _expect(source, Source, f"data={cfg.data.name}")
    return source


def build_preparations(cfg: PrepareConfig) -> tuple[Preparation, ...]:
    """Return the preparation of each category; nothing is read yet."""
    source = build_source(cfg)
    return tuple(
        Preparation(
            source=source,
            category=name,
            num_points=cfg.data.num_points,
            render=cfg.data.render,
            root=Path(cfg.paths.data),
            limit=cfg.data.limit,
            workers=cfg.preparation.workers,
            timeout=cfg.preparation.timeout,
        )
        for name in category_names(cfg)
    )


def build_data(cfg: TrainConfig) -> FfdDataModule:
    """Return the data module; nothing is read yet."""
    strategy = build_part("template_strategy", cfg.template_strategy)
    _expect_function(strategy, f"template_strategy={cfg.template_strategy.name}")
    split = build_part("split", cfg.split)
    _expect_function(split, f"split={cfg.split.name}")
    augmentation = build_part("augmentation", cfg.augmentation)
    if cfg.augmentation.name != "none":
        _expect_function(augmentation, f"augmentation={cfg.augmentation.name}")
    return FfdDataModule(
        category_names(cfg),
        build_source(cfg),
        num_templates=cfg.templates.count,
        template_strategy=strategy,
        hold_out=cfg.templates.hold_out,
        split=split,
        val_fraction=cfg.split.val_fraction,
        drop_outliers=cfg.split.drop_outliers,
        degrees=cfg.network.degrees,
        max_edge=cfg.templates.max_edge,
        batch_size=cfg.schedule.batch_size,
        num_points=cfg.schedule.num_points,
        seed=cfg.seed,
        render=cfg.data.render,
        cloud_points=cfg.data.num_points,
        root=cfg.paths.data,
        limit=cfg.data.limit,
        augmentation=augmentation,
        residency=cfg.data.residency.value,
        num_workers=cfg.trainer.num_workers,
        prepare_workers=cfg.preparation.workers,
        prepare_timeout=cfg.preparation.timeout,
    )


def build_network(cfg: TrainConfig) -> TemplateFfdNetwork:
    """Return the network, weights drawn from torch's global seed."""
    image_size = (cfg.data.render.height, cfg.data.render.width)
    momentum = cfg.network.batch_norm_momentum
    shrink = max(1, image_size[0] // (cfg.network.seen_height or image_size[0]))
    seen = shrunk_size(image_size, shrink)
    encoder = build_part("encoder", cfg.encoder, image_size=seen, batch_norm_momentum=momentum)
    _expect(encoder, ImageEncoder, f"encoder={cfg.encoder.name}")
    _check_feature_map(encoder, seen, f"encoder={cfg.encoder.name}")
    mirrored = cfg.regime.mirror_offsets and cfg.category.symmetric
    return TemplateFfdNetwork(
        encoder,
        image_size=image_size,
        num_templates=cfg.templates.count,
        num_control_points=num_control_points(cfg.network.degrees),
        bottleneck=cfg.network.bottleneck,
        hidden=cfg.network.hidden,
        min_weight=cfg.regime.min_weight,
        offset_std=cfg.network.offset_std,
        batch_norm_momentum=momentum,
        shrink=shrink,
        mirror_degrees=cfg.network.degrees if mirrored else None,
    )


def build_objective(regime: RegimeConfig, annealing_steps: float) -> Objective:
    """Return a regime as a loss."""
    terms = {}
    for label, node in regime.terms.items():
        term = registry.get("term", node.term).build(node)
        _expect_function(term, f"the term {node.term}")
        annealing = make_annealing(node.annealing.value, annealing_steps)
        terms[label] = WeightedTerm(term, node.weight, annealing)
    selection = build_part("regime.selection", regime.selection)
    _expect_function(selection, f"regime/selection={regime.selection.name}")
    return Objective(terms, selection)


def build_module(
    cfg: TrainConfig, network: TemplateFfdNetwork, record: dict[str, Any]
) -> FfdModule:
    """Return what is trained."""
    schedule = cfg.schedule
    return FfdModule(
        network,
        build_objective(cfg.regime, schedule.annealing_steps),
        optimizer=partial(torch.optim.Adam, lr=schedule.learning_rate, fused=True),
        scheduler=_SCHEDULERS[schedule.learning_rate_decay],
        offset_rate=schedule.offset_rate,
        seed=cfg.seed,
        record=record,
    )


def _cosine(optimizer: Optimizer, steps: int) -> LRScheduler:
    return CosineAnnealingLR(optimizer, T_max=steps)


def _one_cycle(optimizer: Optimizer, steps: int) -> LRScheduler:
    highest = [group["lr"] for group in optimizer.param_groups]
    # OneCycleLR divides by the steps of the warm-up less one; of fewer steps it makes no warm-up.
    share = 0.0 if steps * _WARM_UP == 1 else _WARM_UP
    return OneCycleLR(optimizer, highest, total_steps=steps, pct_start=share, cycle_momentum=False)


_SCHEDULERS = {
    LearningRateDecay.none: None,
    LearningRateDecay.cosine: _cosine,
    LearningRateDecay.one_cycle: _one_cycle,
}


def build_protocol(node: Any) -> EvaluationProtocol:
    """Return how predictions are measured.

    Raises:
        ConfigError: it is no protocol, or does not call itself by the name that it is registered
            under.
    """
    protocol: EvaluationProtocol = build_part("protocol", node)
    _expect(protocol, EvaluationProtocol, f"protocol={node.name}")
    if "__dataclass_params__" not in vars(type(protocol)):  # else its settings would not be known
        raise ConfigError(
            f"protocol={node.name} gives a {type(protocol).__name__}, which is no dataclass: put "
            "@dataclass(frozen=True) above the class"
        )
    if not protocol.measures:
        raise ConfigError(f"protocol={node.name} has no measures: it needs one at least")
    if protocol.name != node.name:
        raise ConfigError(f"protocol {node.name!r} calls itself {protocol.name!r}: use one name")
    return protocol


def _expect(made: Any, kind: type[Any], what: str) -> None:
    """Make sure that a factory has built what it is for.

    Raises:
        ConfigError: it has built something else.
    """
    if not isinstance(made, kind):
        raise ConfigError(f"{what} gives a {type(made).__name__}, not a {kind.__name__}")


def _expect_function(made: Any, what: str) -> None:
    if not callable(made):
        raise ConfigError(f"the factory of {what} gives a {type(made).__name__}, not a function")


def _check_feature_map(encoder: ImageEncoder, size: tuple[int, int], what: str) -> None:
    """Encode one empty image, and hold the feature map against what the encoder says of it.

    Raises:
        ConfigError: it is of another shape.
    """
    for name in ("forward", "output_size"):
        if getattr(type(encoder), name) is getattr(ImageEncoder, name):
            raise ConfigError(f"{what} has no method {name}")
    if not isinstance(getattr(encoder, "out_channels", None), int):
        raise ConfigError(f"{what} has no out_channels: set it to the channels of the feature map")
    modes = [(module, module.training) for module in encoder.modules()]  # some may be frozen
    with torch.random.fork_rng(devices=[]), torch.no_grad():
        features = encoder.eval()(torch.zeros(1, 3, *size))
    for module, training in modes:
        module.training = training
    told = encoder.output_size(size)
    expected = (1, encoder.out_channels, *(told if isinstance(told, list | tuple) else (told,)))
    shape = tuple(features.shape) if isinstance(features, torch.Tensor) else type(features).__name__
    if shape != expected:
        raise ConfigError(
            f"{what} turns an image of {size[0]} x {size[1]} into {shape}, where its out_channels "
            f"and output_size say {expected}, (q, C, h, w)"
        )
