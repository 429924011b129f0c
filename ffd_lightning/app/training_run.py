"""One run from configuration to evaluated network, resumable at any moment."""

import logging
import warnings
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from lightning import Trainer, seed_everything
from lightning.pytorch.utilities import rank_zero_only
from lightning.pytorch.utilities.exceptions import MisconfigurationException

from ffd_lightning.app import identity
from ffd_lightning.app.build import (
    build_callbacks,
    build_data,
    build_module,
    build_network,
    build_protocol,
    build_trainer,
)
from ffd_lightning.app.checks import validate
from ffd_lightning.app.config import EvaluateConfig, TrainConfig
from ffd_lightning.app.first_weights import leak_warning
from ffd_lightning.checkpoint import read_checkpoint
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.data.templates.distances import outlier_note, outlier_rows, template_rows
from ffd_lightning.data.twins import twin_warning, twins
from ffd_lightning.errors import ConfigError, DataError, UserError
from ffd_lightning.evaluation.evaluator import (
    SHARED_FOLDER,
    EvaluatedNetwork,
    EvaluationOptions,
    evaluate,
    with_labels,
)
from ffd_lightning.evaluation.figures import reconstruction_figure, template_figure
from ffd_lightning.evaluation.protocols import ProtocolDescription
from ffd_lightning.evaluation.samples import Subset, predict_in_chunks
from ffd_lightning.evaluation.summaries import template_ranking
from ffd_lightning.files import write_bytes_atomic, write_csv
from ffd_lightning.imaging.grid import png
from ffd_lightning.nn.network import TemplateFfdNetwork, compile_encoder
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.terminal import counted
from ffd_lightning.training.callbacks import (
    Clock,
    Progress,
    Reconstructions,
    TemplateSelection,
    example_rows,
)
from ffd_lightning.training.checkpoints import Checkpoints, WholeFiles
from ffd_lightning.training.module import FfdModule
from ffd_lightning.training.tensorboard import StepLogger

log = logging.getLogger(__name__)

_NOISE = (
    "smaller than the logging interval",
    "LeafSpec",
    "Total length of `list`",  # split.val_fraction=0
    "exists and is not empty",
)  # warnings of Lightning's that say nothing to users


def train(cfg: TrainConfig, run: RunFolder) -> dict[str, float]:
    """Train and evaluate one run; resume where an earlier attempt stopped.

    Returns:
        The summary of the evaluation; read back if the run is finished already; {} in further
        processes of a distributed run.

    Raises:
        ConfigError: settings that cannot work, or a folder that holds a run with other settings.
        DataError: data that is missing or damaged.
    """
    validate(cfg)
    cfg.paths.data = str(Path(cfg.paths.data).absolute())  # a run may be opened from elsewhere
    if _rank() != 0:
        return _train(cfg, run)
    with run.lock():
        identity.check_folder(cfg, run)
        for unfinished in run.checkpoint.parent.glob(".*.tmp"):  # a kill while it was written
            unfinished.unlink()
        asked = {
            "name": str(_evaluation_folder(run, cfg).relative_to(run.evaluation(""))),
            "settings": build_protocol(cfg.protocol).key,
            "references": cfg.evaluation.references,
            "subset": cfg.evaluation.subset,
        }
        if run.finished and run.status.get("evaluation") == asked:
            log.info("%s is finished already; restart=true would train it again", run.path)
            with suppress(UserError, OSError):  # of data that is gone since
                if not run.is_of_data(build_data(cfg).sources):
                    log.warning("%s: its shapes have changed since it was trained", run.path)
            return dict(run.status["summary"])
        trained = run.finished  # and stays so, whatever becomes of an evaluation in another way
        if not trained:
            run.set_status("running")
        try:
            summary = _train(cfg, run)
        except Exception as error:
            if not trained:
                name = "" if isinstance(error, UserError) else f"{type(error).__name__}: "
                with suppress(OSError):  # of a full disk: the first error is the one to show
                    run.set_status("failed", reason=f"{name}{error}")
            raise
        run.set_status("finished", evaluation=asked, summary=summary)
        (run.path / "progress.json").unlink(missing_ok=True)
        return summary


def _rank() -> int:
    return getattr(rank_zero_only, "rank", 0)


