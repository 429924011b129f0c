"""`ffd evaluate`: a run's scores under a protocol."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ffd_lightning.app.config import EvaluateConfig
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.app.settings import read_options, read_value
from ffd_lightning.components import settings_of
from ffd_lightning.errors import ConfigError
from ffd_lightning.run_folder import RunFolder

if TYPE_CHECKING:
    from ffd_lightning.checkpoint import TrainedModel
    from ffd_lightning.data.datamodule import FfdDataModule
    from ffd_lightning.data.preparation.prepared import PreparedSet
    from ffd_lightning.evaluation.protocols import Protocol
    from ffd_lightning.evaluation.samples import Subset
    from ffd_lightning.geometry.mesh import Mesh
    from ffd_lightning.inference.own_templates import OwnTemplates

log = logging.getLogger(__name__)

_FILES = ("run", "checkpoint", "prepared", "data_root", "templates")
_DIGITS = 8  # of digests in names
_SAME = 1e-4  # by which moments of one mesh may differ: files round coordinates


def main(arguments: Sequence[str]) -> int:
    """Evaluate what the command line names, and print the table."""
    from ffd_lightning.app.build import build_protocol
    from ffd_lightning.app.help import command_help

    options, words = read_options("evaluate", arguments, "-h", "--help")
    if options.help or options.h:
        print(command_help("evaluate", EvaluateConfig, options.config_dir, "all" in words))
        return 0
    cfg = read_config(words, options.config_dir)
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stdout)
    summary, folder = evaluate_run(cfg)
    shapes = cfg.evaluation.subset if cfg.prepared is None else Path(cfg.prepared).name
    print_summary(build_protocol(cfg.protocol), summary, shapes)
    print(f"samples.csv and summary.json: {folder}")
    return 0


def print_summary(protocol: Protocol, summary: Mapping[str, float], shapes: str) -> None:
    """Print a row for each candidate that was scored and a column for each metric."""
    from ffd_lightning.analysis.table import Table, number
    from ffd_lightning.evaluation.candidates import CANDIDATES
    from ffd_lightning.terminal import counted, table_console, terminal_width

    def cells(prefix: str) -> list[str]:
        named = [(m, summary.get(f"{prefix}_{m.name}".removeprefix("_"))) for m in protocol.metrics]
        return ["" if x is None else number(m.factor * x) for m, x in named]

    every = ([meaning, *cells(name)] for name, meaning in CANDIDATES.items())
    rows = [row for row in every if "" not in row]
    if twins := summary.get("num_twins"):
        title = f"model, less {twins:.0f} near copies of training shapes"
        rows.append([title, *cells("without_twins")])
    head = ["", *(f"{m.scaled_title} {m.arrow}" for m in protocol.metrics)]
    title = f"Means over {counted(summary['num_samples'], 'image')} of {shapes} shapes"
    note = "; ".join(f"{m.title}: {m.definition}" for m in protocol.metrics)
    table = Table(title, head, rows, note=f"{note}. {protocol.note}.")
    table_console().print(table.rich(terminal_width()))
    print(
        f"effective templates {summary['effective_templates']:.1f}; {summary['folded']:.1%} of the "
        f"surface folded, edges stretched {summary['stretch_95']:.2f} times (95th percentile)"
    )


def read_config(words: Sequence[str], config_dir: str | None = None) -> EvaluateConfig:
    """Return the settings of a command line."""
    files = {k: v for k, _, v in (word.partition("=") for word in words) if k in _FILES and v}
    rest = [word for word in words if word.partition("=")[0] not in files]
    composed = compose_config("evaluate", EvaluateConfig, rest, config_dir)
    for key, text in files.items():
        composed[key] = read_value(text, settings_of(EvaluateConfig)[key].hint)
    return typed_config(composed, EvaluateConfig)


def evaluate_run(cfg: EvaluateConfig) -> tuple[dict[str, float], Path]:
    """Evaluate a run folder under a protocol; read the result back where it is there already.

    Returns:
        The summary, and the folder of the results. What is not measured as a training measures it,
        or not of the network that it ended with on its test shapes, is in a folder of its own.
    """
    from ffd_lightning.app.build import build_protocol
    from ffd_lightning.app.identity import evaluation_name
    from ffd_lightning.app.open_run import open_run
    from ffd_lightning.app.training_run import evaluated, evaluation_options
    from ffd_lightning.checkpoint import load_model
    from ffd_lightning.data.preparation.prepared import PreparedSet
    from ffd_lightning.evaluation.evaluator import evaluate, weights_digest
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
    if not run.is_of_data(opened.data.sources):
        log.warning(
            f"shapes of {run.path} have changed since it was trained, in their files or in how "
            "these are read: the scores are kept beside those of its own"
        )
        changed = opened.data.prepared.digest[:_DIGITS]
        subset = f"data-{changed}_{subset}".removesuffix("_test")
    if cfg.prepared is not None:
        tested_on = _of_set(PreparedSet.open(Path(cfg.prepared)).originals, opened.data)
        subject = replace(subject, tested_on=tested_on, twins=frozenset())
        other = tested_on.prepared
        subset = f"{other.path.resolve().name}-{other.digest[:_DIGITS]}"
    if (told := _told(cfg, opened.data, checkpoint or run.checkpoint)) is not None:
        model, own = told
        left = _without(subject.tested_on, model.bank.meshes)
        among = own.shapes or subject.trained_on  # that are retrieved
        subject = replace(subject, network=model.network, bank=model.bank)
        subject = replace(subject, tested_on=left, trained_on=among)
        named = "beside" if cfg.beside else "templates"
        subset = f"{named}-{own.digest[:_DIGITS]}_{subset}".removesuffix("_test")
    weights = weights_digest(opened.network)
    newest = checkpoint is None or (
        run.checkpoint.is_file() and weights_digest(load_model(run.checkpoint).network) == weights
    )
    if not (newest and run.finished):  # a checkpoint of an unfinished training will be another
        subset = f"weights-{weights[:_DIGITS]}_{subset}".removesuffix("_test")
    subject.network.to(device)
    options = evaluation_options(cfg, opened.data, cfg.progress_bar, cfg.restart)
    folder = run.evaluation(evaluation_name(cfg), subset)
    return evaluate(subject, protocol, folder, options), folder


def _of_set(other: PreparedSet, data: FfdDataModule) -> Subset:
    """Return the shapes of another prepared set that are no templates of a run's data."""
    import numpy as np

    from ffd_lightning.evaluation.samples import Subset

    prefix = f"{other.category(0)}/" if len(data.categories) > 1 else ""
    ids = [f"{prefix}{i}" for i in other.ids]  # as the run has them
    rows = [k for k, i in enumerate(ids) if i not in data.bank.ids]
    known = {*data.split.train, *data.split.val}
    if seen := sum(ids[row] in known for row in rows):
        log.warning(
            f"{seen} of {len(rows)} shapes have ids of shapes that the run was trained or "
            "validated on: such scores say nothing of new shapes"
        )
    return Subset(other, np.asarray(rows, np.int64))


