"""What the golden digests are taken of, as plain arrays, numbers and words.

All that the digests know of the package is here: when its modules move or its classes change, this
file is adapted, and nothing else. What its functions return must stay as it is.
"""

import logging
import re
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pandas as pd
import torch
from lightning import Callback, Trainer, seed_everything
from torch import nn

from ffd_lightning import shapes
from ffd_lightning.analysis.report.page import write_report
from ffd_lightning.analysis.results import Results
from ffd_lightning.app.build import build_data, build_module, build_network, build_preparations
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.app.open_run import open_run
from ffd_lightning.app.training_run import train
from ffd_lightning.data.preparation.prepared import FORMAT_VERSION as PREPARATION_VERSION
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation.evaluator import FORMAT_VERSION as EVALUATION_VERSION
from ffd_lightning.evaluation.evaluator import EvaluatedNetwork, EvaluationOptions, evaluate
from ffd_lightning.evaluation.protocols import PaperProtocol
from ffd_lightning.evaluation.samples import Subset
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.imaging.rendering import render
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.nn.network import FfdPrediction, standardize
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.training.module import FfdModule

REGIMES = ("b", "w", "e", "r", "posterior")
STEPS = 3
RUNS = {
    "posterior": ("regime=posterior", "lr_schedule=one_cycle"),
    "joint": (
        "regime=posterior",
        "regime.selection.within_category=true",
        "category=joint",
        "category.members=[sofa,table]",
        "templates=t4",
    ),
    "photo": ("regime=b", "augmentation=photo"),
    "embedded": ("regime=e", "encoder.weights=embedded"),
}
"""Overrides of the runs that are recorded to the last bit."""
_SETTINGS = (
    "category=table",
    "templates=t2",
    "template_strategy=listed",  # the templates that the steps were first recorded with
    f'template_strategy.file="{Path(__file__).parent}/{{category}}.txt"',
    "data.num_models=12",
    "data.num_points=2048",
    "data.render.height=48",
    "data.render.width=64",
    "data.render.samples=1",
    "encoder.weights=none",
    "network.hidden=32",
    "network.bottleneck=8",
    f"schedule.steps={STEPS}",
    "schedule.batch_size=4",
    "schedule.num_points=64",
    "schedule.learning_rate=1e-3",
    "lr_schedule=cosine",
    "schedule.offset_rate=1",
    "schedule.annealing_steps=2",  # so few that the steps' terms fade visibly
    "split.val_fraction=0",
    "preparation.workers=1",
    "trainer=cpu",
    "trainer.progress_bar=false",
    "seed=0",
)
_TEMPLATES = ("table-000008", "table-000003")  # of the evaluation: the second fits better


def versions() -> dict[str, int]:
    """Return the versions that go up when results are meant to change."""
    return {
        "generators": shapes.GENERATOR_VERSION,
        "preparation": PREPARATION_VERSION,
        "evaluation": EVALUATION_VERSION,
    }


def shape(category: str, shape_id: str) -> dict[str, Any]:
    """Return one procedural shape as its generator draws it."""
    model = ProceduralSource(1).load(category, shape_id)
    mesh = model.mesh
    textured = mesh.face_textures is not None
    return {
        "family": model.family,
        "part_names": list(mesh.part_names),
        "vertices": mesh.vertices,
        "faces": mesh.faces,
        "face_colors": mesh.face_colors,
        "face_parts": mesh.face_parts,
        "textures": list(mesh.textures),
        "face_textures": mesh.face_textures if textured else np.empty(0, np.int16),
        "face_uvs": mesh.face_uvs if textured else np.empty((0, 3, 2), np.float32),
    }


