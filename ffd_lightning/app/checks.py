"""What types alone cannot check in a configuration, before anything is built."""

from __future__ import annotations

import re
from pathlib import Path

from ffd_lightning.app.config import (
    ImageKind,
    PrepareConfig,
    SourceKind,
    SplitKind,
    TemplateStrategy,
    TrainConfig,
    Weighting,
)
from ffd_lightning.errors import ConfigError


def validate(cfg: PrepareConfig) -> None:
    """Check a configuration to prepare data with, or to train with.

    Raises:
        ConfigError: names every setting that cannot work, and the way out.
    """
    checks = _data_checks(cfg)
    if isinstance(cfg, TrainConfig):
        checks += [*_number_checks(cfg), *_regime_checks(cfg)]
    problems = [message for wrong, message in checks if wrong]
    if problems:
        raise ConfigError("; ".join(problems))


_Checks = list[tuple[bool, str]]  # whether something is wrong, and what


def _number_checks(cfg: TrainConfig) -> _Checks:
    schedule = cfg.schedule
    templates, network = cfg.templates, cfg.network
    positive = {
        "schedule.steps": schedule.steps,
        "schedule.num_points": schedule.num_points,
        "schedule.learning_rate": schedule.learning_rate,
        "schedule.annealing_steps": schedule.annealing_steps,
        "schedule.val_every": schedule.val_every,
        "schedule.checkpoint_every": schedule.checkpoint_every,
        "templates.count": templates.count,
        "templates.max_edge": templates.max_edge,
        "encoder.width": cfg.encoder.width,
        "network.bottleneck": network.bottleneck,
        "network.hidden": network.hidden,
        "network.offset_std": network.offset_std,
        "logger.every": cfg.logger.every,
        "trainer.jobs_per_gpu": cfg.trainer.jobs_per_gpu,
    }
    return [
        *_all_positive(positive),
        (schedule.batch_size < 2, "schedule.batch_size must be 2 or more (batch norm needs it)"),
        (
            schedule.num_points > cfg.data.num_points,
            f"schedule.num_points={schedule.num_points} is more than "
            f"data.num_points={cfg.data.num_points}, the points kept per model",
        ),
    ]


def _all_positive(values: dict[str, float]) -> _Checks:
    return [(not value > 0, f"{key}={value} must be above 0") for key, value in values.items()]


def _data_checks(cfg: PrepareConfig) -> _Checks:
    data, render = cfg.data, cfg.data.render
    name, on_disk = data.source.value, data.source is not SourceKind.procedural
    positive = {
        "data.num_models": data.num_models,
        "data.num_points": data.num_points,
        "data.render.samples": render.samples,
        "preparation.timeout": cfg.preparation.timeout,
    }
    split_file = Path(data.split_file).expanduser() if data.split_file else None
    return [
        *_all_positive(positive),
        (on_disk and not data.root, f"data={name} needs data.root=DIR, a folder of categories"),
        (
            on_disk and bool(data.root) and not Path(str(data.root)).expanduser().exists(),
            f"data.root={data.root} does not exist",
        ),
        (
            data.images is not ImageKind.render and data.source is not SourceKind.shapenet,
            f"data.images={data.images.value} goes with data=shapenet",
        ),
        (
            data.parts_root is not None and data.source is not SourceKind.shapenet,
            f"data.parts_root={data.parts_root} goes with data=shapenet",
        ),
        (
            data.split is SplitKind.listed and not (split_file and split_file.exists()),
            "data.split=listed needs data.split_file=FILE, a file or folder that exists "
            f"(got {data.split_file})",
        ),
        (
            data.split is not SplitKind.listed and split_file is not None,
            "data.split_file needs data.split=listed",
        ),
        (not 0 < data.train_fraction < 1, "data.train_fraction must lie between 0 and 1"),
        (min(render.height, render.width) < 32, "data.render.height and width must be 32 or more"),
        (data.seed < 0, "data.seed must not be negative"),
        (not render.azimuths, "data.render.azimuths needs at least one angle"),
        (not -90 <= render.elevation <= 90, "data.render.elevation must lie in [-90, 90] degrees"),
        (
            Path(cfg.category.name).name != cfg.category.name,
            f"category.name={cfg.category.name} must be the name of a folder, not a path",
        ),
        (
            cfg.category.synset is not None and not re.fullmatch(r"\d{8}", cfg.category.synset),
            f"category.synset={cfg.category.synset} must be 8 digits; quote it",
        ),
    ]


def _regime_checks(cfg: TrainConfig) -> _Checks:
    regime, templates, network = cfg.regime, cfg.templates, cfg.network
    needs_file = templates.strategy in (TemplateStrategy.listed, TemplateStrategy.ranking)
    return [
        (
            needs_file and not all(file.is_file() for file in _template_files(cfg)),
            f"templates.strategy={templates.strategy.value} needs templates.file=FILE, a file that "
            f"exists (got {templates.file})",
        ),
        (not 0 <= regime.min_weight < 1, "regime.min_weight must lie in [0, 1)"),
        (
            regime.weighting is Weighting.log and templates.count == 1,
            "regime.weighting=log is infinite for a single template: use another regime (b, e, r) "
            "or more templates",
        ),
        (
            min(regime.entropy_weight, regime.offset_weight) < 0,
            "regime.entropy_weight and regime.offset_weight must not be negative",
        ),
        (min(network.degrees) < 1, f"network.degrees={list(network.degrees)} must be 1 or more"),
        (
            not 0 < network.batch_norm_momentum <= 1,
            "network.batch_norm_momentum must lie in (0, 1]",
        ),
        (
            cfg.encoder.weights is not None and not Path(cfg.encoder.weights).is_file(),
            f"encoder.weights={cfg.encoder.weights} is not a file",
        ),
        (
            cfg.preparation.shard is not None,
            "preparation.shard goes with prepare.py: training needs all models",
        ),
        (
            cfg.category.members is not None
            and (not cfg.category.members or templates.count % len(cfg.category.members) != 0),
            f"templates.count={templates.count} must be a multiple of the number of "
            f"category.members ({len(cfg.category.members or ())}), each of which gives as many",
        ),
        (
            templates.hold_out is not None and templates.hold_out < templates.count,
            f"templates.hold_out={templates.hold_out} is less than "
            f"templates.count={templates.count}",
        ),
        (cfg.seed < 0 or templates.seed < 0, "seed and templates.seed must not be negative"),
    ]


def _template_files(cfg: TrainConfig) -> list[Path]:
    """Return the files that templates are read from, one for each category."""
    names = cfg.category.members or [cfg.category.name]
    return [Path(str(cfg.templates.file).replace("{category}", name)) for name in names]
