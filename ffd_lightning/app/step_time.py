"""How long training takes on this machine, from a few steps on made-up data of the right sizes."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Sequence

import torch

from ffd_lightning.app.build import build_network, build_objective, category_names
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.hydra_app import compose_config, config_folder
from ffd_lightning.app.schema import typed_config
from ffd_lightning.app.studies.study import commands, count_runs, load_study
from ffd_lightning.geometry.deformation import TemplateSample
from ffd_lightning.geometry.lattice import num_control_points
from ffd_lightning.parallel import available_cores
from ffd_lightning.terminal import duration

_WARM_UP = 2
_MIN_STEPS, _MAX_STEPS = 3, 30
_ENOUGH = 5.0  # seconds


def training_times(overrides: Sequence[str], categories: Sequence[str]) -> list[str]:
    """Return how long runs and the paper's table take, in words.

    Args:
        overrides: settings of the data, as `train` takes them.
        categories: those of the paper's that are there.
    """
    paper, quick = (
        typed_config(compose_config("train", TrainConfig, [*overrides, *own]), TrainConfig)
        for own in (["schedule=paper", "templates=t30"], ["schedule=quick"])
    )
    device, lines = training_device(paper), []
    for cfg in (paper, quick):
        seconds = seconds_per_step(cfg, device)
        run = cfg.schedule.steps * seconds
        lines.append(
            f"  schedule={cfg.schedule.name} templates={cfg.templates.name}: {seconds:.2g} s a "
            f"step, {cfg.schedule.steps:,} steps take {duration(run)}"
        )
        if cfg is paper and categories:
            study = load_study(config_folder("sweeps") / "paper_table.yaml")
            own = [f"category={','.join(categories)}"]
            runs = sum(count_runs(sweep) for sweep in commands(study, "x", False, own))
            lines[-1] += f"; the study paper_table, {runs} such runs, {duration(runs * run)}"
    on_gpu = device.type == "cuda"
    where = torch.cuda.get_device_name(device) if on_gpu else f"{available_cores()} cores"
    size = f"{paper.schedule.batch_size} images of {paper.data.render.height} x "
    size += f"{paper.data.render.width}"
    lines.insert(0, f"to train, on {where} ({size} a step, made up; evaluation is not counted):")
    if not on_gpu and os.getloadavg()[0] > 2 * available_cores():
        lines.append("  other work keeps the cores busy: alone, training is faster")
    return lines


def training_device(cfg: TrainConfig) -> torch.device:
    """Return where a run of these settings would train, if it takes the first device."""
    on_gpu = cfg.trainer.accelerator in ("auto", "gpu", "cuda") and torch.cuda.is_available()
    return torch.device("cuda" if on_gpu else "cpu")


def seconds_per_step(cfg: TrainConfig, device: torch.device) -> float:
    """Return the median time of a training step: network, objective and Adam.

    Batches are made up: reading them is little beside a step. `trainer.compile` is left out.

    Args:
        cfg: settings of a run.
        device: where to train.
    """
    with torch.random.fork_rng():
        network = build_network(cfg).to(device).train()
        images, targets, templates = _made_up(cfg, device)
    members = len(category_names(cfg))
    of_category = torch.arange(cfg.templates.count, device=device).view(members, -1)
    own = of_category[torch.arange(len(images), device=device) % members]
    objective = build_objective(cfg.regime, cfg.schedule.annealing_steps).to(device)
    weights = [*network.parameters(), *objective.parameters()]
    adam = torch.optim.Adam(weights, lr=cfg.schedule.learning_rate, fused=True)
    half = cfg.trainer.precision == "bf16-mixed"

    def step(number: int) -> float:
        start = time.perf_counter()
        adam.zero_grad()
        with torch.autocast(device.type, torch.bfloat16, enabled=half):
            prediction = network(images)
            total, _ = objective(prediction, targets, templates, number, own_templates=own)
        total.backward()
        adam.step()
        if device.type == "cuda":
            torch.cuda.synchronize()
        return time.perf_counter() - start

    for number in range(_WARM_UP):
        step(number)
    times: list[float] = []
    while len(times) < _MIN_STEPS or (sum(times) < _ENOUGH and len(times) < _MAX_STEPS):
        times.append(step(_WARM_UP + len(times)))
    return statistics.median(times)


def _made_up(
    cfg: TrainConfig, device: torch.device
) -> tuple[torch.Tensor, torch.Tensor, TemplateSample]:
    """Return images, clouds and templates of the sizes that the settings give them."""
    queries, points = cfg.schedule.batch_size, cfg.schedule.num_points
    count, control_points = cfg.templates.count, num_control_points(cfg.network.degrees)
    size = (queries, cfg.data.render.height, cfg.data.render.width, 3)
    # Channels are last in memory, as in real batches: convolutions are faster then.
    images = torch.randint(0, 256, size, dtype=torch.uint8, device=device).permute(0, 3, 1, 2)
    targets = torch.rand(queries, points, 3, device=device) - 0.5
    matrix = torch.rand(count, points, control_points, device=device).softmax(dim=-1)
    nodes = torch.rand(count, control_points, 3, device=device) - 0.5
    return images, targets, TemplateSample(matrix, nodes, cfg.network.degrees)
