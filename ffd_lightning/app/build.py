"""Composition: from typed settings to objects. Nothing else knows both."""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import torch
from lightning import Callback, Trainer
from lightning.pytorch.utilities.exceptions import MisconfigurationException
from torch.optim import Optimizer
from torch.optim.lr_scheduler import LRScheduler

from ffd_lightning.app.config import PrepareConfig, RegimeConfig, TrainConfig, TrainerConfig
from ffd_lightning.app.first_weights import load_first_weights, load_network_weights
from ffd_lightning.components import Component
from ffd_lightning.data.datamodule import FfdDataModule, check_split
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.source import Source
from ffd_lightning.errors import ConfigError
from ffd_lightning.evaluation.protocols import Protocol
from ffd_lightning.geometry.ffd import num_control_points
from ffd_lightning.losses.objective import Objective, WeightedTerm
from ffd_lightning.nn.encoders.base import ImageEncoder
from ffd_lightning.nn.network import TemplateFfdNetwork, evaluating, shrunk_size
from ffd_lightning.training.module import FfdModule

_Kind = TypeVar("_Kind")


def category_names(cfg: PrepareConfig) -> tuple[str, ...]:
    """Return the categories that are trained on together, mostly one."""
    return tuple(cfg.category.members or [cfg.category.name])


def build_source(cfg: PrepareConfig) -> Source:
    """Return the source of shapes; nothing is read yet."""
    return _built(cfg.data, Source)


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
            leave_out=cfg.data.leave_out,
            variants=cfg.data.asked_variants,
            workers=cfg.preparation.workers,
            timeout=cfg.preparation.timeout,
        )
        for name in category_names(cfg)
    )


def build_data(cfg: TrainConfig) -> FfdDataModule:
    """Return the data module; nothing is read yet."""
    # Without an augmentation images are used without their coverage, which is not even kept.
    augmentation = None if cfg.augmentation.name == "none" else cfg.augmentation.build()
    return FfdDataModule(
        build_preparations(cfg),
        num_templates=cfg.templates.count,
        template_strategy=cfg.template_strategy.build(),
        hold_out=cfg.templates.hold_out,
        split=cfg.split.build(),
        val_fraction=cfg.split.val_fraction,
        drop_outliers=cfg.split.drop_outliers,
        degrees=cfg.network.degrees,
        max_edge=cfg.templates.max_edge,
        batch_size=cfg.schedule.batch_size,
        num_points=cfg.schedule.num_points,
        draw=cfg.heads.settings.get("draw"),
        seed=cfg.seed,
        augmentation=augmentation,
        residency=cfg.trainer.residency,
        num_workers=cfg.trainer.num_workers,
    )


def build_encoder(cfg: TrainConfig, size: tuple[int, int]) -> ImageEncoder:
    """Return the encoder of images of a size, with its first weights."""
    momentum = cfg.network.batch_norm_momentum
    encoder = _built(cfg.encoder, ImageEncoder, image_size=size, batch_norm_momentum=momentum)
    load_first_weights(encoder, cfg.encoder.first_weights)
    with torch.random.fork_rng(devices=[]), torch.no_grad(), evaluating(encoder):
        found = encoder(torch.zeros(1, 3, *size))
    shape = tuple(found.shape) if isinstance(found, torch.Tensor) else type(found).__name__
    expected = (1, encoder.out_channels, *encoder.output_size(size))
    if shape != expected:
        raise ConfigError(
            f"encoder={cfg.encoder.name} turns an image of {size[0]} x {size[1]} into {shape}, "
            f"where its out_channels and output_size say {expected}, (q, C, h, w)"
        )
    return encoder


