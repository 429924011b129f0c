"""Prepare a category for training, or one machine's part of it: see `python prepare.py --help`."""

import hydra
from omegaconf import DictConfig

from ffd_lightning.app.cli import register, run_app
from ffd_lightning.app.config import PrepareConfig

register(PrepareConfig)


@hydra.main(version_base="1.3", config_path="conf", config_name="prepare")
def main(cfg: DictConfig) -> None:
    """Hand the composed configuration to the preparation."""
    from ffd_lightning.app.prepare import prepare_job

    prepare_job(cfg)


if __name__ == "__main__":
    run_app(main)