def prepared(folder: Path) -> dict[str, Any]:
    """Return what a prepared set of 12 tables holds; it is built below `folder` if need be."""
    found = _prepared(folder)
    (manifest,) = found.manifests
    facts = {
        "folder": found.path.name,
        "settings": manifest["settings"],
        "ids": list(found.ids),
        "families": list(found.families),
        "part_names": list(found.part_names),
        "image_shape": list(found.image_shape),
        "counts": {name: len(manifest[name]) for name in ("ids", "rejected", "warnings")},
        "manifest_keys": sorted(manifest),
        "files": sorted(path.name for path in found.path.iterdir()),
    }
    models = {}
    for row, shape_id in enumerate(found.ids):
        mesh = found.mesh(row)
        models[shape_id] = {
            "points": found.packed_cloud(row),
            "image": found.image(row),
            "vertices": mesh.vertices,
            "faces": mesh.faces,
            "face_colors": mesh.face_colors,
            "face_parts": mesh.face_parts,
            "point_parts": found.point_parts(row),
        }
    return {"facts": facts, "models": models}


def training(regime: str, folder: Path, double: bool) -> dict[str, Any]:
    """Train a tiny network for a few steps and return the terms of its loss at each.

    Args:
        regime: its name.
        folder: where data is prepared.
        double: in float64, from weights of numpy's, instead of the usual float32 from torch's own.
            Three steps are then the same on all processors to many digits. The usual ones are not:
            Adam makes full steps along gradients that are nothing but rounding, and torch draws
            weights whose last digits depend on the processor; the second loss is off by a tenth.
    """
    logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)
    cfg = _config(folder, f"regime={regime}")
    seed_everything(cfg.seed, verbose=False)
    data = build_data(cfg)
    data.setup()
    network = build_network(cfg)
    if double:
        _draw_weights(network)
        # Images are bytes, and would be standardised in float32.
        network.register_forward_pre_hook(lambda _, images: (images[0].double(),))
    module = build_module(cfg, network, {})
    terms = _Terms()
    trainer = Trainer(
        accelerator="cpu",
        devices=1,
        precision="64-true" if double else "32-true",
        max_steps=STEPS,
        limit_val_batches=0,
        logger=False,
        callbacks=[terms],
        use_distributed_sampler=False,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
        default_root_dir=folder,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of workers and of intervals that are too long
        trainer.fit(module, datamodule=data)
    values = [value.detach().reshape(-1).double() for value in network.state_dict().values()]
    return {
        "templates": list(data.bank.ids),
        "trained_on": list(data.split.train),
        "tested_on": list(data.split.test),
        "steps": terms.steps,
        "weights": torch.cat(values).numpy(),
    }


def run(name: str, folder: Path) -> dict[str, Any]:
    """Train and evaluate one of `RUNS` as the command does.

    Returns:
        The network's state, what the evaluation measured for each sample and in the mean, and how
        often each template was selected.
    """
    run = RunFolder(folder / "runs" / name)
    summary = train(_run_config(name, folder), run)
    summary.pop("seconds_per_step")
    samples = Results.of([run], "paper").samples.select_dtypes("number")
    samples = samples.drop(columns=["seed", "templates"])
    ranking = pd.read_csv(run.path / "template_ranking.csv")
    return {
        "weights": _state(run),
        "samples": {str(name): column.to_numpy() for name, column in samples.items()},
        "means": dict(sorted(summary.items())),
        "ranking": ranking["id"].tolist() + ranking["count"].tolist(),
    }


def resumed(folder: Path) -> np.ndarray:
    """Return the weights of the first of `RUNS` where it fails at its last step and is resumed."""
    config = _run_config(next(iter(RUNS)), folder)
    run = RunFolder(folder / "runs" / "resumed")
    step = FfdModule.training_step

    def fails(module: FfdModule, *arguments: Any) -> Any:
        if module.global_step == STEPS - 1:
            raise KeyboardInterrupt
        return step(module, *arguments)

    with mock.patch.object(FfdModule, "training_step", fails), suppress(KeyboardInterrupt):
        train(config, run)
    train(config, run)
    return _state(run)


def prediction() -> dict[str, Any]:
    """Return what the packaged model predicts for a rendered table."""
    mesh = ProceduralSource(1).load("table", _TEMPLATES[0]).mesh
    settings = RenderSettings()
    (camera,) = settings.cameras(_TEMPLATES[0])
    image = render(mesh, camera, height=settings.height, width=settings.width, samples=1)
    found = Predictor.load(device="cpu").predict(image)
    return {
        "image": found.photo.image,
        "template": found.template_id,
        "weights": found.weights,
        "offsets": found.offsets,
        "vertices": found.surface.vertices,
        "cloud": found.cloud(1024),
    }


def report(folder: Path) -> list[str]:
    """Return the numbers in the tables of the report on all `RUNS`, which are there already."""
    page = write_report(folder / "runs", open_run, gallery_runs=0).read_text(encoding="utf-8")
    cells = re.findall(r"<td[^>]*>(.*?)</td>", page, re.DOTALL)
    return [number for cell in cells for number in re.findall(r"-?\d+\.\d+", cell)]


def _run_config(name: str, folder: Path) -> TrainConfig:
    return _config(folder, "trainer.checkpoint_every=1", "callbacks.report=false", *RUNS[name])


def _state(run: RunFolder) -> np.ndarray:
    state = torch.load(run.checkpoint, weights_only=True)["state_dict"]
    values = [v.reshape(-1).double() for name, v in state.items() if name.startswith("network.")]
    return torch.cat(values).numpy()


def evaluation(folder: Path) -> dict[str, float]:
    """Evaluate a network of fixed outputs, with references, and return the means."""
    found = _prepared(folder)
    bank = TemplateBank.of(found, _TEMPLATES)
    rows = np.array([row for row, name in enumerate(found.ids) if name not in _TEMPLATES])
    evaluated = EvaluatedNetwork(
        _FixedOutputs(*bank.control_points.shape[:2]),  # type: ignore[arg-type]
        bank,
        trained_on=Subset(found, rows[:-3]),
        tested_on=Subset(found, rows[-3:]),
        step=0,
    )
    options = EvaluationOptions(references=True, progress=False, restart=True)
    return evaluate(evaluated, PaperProtocol(), folder / "evaluation", options)


def _draw_weights(network: nn.Module) -> None:
    """Give all matrices and kernels weights of Glorot's size, in the order of the modules."""
    rng = np.random.default_rng(0)
    for value in network.parameters():
        if value.ndim > 1:
            bound = (6 / (value.shape[0] + value[0].numel())) ** 0.5
            value.data = torch.from_numpy(rng.uniform(-bound, bound, value.shape)).float()


class _Terms(Callback):
    """Keeps what is logged at each step."""

    def __init__(self) -> None:
        self.steps: list[dict[str, float]] = []

    def on_train_batch_end(self, trainer: Trainer, *_: Any) -> None:
        logged = {name: float(value) for name, value in trainer.callback_metrics.items()}
        self.steps.append(dict(sorted(logged.items())))


class _FixedOutputs(nn.Module):
    """A network that says the same of every image, and knows images apart by their brightness.

    The first template is selected by far, and no rounding of another processor's can change that;
    a template that a network not yet trained selects would depend on it.
    """

    def __init__(self, num_templates: int, num_control_points: int) -> None:
        super().__init__()
        generator = torch.Generator().manual_seed(0)
        shape = (num_templates, num_control_points, 3)
        offsets = 0.1 * (torch.rand(shape, generator=generator) - 0.5)
        self.offsets = nn.Parameter(offsets, requires_grad=False)
        self.logits = nn.Parameter(torch.linspace(1, -1, num_templates), requires_grad=False)
        self.encoder = nn.AdaptiveAvgPool2d((6, 8))

    def features(self, images: torch.Tensor) -> torch.Tensor:
        return self.encoder(standardize(images))

    def forward(self, images: torch.Tensor) -> FfdPrediction:
        return self.predict(self.features(images))

    def predict(self, features: torch.Tensor, mask: Any = None) -> FfdPrediction:
        logits = self.logits.expand(len(features), -1)
        probs = logits.softmax(1)
        return FfdPrediction(probs, probs, self.offsets.expand(len(features), -1, -1, -1), logits)


def _config(folder: Path, *overrides: str) -> TrainConfig:
    given = [*_SETTINGS, f"paths.data={folder}", *overrides]
    return typed_config(compose_config("train", TrainConfig, given), TrainConfig)


def _prepared(folder: Path) -> PreparedSet:
    (preparation,) = build_preparations(_config(folder))
    return preparation.run()
