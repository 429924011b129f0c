"""`ffd evaluate`: a run's scores under a protocol."""

from __future__ import annotations

import logging
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ffd_lightning.app.config import EvaluateConfig
from ffd_lightning.app.configuration import compose_config, config_folder, typed_config
from ffd_lightning.app.settings import read_options
from ffd_lightning.errors import ConfigError
from ffd_lightning.run_folder import RunFolder

_FILES = ("run", "checkpoint", "prepared", "data_root")
_DIGITS = 8  # of digests in names


def main(arguments: Sequence[str]) -> int:
    """Evaluate what the command line names, and print the table."""
    from ffd_lightning.app.build import build_protocol
    from ffd_lightning.app.help import command_help
    from ffd_lightning.evaluation.tables import print_summary

    options, words = read_options("evaluate", arguments, "-h", "--help")
    if options.help or options.h:
        more = [] if options.config_dir is None else [Path(options.config_dir)]
        print(command_help("evaluate", EvaluateConfig, [config_folder(), *more], "all" in words))
        return 0
    files = {k: v for k, _, v in (word.partition("=") for word in words) if k in _FILES and v}
    rest = [word for word in words if word.partition("=")[0] not in files]
    composed = compose_config("evaluate", EvaluateConfig, rest, options.config_dir)
    for key, name in files.items():  # names of files are taken as they are
        composed[key] = None if name == "null" else name
    cfg = typed_config(composed, EvaluateConfig)
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stdout)
    summary, folder = evaluate_run(cfg)
    shapes = cfg.evaluation.subset if cfg.prepared is None else Path(cfg.prepared).name
    print_summary(folder, build_protocol(cfg.protocol), summary, shapes)
    return 0


def evaluate_run(cfg: EvaluateConfig) -> tuple[dict[str, float], Path]:
    """Evaluate a run folder under a protocol; read the result back where it is there already.

    Returns:
        The summary, and the folder of the results. What is not measured as a training measures it,
        or not of the network that it ended with on its test shapes, is in a folder of its own.
    """
    import numpy as np

    from ffd_lightning.app.build import build_protocol
    from ffd_lightning.app.identity import evaluation_name
    from ffd_lightning.app.open_run import open_run
    from ffd_lightning.app.training_run import evaluated, evaluation_options
    from ffd_lightning.checkpoint import load_model
    from ffd_lightning.data.preparation.prepared import PreparedSet
    from ffd_lightning.evaluation.evaluator import evaluate, weights_digest
    from ffd_lightning.evaluation.samples import Subset
    from ffd_lightning.inference.predictor import choose_device

    protocol, device = build_protocol(cfg.protocol), choose_device(cfg.device)
    if Path(cfg.run).is_file():
        raise ConfigError(
            f"run={cfg.run} is a checkpoint, which does not say on what shapes to test its "
            "network: give run=RUN checkpoint=FILE, with a run of the same templates; or evaluate "
            "in the script that trained it, as docs/python.md shows"
        )
    run = RunFolder.at(cfg.run)
    checkpoint = Path(cfg.checkpoint) if cfg.checkpoint else None
    opened = open_run(run, cfg.data_root, checkpoint, prepare=True)
    subject = evaluated(cfg, opened.network, opened.data, opened.step)
    subset: str = cfg.evaluation.subset
    if cfg.prepared is not None:
        other = PreparedSet.open(Path(cfg.prepared)).originals
        rows = [k for k, i in enumerate(other.ids) if i not in opened.data.bank.ids]
        tested_on = Subset(other, np.asarray(rows, np.int64))
        subject = replace(subject, tested_on=tested_on, twins=frozenset())
        subset = f"{other.path.resolve().name}-{other.digest[:_DIGITS]}"
    weights = weights_digest(opened.network)
    newest = checkpoint is None or (
        run.checkpoint.is_file() and weights_digest(load_model(run.checkpoint).network) == weights
    )
    if not (newest and run.finished):  # a checkpoint of an unfinished training will be another
        subset = f"weights-{weights[:_DIGITS]}_{subset}".removesuffix("_test")
    opened.network.to(device)
    options = evaluation_options(cfg, opened.data, cfg.progress_bar, cfg.restart)
    folder = run.evaluation(evaluation_name(cfg), subset)
    return evaluate(subject, protocol, folder, options), folder
