"""Composition: from typed settings to objects. Nothing else knows both."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import torch
from lightning import Callback
from torch.optim import Optimizer
from torch.optim.lr_scheduler import LRScheduler
from torch.optim.optimizer import ParamsT

from ffd_lightning.app.config import PrepareConfig, RegimeConfig, TrainConfig
from ffd_lightning.app.first_weights import load_first_weights
from ffd_lightning.components import Component
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.source import Source
from ffd_lightning.errors import ConfigError
from ffd_lightning.evaluation.protocols import EvaluationProtocol
from ffd_lightning.geometry.lattice import num_control_points
from ffd_lightning.losses.objective import Objective, WeightedTerm
from ffd_lightning.nn.encoders.base import ImageEncoder
from ffd_lightning.nn.network import TemplateFfdNetwork, shrunk_size
from ffd_lightning.training.module import FfdModule


def category_names(cfg: PrepareConfig) -> tuple[str, ...]:
    """Return the categories that are trained on together, mostly one."""
    return tuple(cfg.category.members or [cfg.category.name])


def build_source(cfg: PrepareConfig) -> Source:
    """Return the source of shapes; nothing is read yet."""
    source: Source = cfg.data.build()
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
    # Without an augmentation images are used without their coverage, which is not even kept.
    augmentation = None if cfg.augmentation.name == "none" else _function(cfg.augmentation)
    return FfdDataModule(
        category_names(cfg),
        build_source(cfg),
        num_templates=cfg.templates.count,
        template_strategy=_function(cfg.template_strategy),
        hold_out=cfg.templates.hold_out,
        split=_function(cfg.split),
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
        residency=cfg.trainer.residency,
        num_workers=cfg.trainer.num_workers,
        prepare_workers=cfg.preparation.workers,
        prepare_timeout=cfg.preparation.timeout,
    )


def _seen(cfg: Any) -> tuple[tuple[int, int], int, tuple[int, int]]:
    """Return the size of images, by how much they are shrunk, and what the encoder sees."""
    size = (cfg.data.render.height, cfg.data.render.width)
    shrink = max(1, size[0] // (cfg.network.seen_height or size[0]))
    return size, shrink, shrunk_size(size, shrink)


def build_encoder(cfg: Any) -> ImageEncoder:
    """Return the encoder with its first weights.

    Args:
        cfg: what has `encoder`, `data` and `network` of a `TrainConfig`.

    Raises:
        ConfigError: it is none, or has no such weights.
    """
    seen = _seen(cfg)[2]
    momentum = cfg.network.batch_norm_momentum
    encoder: ImageEncoder = cfg.encoder.build(image_size=seen, batch_norm_momentum=momentum)
    _expect(encoder, ImageEncoder, f"encoder={cfg.encoder.name}")
    load_first_weights(encoder, cfg.encoder.first_weights)
    _check_feature_map(encoder, seen, f"encoder={cfg.encoder.name}")
    return encoder


def build_network(cfg: TrainConfig) -> TemplateFfdNetwork:
    """Return the network, weights drawn from torch's global seed."""
    image_size, shrink, _ = _seen(cfg)
    return TemplateFfdNetwork(
        build_encoder(cfg),
        image_size=image_size,
        num_templates=cfg.templates.count,
        num_control_points=num_control_points(cfg.network.degrees),
        bottleneck=cfg.network.bottleneck,
        hidden=cfg.network.hidden,
        min_weight=cfg.regime.min_weight,
        offset_std=cfg.network.offset_std,
        batch_norm_momentum=cfg.network.batch_norm_momentum,
        shrink=shrink,
        mirror_degrees=cfg.network.degrees if cfg.regime.mirror_offsets else None,
    )


def build_objective(regime: RegimeConfig, annealing_steps: float) -> Objective:
    """Return a regime as a loss."""
    terms = {
        label: WeightedTerm(_function(term), term.weight, term.annealing, annealing_steps)
        for label, term in regime.terms.items()
    }
    return Objective(terms, _function(regime.selection))