def _train(cfg: TrainConfig, run: RunFolder) -> dict[str, float]:
    seed_everything(cfg.seed, verbose=False)
    data = build_data(cfg)
    data.prepare_data()
    data.setup()
    network, protocol = build_network(cfg), build_protocol(cfg.protocol)
    subject = evaluated(cfg, network, data)
    with_labels(subject, protocol, cfg.evaluation.references)  # refused now, not after the training
    if cfg.trainer.compile:
        compile_encoder(network)
    module = build_module(cfg, network, _record(cfg))
    train_on, validate_on, test_on = map(len, data.split)
    made = f" and {counted(len(data.variants), 'variant')}" if data.variants else ""
    log.info(
        f"{run.path}: {cfg.category.name}, regime {cfg.regime.name}, "
        f"{counted(len(data.bank), 'template')}, {counted(train_on, 'shape')}{made} to train on, "
        f"{validate_on} to validate on, {test_on} to test on, "
        f"{cfg.schedule.steps} steps"
    )
    tested = [data.prepared.ids[row] for row in subject.tested_on.rows]
    copies = twin_warning(len(subject.twins), len(tested))
    alike = {of.categories[0]: twins(of.originals) for of in data.prepared.members}
    leak = leak_warning(cfg, tested, alike)
    for warning in filter(None, (data.split.warning(), leak, copies)):
        log.warning("%s: %s", run.path, warning)
    done, last = _steps(cfg, run, data)
    if _rank() == 0:
        if not run.data:
            run.set_data(data.record())
        _record_templates(run, data)
    clock = Clock(cfg.logger.every)
    trainer = _trainer(cfg, run, done, last, clock)
    _fit(trainer, module, data, run.checkpoint if done else None)
    trainer.save_checkpoint(run.checkpoint)  # whatever trainer.checkpoint_every divides
    if not trainer.is_global_zero:
        return {}
    network.to(trainer.strategy.root_device)  # Lightning leaves it on the CPU
    options = evaluation_options(cfg, data, cfg.trainer.progress_bar)
    _rank_templates(cfg, run, data, network, options.workers)
    count, steps = len(tested), trainer.global_step
    log.info("%s: evaluating %d %s shapes", run.path, count, cfg.evaluation.subset)
    run.set_progress("evaluating", 0, count, None)
    subject = replace(subject, step=steps)
    summary = evaluate(subject, protocol, _evaluation_folder(run, cfg), options)
    summary["seconds_per_step"] = clock.seconds_per_step
    logger = trainer.logger if isinstance(trainer.logger, StepLogger) else None
    if rows := example_rows(data, cfg.callbacks.figure_examples):
        figure = reconstruction_figure(network, data.prepared, data.bank, rows)
        write_bytes_atomic(run.path / "reconstructions.png", png(figure))
        if logger is not None:
            tag = "worked_examples/reconstructions"
            logger.experiment.add_image(tag, np.asarray(figure), steps, dataformats="HWC")
    if logger is not None:
        described = ProtocolDescription.of(protocol)
        logger.log_results(identity.hyperparameters(cfg), summary, described, steps)
        logger.finalize("success")
    return summary


def evaluated(
    cfg: TrainConfig | EvaluateConfig,
    network: TemplateFfdNetwork,
    data: FfdDataModule,
    step: int = 0,
) -> EvaluatedNetwork:
    """Return what is evaluated: a network, and the shapes of `evaluation.subset`."""
    ids = data.split.test if cfg.evaluation.subset == "test" else data.split.val
    if not ids:
        raise ConfigError(
            "evaluation.subset=val: there are no validation shapes (split.val_fraction)"
        )
    trained_on, tested_on = (Subset(data.prepared, data.rows(x)) for x in (data.split.train, ids))
    seen = data.seen_twins.intersection(ids)
    return EvaluatedNetwork(network, data.bank, trained_on, tested_on, step, seen)


def evaluation_options(
    cfg: TrainConfig | EvaluateConfig, data: FfdDataModule, progress: bool, restart: bool = False
) -> EvaluationOptions:
    """Return how `cfg.evaluation` has it evaluated."""
    return EvaluationOptions(
        references=cfg.evaluation.references,
        all_views=cfg.evaluation.all_views,
        seed=cfg.evaluation.seed,
        workers=cfg.evaluation.workers or torch.get_num_threads(),
        progress=progress,
        restart=restart,
        shared=data.root / SHARED_FOLDER,
    )


def _evaluation_folder(run: RunFolder, cfg: TrainConfig) -> Path:
    return run.evaluation(identity.evaluation_name(cfg), cfg.evaluation.subset)


def _record(cfg: TrainConfig) -> dict[str, Any]:
    """Return what checkpoints say of the training; they may be handed to others, so no paths."""
    names = (cfg.name, cfg.category.name, cfg.regime.name, cfg.templates.name, f"seed{cfg.seed}")
    settings = identity.identity(cfg)
    paths = {k for k, v in settings.items() if isinstance(v, str) and ("/" in v or "\\" in v)}
    return {
        "run": "/".join(names),
        "regime": cfg.regime.name,
        "settings": {key: value for key, value in settings.items() if key not in paths},
    }