def build_network(cfg: TrainConfig) -> TemplateFfdNetwork:
    """Return the network, weights drawn from torch's global seed."""
    render = cfg.data.render
    size = (render.height, render.width)
    shrink = max(1, size[0] // (cfg.network.seen_height or size[0]))
    network = TemplateFfdNetwork(
        build_encoder(cfg, shrunk_size(size, shrink)),
        image_size=size,
        num_templates=cfg.templates.count,
        num_control_points=num_control_points(cfg.network.degrees),
        bottleneck=cfg.network.bottleneck,
        hidden=cfg.network.hidden,
        min_weight=cfg.regime.min_weight,
        offset_std=cfg.network.offset_std,
        batch_norm_momentum=cfg.network.batch_norm_momentum,
        shrink=shrink,
        mirror_degrees=cfg.network.degrees if cfg.regime.mirror_offsets else None,
        heads=cfg.heads,
        viewpoint=render.only_camera is None and not build_source(cfg).own_images,
    )
    if cfg.network.weights is not None:
        load_network_weights(network, cfg.network.weights)
    return network


def build_objective(regime: RegimeConfig, annealing_steps: float) -> Objective:
    """Return a regime as a loss."""
    terms = {
        label: WeightedTerm(term.build(), term.weight, term.annealing, annealing_steps)
        for label, term in regime.terms.items()
    }
    return Objective(terms, regime.selection.build())


def regime(name: str, *overrides: str, annealing_steps: float = 10_000) -> Objective:
    """Return the objective of a regime of `conf/regime`, for scripts of your own.

    What a regime says of the network, its `min_weight` and whether offsets are mirrored, is to be
    given to `TemplateFfdNetwork`: `min_weight=0.001` for w; `min_weight=0` and `mirror_degrees` for
    `posterior`.

    Args:
        name: b, w, e, r, ...
        overrides: as on the command line, without the group: `terms.offset_penalty.weight=2`,
            `term=[my_term]`, `selection=my_selection`.
        annealing_steps: b_0, over which annealed weights fade by a factor of e.

    Raises:
        ConfigError: no such regime, or overrides that do not fit.
    """
    from ffd_lightning.app.configuration import compose_config, typed_config
    from ffd_lightning.app.messages import SHOWN, explain

    for override in overrides:
        if override.startswith(("min_weight=", "mirror_offsets=")):
            raise ConfigError(f"{override}: this is the network's; give it to TemplateFfdNetwork")
    own = [f"regime={name}", *(_in_regime(override) for override in overrides)]
    try:
        cfg = typed_config(compose_config("train", TrainConfig, own), TrainConfig)
    except SHOWN as error:
        raise ConfigError(explain(error)) from None
    return build_objective(cfg.regime, annealing_steps)


def _in_regime(override: str) -> str:
    """Put the group before an override, behind the signs that it begins with.

    >>> _in_regime("+terms.smoothness.weight=1"), _in_regime("selection=taught")
    ('+regime.terms.smoothness.weight=1', 'regime/selection=taught')
    """
    rest = override.lstrip("+~")
    signs = override.removesuffix(rest)
    return f"{signs}regime{'/' if rest.startswith(('selection=', 'term=')) else '.'}{rest}"


def build_module(
    cfg: TrainConfig, network: TemplateFfdNetwork, record: dict[str, Any]
) -> FfdModule:
    """Return what is trained."""
    rate = cfg.schedule.learning_rate
    return FfdModule(
        network,
        build_objective(cfg.regime, cfg.schedule.annealing_steps),
        optimizer=lambda params: _built(
            cfg.optimizer, Optimizer, params=params, lr=rate, fused=True
        ),
        scheduler=None
        if cfg.lr_schedule.name == "none"
        else lambda optimizer, steps: _built(
            cfg.lr_schedule, LRScheduler, optimizer=optimizer, total_steps=steps
        ),
        offset_rate=cfg.schedule.offset_rate,
        seed=cfg.seed,
        record=record,
    )


def build_callbacks(cfg: TrainConfig) -> list[Callback]:
    """Return the callbacks that are chosen by name."""
    return [_built(chosen, Callback) for chosen in cfg.callback.values()]


def build_protocol(chosen: Component) -> Protocol:
    """Return how predictions are measured."""
    protocol = _built(chosen, Protocol)
    protocol.check_metrics(chosen.name)
    return protocol


def build_trainer(cfg: TrainerConfig, **settings: Any) -> Trainer:
    """Return a Trainer for the devices that are asked for."""
    logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)  # devices, tips, farewells
    try:
        return Trainer(
            accelerator=cfg.accelerator,
            devices=int(cfg.devices) if cfg.devices.isdecimal() else cfg.devices,
            strategy=cfg.strategy,
            precision=cfg.precision,
            accumulate_grad_batches=cfg.accumulate_grad_batches,
            gradient_clip_val=cfg.gradient_clip_val,
            **settings,
        )
    except (MisconfigurationException, TypeError, ValueError) as error:
        raise ConfigError(f"trainer: {' '.join(str(error).split())}") from error


def build_all(cfg: TrainConfig) -> None:
    """Build whatever a training needs but its data, to see that it can be built."""
    with torch.random.fork_rng(devices=[]):
        build_data(cfg)
        module = build_module(cfg, build_network(cfg), {})
        optimizer = module.make_optimizer([torch.nn.Parameter(torch.zeros(1))])
        if module.make_scheduler is not None:
            module.make_scheduler(optimizer, cfg.schedule.steps)
        build_callbacks(cfg)
        build_protocol(cfg.protocol)
        trainer = build_trainer(cfg.trainer, logger=False, enable_checkpointing=False)
        check_split(cfg.schedule.batch_size, trainer.world_size)


def _built(chosen: Component, kind: Callable[..., _Kind], **context: Any) -> _Kind:
    """Build a component of a class that all of its kind have."""
    made = chosen.build(**context)
    if isinstance(made, cast(type, kind)):
        return cast(_Kind, made)
    names = type(made).__name__, kind.__name__
    raise ConfigError(f"{chosen.where}: {chosen.name} gives a {names[0]}, not a {names[1]}")
