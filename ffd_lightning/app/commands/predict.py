"""`ffd predict`: what photographs show."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from ffd_lightning.app.config import PredictConfig
from ffd_lightning.app.configuration import run_hydra

SCHEMA = PredictConfig


def main(arguments: Sequence[str]) -> None:
    """Reconstruct what the command line names."""
    run_hydra("predict", PredictConfig, predict_job, arguments, ("run", "image", "mask", "out"))


def predict_job(cfg: PredictConfig) -> None:
    """Reconstruct photographs; the exit code is 1 if one failed."""
    from ffd_lightning.app.photo_run import predict_files

    outcomes = predict_files(cfg)
    failed = sum(bool(outcome.error) for outcome in outcomes)
    known = sum(outcome.known for outcome in outcomes)
    if len(outcomes) > 1 or known:
        there = f", {known} of them there already (restart=true does them again)" if known else ""
        print(f"{len(outcomes) - failed} of {len(outcomes)} photographs done{there}: {cfg.out}")
    sys.exit(int(failed > 0))
