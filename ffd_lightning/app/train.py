"""One run from configuration to evaluated model, resumable at any moment."""

from __future__ import annotations

import logging
import pickle
import subprocess
import sys
import warnings
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from hydra.conf import HydraConf
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from lightning import Callback, Trainer, seed_everything
from lightning.pytorch.callbacks import ModelCheckpoint
from lightning.pytorch.utilities import rank_zero_only
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException
from PIL import Image

from ffd_lightning.app.checks import validate
from ffd_lightning.app.cli import explain
from ffd_lightning.app.config import TrainConfig, typed_config
from ffd_lightning.app.identity import check_folder
from ffd_lightning.app.open_run import build_data
from ffd_lightning.app.sharing import (
    give_memory_back,
    gpu_slot,
    jobs_at_once,
    share_of_cores,
    visible_gpus,
)
from ffd_lightning.checkpoint import build_network, model_entry
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.errors import DataError, UserError
from ffd_lightning.evaluation.evaluator import Models, Options, Subject, evaluate, measurable
from ffd_lightning.evaluation.figures import reconstruction_figure
from ffd_lightning.evaluation.protocols import PROTOCOLS
from ffd_lightning.files import write_atomic
from ffd_lightning.imaging.appearance import MOST_IMAGES, TrainingAppearance
from ffd_lightning.losses.objective import Objective
from ffd_lightning.nn.network import TemplateFfdNetwork, compile_encoder
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.training.callbacks import (
    StepProgressBar,
    StepTimer,
    example_rows,
    tensorboard_callbacks,
)
from ffd_lightning.training.module import FfdModule
from ffd_lightning.training.progress import ProgressNote
from ffd_lightning.training.tensorboard import StepLogger

log = logging.getLogger(__name__)


def train_job(cfg: DictConfig) -> dict[str, float] | None:
    """Run what Hydra composed: train, evaluate, and write the run folder Hydra named.

    In a multirun a failed job is recorded in its `status.json` and does not stop the others.
    """
    hydra = HydraConfig.get()
    run = RunFolder(Path(hydra.runtime.output_dir))
    if hydra.mode is not RunMode.MULTIRUN:
        try:
            return train(typed_config(cfg, TrainConfig), run)
        except (UserError, OmegaConfBaseException) as error:
            # Not as an exception: Hydra would put a line of its own above it.
            sys.exit(f"error: {explain(error)}")
    try:
        return _train_in_sweep(typed_config(cfg, TrainConfig), run, hydra)
    except (UserError, OmegaConfBaseException) as error:
        log.error("%s failed: %s", run.path, explain(error))
    except Exception:
        log.exception("%s failed", run.path)
    finally:
        give_memory_back()
    return None


def _train_in_sweep(cfg: TrainConfig, run: RunFolder, hydra: HydraConf) -> dict[str, float] | None:
    """Train one job of a sweep on its share of the machine."""
    if cfg.trainer.strategy.startswith("ddp") and not run.finished:
        return _train_in_own_process(run, hydra)
    alone = cfg.trainer.strategy == "auto" and cfg.trainer.devices in ("auto", "1")
    gpus = visible_gpus() if alone and cfg.trainer.accelerator in ("auto", "gpu", "cuda") else []
    with share_of_cores(jobs_at_once(hydra.launcher)):
        if run.finished or not gpus:
            return train(cfg, run)
        with gpu_slot(gpus, cfg.trainer.jobs_per_gpu) as gpu:
            cfg.trainer.devices = f"{gpu},"  # a list of one, as Lightning writes it
            return train(cfg, run)


def _train_in_own_process(run: RunFolder, hydra: HydraConf) -> dict[str, float] | None:
    """Train a job as a run of its own, which Lightning can start again for each further device.

    It starts the command that it finds itself in: here that would be the whole sweep.
    """
    script = Path(__file__).parents[2] / "train.py"
    place = f"hydra.run.dir='{run.path}'"
    command = [sys.executable, str(script), *hydra.overrides.task, place]
    if subprocess.run(command, check=False).returncode == 0:
        return dict(run.status["summary"])
    log.error("%s failed: see its messages above", run.path)
    return None


