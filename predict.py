"""Reconstruct what photographs show: see `python predict.py --help`."""

import sys

import hydra
from omegaconf import DictConfig

from ffd_lightning.app.cli import quote_paths, register, run_app
from ffd_lightning.app.config import PredictConfig

register(PredictConfig)


@hydra.main(version_base="1.3", config_path="conf", config_name="predict")
def main(cfg: DictConfig) -> None:
    """Hand the composed configuration to the prediction."""
    from ffd_lightning.app.predict import predict_job

    predict_job(cfg)


if __name__ == "__main__":
    sys.argv[1:] = quote_paths(sys.argv[1:], ("run", "image", "mask", "out"))
    run_app(main)
