"""Train one run, or a sweep with -m: see `python train.py --help`."""

import hydra
from omegaconf import DictConfig

from ffd_lightning.app.cli import register, run_app

register()


@hydra.main(version_base="1.3", config_path="conf", config_name="train")
def main(cfg: DictConfig) -> dict[str, float] | None:
    """Hand the composed configuration to the training run."""
    # Imported here so that --help and a typo are answered before torch is loaded.
    from ffd_lightning.app.train import train_job

    return train_job(cfg)


if __name__ == "__main__":
    run_app(main)
