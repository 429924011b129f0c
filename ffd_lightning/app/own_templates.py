"""The settings `templates=`, `up=` and `yaw=` of several commands."""

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
        ConfigError, DataError: see `of_files`; or meshes are to be turned, and none are named.
    """
    up, yaw = settings.up, settings.yaw
    if settings.templates is not None:
        return of_files(model, settings.templates, up=up, yaw=yaw, root=root, progress=progress)
    if (up, yaw) != ("y", 0.0):
        raise ConfigError("up= and yaw= turn the meshes that templates= names: there are none")
    return None
