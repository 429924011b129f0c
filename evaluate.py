"""Evaluate a run: see `python evaluate.py --help`."""

import sys

import hydra
from omegaconf import DictConfig

from ffd_lightning.app.cli import quote_paths, register, run_app
from ffd_lightning.app.config import EvaluateConfig

register(EvaluateConfig)


@hydra.main(version_base="1.3", config_path="conf", config_name="evaluate")
def main(cfg: DictConfig) -> None:
    """Hand the composed configuration to the evaluation."""
    from ffd_lightning.app.evaluate import evaluate_job

    evaluate_job(cfg)


if __name__ == "__main__":
    sys.argv[1:] = quote_paths(sys.argv[1:], ("run", "checkpoint", "prepared", "data_root"))
    run_app(main)