def regime(name: str, *overrides: str, annealing_steps: float = 10_000) -> Objective:
    """Return the objective of a regime of `conf/regime`, for scripts of your own.

    Args:
        name: b, w, e, r, ...
        overrides: as on the command line, without the group: `terms.offset_penalty.weight=2`,
            `term=[my_term]`, `selection=my_selection`.
        annealing_steps: b_0, over which annealed weights fade by a factor of e.

    Raises:
        HydraException: no such regime.
        ConfigError: overrides that do not fit.
    """
    from ffd_lightning.app.configuration import compose_config, typed_config

    own = [f"regime={name}", *(_in_regime(override) for override in overrides)]
    cfg = typed_config(compose_config("train", TrainConfig, own), TrainConfig)
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
    constant = cfg.lr_schedule.name == "none"
    return FfdModule(
        network,
        build_objective(cfg.regime, cfg.schedule.annealing_steps),
        optimizer=partial(_optimizer, cfg.optimizer, cfg.schedule.learning_rate),
        scheduler=None if constant else partial(_lr_schedule, cfg.lr_schedule),
        offset_rate=cfg.schedule.offset_rate,
        seed=cfg.seed,
        record=record,
    )


def _optimizer(chosen: Component, rate: float, params: ParamsT) -> Optimizer:
    made: Optimizer = chosen.build(params=params, lr=rate, fused=True)
    return made


def _lr_schedule(chosen: Component, optimizer: Optimizer, total_steps: int) -> LRScheduler:
    made: LRScheduler = chosen.build(optimizer=optimizer, total_steps=total_steps)
    return made


def build_callbacks(cfg: TrainConfig) -> list[Callback]:
    """Return the callbacks that are chosen by name."""
    found = [chosen.build() for chosen in cfg.callback.values()]
    for label, made in zip(cfg.callback, found, strict=True):
        _expect(made, Callback, f"callback.{label}")
    return found


def build_protocol(chosen: Component) -> EvaluationProtocol:
    """Return how predictions are measured.

    Raises:
        ConfigError: it is no protocol, or does not call itself by the name that it is registered
            under.
    """
    protocol: EvaluationProtocol = chosen.build(name=chosen.name)
    _expect(protocol, EvaluationProtocol, f"protocol={chosen.name}")
    if "__dataclass_params__" not in vars(type(protocol)):  # else its settings would not be known
        raise ConfigError(
            f"protocol={chosen.name} gives a {type(protocol).__name__}, which is no dataclass: put "
            "@dataclass(frozen=True) above the class"
        )
    if not protocol.measures:
        raise ConfigError(f"protocol={chosen.name} has no measures: it needs one at least")
    if protocol.name != chosen.name:
        raise ConfigError(f"protocol {chosen.name!r} calls itself {protocol.name!r}: use one name")
    return protocol


def build_all(cfg: TrainConfig) -> None:
    """Build whatever a training needs but its data, to see that it can be built.

    Raises:
        ConfigError: something cannot.
    """
    with torch.random.fork_rng(devices=[]):
        build_data(cfg)
        build_encoder(cfg)
        build_objective(cfg.regime, cfg.schedule.annealing_steps)
        weights = [torch.nn.Parameter(torch.zeros(1))]
        optimizer = _optimizer(cfg.optimizer, cfg.schedule.learning_rate, weights)
        _lr_schedule(cfg.lr_schedule, optimizer, cfg.schedule.steps)
        build_callbacks(cfg)
        build_protocol(cfg.protocol)


def _function(chosen: Component) -> Any:
    """Build what is called later.

    Raises:
        ConfigError: it cannot be called.
    """
    made = chosen.build()
    if not callable(made):
        raise ConfigError(f"{chosen.where}: {chosen.name} is a {type(made).__name__}, no function")
    return made


def _expect(made: Any, kind: type[Any], what: str) -> None:
    """Make sure that a factory has built what it is for.

    Raises:
        ConfigError: it has built something else.
    """
    if not isinstance(made, kind):
        raise ConfigError(f"{what} gives a {type(made).__name__}, not a {kind.__name__}")


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
