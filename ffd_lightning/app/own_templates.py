"""The settings `templates=`, `up=`, `yaw=` and `beside=` of several commands."""

from __future__ import annotations

from pathlib import Path

from ffd_lightning.app.config import TemplateSettings
from ffd_lightning.checkpoint import TrainedModel
from ffd_lightning.errors import ConfigError
from ffd_lightning.inference.own_templates import OwnTemplates, of_files


def named_templates(
    settings: TemplateSettings, model: TrainedModel, root: str | Path, progress: bool = True
) -> OwnTemplates | None:
    """Return the templates that settings name, prepared below `root`; None for the model's own.

    Raises:
        ConfigError, DataError: see `of_files`; or a setting says how meshes are taken, and none
            are named.
    """
    if settings.templates is None:
        check_unused(settings, "there are none")
        return None
    up, yaw = settings.up, settings.yaw
    return of_files(model, settings.templates, up=up, yaw=yaw, root=root, progress=progress)


def check_unused(settings: TemplateSettings, why: str) -> None:
    """Make sure that no setting says how meshes are taken.

    Raises:
        ConfigError: one does.
    """
    if (settings.up, settings.yaw, settings.beside) != ("y", 0.0, False):
        raise ConfigError(f"up=, yaw= and beside= are of meshes that templates= names: {why}")
