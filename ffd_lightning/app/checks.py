"""What types alone cannot check in a configuration, before anything is built."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ffd_lightning import registry
from ffd_lightning.app.config import GROUPS, PrepareConfig, TrainConfig
from ffd_lightning.app.parts.encoders import KERAS_ADDRESS, KERAS_FILES
from ffd_lightning.errors import ConfigError
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.registry import plain


def validate(cfg: PrepareConfig) -> None:
    """Check a configuration to prepare data with, or to train with.

    Raises:
        ConfigError: names every setting that cannot work, and the way out.
    """
    checks = [*_data_checks(cfg), *_given_images_checks(cfg)]
    if isinstance(cfg, TrainConfig):
        checks += [*_number_checks(cfg), *_regime_checks(cfg), *_template_checks(cfg)]
    problems = [message for wrong, message in checks if wrong]
    problems += setting_problems(cfg)
    if isinstance(cfg, TrainConfig):
        problems += [*_weights_problems(cfg), *device_problems(cfg)]
    if problems:
        raise ConfigError("; ".join(problems))


def encoder_problems(cfg: Any) -> list[str]:
    """Return what is wrong with the encoder, and with the weights that it starts from.

    Args:
        cfg: what `train` reads, typed or as it was composed.
    """
    name, node = cfg.encoder.name, cfg.encoder
    found = registry.range_problems(registry.get("encoder", name).own_settings(node), "encoder.")
    return [*found, *_own_problems("encoder", name, node), *_weights_problems(cfg)]


def device_problems(cfg: Any) -> list[str]:
    """Return what is wrong with where a run is to train on this machine.

    Args:
        cfg: what `train` reads, typed or as it was composed.
    """
    import torch

    accelerator = cfg.trainer.accelerator
    if accelerator not in ("gpu", "cuda") or torch.cuda.is_available():
        return []
    return [f"trainer.accelerator={accelerator}: there is no GPU: use trainer=auto"]


def _weights_problems(cfg: Any) -> list[str]:
    """Return what the paper's schedule lacks: first weights, or the word that none are meant.

    The paper's networks start from ImageNet weights, which this package does not bring.
    """
    encoder = cfg.encoder
    if cfg.schedule.name != "paper" or encoder.name != "mobilenet" or encoder.weights is not None:
        return []
    file = KERAS_FILES.get(encoder.width)
    if file is None:
        ask = f"Keras publishes none of width {encoder.width:g}: encoder.weights=FILE takes yours"
    else:
        ask = f"give Keras' file, encoder.weights={file} ({KERAS_ADDRESS}{file})"
    return [
        f"schedule=paper starts from ImageNet weights, as the paper does: {ask}, or train from "
        "scratch with encoder.weights=none"
    ]


_Checks = list[tuple[bool, str]]  # whether something is wrong, and what


def setting_problems(cfg: Any) -> list[str]:
    """Return which settings are out of range, and what parts' own `check()` says of theirs."""
    return registry.range_problems(cfg) + [
        problem
        for kind, node in _parts(cfg)
        for problem in _own_problems(kind, node.term if kind == "term" else node.name, node)
    ]


def _own_problems(kind: str, name: str, node: Any) -> list[str]:
    """Return what a part says of its own settings, [] if nothing."""
    check = getattr(registry.get(kind, name).own_settings(node), "check", None)
    try:
        if check is not None:
            check()
    except ConfigError as error:
        return [str(error)]
    return []


def _parts(cfg: Any) -> Iterator[tuple[str, Any]]:
    for where, kind in GROUPS.items():
        node = cfg
        for step in where.split("."):
            node = getattr(node, step, None)
        if node is not None:
            yield kind, node
    for node in cfg.regime.terms.values() if isinstance(cfg, TrainConfig) else ():
        yield "term", node


def _number_checks(cfg: TrainConfig) -> _Checks:
    schedule = cfg.schedule
    return [
        (
            schedule.num_points > cfg.data.num_points,
            f"schedule.num_points={schedule.num_points} is more than "
            f"data.num_points={cfg.data.num_points}, the points kept per shape",
        ),
    ]


def _data_checks(cfg: PrepareConfig) -> _Checks:
    render, name = cfg.data.render, cfg.category.name
    return [
        (render.samples < 1, f"data.render.samples={render.samples} must be above 0"),
        (min(render.height, render.width) < 32, "data.render.height and width must be 32 or more"),
        (render.random_views < 0, "data.render.random_views must not be negative"),
        (
            not render.azimuths and render.random_views < 1,
            "data.render.azimuths needs at least one angle, or data.render.random_views one view",
        ),
        (
            render.elevation is not None and not -90 <= render.elevation <= 90,
            "data.render.elevation must lie in [-90, 90] degrees",
        ),
        (
            Path(name).name != name,
            f"category.name={name} must be the name of a folder, not a path",
        ),
    ]


def _given_images_checks(cfg: PrepareConfig) -> _Checks:
    """Refuse cameras where the source has the images already; their size still counts."""
    images = getattr(cfg.data, "images", None)
    if images is None or getattr(images, "value", "render") == "render":
        return []
    whose = f"data.images={images.value}"
    render, usual = cfg.data.render, RenderSettings()
    pairs = {
        name: (getattr(render, name), getattr(usual, name))
        for name in ("camera", "elevation", "azimuths", "random_views", "samples")
    }
    return [
        (
            value != default,
            f"data.render.{name} means nothing with {whose}, which has images of its own: leave "
            f"it out, or, where a study sets it, data.render.{name}={_told(default)}",
        )
        for name, (value, default) in pairs.items()
    ]


def _told(value: Any) -> str:
    return "null" if value is None else str(plain(value)).replace(" ", "")


def _regime_checks(cfg: TrainConfig) -> _Checks:
    regime = cfg.regime
    alone = cfg.templates.count == 1 and regime.selection.name == "weighted"
    logged = {"box_chamfer", "chamfer", "loss", "selection"}
    taken = sorted(logged & set(regime.terms))
    return [
        (
            bool(taken),
            f"regime.terms.{''.join(taken[:1])}: another quantity is logged by that name; choose "
            f"another label: +regime.terms.my_{''.join(taken[:1])}.term=...",
        ),
        (
            alone and regime.selection.function.value == "log",
            "regime.selection.function=log is infinite for a single template: use another regime "
            "(b, e, r) or more templates",
        ),
        (
            not any(term.weight for term in regime.terms.values()),
            f"regime {regime.name} has no term of a weight above 0: nothing would be learnt",
        ),
    ]


def _template_checks(cfg: TrainConfig) -> _Checks:
    file = getattr(cfg.template_strategy, "file", None)
    names = cfg.category.members or [cfg.category.name]
    files = [] if file is None else [Path(file.replace("{category}", name)) for name in names]
    absent = [str(path) for path in files if not path.expanduser().is_file()]
    return [(bool(absent), f"template_strategy.file={', '.join(absent)} is not there")]