def _steps(cfg: TrainConfig, run: RunFolder, data: FfdDataModule) -> tuple[int, int]:
    """Return the step of the run's checkpoint, 0 without one, and the last step of its training.

    A callback may have ended the training early: then the checkpoint's step is its last.
    """
    if not run.checkpoint.exists():
        return 0, cfg.schedule.steps
    try:
        found = read_checkpoint(run.checkpoint)
        bank = TemplateBank.from_state(found["model"]["templates"])
        epochs = found["loops"]["fit_loop"]["epoch_progress"]["current"]["completed"]
    except (DataError, KeyError, TypeError, ValueError):  # cut off, or not of this training
        problem = "is damaged"
    else:
        if bank.is_of(data.bank):
            if not run.is_of_data(data.sources):
                log.warning(
                    "%s: its shapes have changed since it was begun, in their files or in how "
                    "these are read. It goes on with what they are now; restart=true begins anew",
                    run.path,
                )
            done = int(found["global_step"])
            ended = done > 0 and epochs > 0  # the whole training is one epoch
            return done, done if ended else cfg.schedule.steps
        problem = f"has other templates than there are now, the first of them {data.bank.ids[0]}"
    raise DataError(
        f"the checkpoint {run.checkpoint} {problem}: add restart=true to train from the start"
    )


def _record_templates(run: RunFolder, data: FfdDataModule) -> None:
    """Write `templates.csv`, `templates.png` and, if there are outliers, `outliers.csv`."""
    bank = data.bank
    rows, coverage = template_rows(data.prepared, bank)
    write_csv(run.path / "templates.csv", rows)
    notes = [f"nearest to {100 * row['share']:.0f}% of the shapes" for row in rows]
    write_bytes_atomic(run.path / "templates.png", png(template_figure(bank, notes)))
    log.info(
        f"{run.path}: T = {len(bank)} templates (templates.csv, templates.png); mean box "
        f"Chamfer x 1000 of the other shapes to the nearest: {1000 * coverage:.1f}"
    )
    (run.path / "outliers.csv").unlink(missing_ok=True)
    if outliers := outlier_rows(data.prepared):
        write_csv(run.path / "outliers.csv", outliers)
        note = outlier_note(data.prepared, outliers, data.drop_outliers)
        chosen = len({row["id"] for row in outliers}.intersection(bank.ids))
        log.warning("%s: %s (outliers.csv); %d of them are templates", run.path, note, chosen)


def _rank_templates(
    cfg: TrainConfig, run: RunFolder, data: FfdDataModule, network: TemplateFfdNetwork, workers: int
) -> None:
    """Write how often each template is selected: a choice, so not on test shapes."""
    on_train = cfg.template_ranking.subset == "train"
    ids = data.split.train if on_train else data.split.selection_ids
    samples = Subset(data.prepared, data.rows(ids)).samples(cfg.template_ranking.all_views)
    log.info("%s: ranking the templates on %s", run.path, counted(len(samples), "image"))
    predictions = predict_in_chunks(network, data.prepared, samples, workers)
    write_csv(run.path / "template_ranking.csv", template_ranking(data.bank, predictions))


def _fit(trainer: Trainer, module: FfdModule, data: FfdDataModule, checkpoint: Path | None) -> None:
    with warnings.catch_warnings():
        for text in _NOISE:
            warnings.filterwarnings("ignore", f".*{text}.*")
        try:
            trainer.fit(module, datamodule=data, ckpt_path=checkpoint)
        except SystemExit:
            # Lightning turns Ctrl-C into an exit; the entry script says how to resume.
            raise KeyboardInterrupt from None
        except MisconfigurationException as error:  # of a callback or an lr_schedule, say
            raise ConfigError(" ".join(str(error).split())) from error


def _trainer(cfg: TrainConfig, run: RunFolder, done: int, last: int, clock: Clock) -> Trainer:
    figures, batches = cfg.callbacks, cfg.trainer.accumulate_grad_batches
    name = f"{cfg.category.name} {cfg.regime.name} {cfg.templates.name} {run.path.name}"
    callbacks = [
        clock,
        Progress(run, clock, cfg.trainer.progress_bar),
        TemplateSelection(),
        Reconstructions(
            figures.figure_examples, figures.training_examples, figures.training_figures, name
        ),
        Checkpoints(
            dirpath=run.checkpoint.parent,
            filename=run.checkpoint.stem,
            every_n_train_steps=cfg.trainer.checkpoint_every,
            save_top_k=1,
            enable_version_counter=False,
        ),
        *build_callbacks(cfg),
    ]
    logger = StepLogger(
        save_dir=run.path,
        name="",
        version="",  # TensorBoard names a run after the folder of its log
        default_hp_metric=False,
        # Steps after the checkpoint are done again: hide what the killed attempt wrote of them.
        purge_step=done + 1 if done else None,
    )
    return build_trainer(
        cfg.trainer,
        max_steps=last,
        max_epochs=-1,
        val_check_interval=min(cfg.trainer.val_every, last) * batches,
        num_sanity_val_steps=0,
        log_every_n_steps=cfg.logger.every,
        logger=logger if cfg.logger.tensorboard else False,
        callbacks=callbacks,
        plugins=WholeFiles(),
        use_distributed_sampler=False,
        enable_progress_bar=False,  # ours is `Progress`
        enable_model_summary=False,
        default_root_dir=run.path,
    )