def train(cfg: TrainConfig, run: RunFolder) -> dict[str, float]:
    """Train and evaluate one run; go on where an earlier attempt stopped.

    Args:
        cfg: the whole configuration.
        run: where everything is written.

    Returns:
        The summary of the evaluation; read back if the run is finished already; {} in further
        processes of a distributed run.

    Raises:
        ConfigError: settings that cannot work, or a folder that holds a run with other settings.
        DataError: data that is missing or damaged.
    """
    validate(cfg)
    cfg.paths.data = str(Path(cfg.paths.data).absolute())  # a run may be opened from elsewhere
    if getattr(rank_zero_only, "rank", 0) != 0:
        return _train(cfg, run)
    with run.lock():
        check_folder(cfg, run)
        evaluated = {
            "protocol": cfg.evaluation.protocol.value,
            "references": cfg.evaluation.references,
        }
        if run.finished and run.status.get("evaluation") == evaluated:
            log.info("%s is finished already; restart=true would train it again", run.path)
            return dict(run.status["summary"])
        run.set_status("running", steps=cfg.schedule.steps)
        try:
            summary = _train(cfg, run)
        except Exception as error:
            name = "" if isinstance(error, UserError) else f"{type(error).__name__}: "
            run.set_status("failed", reason=f"{name}{error}")
            raise
        run.set_status("finished", steps=cfg.schedule.steps, evaluation=evaluated, summary=summary)
        (run.path / "progress.json").unlink(missing_ok=True)
        return summary


def _train(cfg: TrainConfig, run: RunFolder) -> dict[str, float]:
    logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)  # devices, tips, farewells
    seed_everything(cfg.seed, verbose=False)
    data = build_data(cfg)
    data.prepare_data()
    data.setup()
    train_rows = data.rows(data.split.train)
    looks = TrainingAppearance.of(data.prepared.spread_images(train_rows, MOST_IMAGES))
    network = build_network(cfg)
    subject = _subject(network, data)
    # Told now, not after the training.
    measurable(subject, PROTOCOLS[cfg.evaluation.protocol], cfg.evaluation.references)
    if cfg.trainer.compile:
        compile_encoder(network)
    module = FfdModule(
        network,
        Objective(
            weighting=cfg.regime.weighting,
            entropy_weight=cfg.regime.entropy_weight,
            offset_weight=cfg.regime.offset_weight,
            annealing_steps=cfg.schedule.annealing_steps,
        ),
        learning_rate=cfg.schedule.learning_rate,
        learning_rate_decay=cfg.schedule.learning_rate_decay,
        steps=cfg.schedule.steps,
        seed=cfg.seed,
        kept=model_entry(cfg, data.bank, looks),
    )
    log.info(
        "%s: %s, regime %s, %d templates, %d models to train on, %d to test on, %d steps",
        run.path,
        cfg.category.name,
        cfg.regime.name,
        len(data.bank),
        len(data.split.train),
        len(data.split.test),
        cfg.schedule.steps,
    )
    done = _checkpoint_step(run)
    timer = StepTimer()
    with warnings.catch_warnings():
        # One loader item is a whole batch, made from memory-mapped arrays: no workers are needed.
        warnings.filterwarnings("ignore", ".*does not have many workers.*")
        warnings.filterwarnings("ignore", ".*mid-epoch.*")
        warnings.filterwarnings("ignore", ".*smaller than the logging interval.*")
        warnings.filterwarnings("ignore", ".*LeafSpec.*")
        warnings.filterwarnings("ignore", ".*exists and is not empty.*")
        trainer = _trainer(cfg, run, done, timer)
        try:
            trainer.fit(module, datamodule=data, ckpt_path=run.checkpoint if done else None)
        except SystemExit:
            # Lightning turns Ctrl-C into an exit; the entry script says how to go on.
            raise KeyboardInterrupt from None
    trainer.save_checkpoint(run.checkpoint)  # whatever schedule.checkpoint_every divides
    if not trainer.is_global_zero:
        return {}
    return _finish(cfg, run, data, subject, trainer, timer)


def _subject(network: TemplateFfdNetwork, data: FfdDataModule) -> Subject:
    """Return what will be evaluated when the network is trained."""
    train, test = (data.rows(ids) for ids in (data.split.train, data.split.test))
    return Subject(network, data.bank, Models(data.prepared, train), Models(data.prepared, test), 0)


def _checkpoint_step(run: RunFolder) -> int:
    """Return the step that the run's checkpoint continues from, 0 without one."""
    if not run.checkpoint.exists():
        return 0
    try:
        checkpoint = torch.load(run.checkpoint, map_location="cpu", weights_only=True)
        return int(checkpoint["global_step"])
    except (OSError, RuntimeError, EOFError, KeyError, pickle.PickleError, zipfile.BadZipFile):
        raise DataError(
            f"the checkpoint {run.checkpoint} is damaged: add restart=true to train from the start"
        ) from None


