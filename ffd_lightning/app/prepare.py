"""From configuration to prepared set."""

from __future__ import annotations

import sys
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning.app.checks import validate
from ffd_lightning.app.cli import explain
from ffd_lightning.app.config import PrepareConfig, typed_config
from ffd_lightning.data.preparation.preparation import Preparation, Shard
from ffd_lightning.data.sources import build_source
from ffd_lightning.errors import DataError, UserError


def build_preparations(cfg: PrepareConfig) -> tuple[Preparation, ...]:
    """Return the preparation of each category of a configuration; nothing is read yet."""
    return tuple(
        Preparation(
            source=build_source(cfg.data),
            category=name,
            num_points=cfg.data.num_points,
            render=cfg.data.render,
            root=Path(cfg.paths.data),
            workers=cfg.preparation.workers,
            timeout=cfg.preparation.timeout,
        )
        for name in cfg.category.members or [cfg.category.name]
    )


def prepare_job(cfg: DictConfig) -> None:
    """Prepare what Hydra composed: a category, or the shard of it that is asked for.

    In a multirun a category that cannot be prepared does not stop the others.
    """
    try:
        config = typed_config(cfg, PrepareConfig)
        validate(config)
        for preparation in build_preparations(config):
            if config.preparation.shard is None:
                preparation.run()
            else:
                preparation.run_shard(Shard.parse(config.preparation.shard))
    except (UserError, OmegaConfBaseException) as error:
        if HydraConfig.get().mode is not RunMode.MULTIRUN:
            # Not as an exception: Hydra would put a line of its own above it.
            sys.exit(f"error: {explain(error)}")
        # Hydra goes on, and shows the first of all exceptions at the end.
        print(f"error: {explain(error)}", file=sys.stderr)
        raise DataError("not everything could be prepared: see the messages above") from None
