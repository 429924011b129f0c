"""What neither types nor constructors can check: settings that do not go together."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ffd_lightning.app.config import PrepareConfig, TrainConfig
from ffd_lightning.app.first_weights import unsaid_problem
from ffd_lightning.components import plain, written
from ffd_lightning.errors import ConfigError
from ffd_lightning.imaging.render_settings import RenderSettings


def validate(cfg: PrepareConfig) -> None:
    """Check a configuration to prepare data with, or to train with; build all that is cheap.

    Raises:
        ConfigError: names every setting that cannot work, and the way out.
    """
    from ffd_lightning.app import build

    checks = [*_data_checks(cfg), *_given_images_checks(cfg)]
    problems = [*(message for wrong, message in checks if wrong), *_file_problems(cfg)]
    if isinstance(cfg, TrainConfig):
        problems += [message for wrong, message in _training_checks(cfg) if wrong]
        problems += [*filter(None, [unsaid_problem(cfg)]), *device_problems(cfg)]
    if problems:
        raise ConfigError("; ".join(problems))
    build.build_source(cfg)
    if isinstance(cfg, TrainConfig):
        build.build_all(cfg)


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


_Checks = list[tuple[bool, str]]  # whether something is wrong, and what


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
    images = cfg.data.settings.get("images", "render")
    if images == "render":
        return []
    whose = f"data.images={images}"
    render, usual = cfg.data.render, RenderSettings()
    pairs = {
        name: (getattr(render, name), getattr(usual, name))
        for name in ("camera", "elevation", "azimuths", "random_views", "samples")
    }
    return [
        (
            value != default,
            f"data.render.{name} means nothing with {whose}, which has images of its own: leave "
            f"it out, or, where a study sets it, data.render.{name}={written(plain(default))}",
        )
        for name, (value, default) in pairs.items()
    ]


def _file_problems(cfg: PrepareConfig) -> Iterator[str]:
    """Name files and folders that are not there, before anything is prepared."""
    root = cfg.data.settings.get("root")
    if root is not None and not Path(root).expanduser().exists():
        yield f"data.root={root} does not exist: data={cfg.data.name} needs the folder of its data"
    if not isinstance(cfg, TrainConfig):
        return
    file = cfg.split.settings.get("file")
    if file is not None and not Path(file).expanduser().exists():
        yield f"split.file={file} does not exist"
    file = str(cfg.template_strategy.settings.get("file") or "")
    names = cfg.category.members or [cfg.category.name]
    files = [Path(file.replace("{category}", name)) for name in names if file]
    absent = [str(path) for path in files if not path.expanduser().is_file()]
    if absent:
        yield f"template_strategy.file={', '.join(absent)} is not there"


def _training_checks(cfg: TrainConfig) -> _Checks:
    regime, selection = cfg.regime, cfg.regime.selection
    function = selection.settings.get("function") if selection.name == "weighted" else None
    taken = sorted({"box_chamfer", "chamfer", "loss", "selection"} & set(regime.terms))
    return [
        (
            cfg.schedule.num_points > cfg.data.num_points,
            f"schedule.num_points={cfg.schedule.num_points} is more than "
            f"data.num_points={cfg.data.num_points}, the points kept per shape",
        ),
        (
            bool(taken),
            f"regime.terms.{''.join(taken[:1])}: another quantity is logged by that name; choose "
            f"another label: +regime.terms.my_{''.join(taken[:1])}.term=...",
        ),
        (
            cfg.templates.count == 1 and function == "log",
            "regime.selection.function=log is infinite for a single template: use another regime "
            "(b, e, r) or more templates",
        ),
        (
            not any(term.weight for term in regime.terms.values()),
            f"regime {regime.name} has no term of a weight above 0: nothing would be learnt",
        ),
    ]