def _trainer(cfg: TrainConfig, run: RunFolder, done: int, timer: StepTimer) -> Trainer:
    callbacks: list[Callback] = [
        timer,
        ProgressNote(run, timer),
        *tensorboard_callbacks(
            cfg.logger.every,
            cfg.data.render,
            cfg.callbacks.figure_examples,
            cfg.callbacks.training_examples,
            cfg.callbacks.training_figures,
        ),
        ModelCheckpoint(
            dirpath=run.checkpoint.parent,
            filename=run.checkpoint.stem,
            every_n_train_steps=cfg.schedule.checkpoint_every,
            save_top_k=1,
            enable_version_counter=False,
        ),
    ]
    if cfg.trainer.progress_bar:
        callbacks.append(StepProgressBar(refresh_rate=10))
    logger = StepLogger(
        save_dir=run.path,
        name="",
        version="tensorboard",
        default_hp_metric=False,
        # Steps after the checkpoint are done again: hide what the killed attempt wrote of them.
        purge_step=done + 1 if done else None,
    )
    devices = cfg.trainer.devices
    return Trainer(
        accelerator=cfg.trainer.accelerator,
        devices=int(devices) if devices.isdecimal() else devices,
        strategy=cfg.trainer.strategy,
        precision=cfg.trainer.precision,  # type: ignore[arg-type]
        max_steps=cfg.schedule.steps,
        max_epochs=1,
        val_check_interval=min(cfg.schedule.val_every, cfg.schedule.steps),
        num_sanity_val_steps=0,
        log_every_n_steps=cfg.logger.every,
        logger=logger if cfg.logger.tensorboard else False,
        callbacks=callbacks,
        use_distributed_sampler=False,
        enable_progress_bar=cfg.trainer.progress_bar,
        enable_model_summary=False,
        default_root_dir=run.path,
    )


def _finish(
    cfg: TrainConfig,
    run: RunFolder,
    data: FfdDataModule,
    subject: Subject,
    trainer: Trainer,
    timer: StepTimer,
) -> dict[str, float]:
    """Evaluate the trained network, draw the figure, and close the log."""
    subject.network.to(trainer.strategy.root_device)  # Lightning leaves it on the CPU
    subject = replace(subject, step=trainer.global_step)
    count = len(subject.tested_on.rows)
    options = Options(
        references=cfg.evaluation.references,
        workers=cfg.evaluation.workers or torch.get_num_threads(),
        progress=cfg.trainer.progress_bar,
    )
    protocol = PROTOCOLS[cfg.evaluation.protocol]
    folder = run.evaluation(protocol.name)
    log.info("%s: evaluating %d test models", run.path, count)
    run.set_progress("evaluating", 0, count, None)
    summary = evaluate(subject, protocol, folder, options)
    summary["seconds_per_step"] = timer.seconds_per_step
    # Where templates.strategy=ranking looks for it, whatever the protocol was.
    write_atomic(
        run.path / "template_ranking.csv", (folder / "template_ranking.csv").read_text("utf-8")
    )
    logger = trainer.logger if isinstance(trainer.logger, StepLogger) else None
    if rows := example_rows(data, cfg.callbacks.figure_examples):
        figure = reconstruction_figure(
            subject.network, data.prepared, data.bank, rows, cfg.data.render
        )
        Image.fromarray(figure).save(run.path / "reconstructions.png")
        if logger is not None:
            logger.experiment.add_image(
                "examples/reconstructions", figure, trainer.global_step, dataformats="HWC"
            )
    if logger is not None:
        logger.log_results(_hyperparameters(cfg), summary, trainer.global_step)
        logger.finalize("success")
    return summary


def _hyperparameters(cfg: TrainConfig) -> dict[str, Any]:
    """What tells runs of one study apart, flat, for TensorBoard's HPARAMS page."""
    return {
        "category": cfg.category.name,
        "regime": cfg.regime.name,
        "templates": cfg.templates.count,
        "strategy": cfg.templates.strategy.value,
        "seed": cfg.seed,
        "steps": cfg.schedule.steps,
        "batch_size": cfg.schedule.batch_size,
        "learning_rate": cfg.schedule.learning_rate,
        "annealing_steps": cfg.schedule.annealing_steps,
        "min_weight": cfg.regime.min_weight,
        "weighting": cfg.regime.weighting.value,
        "entropy_weight": cfg.regime.entropy_weight,
        "offset_weight": cfg.regime.offset_weight,
    }