def _told(
    cfg: EvaluateConfig, data: FfdDataModule, checkpoint: Path
) -> tuple[TrainedModel, OwnTemplates] | None:
    """Return a run's model with the templates that are asked for, and these."""
    from ffd_lightning.checkpoint import load_model
    from ffd_lightning.inference.own_templates import of_prepared, tell

    model = load_model(checkpoint)
    if cfg.templates == ["train"]:
        cfg.check_unused("templates=train are the run's own shapes, as they are")
        val = () if cfg.evaluation.subset == "val" else data.split.val
        ids = sorted({*data.split.train, *data.bank.ids, *val})
        own: OwnTemplates | None = of_prepared(model, data.prepared, ids)
    else:
        own = cfg.named_templates(model, data.root, cfg.progress_bar)
    return None if own is None else (tell(model, own, cfg.progress_bar, cfg.beside), own)


def _without(shapes: Subset, meshes: Iterable[Mesh]) -> Subset:
    """Return the shapes whose mesh is none of some, whatever they are called.

    Raises:
        ConfigError: none is left.
    """
    from scipy.spatial import cKDTree

    known = cKDTree([mesh.moments() for mesh in meshes])
    prepared, rows = shapes
    new = [known.query(prepared.mesh(int(row)).moments())[0] > _SAME for row in rows]
    if not any(new):
        raise ConfigError("all shapes to test on are among the templates")
    return shapes._replace(rows=rows[new])
