"""From a run folder to its scores under a protocol."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import torch
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from ffd_lightning.app.cli import explain
from ffd_lightning.app.config import EvaluateConfig, typed_config
from ffd_lightning.app.open_run import open_run
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import UserError
from ffd_lightning.evaluation.evaluator import Models, Options, Subject, evaluate
from ffd_lightning.evaluation.protocols import PROTOCOLS
from ffd_lightning.parallel import available_cores
from ffd_lightning.run_folder import RunFolder


def evaluate_job(cfg: DictConfig) -> None:
    """Evaluate what Hydra composed, and print the table."""
    try:
        config = typed_config(cfg, EvaluateConfig)
        summary = evaluate_run(config)
    except (UserError, OmegaConfBaseException) as error:
        # Not as an exception: Hydra would put a line of its own above it.
        sys.exit(f"error: {explain(error)}")
    from ffd_lightning.evaluation.tables import print_summary

    print_summary(RunFolder(Path(config.run)), PROTOCOLS[config.protocol], summary)


def evaluate_run(cfg: EvaluateConfig) -> dict[str, float]:
    """Evaluate a run folder under a protocol; read the result back where it is there already.

    Raises:
        ConfigError: no run, no checkpoint, or one that does not fit.
        DataError: data that is missing or damaged.
    """
    run = RunFolder(Path(cfg.run))
    checkpoint = Path(cfg.checkpoint) if cfg.checkpoint else None
    _, network, data, step = open_run(run, cfg.data_root, checkpoint)
    tested_on = Models(data.prepared, data.rows(data.split.test))
    if cfg.prepared is not None:
        other = PreparedSet.open(Path(cfg.prepared))
        rows = [k for k, i in enumerate(other.ids) if i not in data.bank.ids]
        tested_on = Models(other, np.asarray(rows, np.int64))
    device = cfg.device
    if device == "auto":
        device = "cuda" if torch.cuda.is_available() else "cpu"
    subject = Subject(
        network.to(device),
        data.bank,
        Models(data.prepared, data.rows(data.split.train)),
        tested_on,
        step,
    )
    options = Options(
        references=cfg.references,
        all_views=cfg.all_views,
        seed=cfg.seed,
        workers=cfg.workers or available_cores(),
        progress=cfg.progress_bar,
        restart=cfg.restart,
    )
    return evaluate(subject, PROTOCOLS[cfg.protocol], run.evaluation(cfg.protocol.value), options)
