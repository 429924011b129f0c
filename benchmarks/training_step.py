"""A full training step of the paper's configuration, and the parts it cannot do without."""

import itertools
import logging
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from lightning import Callback, Trainer

from benchmarks.nearest import POINTS, QUERIES, TEMPLATES, clouds
from benchmarks.timing import Row, seconds_of
from ffd_lightning.app.build import regime
from ffd_lightning.data.batches import Residency
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.data.templates.choice import RandomTemplates
from ffd_lightning.geometry.ffd import deform
from ffd_lightning.geometry.nearest import nearest_neighbors
from ffd_lightning.nn.encoders.mobilenet import MobileNetV1
from ffd_lightning.nn.network import TemplateFfdNetwork, compile_encoder
from ffd_lightning.training.module import FfdModule

_MODELS = 80


class _Timer(Callback):
    """Notes the time of every step's end, with the GPU's work done."""

    def __init__(self) -> None:
        self.times: list[float] = []

    def on_train_batch_end(self, *_: Any) -> None:
        if torch.cuda.is_available():
            torch.cuda.synchronize()
        self.times.append(time.perf_counter())


def build(folder: Path, residency: Residency = "auto") -> tuple[FfdModule, FfdDataModule]:
    """Return the paper's network on procedural tables, with both regularizers (e and r)."""
    data = FfdDataModule(
        Preparation(ProceduralSource(_MODELS), "table", root=folder),
        num_templates=TEMPLATES,
        template_strategy=RandomTemplates(),
        batch_size=QUERIES,
        num_points=POINTS,
        residency=residency,
    )
    data.prepare_data()
    data.setup()
    network = TemplateFfdNetwork(MobileNetV1(), (192, 256), TEMPLATES, 64)
    return FfdModule(network, regime("e", "terms.offset_penalty.weight=1")), data


def fit(module: FfdModule, data: FfdDataModule, steps: int, precision: str) -> list[float]:
    """Train through Lightning and return the seconds of each step, the first two left out."""
    timer = _Timer()
    trainer = Trainer(
        accelerator="auto",
        devices=1,
        precision=precision,  # type: ignore[arg-type]
        max_steps=steps,
        limit_val_batches=0,
        logger=False,
        callbacks=[timer],
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
        use_distributed_sampler=False,
    )
    trainer.fit(module, datamodule=data)
    return [b - a for a, b in zip(timer.times[1:-1], timer.times[2:], strict=True)]


def measure(device: torch.device, quick: bool) -> list[Row]:
    """Time steps and their parts in turn, in several rounds."""
    section = f"training step, {QUERIES} queries, {TEMPLATES} templates, {device.type}"
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    warnings.filterwarnings("ignore", module="lightning")
    rounds, steps = (1, 5) if quick else (4, 8)
    variants: dict[str, tuple[str, Residency, bool]] = {
        "full step": ("32-true", "auto", False),
        "full step, trainer.residency=device": ("32-true", "device", False),
        "full step, trainer.precision=bf16-mixed": ("bf16-mixed", "auto", False),
    }
    if not quick:  # compilation takes most of a minute
        variants["full step, trainer.compile=true"] = ("32-true", "auto", True)
    times: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(rounds):
            module, data = build(Path(folder))
            for part, function in _parts(module, data, device).items():
                times.setdefault(part, []).extend(seconds_of(function) for _ in range(4))
            for variant, (precision, residency, fused) in variants.items():
                module, data = build(Path(folder), residency)
                if fused:
                    compile_encoder(module.network)
                times.setdefault(variant, []).extend(fit(module, data, steps, precision))
    best = {part: min(values) for part, values in times.items()}
    own = best["full step"]
    return [Row(section, part, value, value / own) for part, value in best.items()]


def _parts(
    module: FfdModule, data: FfdDataModule, device: torch.device
) -> dict[str, Callable[[], object]]:
    """Return what a step is made of, one function each."""
    network = module.network.to(device).train()
    data.trainer = None
    items, steps = data.train_dataloader().loader.dataset, itertools.count()
    batch = data.on_after_batch_transfer(items[next(steps)], 0)
    images = batch.images.to(device)
    matrix, control_points = (t.to(device) for t in batch.templates[:2])
    prediction = network(images)
    a, b = clouds(QUERIES, TEMPLATES, POINTS, device, torch.float32)
    leaf = a.requires_grad_()
    adam = torch.optim.Adam(network.parameters(), lr=0.0, fused=True)

    def encoder() -> None:
        answer = network(images)
        (answer.offsets.sum() + answer.template_logits.sum()).backward()

    def nearest() -> None:
        result = nearest_neighbors(leaf, b)
        (result.a_to_b.sum() + result.b_to_a.sum()).backward()

    def deformation() -> None:
        offsets = prediction.offsets.detach().requires_grad_()
        deform(matrix, control_points, offsets).backward(a.detach())

    return {
        "encoder alone": encoder,
        "nearest neighbours alone": nearest,
        "part: batch": lambda: data.on_after_batch_transfer(items[next(steps)], 0),
        "part: deformation": deformation,
        "part: Adam": adam.step,
    }
