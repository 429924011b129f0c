"""What neither types nor constructors can check: settings that do not go together."""

from collections.abc import Iterator
from pathlib import Path

import torch

from ffd_lightning.app.build import build_all, build_source, category_names
from ffd_lightning.app.config import PrepareConfig, TrainConfig
from ffd_lightning.components import plain, written
from ffd_lightning.errors import ConfigError
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.pretrained import KERAS_ADDRESS, KERAS_FILES

_CAMERAS = ("camera", "elevation", "azimuths", "random_views", "samples")


def validate(cfg: PrepareConfig) -> None:
    """Check a configuration to prepare data with, or to train with; build all that is cheap."""
    problems = list(_data_problems(cfg))
    if isinstance(cfg, TrainConfig):
        problems += _training_problems(cfg)
    if problems:
        raise ConfigError("; ".join(problems))
    if isinstance(cfg, TrainConfig):
        build_all(cfg)


def _data_problems(cfg: PrepareConfig) -> Iterator[str]:
    """Name files that are not there, and cameras of images that are given."""
    found = [("data.root", cfg.data.settings.get("root"))]
    if isinstance(cfg, TrainConfig):
        found.append(("split.file", cfg.split.settings.get("file")))
        pattern = str(cfg.template_strategy.settings.get("file") or "")
        files = [pattern.replace("{category}", name) for name in category_names(cfg)]
        found += [("template_strategy.file", file) for file in files]
    for setting, path in found:
        if path and not Path(path).expanduser().exists():
            yield f"{setting}={path} does not exist"
    if not build_source(cfg).own_images:
        return
    usual = RenderSettings()
    for name in _CAMERAS:
        default = getattr(usual, name)
        if getattr(cfg.data.render, name) != default:
            yield (
                f"data.render.{name} means nothing here, as data={cfg.data.name} has images of its "
                "own: leave it out, or, where a study sets it, "
                f"data.render.{name}={written(plain(default))}"
            )


def _training_problems(cfg: TrainConfig) -> Iterator[str]:
    if cfg.trainer.accelerator in ("gpu", "cuda") and not torch.cuda.is_available():
        yield f"trainer.accelerator={cfg.trainer.accelerator}: there is no GPU: use trainer=auto"
    regime = cfg.regime
    for label in sorted({"box_chamfer", "chamfer", "loss", "selection"} & set(regime.terms)):
        yield (
            f"regime.terms.{label}: another quantity is logged by that name; choose another "
            f"label: +regime.terms.my_{label}.term=..."
        )
    if cfg.templates.count == 1 and regime.selection.settings.get("function") == "log":
        yield (
            "regime.selection.function=log is infinite for a single template: use another regime "
            "(b, e, r) or more templates"
        )
    if not any(term.weight for term in regime.terms.values()):
        yield f"regime {regime.name} has no term of a weight above 0: nothing would be learnt"
    yield from _first_weights_problems(cfg)


def _first_weights_problems(cfg: TrainConfig) -> Iterator[str]:
    """Ask for a word that none are meant, where others are usual.

    The paper's networks start from ImageNet weights, which this package does not bring.
    """
    encoder = cfg.encoder
    if cfg.network.weights is not None:
        if encoder.weights not in (None, "none"):
            yield "network.weights brings the encoder's, too: leave encoder.weights out"
    elif (cfg.schedule.name, encoder.name, encoder.weights) == ("paper", "mobilenet", None):
        width = encoder.settings["width"]
        if file := KERAS_FILES.get(width):
            ask = f"give Keras' file, encoder.weights={file} ({KERAS_ADDRESS}{file})"
        else:
            ask = f"Keras publishes none of width {width:g}: encoder.weights=FILE takes yours"
        yield (
            f"schedule=paper starts from ImageNet weights, as the paper does: {ask}, or train from "
            "scratch with encoder.weights=none"
        )
